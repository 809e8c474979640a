
/* Sine and cosine: Cody-Waite reduction and the minimax polynomials of fdlibm, in a fixed order, so that every machine
   has the same bits. Beyond 1e5 rad the C library answers, which may differ by 1 ulp from machine to machine. */
static void sincos_of(double x, double *sine, double *cosine)
{
    double rounded, k, r, z, s, c;
    uint64_t q, bits;
    if (!(x > -1e5 && x < 1e5)) {
        *sine = sin(x);
        *cosine = cos(x);
        return;
    }
    rounded = x * 0x1.45f306dc9c883p-1 + 6755399441055744.0;
    k = rounded - 6755399441055744.0;
    r = ((x - k * 1.57079632673412561417e0) - k * 6.07710050630396597660e-11) - k * 2.02226624879595063154e-21;
    z = r * r;
    s = r + r * z * (-1.66666666666666324348e-01
            + z * (8.33333333332248946124e-03
                + z * (-1.98412698298579493134e-04
                    + z * (2.75573137070700676789e-06
                        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    c = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02
            + z * (-1.38888888888741095749e-03
                + z * (2.48015872894767294178e-05
                    + z * (-2.75573143513906633035e-07
                        + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)))));
    memcpy(&q, &rounded, sizeof q);
    if (q & 1) {
        const double other = s;
        s = c;
        c = other;
    }
    memcpy(&bits, &s, sizeof bits);
    bits ^= (q & 2) << 62;
    memcpy(sine, &bits, sizeof bits);
    memcpy(&bits, &c, sizeof bits);
    bits ^= ((q + 1) & 2) << 62;
    memcpy(cosine, &bits, sizeof bits);
}

static double root(double x) { return sqrt(x); }
