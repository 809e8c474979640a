
/* The model predicts, a constant gain corrects. */
static void estimate(furuta_controller *f, furuta_real theta, furuta_real alpha, furuta_real held, uint32_t periods,
                     furuta_real ahead[4])
{
    furuta_real e[2], by[4];
    int i;
    if (follow(f, theta, alpha, held, periods, ZERO, e)) {
        for (i = 0; i < 4; i++)
            by[i] = FURUTA_ESTIMATOR_GAIN[2 * i] * e[0] + FURUTA_ESTIMATOR_GAIN[2 * i + 1] * e[1];
        correct(f, by);
    }
    look_ahead(f, ZERO, ahead);
}
