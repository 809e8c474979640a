//! The work of steps.py and rollouts.py written by hand for this plant alone: what the machine can do.
//!
//! `rustc -C opt-level=3 -C target-cpu=native --crate-type cdylib native.rs`: it needs nothing else. Not part of the
//! workspace: the pointers come from NumPy, plant.py says how long the arrays are.

const LANES: usize = 8;
type Lane = [f64; LANES];

/// Sines and cosines by fdlibm's polynomials; within 1e6 rad they are right to a rounding.
#[inline(always)]
fn sin_cos(x: f64) -> (f64, f64) {
    // Adding and taking away 1.5 * 2^52 rounds to a whole number.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let turned = x * std::f64::consts::FRAC_2_PI + ROUND;
    let quarter = turned.to_bits();
    let k = turned - ROUND;
    // pi/2 in three parts.
    let r = ((x - k * 1.570_796_326_734_125_6) - k * 6.077_100_506_303_966e-11)
        - k * 2.022_266_248_795_950_6e-21;
    let z = r * r;
    let s = r + r * z
        * (-1.666_666_666_666_663_2e-1 + z * (8.333_333_333_322_49e-3 + z * (-1.984_126_982_985_795e-4
            + z * (2.755_731_370_707_006_8e-6 + z * (-2.505_076_025_340_686_3e-8 + z * 1.589_690_995_211_55e-10)))));
    let c = 1.0 - 0.5 * z + z * z
        * (4.166_666_666_666_66e-2 + z * (-1.388_888_888_887_411e-3 + z * (2.480_158_728_947_673e-5
            + z * (-2.755_731_435_139_066_3e-7 + z * (2.087_572_321_298_175e-9 - z * 1.135_964_755_778_819_5e-11)))));
    let (a, b) = if quarter & 1 == 0 { (s, c) } else { (c, s) };
    (
        f64::from_bits(a.to_bits() ^ ((quarter & 2) << 62)),
        f64::from_bits(b.to_bits() ^ ((quarter.wrapping_add(1) & 2) << 62)),
    )
}

/// Derivatives of [alpha, theta_dot, alpha_dot] with the coefficients of plant.py.
#[inline(always)]
fn rate(c: &[f64; 8], alpha: f64, v: f64, w: f64, u: f64) -> [f64; 4] {
    let (s, k) = sin_cos(alpha);
    let (m11, m12) = (c[0] + c[1] * s * s, -c[2] * k);
    let twist = c[1] * s * k * v;
    let a = c[5] * u - c[6] * v - 2.0 * twist * w - c[2] * s * w * w;
    let b = c[4] * s - c[7] * w + twist * v;
    let over = 1.0 / (m11 * c[3] - m12 * m12);
    [v, w, (c[3] * a - m12 * b) * over, (m11 * b - m12 * a) * over]
}

#[inline(always)]
fn step(c: &[f64; 8], x: [f64; 4], u: f64, h: f64) -> [f64; 4] {
    let along = |k: &[f64; 4], h: f64| rate(c, x[1] + h * k[1], x[2] + h * k[2], x[3] + h * k[3], u);
    let k1 = rate(c, x[1], x[2], x[3], u);
    let k2 = along(&k1, 0.5 * h);
    let k3 = along(&k2, 0.5 * h);
    let k4 = along(&k3, h);
    std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}

/// # Safety
/// `c` has 8 numbers, `x` 4 (n + 1) of which the first four are the start, `u` n.
#[no_mangle]
pub unsafe extern "C" fn steps(c: *const f64, x: *mut f64, u: *const f64, n: usize, h: f64) {
    let (c, u) = (&*c.cast::<[f64; 8]>(), std::slice::from_raw_parts(u, n));
    let out = std::slice::from_raw_parts_mut(x.cast::<[f64; 4]>(), n + 1);
    let mut x = out[0];
    for (out, u) in out[1..].iter_mut().zip(u) {
        x = step(c, x, *u, h);
        *out = x;
    }
}

/// Eight rollouts side by side in the lanes of vector registers, each with its own coefficients.
///
/// # Safety
/// `c` has 8 n numbers, `x` 4 n, `u` m; n is a multiple of 8.
#[no_mangle]
pub unsafe extern "C" fn rollouts(c: *const f64, x: *mut f64, u: *const f64, n: usize, m: usize, h: f64) {
    let c = std::slice::from_raw_parts(c.cast::<[f64; 8]>(), n);
    let x = std::slice::from_raw_parts_mut(x.cast::<[f64; 4]>(), n);
    let u = std::slice::from_raw_parts(u, m);
    for (c, x) in c.chunks_exact(LANES).zip(x.chunks_exact_mut(LANES)) {
        let turned: [Lane; 8] = std::array::from_fn(|i| std::array::from_fn(|l| c[l][i]));
        let mut state: [Lane; 4] = std::array::from_fn(|i| std::array::from_fn(|l| x[l][i]));
        for u in u {
            let before = state;
            for l in 0..LANES {
                let c = std::array::from_fn(|i| turned[i][l]);
                let next = step(&c, std::array::from_fn(|i| before[i][l]), *u, h);
                for i in 0..4 {
                    state[i][l] = next[i];
                }
            }
        }
        for (l, x) in x.iter_mut().enumerate() {
            *x = std::array::from_fn(|i| state[i][l]);
        }
    }
}
