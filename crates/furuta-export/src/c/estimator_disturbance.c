
/* The model predicts, a constant gain corrects it and a voltage that acts beside the command. */
static void estimate(furuta_controller *f, furuta_real theta, furuta_real alpha, furuta_real held, uint32_t periods,
                     furuta_real ahead[4])
{
    furuta_real e[2], by[5];
    int i;
    if (follow(f, theta, alpha, held, periods, f->disturbance, e)) {
        furuta_real d;
        for (i = 0; i < 5; i++)
            by[i] = FURUTA_ESTIMATOR_GAIN[2 * i] * e[0] + FURUTA_ESTIMATOR_GAIN[2 * i + 1] * e[1];
        correct(f, by);
        d = f->disturbance + by[4];
        f->disturbance = isfinite(d) ? limited(d, -FURUTA_ESTIMATOR_LIMIT, FURUTA_ESTIMATOR_LIMIT) : ZERO;
    } else {
        f->disturbance = ZERO;
    }
    look_ahead(f, f->disturbance, ahead);
}
