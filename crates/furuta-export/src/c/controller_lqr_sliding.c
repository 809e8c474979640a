
/* What reaches the surface; f->memory is what super-twisting has learnt. */
static furuta_real reach(furuta_controller *f, furuta_real sigma, furuta_real h)
{
    if (FURUTA_TWISTING) {
        const furuta_real side = saturated(sigma, ZERO);
        const furuta_real learnt = f->memory + FURUTA_REACHING[1] * side * h;
        if (isfinite(learnt))
            f->memory = limited(learnt, -FURUTA_REACHING[2], FURUTA_REACHING[2]);
        return FURUTA_REACHING[0] * root(magnitude(sigma)) * side + f->memory;
    }
    return FURUTA_REACHING[0] * saturated(sigma, FURUTA_REACHING[1]);
}

static furuta_real balance(furuta_controller *f, const furuta_real x[4])
{
    furuta_real e[4], u;
    error_of(x, f->arm_reference, e);
    u = FURUTA_FORWARD - product(FURUTA_GAIN, e);
    return commanded(u - reach(f, product(FURUTA_SURFACE, e), FURUTA_PERIOD), FURUTA_CONTROLLER_LIMIT);
}

static void take_over(furuta_controller *f, const furuta_real x[4])
{
    furuta_real e[4], u;
    error_of(x, x[0], e);
    u = FURUTA_FORWARD - product(FURUTA_GAIN, e);
    f->memory = ZERO;
    if (FURUTA_TWISTING) {
        const furuta_real learnt = u - reach(f, product(FURUTA_SURFACE, e), ZERO) - f->u;
        if (isfinite(learnt))
            f->memory = limited(learnt, -FURUTA_REACHING[2], FURUTA_REACHING[2]);
    }
}
