//! Random numbers by number: the `n`-th one of a seed is a function of seed and `n`, with no state in between.
//!
//! SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, OOPSLA 2014): a counter in steps of
//! the golden ratio, mixed by two multiplications. Integer arithmetic: the same everywhere.

/// `2^64` over the golden ratio, odd.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// The `n`-th 64 random bits of a seed.
///
/// ```
/// use furuta_model::signals::random::bits;
/// // The published generator's first numbers for the seed 1234567.
/// assert_eq!([0, 1, 2].map(|n| bits(1_234_567, n)), [6457827717110365317, 3203168211198807973, 9817491932198370423]);
/// ```
#[must_use]
pub fn bits(seed: u64, n: u64) -> u64 {
    let mut z = seed.wrapping_add(GOLDEN.wrapping_mul(n.wrapping_add(1)));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The `n`-th random number of a seed, uniform in [0, 1).
///
/// ```
/// use furuta_model::signals::random::uniform;
/// let mean = (0..100_000).map(|n| uniform(1, n)).sum::<f64>() / 1e5;
/// assert!((mean - 0.5).abs() < 0.004); // its standard deviation is 0.0009
/// ```
#[must_use]
pub fn uniform(seed: u64, n: u64) -> f64 {
    // The upper 53 bits fill a double's mantissa.
    (bits(seed, n) >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

/// The `n`-th random number of a seed with mean 0 and variance 1, almost Gaussian.
///
/// It counts 64 coins: `(heads - 32) / 4`, whose mean and variance are exact, whose kurtosis is 3 - 1/32, and which
/// never exceeds 8. Sums of a few of them, as a filter makes, cannot be told from Gaussian ones.
///
/// ```
/// use furuta_model::signals::random::normal;
/// let variance = (0..10_000).map(|n| normal(1, n).powi(2)).sum::<f64>() / 1e4;
/// assert!((variance - 1.0).abs() < 0.05); // its standard deviation is 0.014
/// ```
#[must_use]
pub fn normal(seed: u64, n: u64) -> f64 {
    (f64::from(bits(seed, n).count_ones()) - 32.0) * 0.25
}
