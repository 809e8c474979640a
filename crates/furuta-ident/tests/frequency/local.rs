use super::{exact, filtered, white};
use furuta_ident::frequency::{
    Estimator, FrequencyError, FrequencyNotice, Frf, Settings, Stretch, local, periodic,
};
use furuta_model::signals::{Harmonics, Multisine, Phases};
use nalgebra::Complex;
use std::f64::consts::TAU;

const H: f64 = 0.002;

fn stretch<'a>(u: &'a [f64], y: &'a [f64]) -> Stretch<'a> {
    Stretch { u, y, r: None }
}

/// A resonance at 5 Hz, damped to 3 %: 0.3 Hz wide, and its response by the closed form.
fn resonance(u: &[f64]) -> Vec<f64> {
    let (a1, a2) = poles();
    let mut y = vec![3.0, -2.0];
    for k in 2..u.len() {
        y.push(-a1 * y[k - 1] - a2 * y[k - 2] + u[k - 1]);
    }
    y
}

fn poles() -> (f64, f64) {
    let (w, decay) = (TAU * 5.0 * H, 0.03 * TAU * 5.0 * H);
    (-2.0 * (-decay).exp() * w.cos(), (-2.0 * decay).exp())
}

fn resonant(f: f64) -> Complex<f64> {
    let z = Complex::from_polar(1.0, -TAU * f * H);
    let (a1, a2) = poles();
    z / (1.0 + a1 * z + a2 * z * z)
}

/// Without noise what is left is leakage: under Hann's window per cents at the resonance, here next to nothing, though
/// the record begins far from rest.
#[test]
fn transients_do_not_leak() {
    let n = 20_000;
    let u = white(7, n);
    let y = resonance(&u);
    let worst = |frf: &Frf| -> f64 {
        let errors = frf.frequency.iter().zip(&frf.response);
        let near = errors.filter(|(f, _)| (3.0..7.0).contains(*f));
        near.map(|(f, h)| (h / resonant(*f) - 1.0).norm())
            .fold(0.0, f64::max)
    };
    let (frf, notices) = local::response(&[stretch(&u, &y)], H, 0.25, None).expect("long enough");
    assert!(notices.is_empty(), "{notices:?}");
    assert_eq!(frf.frequency.len(), 999); // 0.25 to 249.75 Hz
    let (hann, _) = Frf::measure(&[stretch(&u, &y)], H, &Settings::new(2000), Estimator::H1)
        .expect("long enough");
    assert!(worst(&frf) < 3e-4, "{}", worst(&frf));
    assert!(worst(&hann) > 0.05, "{}", worst(&hann));
}

/// 95 % circles over the resonance too; 20 recordings, 40 lines each: 3 standard deviations of 800 are 2.3 %.
#[test]
fn circles_hold_the_truth_at_the_resonance() {
    for resolution in [0.2, 0.3, 0.5] {
        let (mut inside, mut all) = (0, 0);
        for seed in 0..20 {
            let n = 20_000;
            let u = white(2 * seed, n);
            let noise = white(2 * seed + 1, n);
            let y: Vec<f64> = resonance(&u)
                .iter()
                .zip(&noise)
                .map(|(y, e)| y + 0.5 * e)
                .collect();
            let band = Some([2.0, 2.0 + 40.0 * resolution]);
            let (frf, _) = local::response(&[stretch(&u, &y)], H, resolution, band).expect("good");
            let radius = frf.confidence(0.95).expect("a probability");
            for ((f, h), radius) in frf.frequency.iter().zip(&frf.response).zip(&radius) {
                let error = (h - resonant(*f)).norm();
                inside += u32::from(error <= *radius);
                all += 1;
            }
        }
        let share = f64::from(inside) / f64::from(all);
        assert!(
            (share - 0.95).abs() < 0.023,
            "{resolution}: {share} of {all}"
        );
    }
}

/// `u = r - 0.8 y` with strong noise: with the external signal the estimate is right, without it is pulled away.
#[test]
fn a_loop_is_seen_through() {
    let n = 60_000;
    let (r, e) = (white(3, n), white(4, n));
    let (mut u, mut x, mut y) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 2..n {
        x[k] = 1.2 * x[k - 1] - 0.5 * x[k - 2] + 0.4 * u[k - 1];
        y[k] = x[k] + e[k];
        u[k] = r[k] - 0.8 * y[k];
    }
    let truth = |f: f64| {
        let z = Complex::from_polar(1.0, -TAU * f * H);
        0.4 * z / (1.0 - 1.2 * z + 0.5 * z * z)
    };
    let joint = Stretch {
        u: &u,
        y: &y,
        r: Some(&r),
    };
    let band = Some([5.0, 100.0]);
    let of = |s| local::response(&[s], H, 1.0, band).expect("long enough").0;
    let (joint, plain) = (of(joint), of(stretch(&u, &y)));
    let scaled = |frf: &Frf| -> f64 {
        let errors = (0..frf.frequency.len())
            .map(|k| ((frf.response[k] - truth(frf.frequency[k])).norm() / frf.std[k]).powi(2));
        errors.sum::<f64>() / frf.frequency.len() as f64
    };
    // 96 lines of two degrees of freedom.
    assert!((0.7..1.35).contains(&scaled(&joint)), "{}", scaled(&joint));
    assert!(scaled(&plain) > 5.0, "{}", scaled(&plain));
}

#[test]
fn stretches_have_transients_of_their_own() {
    let u = white(9, 12_000);
    let y = resonance(&u);
    // The second is cut out of the middle: it begins in full swing. The third is too short.
    let parts = [(0, 5000), (6000, 11_500), (11_600, 11_650)];
    let parts = parts.map(|(a, b)| stretch(&u[a..b], &y[a..b]));
    let (frf, notices) = local::response(&parts, H, 0.5, Some([3.0, 7.0])).expect("long enough");
    let gaps = FrequencyNotice::Gaps {
        stretches: 3,
        unused: 1,
    };
    assert!(notices.contains(&gaps), "{notices:?}");
    for (f, h) in frf.frequency.iter().zip(&frf.response) {
        assert!((h / resonant(*f) - 1.0).norm() < 1e-2, "{f} Hz: {h}");
    }
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let u = white(1, 1000);
    let y = filtered(&u);
    let of = |resolution, band| local::response(&[stretch(&u, &y)], H, resolution, band);
    // 2 s: 13 lines lie within one resolution of 3.25 Hz.
    assert!(of(3.25, None).is_ok());
    let error = of(1.0, None).expect_err("too fine");
    assert!(
        matches!(error, FrequencyError::TooShort { possible, .. } if (possible - 3.25).abs() < 1e-9),
        "{error}"
    );
    for resolution in [0.0, -1.0, f64::NAN, 300.0] {
        let error = of(resolution, None).expect_err("none");
        assert!(
            matches!(error, FrequencyError::Resolution { .. }),
            "{error}"
        );
    }
    let error = of(5.0, Some([300.0, 400.0])).expect_err("beyond");
    assert!(matches!(error, FrequencyError::EmptyBand { .. }), "{error}");
    // One sine says something where it is, and nothing elsewhere.
    let sine: Vec<f64> = (0..1000)
        .map(|k| (TAU * 25.0 * f64::from(k) * H).sin())
        .collect();
    let at = |band| local::response(&[stretch(&sine, &sine)], H, 5.0, band);
    assert_eq!(at(None).expect("one line").0.frequency, [25.0]);
    let error = at(Some([30.0, 200.0])).expect_err("nothing");
    assert!(
        matches!(error, FrequencyError::NotExcited { .. }),
        "{error}"
    );
}

/// Odd multisines through `v = u + c u³`, then a filter, with noise: what detection lines tell of distortion is how the
/// response scatters from one set of phases to the next, and a linear system has none.
#[test]
fn distortion_is_told_from_noise() {
    let run = |cubic: f64, square: f64, seed: u64| {
        let phases = Phases::Random(seed);
        let signal = Multisine::new(1.0, 0.5, 0.5, 60.0, Harmonics::Detecting(seed), phases);
        let signal = signal.expect("valid");
        let n = 7000; // 7 periods of 1000
        let u: Vec<f64> = (0..n).map(|k| signal.volts(k as f64 * H)).collect();
        let v: Vec<f64> = u
            .iter()
            .map(|u| u + square * u * u + cubic * u.powi(3))
            .collect();
        let y: Vec<f64> = filtered(&v)
            .iter()
            .zip(white(seed, n))
            .map(|(y, e)| y + 0.02 * e)
            .collect();
        periodic::response(&[stretch(&u, &y)], H, 2.0, 1).expect("periodic")
    };
    let detected = |notice: &Option<FrequencyNotice>| match notice {
        Some(FrequencyNotice::Distortion { detected, .. }) => *detected,
        other => panic!("{other:?}"),
    };
    let false_alarms = (0..40).filter(|s| detected(&run(0.0, 0.0, *s).1)).count();
    // One in twenty is expected: 2 of 40; 7 or more come once in 200 times.
    assert!(false_alarms < 7, "{false_alarms}");
    // An even nonlinearity leaves the odd harmonics alone.
    let even = (0..40).filter(|s| detected(&run(0.0, 0.05, *s).1)).count();
    assert!(even < 7, "{even}");

    // With a cubic one the linear part at every line is 1 + 3 c times the filter, for signals of RMS 1.
    let (mut errors, mut variances, mut shares) = (0.0, 0.0, 0.0);
    for seed in 0..20 {
        let (frf, notice) = run(0.02, 0.0, seed);
        assert!(detected(&notice), "{seed}");
        for k in 0..frf.frequency.len() {
            let linear = exact(frf.frequency[k], H) * 1.06;
            errors += ((frf.response[k] - linear).norm() / frf.response[k].norm()).powi(2);
            variances += (frf.std[k] / frf.response[k].norm()).powi(2);
            shares += (frf.distortion[k] / frf.std[k]).powi(2);
        }
        let lines = frf.frequency.len() as f64;
        shares /= lines;
        assert!(shares > 0.5, "{shares}");
    }
    // The level at detection lines is that at excited ones but for a factor near 1.
    assert!(
        (0.5..2.0).contains(&(errors / variances)),
        "{}",
        errors / variances
    );
}
