
/* Speed from an angle: difference quotient behind two low passes. */
static furuta_real derivative(furuta_controller *f, int i, furuta_real angle)
{
    if (!isfinite(angle))
        return f->second[i];
    if (f->seen[i]) {
        const furuta_real quotient = wrapped(angle - f->angle[i]) * FURUTA_ESTIMATOR_RATE;
        f->first[i] += FURUTA_ESTIMATOR_BLEND * (quotient - f->first[i]);
        f->second[i] += FURUTA_ESTIMATOR_BLEND * (f->first[i] - f->second[i]);
    }
    f->seen[i] = 1;
    f->angle[i] = angle;
    return f->second[i];
}

static void estimate(furuta_controller *f, furuta_real theta, furuta_real alpha, furuta_real held, uint32_t periods,
                     furuta_real ahead[4])
{
    (void)held;
    (void)periods;
    f->now[0] = theta;
    f->now[1] = alpha;
    f->now[2] = derivative(f, 0, theta);
    f->now[3] = derivative(f, 1, alpha);
    memcpy(ahead, f->now, sizeof f->now);
}
