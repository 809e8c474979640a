
/* The integral within what the full command needs. */
static furuta_real bounded(furuta_real integral)
{
    const furuta_real full = FURUTA_CONTROLLER_LIMIT / magnitude(FURUTA_INTEGRAL_GAIN);
    integral = isfinite(full) ? limited(integral, -full, full) : ZERO;
    return isfinite(integral) ? integral : ZERO;
}

static furuta_real balance(furuta_controller *f, const furuta_real x[4])
{
    const furuta_real wanted = feedback(FURUTA_GAIN, x, f->arm_reference) - FURUTA_INTEGRAL_GAIN * f->memory;
    const furuta_real step = (x[0] - f->arm_reference) * FURUTA_PERIOD;
    const furuta_real more = -(FURUTA_INTEGRAL_GAIN * step);
    const int stuck = magnitude(wanted) >= FURUTA_CONTROLLER_LIMIT && wanted * more > ZERO;
    if (isfinite(wanted) && isfinite(step) && !stuck)
        f->memory = bounded(f->memory + step);
    return commanded(wanted, FURUTA_CONTROLLER_LIMIT);
}

static void take_over(furuta_controller *f, const furuta_real x[4])
{
    f->memory = bounded((feedback(FURUTA_GAIN, x, x[0]) - f->u) / FURUTA_INTEGRAL_GAIN);
}
