
static void moved(const furuta_real x[4], const furuta_real k[4], furuta_real h, furuta_real to[4])
{
    int i;
    for (i = 0; i < 4; i++)
        to[i] = x[i] + k[i] * h;
}

/* One step of the classical Runge-Kutta method over a sample period under the command u. */
static void model_step(furuta_real x[4], furuta_real u)
{
    const furuta_real h = FURUTA_PERIOD, half = h * R(0.5), sixth = h / R(6.0), volts = mapped(u);
    const furuta_real weight = FURUTA_MODEL[WEIGHT];
    furuta_real k1[4], k2[4], k3[4], k4[4], at[4];
    int i;
    rate_of(x, volts, weight, 0, k1);
    moved(x, k1, half, at);
    rate_of(at, volts, weight, 0, k2);
    moved(x, k2, half, at);
    rate_of(at, volts, weight, 0, k3);
    moved(x, k3, h, at);
    rate_of(at, volts, weight, 0, k4);
    for (i = 0; i < 4; i++) {
        const furuta_real middle = k2[i] + k3[i];
        x[i] = x[i] + (k1[i] + middle + middle + k4[i]) * sixth;
    }
}

/* Carries the belief to this sample; 1 and by how much the angles differ from those expected, or 0 where the belief
   begins anew. */
static int follow(furuta_controller *f, furuta_real theta, furuta_real alpha, furuta_real held, uint32_t periods,
                  furuta_real extra, furuta_real difference[2])
{
    furuta_real angles[2];
    const int goes_on = f->started && periods <= 50 && all_finite(f->belief);
    if (goes_on) {
        uint32_t i;
        for (i = 0; i < periods; i++)
            model_step(f->belief, f->held + extra);
        angles[0] = f->belief[0];
        angles[1] = f->belief[1];
        read_angles(angles);
        difference[0] = theta - angles[0];
        difference[1] = alpha - angles[1];
    } else {
        f->started = 1;
        angles[0] = theta;
        angles[1] = alpha;
        read_angles(angles);
        f->belief[0] = theta + theta - angles[0];
        f->belief[1] = alpha + alpha - angles[1];
        f->belief[2] = ZERO;
        f->belief[3] = ZERO;
    }
    f->held = held;
    return goes_on;
}

static void correct(furuta_controller *f, const furuta_real by[4])
{
    f->belief[0] = f->belief[0] + (f->belief[0] + by[0] - f->belief[0]);
    f->belief[1] = f->belief[1] + by[1];
    f->belief[2] = f->belief[2] + (f->belief[2] + by[2] - f->belief[2]);
    f->belief[3] = f->belief[3] + by[3];
}

/* The state at the sample, and when a command given now begins to act. */
static void look_ahead(furuta_controller *f, furuta_real extra, furuta_real ahead[4])
{
    memcpy(f->now, f->belief, sizeof f->now);
    memcpy(ahead, f->belief, sizeof f->belief);
    model_step(ahead, f->held + extra);
}
