
/* Energy swing-up: crates/furuta-ctrl/src/controllers/swing_up. */

static furuta_real weight_ratio(const furuta_controller *f)
{
    return ONE + f->heavier / FURUTA_SWING_UP_MODEL[WEIGHT];
}

/* The pendulum's energy with the arm at rest. */
static furuta_real energy_of(const furuta_real x[4])
{
    const furuta_real *const c = FURUTA_SWING_UP_MODEL;
    furuta_real s, co, arm, coupling, p0, p1;
    sincos_of(x[1], &s, &co);
    arm = c[ARM] + c[SWING] * (s * s);
    coupling = -(c[COUPLING] * co);
    p0 = arm * ZERO + coupling * x[3];
    p1 = coupling * ZERO + c[PENDULUM] * x[3];
    return (ZERO * p0 + x[3] * p1) * R(0.5) + c[WEIGHT] * co;
}

/* Friction's work still to come on the way up. */
static furuta_real friction_ahead(const furuta_real x[4])
{
    const furuta_real alpha = wrapped(x[1]);
    const double angle = alpha * x[3] < ZERO ? (double)magnitude(alpha) : FURUTA_PI;
    const int index = (int)(angle / FURUTA_PI * 64.0 + 0.5);
    return FURUTA_SWING_UP_FRICTION[index < 64 ? index : 64];
}

/* Where the arm comes to rest under full braking. */
static furuta_real stops_at(const furuta_real x[4])
{
    const furuta_real *const c = FURUTA_SWING_UP_MODEL;
    furuta_real s, co, lighter;
    sincos_of(wrapped(x[1]), &s, &co);
    s = magnitude(s) + FURUTA_SWING_UP_FALLING;
    s = s < ONE ? s : ONE;
    lighter = (c[ARM] + c[SWING]) / (c[ARM] + c[SWING] * s * s);
    return x[0] + x[2] * magnitude(x[2]) / (R(2.0) * FURUTA_SWING_UP_BRAKE * lighter);
}

/* Energy that the rising pendulum loses and the model does not explain counts as weight. */
static void learn(furuta_controller *f, const furuta_real x[4], furuta_real s, furuta_real co, furuta_real h)
{
    const furuta_real *const c = FURUTA_SWING_UP_MODEL;
    furuta_real energy, lost = ZERO, risen = ZERO;
    if (!(wrapped(x[1]) * x[3] < ZERO) || FURUTA_SWING_UP_LEARN == ZERO) {
        f->ascent = 0;
        return;
    }
    energy = energy_of(x);
    if (f->ascent) {
        const furuta_real pumped = c[COUPLING] * co * x[3] * (x[2] - f->theta_dot);
        const furuta_real thrown = c[SWING] * s * co * x[2] * x[2] * x[3];
        const furuta_real damped = c[PENDULUM_DAMPING] * x[3] * x[3];
        lost = f->lost + f->energy - energy + pumped + (thrown - damped) * h;
        risen = f->risen + co - f->cosine;
        if (risen > FURUTA_SWING_UP_LEARN_HEIGHT) {
            const furuta_real most = FURUTA_SWING_UP_LEARN_LIMIT * c[WEIGHT];
            f->heavier += FURUTA_SWING_UP_LEARN * (limited(lost / risen, -most, most) - f->heavier);
            lost = ZERO;
            risen = ZERO;
        }
    }
    f->ascent = 1;
    f->energy = energy;
    f->cosine = co;
    f->theta_dot = x[2];
    f->lost = lost;
    f->risen = risen;
}

/* The arm's acceleration that holds the pendulum to the ascent; 0 where it is not close to it. */
static int ascend(const furuta_controller *f, const furuta_real x[4], furuta_real s, furuta_real co,
                  furuta_real *acceleration)
{
    const furuta_real *const c = FURUTA_SWING_UP_MODEL;
    const furuta_real alpha = wrapped(x[1]);
    furuta_real climb, wanted, excess, brake, centrifugal;
    if (magnitude(alpha) > FURUTA_SWING_UP_ASCENT_ANGLE || !(alpha * x[3] < ZERO))
        return 0;
    climb = (c[WEIGHT] + f->heavier) * (ONE - co) + friction_ahead(x);
    wanted = root(R(2.0) * climb / c[PENDULUM] + FURUTA_SWING_UP_TOP_SPEED * FURUTA_SWING_UP_TOP_SPEED);
    excess = magnitude(x[3]) - wanted;
    if (magnitude(excess) > FURUTA_SWING_UP_ASCENT_WINDOW * FURUTA_SWING_UP_FREQUENCY)
        return 0;
    brake = c[PENDULUM] * FURUTA_SWING_UP_ASCENT_RATE * FURUTA_SWING_UP_FREQUENCY * excess
        * (alpha > ZERO ? -ONE : ONE);
    centrifugal = c[SWING] * s * co * x[2] * x[2];
    *acceleration = -(brake + centrifugal) / (c[COUPLING] * co);
    return 1;
}

/* What the drive is multiplied with, from stroke to stroke. */
static furuta_real variation(uint32_t strokes)
{
    double turns;
    if (strokes <= 8)
        return ONE;
    turns = (double)(strokes % 1000) * 0.6180339887498949;
    return (furuta_real)(0.6 + 0.6 * (turns - (double)(uint32_t)turns));
}

/* The arm's acceleration that pumps. */
static furuta_real pump(furuta_controller *f, const furuta_real x[4], furuta_real theta, furuta_real co, furuta_real h)
{
    const furuta_real *const c = FURUTA_SWING_UP_MODEL;
    const furuta_real w = FURUTA_SWING_UP_FREQUENCY, stroke = co * x[3] / w;
    furuta_real waiting, faster, missing, shortage, drive, target, arm;
    f->waited += h;
    waiting = limited(ONE - f->waited * w / (furuta_real)FURUTA_TAU, ZERO, ONE);
    if (magnitude(stroke) > FURUTA_SWING_UP_DEADBAND * waiting) {
        const furuta_real direction = stroke > ZERO ? ONE : -ONE;
        if (direction != f->direction) {
            f->waited = ZERO;
            if (f->strokes < UINT32_MAX)
                f->strokes++;
        }
        f->direction = direction;
    }
    faster = R(0.5) * c[PENDULUM] * FURUTA_SWING_UP_TOP_SPEED * FURUTA_SWING_UP_TOP_SPEED;
    missing = c[WEIGHT] + friction_ahead(x) - energy_of(x);
    shortage = (missing + faster + f->heavier * (ONE - co)) / (c[WEIGHT] + c[WEIGHT]);
    drive = limited(shortage / FURUTA_SWING_UP_FULL_DRIVE, -ONE, ONE) * f->direction;
    target = FURUTA_SWING_UP_DRIVE * FURUTA_SWING_UP_ARM_RANGE * drive * variation(f->strokes);
    arm = FURUTA_SWING_UP_ARM_FREQUENCY * w;
    return arm * (arm * (target - theta) - R(2.0) * FURUTA_SWING_UP_ARM_DAMPING * x[2]);
}

/* The acceleration, or full braking where the arm could not be stopped within its range otherwise. */
static furuta_real within_range(furuta_real acceleration, furuta_real theta, furuta_real theta_dot)
{
    const furuta_real stop = theta + theta_dot * magnitude(theta_dot) / (FURUTA_SWING_UP_BRAKE + FURUTA_SWING_UP_BRAKE);
    const furuta_real beyond = magnitude(stop) - FURUTA_SWING_UP_BRAKE_AT * FURUTA_SWING_UP_ARM_RANGE;
    furuta_real left, needed, most, brake;
    if (!(beyond > ZERO))
        return acceleration;
    left = FURUTA_SWING_UP_CATCH_RANGE - magnitude(theta);
    left = left < R(0.1) ? R(0.1) : left;
    needed = theta_dot * theta_dot / (left + left);
    most = needed < FURUTA_SWING_UP_BRAKE ? FURUTA_SWING_UP_BRAKE : needed;
    brake = most * limited(beyond * R(10.0), ZERO, ONE);
    if (stop > ZERO)
        return acceleration < -brake ? acceleration : -brake;
    return acceleration < brake ? brake : acceleration;
}

/* The command under which the arm accelerates so, the pendulum moving freely. */
static furuta_real command_for(furuta_real acceleration, const furuta_real x[4], furuta_real s, furuta_real co)
{
    const furuta_real *const c = FURUTA_SWING_UP_MODEL;
    const furuta_real arm = c[ARM] + c[SWING] * (s * s), coupling = -(c[COUPLING] * co);
    const furuta_real k = c[SWING] * (s * co), kt = k * x[2], twist = kt * x[3];
    const furuta_real b0 = twist + twist + c[COUPLING] * s * (x[3] * x[3]), b1 = -(kt * x[2]);
    const furuta_real swing =
        -(coupling * acceleration + b1 + -(c[WEIGHT] * s) + c[PENDULUM_DAMPING] * x[3]) / c[PENDULUM];
    return (arm * acceleration + coupling * swing + b0 + ZERO + c[ARM_DAMPING] * x[2]) / c[DRIVE];
}

static furuta_real swing_up(furuta_controller *f, const furuta_real x[4])
{
    const furuta_real theta = x[0] - ZERO, h = FURUTA_PERIOD;
    furuta_real s, co, wanted, u, push;
    if (!all_finite(x) || !isfinite(theta))
        return ZERO;
    sincos_of(wrapped(x[1]), &s, &co);
    learn(f, x, s, co, h);
    if (!ascend(f, x, s, co, &wanted))
        wanted = pump(f, x, theta, co, h);
    u = command_for(within_range(wanted, theta, x[2]), x, s, co);
    push = FURUTA_SWING_UP_BREAK_AWAY * FURUTA_SWING_UP_COMMAND_LIMIT;
    push = limited(u * R(0.5), -push, push);
    return commanded(u + push, FURUTA_SWING_UP_COMMAND_LIMIT);
}
