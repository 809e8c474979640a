
/* The integral within what the full command needs. */
static furuta_real bounded(furuta_real integral)
{
    const furuta_real full = FURUTA_CONTROLLER_LIMIT / magnitude(FURUTA_INTEGRAL_GAIN);
    integral = isfinite(full) ? limited(integral, -full, full) : ZERO;
    return isfinite(integral) ? integral : ZERO;
}

static furuta_real balance(furuta_controller *f, const furuta_real x[4])
{
    const furuta_real law = feedback(FURUTA_GAIN, x, f->arm_reference), h = FURUTA_PERIOD;
    const furuta_real held = law - FURUTA_INTEGRAL_GAIN * f->memory;
    furuta_real step = ZERO, more;
    int stuck;
    /* The error since the sample before, from what was wanted then: the integral of the cubic through both. */
    if (f->has_before) {
        const furuta_real from = f->before[0] - f->before[2], to = x[0] - f->before[2];
        step = h * (R(0.5) * (from + to) + h * R(1.0 / 12.0) * (f->before[1] - x[2]));
    }
    more = -(FURUTA_INTEGRAL_GAIN * step);
    stuck = magnitude(held) >= FURUTA_CONTROLLER_LIMIT && held * more > ZERO;
    if (isfinite(held) && isfinite(step) && !stuck)
        f->memory = bounded(f->memory + step);
    f->has_before = isfinite(x[0]) && isfinite(x[2]);
    f->before[0] = x[0];
    f->before[1] = x[2];
    f->before[2] = f->arm_reference;
    return commanded(law - FURUTA_INTEGRAL_GAIN * f->memory, FURUTA_CONTROLLER_LIMIT);
}

static void take_over(furuta_controller *f, const furuta_real x[4])
{
    f->memory = bounded((feedback(FURUTA_GAIN, x, x[0]) - f->u) / FURUTA_INTEGRAL_GAIN);
    f->has_before = 0;
}
