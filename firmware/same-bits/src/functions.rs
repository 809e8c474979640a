//! The elementary functions of the model's scalars over a wide sweep of arguments: if trajectories differ, these lines
//! say why.

use crate::fingerprint::{Fingerprint, Float};
use core::fmt;

/// Arguments that a sweep hardly meets: signed zeros, the smallest and largest numbers, infinities, a NaN, multiples of
/// pi/2.
const CORNERS: [f64; 20] = [
    0.0,
    -0.0,
    5e-324,
    1.401_298_464_324_817e-45,
    1.175_494_350_822_287_5e-38,
    2.225_073_858_507_201_4e-308,
    1e-10,
    0.5,
    core::f64::consts::FRAC_PI_2,
    core::f64::consts::PI,
    -3.0 * core::f64::consts::FRAC_PI_2,
    88.72,
    709.78,
    -745.0,
    1e4,
    1e5,
    1e30,
    f64::MAX,
    f64::INFINITY,
    f64::NAN,
];

/// One line for each function in the scalar `F`, over `count` arguments of either sign from about 1e-12 to 1e8 and
/// [`CORNERS`].
///
/// # Errors
/// Those of `out`.
pub(crate) fn print<F: Float>(out: &mut impl fmt::Write, count: u32) -> fmt::Result {
    type Function<F> = (&'static str, fn(F, &mut Fingerprint));
    let functions: [Function<F>; 6] = [
        ("sin_cos", |x, sum| {
            let (sin, cos) = x.sin_cos();
            sum.add(sin);
            sum.add(cos);
        }),
        ("sqrt", |x, sum| sum.add(x.sqrt())),
        ("exp", |x, sum| sum.add(x.exp())),
        ("over", |x, sum| sum.add(F::ONE / x)),
        // The conversions between the two precisions.
        ("value", |x, sum| sum.add(x.value())),
        ("from_f64", |x, sum| sum.add(F::from_f64(x.value() / 3.0))),
    ];
    for (name, function) in functions {
        let mut sum = Fingerprint::new();
        for x in sweep(count).chain(CORNERS) {
            function(F::from_f64(x), &mut sum);
        }
        let arguments = count as usize + CORNERS.len();
        writeln!(out, "{} {name}: {arguments} arguments {sum}", F::NAME)?;
    }
    Ok(())
}

/// Pseudo-random numbers of either sign, uniform in the exponent: a linear congruential generator fills sign, exponent
/// and fraction.
fn sweep(count: u32) -> impl Iterator<Item = f64> {
    let mut seed = 0x2545_f491_4f6c_dd1d_u64;
    (0..count).map(move |_| {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let sign = seed & (1 << 63);
        let exponent = 1023 - 40 + (seed >> 32) % 67;
        f64::from_bits(sign | (exponent << 52) | (seed >> 12) & ((1 << 52) - 1))
    })
}
