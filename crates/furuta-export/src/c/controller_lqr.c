
static furuta_real balance(furuta_controller *f, const furuta_real x[4])
{
    return commanded(feedback(FURUTA_GAIN, x, f->arm_reference), FURUTA_CONTROLLER_LIMIT);
}

static void take_over(furuta_controller *f, const furuta_real x[4])
{
    (void)f;
    (void)x;
}
