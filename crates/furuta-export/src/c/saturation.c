
static furuta_real saturated(furuta_real x, furuta_real width)
{
    if (magnitude(x) < width)
        return x / width;
    return x > ZERO ? ONE : x < ZERO ? -ONE : ZERO;
}
