
/* -K (x - reference), the arm's reference at rest at `at`, before the limit. */
static furuta_real feedback(const furuta_real gain[4], const furuta_real x[4], furuta_real at)
{
    return -(gain[0] * (x[0] - at) + gain[1] * wrapped(x[1] - ZERO) + gain[2] * (x[2] - ZERO)
             + gain[3] * (x[3] - ZERO));
}
