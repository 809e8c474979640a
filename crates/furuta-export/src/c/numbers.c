#define R(x) ((furuta_real)(x))
#define ZERO R(0)
#define ONE R(1)
#define FURUTA_PI 0x1.921fb54442d18p+1
#define FURUTA_TAU 0x1.921fb54442d18p+2

/* The lists of a model's coefficients are in this order. */
enum { ARM, SWING, COUPLING, PENDULUM, WEIGHT, LEVER, DRIVE, ARM_DAMPING, PENDULUM_DAMPING };

static furuta_real magnitude(furuta_real x) { return x < ZERO ? -x : x; }

static furuta_real least(furuta_real a, furuta_real b) { return a < b ? a : b; }

static furuta_real sign(furuta_real x) { return x < ZERO ? -ONE : ONE; }

/* Limited to low..high; a NaN stays a NaN. */
static furuta_real limited(furuta_real x, furuta_real low, furuta_real high)
{
    x = x < low ? low : x;
    return high < x ? high : x;
}

/* Within the limit; 0 where it is not a number. */
static furuta_real commanded(furuta_real u, furuta_real limit)
{
    return isnan(u) ? ZERO : limited(u, -limit, limit);
}

static int all_finite(const furuta_real x[4])
{
    return isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2]) && isfinite(x[3]);
}

/* The angle in (-pi, pi] that differs by whole turns. */
static furuta_real wrapped(furuta_real angle)
{
    const double whole = ceil((double)angle / FURUTA_TAU - 0.5);
    return whole == 0.0 ? angle : (furuta_real)((double)angle - whole * FURUTA_TAU);
}
