
static furuta_real balance(furuta_controller *f, const furuta_real x[4])
{
    furuta_real e[4];
    error_of(x, f->arm_reference, e);
    return commanded(FURUTA_FORWARD - product(FURUTA_GAIN, e), FURUTA_CONTROLLER_LIMIT);
}

static void take_over(furuta_controller *f, const furuta_real x[4])
{
    (void)f;
    (void)x;
}
