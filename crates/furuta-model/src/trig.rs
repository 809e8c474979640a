//! One deterministic sine and cosine for host and target.
//!
//! Cody-Waite reduction to `|r| <= pi/4` and the minimax polynomials of fdlibm (double precision) and of Cephes (single
//! precision). Only additions and multiplications in a fixed order: no fused multiply-add, no table, no platform libm,
//! so x86-64 and a Cortex-M4 return the same bits. Error: below 1 ulp for `|x| <= 1e5`; beyond, `libm` takes over.

/// `2^52 * 1.5`: adding and subtracting it rounds to the nearest integer.
const ROUND_F64: f64 = 6_755_399_441_055_744.0;
const ROUND_F32: f32 = 12_582_912.0;

/// Sine and cosine of `x` radians in double precision.
///
/// ```
/// let (s, c) = furuta_model::trig::sin_cos_f64(1.0);
/// assert!((s - 1.0_f64.sin()).abs() < 2e-16 && (c - 1.0_f64.cos()).abs() < 2e-16);
/// ```
// Called from code that is compiled for wider vectors, it would have all of their registers saved.
#[inline(always)]
#[must_use]
pub fn sin_cos_f64(x: f64) -> (f64, f64) {
    if near_f64(x) {
        reduced_f64(x)
    } else {
        libm::sincos(x)
    }
}

/// Whether [`reduced_f64`] is right for `x`.
#[inline(always)]
pub(crate) fn near_f64(x: f64) -> bool {
    x > -1e5 && x < 1e5
}

/// [`sin_cos_f64`] without a branch, so that lanes of it become vector instructions.
#[inline(always)]
#[allow(clippy::excessive_precision)]
pub(crate) fn reduced_f64(x: f64) -> (f64, f64) {
    // pi/2 in three parts; k has at most 17 bits, the first two parts 33 bits each: k * part is exact.
    const P1: f64 = 1.570_796_326_734_125_614_17e0;
    const P2: f64 = 6.077_100_506_303_965_976_60e-11;
    const P3: f64 = 2.022_266_248_795_950_631_54e-21;
    // The quadrant stands in the low bits of the rounded sum.
    let rounded = x * core::f64::consts::FRAC_2_PI + ROUND_F64;
    let k = rounded - ROUND_F64;
    let r = ((x - k * P1) - k * P2) - k * P3;
    let z = r * r;
    let s = r + r
        * z
        * (-1.666_666_666_666_663_243_48e-01
            + z * (8.333_333_333_322_489_461_24e-03
                + z * (-1.984_126_982_985_794_931_34e-04
                    + z * (2.755_731_370_707_006_767_89e-06
                        + z * (-2.505_076_025_340_686_341_95e-08
                            + z * 1.589_690_995_211_550_102_21e-10)))));
    let c = 1.0 - 0.5 * z
        + z * z
            * (4.166_666_666_666_660_190_37e-02
                + z * (-1.388_888_888_887_410_957_49e-03
                    + z * (2.480_158_728_947_672_941_78e-05
                        + z * (-2.755_731_435_139_066_330_35e-07
                            + z * (2.087_572_321_298_174_827_90e-09
                                - z * 1.135_964_755_778_819_482_65e-11)))));
    let q = rounded.to_bits();
    let (sin, cos) = if q & 1 == 0 { (s, c) } else { (c, s) };
    (
        f64::from_bits(sin.to_bits() ^ ((q & 2) << 62)),
        f64::from_bits(cos.to_bits() ^ ((q.wrapping_add(1) & 2) << 62)),
    )
}

/// Sine and cosine of `x` radians in single precision.
///
/// ```
/// let (s, c) = furuta_model::trig::sin_cos_f32(2.0);
/// assert!((s - 2.0_f32.sin()).abs() < 2e-7 && (c - 2.0_f32.cos()).abs() < 2e-7);
/// ```
#[inline]
#[must_use]
pub fn sin_cos_f32(x: f32) -> (f32, f32) {
    if near_f32(x) {
        reduced_f32(x)
    } else {
        libm::sincosf(x)
    }
}

/// Whether [`reduced_f32`] is right for `x`.
#[inline(always)]
pub(crate) fn near_f32(x: f32) -> bool {
    x > -1e4 && x < 1e4
}

/// [`sin_cos_f32`] without a branch.
#[inline(always)]
#[allow(clippy::excessive_precision)]
pub(crate) fn reduced_f32(x: f32) -> (f32, f32) {
    const P1: f32 = 1.570_312_5;
    const P2: f32 = 4.837_512_969_970_703e-4;
    const P3: f32 = 7.549_789_948_768_648e-8;
    let rounded = x * core::f32::consts::FRAC_2_PI + ROUND_F32;
    let k = rounded - ROUND_F32;
    let r = ((x - k * P1) - k * P2) - k * P3;
    let z = r * r;
    let s = r + r * z * (-1.666_665_461_1e-1 + z * (8.332_160_873_6e-3 - z * 1.951_529_589_1e-4));
    let c = 1.0 - 0.5 * z
        + z * z
            * (4.166_664_568_298_827e-2
                + z * (-1.388_731_625_493_765e-3 + z * 2.443_315_711_809_948e-5));
    let q = rounded.to_bits();
    let (sin, cos) = if q & 1 == 0 { (s, c) } else { (c, s) };
    (
        f32::from_bits(sin.to_bits() ^ ((q & 2) << 30)),
        f32::from_bits(cos.to_bits() ^ ((q.wrapping_add(1) & 2) << 30)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn double_precision_agrees_with_the_platform(x in -1e5_f64..1e5) {
            let (s, c) = sin_cos_f64(x);
            // 1 ulp of a number near 1
            prop_assert!((s - x.sin()).abs() <= 2.3e-16 && (c - x.cos()).abs() <= 2.3e-16, "{x}: {s} {c}");
        }

        #[test]
        fn single_precision_agrees_with_double(x in -100_f32..100.0) {
            let (s, c) = sin_cos_f32(x);
            let (sd, cd) = f64::from(x).sin_cos();
            prop_assert!((f64::from(s) - sd).abs() <= 1.3e-7 && (f64::from(c) - cd).abs() <= 1.3e-7, "{x}");
        }
    }

    #[test]
    fn non_finite_and_huge_input() {
        assert!(sin_cos_f64(f64::NAN).0.is_nan());
        assert!(sin_cos_f64(f64::INFINITY).1.is_nan());
        assert!((sin_cos_f64(1e6).0 - 1e6_f64.sin()).abs() < 1e-15);
    }
}
