
/* Sine and cosine: Cody-Waite reduction and the minimax polynomials of Cephes, in a fixed order, so that every machine
   has the same bits. Beyond 1e4 rad the C library answers, which may differ by 1 ulp from machine to machine. */
static void sincos_of(float x, float *sine, float *cosine)
{
    float rounded, k, r, z, s, c;
    uint32_t q, bits;
    if (!(x > -1e4f && x < 1e4f)) {
        *sine = sinf(x);
        *cosine = cosf(x);
        return;
    }
    rounded = x * 0x1.45f306p-1f + 12582912.0f;
    k = rounded - 12582912.0f;
    r = ((x - k * 1.5703125f) - k * 4.837512969970703e-4f) - k * 7.549789948768648e-8f;
    z = r * r;
    s = r + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f - z * 1.9515295891e-4f));
    c = 1.0f - 0.5f * z + z * z * (4.166664568298827e-2f
            + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
    memcpy(&q, &rounded, sizeof q);
    if (q & 1) {
        const float other = s;
        s = c;
        c = other;
    }
    memcpy(&bits, &s, sizeof bits);
    bits ^= (q & 2) << 30;
    memcpy(sine, &bits, sizeof bits);
    memcpy(&bits, &c, sizeof bits);
    bits ^= ((q + 1) & 2) << 30;
    memcpy(cosine, &bits, sizeof bits);
}

static float root(float x) { return sqrtf(x); }
