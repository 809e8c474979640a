
/* The error against the steady motion, which rests while the reference rests; the arm's reference is `at`. */
static void error_of(const furuta_real x[4], furuta_real at, furuta_real e[4])
{
    e[0] = x[0] - (FURUTA_WANTED[0] + at);
    e[1] = wrapped(x[1] - FURUTA_WANTED[1]);
    e[2] = x[2] - FURUTA_WANTED[2];
    e[3] = x[3] - FURUTA_WANTED[3];
}

static furuta_real product(const furuta_real row[4], const furuta_real e[4])
{
    return row[0] * e[0] + row[1] * e[1] + row[2] * e[2] + row[3] * e[3];
}
