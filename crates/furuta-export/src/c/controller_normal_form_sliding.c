
/* The command under which the pendulum accelerates so, while effects pull by their slopes at rest. */
static furuta_real inverse_model(const furuta_real x[4], furuta_real middle, furuta_real alpha_ddot)
{
    const furuta_real *const c = FURUTA_CONTROLLER_MODEL;
    const furuta_real distance[4] = {x[0] - middle, wrapped(x[1]), x[2], x[3]};
    furuta_real s, co, centrifugal, moment, theta_ddot, k, kt, twist;
    sincos_of(x[1], &s, &co);
    centrifugal = c[SWING] * (s * co) * (x[2] * x[2]);
    moment = c[PENDULUM] * alpha_ddot + c[PENDULUM_DAMPING] * x[3] - c[WEIGHT] * s - centrifugal;
    theta_ddot = (moment - product(FURUTA_CONTROLLER_LOAD + 4, distance)) / (c[COUPLING] * co);
    k = c[SWING] * (s * co);
    kt = k * x[2];
    twist = kt * x[3];
    moment = (c[ARM] + c[SWING] * (s * s)) * theta_ddot + -(c[COUPLING] * co) * alpha_ddot
        + (twist + twist + c[COUPLING] * s * (x[3] * x[3]));
    return (moment + c[ARM_DAMPING] * x[2] - product(FURUTA_CONTROLLER_LOAD, distance)) / c[DRIVE];
}

static furuta_real balance(furuta_controller *f, const furuta_real x[4])
{
    const furuta_real h = FURUTA_PERIOD, share = h / (FURUTA_SWITCHING_FILTER + h);
    furuta_real e[4], filtered, wanted;
    error_of(x, f->arm_reference, e);
    filtered = f->memory + share * (FURUTA_SWITCHING_GAMMA * saturated(e[3], FURUTA_SWITCHING_EPS) - f->memory);
    if (isfinite(filtered))
        f->memory = filtered;
    wanted = FURUTA_WANTED_ACCELERATION - product(FURUTA_GAIN, e) - f->memory;
    return commanded(inverse_model(x, f->arm_reference, wanted), FURUTA_CONTROLLER_LIMIT);
}

static void take_over(furuta_controller *f, const furuta_real x[4])
{
    (void)x;
    f->memory = ZERO;
}
