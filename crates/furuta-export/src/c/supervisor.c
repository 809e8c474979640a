
/* Catch, compensation, limits and modes: crates/furuta-ctrl/src/supervisor and compensation. */

static furuta_real arm_acceleration(const furuta_real x[4], furuta_real volts, int smooth)
{
    furuta_real rate[4];
    rate_of(x, volts, FURUTA_MODEL[WEIGHT], smooth, rate);
    return rate[2];
}

/* The voltage that holds the arm at theta with the pendulum upright. */
static furuta_real holding(furuta_real theta, int smooth)
{
    const furuta_real x[4] = {theta, ZERO, ZERO, ZERO};
    const furuta_real free = arm_acceleration(x, ZERO, smooth), pushed = arm_acceleration(x, ONE, smooth);
    return -free / (pushed - free);
}

/* Whether the feedback, asked to hold the arm at theta, brings a pendulum of `times` the weight upright. */
static int predicted(const furuta_real from[4], furuta_real theta, furuta_real times)
{
    const furuta_real step = FURUTA_CATCH_STEP, half = step * R(0.5), limit = FURUTA_CATCH_COMMAND_LIMIT;
    const furuta_real weight = times * FURUTA_MODEL[WEIGHT];
    furuta_real x[4], middle[4], rate[4], held = ZERO;
    int i, k;
    if (!all_finite(from))
        return 0;
    memcpy(x, from, sizeof x);
    x[1] = wrapped(from[1]);
    if (FURUTA_CATCH_HOLDS)
        held = holding(theta, 1);
    for (k = 0; k < FURUTA_CATCH_STEPS; k++) {
        furuta_real u = commanded(feedback(FURUTA_CATCH_GAIN, x, theta), limit);
        if (FURUTA_CATCH_HOLDS)
            u = limited(u + held, -limit, limit);
        rate_of(x, u, weight, 1, rate);
        for (i = 0; i < 4; i++)
            middle[i] = x[i] + rate[i] * half;
        rate_of(middle, u, weight, 1, rate);
        for (i = 0; i < 4; i++)
            x[i] = x[i] + rate[i] * step;
        if (!(magnitude(x[0]) < FURUTA_CATCH_ARM_ANGLE && magnitude(x[1]) < R(1.6)))
            return 0;
    }
    return magnitude(x[1]) < FURUTA_CATCH_NEAR_ANGLE && magnitude(x[3]) < FURUTA_CATCH_NEAR_SPEED;
}

/* Whether it is worth a catch from here. */
static int can_be_caught(const furuta_real x[4], furuta_real times)
{
    const furuta_real alpha = wrapped(x[1]);
    if (alpha * x[3] > R(0.1) || !(magnitude(alpha) <= FURUTA_CATCH_FURTHEST))
        return 0;
    if (!predicted(x, x[0], times))
        return 0;
    return FURUTA_CATCH_ERROR == ZERO
        || (predicted(x, x[0], (ONE + FURUTA_CATCH_ERROR) * times)
            && predicted(x, x[0], (ONE - FURUTA_CATCH_ERROR) * times));
}

/* The command for which the motor has the voltage: by bisection. */
static furuta_real motor_inverse(furuta_real volts)
{
    furuta_real low = -FURUTA_MOTOR_LIMIT, high = FURUTA_MOTOR_LIMIT;
    int i;
    for (i = 0; i < FURUTA_MOTOR_HALVINGS; i++) {
        const furuta_real middle = R(0.5) * (low + high);
        if (mapped(middle) < volts)
            low = middle;
        else
            high = middle;
    }
    return R(0.5) * (low + high);
}

static furuta_real motor_command(furuta_real volts)
{
    const furuta_real small = FURUTA_MOTOR_SMALL;
    furuta_real low, high;
    if (magnitude(volts) >= small)
        return motor_inverse(volts);
    low = motor_inverse(-small);
    high = motor_inverse(small);
    return low + (high - low) * ((volts + small) / (small + small));
}

static furuta_real or_zero(furuta_real volts) { return isfinite(volts) ? volts : ZERO; }

static furuta_real compensated(const furuta_controller *f, const furuta_real x[4], furuta_real u)
{
    furuta_real volts = u;
    if (FURUTA_COMPENSATE_HOLD)
        volts += or_zero(holding(f->arm_reference, 0));
    if (FURUTA_COMPENSATE_FRICTION) {
        const furuta_real later = x[2] + arm_acceleration(x, volts, 0) * FURUTA_FRICTION_AHEAD;
        volts += or_zero(FURUTA_FRICTION_LEVEL * limited(later / FURUTA_FRICTION_FULL, -ONE, ONE));
    }
    if (FURUTA_COMPENSATE_DISTURBANCE)
        volts -= or_zero(f->disturbance);
    if (FURUTA_COMPENSATE_MOTOR && isfinite(volts))
        volts = motor_command(volts);
    return volts;
}

/* Against the arm's speed, under an envelope that falls to zero. */
static furuta_real brake(furuta_controller *f, uint32_t periods)
{
    const uint32_t passed = periods > 1 ? periods : 1;
    const furuta_real speed = f->now[2] * sign(f->braking_from);
    furuta_real envelope, risen, u;
    f->braking_left = f->braking_left > passed ? f->braking_left - passed : 0;
    if (!(speed > ZERO && speed <= magnitude(f->braking_from) * FURUTA_BRAKE_FASTER && isfinite(speed)))
        f->braking_left = 0;
    if (f->braking_left == 0) {
        f->braking_u = ZERO;
        return ZERO;
    }
    envelope = FURUTA_BRAKE_LIMIT * (furuta_real)((double)f->braking_left / (double)FURUTA_BRAKE_PERIODS);
    risen = f->braking_u + FURUTA_BRAKE_RISE * (furuta_real)passed;
    u = least(least(FURUTA_BRAKE_GAIN * speed, envelope), risen);
    if (!isfinite(u)) {
        f->braking_left = 0;
        f->braking_u = ZERO;
        return ZERO;
    }
    f->braking_u = u;
    return -u * sign(f->braking_from);
}

static furuta_fault violation(const furuta_real x[4])
{
    if (!all_finite(x))
        return FURUTA_NOT_A_NUMBER;
    if (magnitude(x[0]) > FURUTA_ARM_ANGLE_LIMIT)
        return FURUTA_ARM_ANGLE;
    if (magnitude(x[2]) > FURUTA_ARM_SPEED_LIMIT)
        return FURUTA_ARM_SPEED;
    return magnitude(x[3]) > FURUTA_PENDULUM_SPEED_LIMIT ? FURUTA_PENDULUM_SPEED : FURUTA_SOUND;
}

static void found(furuta_controller *f, furuta_fault fault)
{
    const int known = fault != FURUTA_NOT_A_NUMBER;
    if (f->mode == FURUTA_FAULT || (f->mode == FURUTA_BRAKING && known))
        return;
    if ((f->mode == FURUTA_SWING_UP || f->mode == FURUTA_BALANCE) && known) {
        f->mode = FURUTA_BRAKING;
        f->braking_left = FURUTA_BRAKE_PERIODS;
        f->braking_from = f->now[2];
        f->braking_u = ZERO;
    } else {
        f->mode = FURUTA_FAULT;
    }
    f->fault = fault;
}

/* Whether the arm, going outwards, would stop beyond this angle under full braking. */
static int runs_away(const furuta_real x[4], furuta_real angle)
{
    const furuta_real stop = magnitude(stops_at(x));
    return x[0] * x[2] > ZERO && stop > angle;
}

static int is_lost(const furuta_controller *f, const furuta_real x[4])
{
    const furuta_real alpha = wrapped(x[1]);
    const int doubtful = alpha * x[3] > ZERO && magnitude(alpha) > FURUTA_DOUBT_ANGLE;
    return runs_away(x, FURUTA_LAST_BRAKE) || magnitude(alpha) > FURUTA_RELEASE_ANGLE
        || (doubtful && !predicted(x, f->arm_reference, weight_ratio(f)));
}

static furuta_mode next_mode(furuta_controller *f, const furuta_real x[4], furuta_real periods)
{
    if (f->mode == FURUTA_SWING_UP) {
        const int had = f->has_catch_jump;
        const furuta_real before = f->catch_jump;
        if (f->since_test < UINT32_MAX)
            f->since_test++;
        if (f->since_test < FURUTA_CATCH_EVERY)
            return FURUTA_SWING_UP;
        f->since_test = 0;
        if (runs_away(x, FURUTA_CATCH_BRAKE)) {
            f->has_catch_jump = 0;
            return FURUTA_SWING_UP;
        }
        f->has_catch_jump = can_be_caught(x, weight_ratio(f));
        if (f->has_catch_jump)
            f->catch_jump = magnitude(feedback(FURUTA_CATCH_GAIN, x, x[0]) - f->u);
        if (!had && !f->has_catch_jump)
            return FURUTA_SWING_UP;
        if (f->has_catch_jump && f->catch_jump > FURUTA_SMALL_JUMP && (!had || f->catch_jump < before))
            return FURUTA_SWING_UP;
        return FURUTA_BALANCE;
    }
    if (f->mode == FURUTA_BALANCE)
        return is_lost(f, x) ? FURUTA_SWING_UP : FURUTA_BALANCE;
    if (f->mode == FURUTA_STOPPING) {
        const int moving = magnitude(f->now[2]) > FURUTA_REST_SPEED || magnitude(f->now[3]) > FURUTA_REST_SPEED;
        f->resting = moving ? ZERO : f->resting + FURUTA_PERIOD * periods;
        return f->resting > R(0.5) ? FURUTA_IDLE : FURUTA_STOPPING;
    }
    return f->mode;
}

static void enter(furuta_controller *f, furuta_mode mode, const furuta_real x[4])
{
    f->mode = mode;
    if (mode == FURUTA_BALANCE) {
        f->arm_reference = x[0];
        f->has_bump = 0;
        take_over(f, x);
    } else if (mode == FURUTA_SWING_UP) {
        f->has_catch_jump = 0;
        f->strokes = 0;
        f->ascent = 0;
    }
}

void furuta_init(furuta_controller *f)
{
    const furuta_controller blank = {0};
    *f = blank;
    f->mode = FURUTA_IDLE;
    f->fault = FURUTA_SOUND;
    f->belief[1] = (furuta_real)FURUTA_PI;
    f->direction = ONE;
    f->since_test = UINT32_MAX;
}

int furuta_ask(furuta_controller *f, furuta_request request)
{
    if ((f->mode == FURUTA_IDLE || f->mode == FURUTA_STOPPING) && request == FURUTA_START)
        f->mode = FURUTA_SWING_UP;
    else if ((f->mode == FURUTA_SWING_UP || f->mode == FURUTA_BALANCE) && request == FURUTA_STOP)
        f->mode = FURUTA_STOPPING;
    else if (f->mode == FURUTA_FAULT && request == FURUTA_RESET)
        f->mode = FURUTA_IDLE;
    else
        return 0;
    f->fault = FURUTA_SOUND;
    f->since_test = UINT32_MAX;
    f->resting = ZERO;
    return 1;
}

furuta_real furuta_step(furuta_controller *f, furuta_real theta, furuta_real alpha, furuta_real held,
                        uint32_t periods, furuta_real target)
{
    const furuta_real passed = (furuta_real)(double)periods;
    furuta_real ahead[4], u = ZERO;
    furuta_fault fault;
    furuta_mode mode;
    estimate(f, theta, alpha, held, periods, ahead);
    fault = violation(f->now);
    if (fault != FURUTA_SOUND)
        found(f, fault);
    target = isfinite(target) ? target : ZERO;
    mode = next_mode(f, ahead, passed);
    if (mode != f->mode)
        enter(f, mode, ahead);
    if (mode == FURUTA_SWING_UP) {
        u = swing_up(f, ahead);
    } else if (mode == FURUTA_BALANCE) {
        const furuta_real step = FURUTA_REFERENCE_SPEED * FURUTA_PERIOD * passed;
        f->arm_reference += limited(target - f->arm_reference, -step, step);
        u = balance(f, ahead);
        f->bump = FURUTA_BLEND * (f->has_bump ? f->bump : f->u - u);
        f->has_bump = 1;
        u = compensated(f, ahead, u + f->bump);
    } else if (mode == FURUTA_BRAKING) {
        u = brake(f, periods);
        if (f->braking_left == 0)
            f->mode = FURUTA_FAULT;
    }
    f->u = commanded(u, FURUTA_COMMAND_LIMIT);
    f->reference = f->mode == FURUTA_BALANCE ? f->arm_reference : ZERO;
    return f->u;
}
