//! Fits, against transfer functions that are known.

use super::white;
use furuta_ident::frequency::orders::sweep;
use furuta_ident::frequency::polynomial::from_roots;
use furuta_ident::frequency::{
    Delay, Estimator, FitError, FitNotice, Frf, Hold, Request, Settings, Spectra, Stretch,
    Transfer, fit,
};
use furuta_model::discretize::zero_order_hold;
use furuta_model::transfer::transfer_function;
use furuta_model::{Rig, State, linearize};
use nalgebra::{Complex, RowVector4, SMatrix, SVector};
use proptest::prelude::*;
use std::f64::consts::TAU;

fn request(zeros: usize, poles: usize) -> Request {
    Request {
        zeros,
        poles,
        hold: Hold::None,
        delay: Delay::Known(0.0),
    }
}

/// 0.1 to 25 Hz, evenly in the logarithm.
fn band() -> Vec<f64> {
    (0..120)
        .map(|k| 0.1 * 250_f64.powf(f64::from(k) / 119.0))
        .collect()
}

fn close(found: &[f64], truth: &[f64], within: f64) -> bool {
    found.len() == truth.len()
        && found
            .iter()
            .zip(truth)
            .all(|(a, b)| (a - b).abs() <= within * (b.abs() + 1e-12))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    /// Without noise the function comes back, whatever its poles and zeros within the band, up to order 6 (pairs drawn
    /// apart from one another).
    #[test]
    fn without_noise_the_function_comes_back(
        pairs in prop::collection::vec((0.02..0.9_f64, 0.0..1.0_f64), 1..=3),
        zeros in prop::collection::vec(-3.0..3.0_f64, 0..=3),
        single in prop::option::of(0.5..60.0_f64),
    ) {
        // A pair in each part of the band, or poles could coincide, which no fit tells apart to many digits.
        let n = pairs.len() as f64;
        let mut poles = Vec::new();
        for (k, (damping, place)) in pairs.iter().enumerate() {
            let w = TAU * 0.2 * 60_f64.powf((k as f64 + 0.2 + 0.6 * place) / n);
            let im = w * (1.0 - damping * damping).sqrt();
            poles.extend([Complex::new(-damping * w, im), Complex::new(-damping * w, -im)]);
        }
        if pairs.len() < 3 {
            poles.extend(single.map(|p| Complex::new(-p, 0.0)));
        }
        let zeros: Vec<Complex<f64>> = zeros.iter().take(poles.len() - 1)
            .map(|z| Complex::new(z.signum() * 10_f64.powf(z.abs() - 0.5), 0.0)).collect();
        let truth = Transfer::new(&from_roots(&zeros), &from_roots(&poles)).expect("proper");
        let frf = Frf::exact(&band(), |f| truth.response(f));
        let found = fit(&frf, &request(zeros.len(), poles.len())).expect("a fit");
        // A zero far outside the band is known worse: what counts is the response.
        prop_assert!(found.relative_error < 1e-8, "{} {truth:?} {found:?}", found.relative_error);
        prop_assert!(close(&found.transfer.denominator, &truth.denominator, 1e-4), "{truth:?} {found:?}");
    }
}

/// `alpha / u` of a hanging rig, continuous, and as a sampled system.
fn hanging(rig: &str) -> (Transfer, SMatrix<f64, 4, 4>, SVector<f64, 4>) {
    let rig = Rig::builtin(rig).expect("built in");
    let linear = linearize(&rig.nominal_plant(), State::hanging(), 0.0);
    let g = transfer_function(&linear.a, &linear.b, &RowVector4::new(0.0, 1.0, 0.0, 0.0));
    // The arm's free turning cancels: numerator and denominator begin with s.
    let numerator: Vec<f64> = g.numerator[1..3].iter().rev().copied().collect();
    let mut denominator = vec![1.0];
    denominator.extend(g.denominator[1..].iter().rev());
    let g = Transfer::new(&numerator, &denominator).expect("proper");
    (g, linear.a, linear.b)
}

/// The exact response of the sampled rig gives the continuous rig back.
#[test]
fn the_hold_is_seen_through() {
    let (truth, a, b) = hanging("fong2014-emecs");
    for h in [0.001, 0.01] {
        let (ad, bd) = zero_order_hold(&a, &b, h);
        // Up to a quarter of the sampling rate.
        let lines: Vec<f64> = (1..200).map(|k| f64::from(k) * 0.25 / h / 400.0).collect();
        let sampled = |f: f64| {
            let z = Complex::from_polar(1.0, TAU * f * h);
            let m =
                SMatrix::<Complex<f64>, 4, 4>::identity() * z - ad.map(|v| Complex::new(v, 0.0));
            m.lu()
                .solve(&bd.map(|v| Complex::new(v, 0.0)))
                .expect("no pole there")[1]
        };
        let frf = Frf::exact(&lines, sampled);
        let held = Request {
            hold: Hold::ZeroOrder(h),
            ..request(1, 3)
        };
        let found = fit(&frf, &held).expect("a fit");
        assert!(
            close(&found.transfer.denominator, &truth.denominator, 1e-5),
            "{h}: {found:?} {truth:?}"
        );
        assert!((found.transfer.numerator[0] / truth.numerator[0] - 1.0).abs() < 1e-5);
        // Taken as continuous, half a sample of delay passes for something of the plant's.
        let blind = fit(&frf, &request(1, 3)).expect("a fit");
        assert!(blind.relative_error > 30.0 * found.relative_error.max(1e-6));
        // Half a sample of delay is nearly all of it at low frequencies.
        let late = fit(
            &frf.band(0.0, 0.05 / h).expect("lines"),
            &Request {
                delay: Delay::Fitted,
                ..request(1, 3)
            },
        )
        .expect("a fit");
        assert!(
            (late.delay.value / h - 0.5).abs() < 0.03,
            "{}",
            late.delay.value / h
        );
    }
}

#[test]
fn a_delay_is_found() {
    let truth = Transfer {
        delay: 0.013,
        ..Transfer::new(&[-24.7, 0.0], &[1.0, 9.2, 65.5, 427.0]).expect("proper")
    };
    let frf = Frf::exact(&band(), |f| truth.response(f));
    let found = fit(
        &frf,
        &Request {
            delay: Delay::Fitted,
            ..request(1, 3)
        },
    )
    .expect("a fit");
    assert!((found.delay.value - 0.013).abs() < 1e-9 && found.relative_error < 1e-8);
    let known = fit(
        &frf,
        &Request {
            delay: Delay::Known(0.013),
            ..request(1, 3)
        },
    )
    .expect("a fit");
    assert!((known.transfer.numerator[0] + 24.7).abs() < 1e-6);
    assert_eq!(known.delay.std, 0.0);
}

/// White noise through the sampled rig, white noise on its output: over 60 recordings the 95 % intervals hold the true
/// coefficients and poles as often as they should. 60 x 5 coefficients, correlated with one another: between 89 and 99
/// %.
#[test]
fn standard_deviations_are_true() {
    let (truth, a, b) = hanging("qube-servo-2");
    let h = 0.004;
    let (ad, bd) = zero_order_hold(&a, &b, h);
    let poles = truth.poles().expect("they converge");
    let (mut inside, mut all, mut chi2) = (0, 0, 0.0);
    for seed in 0..60 {
        let n = 20_000;
        let (u, e) = (white(2 * seed, n), white(2 * seed + 1, n));
        let mut x = SVector::<f64, 4>::zeros();
        let mut y = Vec::with_capacity(n);
        for k in 0..n {
            y.push(x[1] + 0.02 * e[k]);
            x = ad * x + bd * u[k];
        }
        let spectra = Spectra::of(
            &[Stretch {
                u: &u,
                y: &y,
                r: None,
            }],
            h,
            &Settings::new(2000),
        )
        .expect("good data");
        let frf = Frf::of(&spectra, Estimator::H1)
            .expect("many segments")
            .band(0.3, 12.0)
            .expect("lines");
        let held = Request {
            hold: Hold::ZeroOrder(h),
            ..request(1, 3)
        };
        let found = fit(&frf, &held).expect("a fit");
        chi2 += found.chi2 / 60.0;
        let mut judge = |value: f64, truth: f64, std: f64| {
            inside += u32::from((value - truth).abs() <= 1.96 * std);
            all += 1;
        };
        judge(
            found.transfer.numerator[0],
            truth.numerator[0],
            found.numerator_std[0],
        );
        for i in 1..4 {
            judge(
                found.transfer.denominator[i],
                truth.denominator[i],
                found.denominator_std[i],
            );
        }
        for (p, truth) in found.poles.iter().zip(&poles) {
            judge(p.value.re, truth.re, p.std.re);
            if truth.im > 0.0 {
                judge(p.value.im, truth.im, p.std.im);
            }
        }
    }
    let share = f64::from(inside) / f64::from(all);
    assert!(
        (0.89..0.99).contains(&share),
        "{share} of {all}, chi2 {chi2}"
    );
    // 18 averages: variances from so few make chi² 6 % too large; leakage adds.
    assert!((0.85..1.35).contains(&chi2), "{chi2}");
}

#[test]
fn orders_are_chosen() {
    let truth = Transfer::new(&[-24.7, 0.0], &[1.0, 9.2, 65.5, 427.0]).expect("proper");
    let frequency: Vec<f64> = (1..230).map(|k| 0.1 * f64::from(k)).collect();
    let mut frf = Frf::exact(&frequency, |f| truth.response(f));
    let noise = white(11, 2 * frequency.len());
    frf.averages = 30.0;
    for (k, h) in frf.response.iter_mut().enumerate() {
        let std = 0.02 * h.norm();
        frf.std[k] = std;
        *h += Complex::new(noise[2 * k], noise[2 * k + 1]) * (std / 2_f64.sqrt());
    }
    let fits = sweep(&frf, 5, Hold::None, Delay::Known(0.0));
    assert_eq!(
        fits[0].transfer.orders(),
        [1, 3],
        "{:?}",
        fits.iter()
            .map(|f| (f.transfer.orders(), f.bic))
            .collect::<Vec<_>>()
    );
    assert_eq!(fits.len(), 15);
    // One pole and one zero too many cancel, and it is said.
    let more = fits
        .iter()
        .find(|f| f.transfer.orders() == [2, 4])
        .expect("fitted");
    assert!(
        more.notices().iter().any(|n| matches!(
            n,
            FitNotice::Cancels { .. } | FitNotice::Undetermined { .. }
        )),
        "{more:?}"
    );
    let fewer = fits
        .iter()
        .find(|f| f.transfer.orders() == [0, 2])
        .expect("fitted");
    assert!(
        matches!(fewer.notices()[..], [.., FitNotice::MoreThanNoise { .. }]),
        "{fewer:?}"
    );
}

#[test]
fn what_cannot_be_fitted_is_refused_and_what_is_doubtful_said() {
    let unstable = Transfer::new(&[2.0], &[1.0, -1.0, 20.0]).expect("proper");
    let frf = Frf::exact(&band(), |f| unstable.response(f));
    let found = fit(&frf, &request(0, 2)).expect("a fit");
    assert!(!found.is_stable());
    let text = found.notices()[0].to_string();
    assert!(
        text.starts_with("the fit is unstable: a pole at 0.5000"),
        "{text}"
    );
    assert!(text.contains("fit lower orders"), "{text}");

    // However little it is unstable, and however unsure that is.
    let mut barely = Frf::exact(&band(), |f| {
        Complex::new(1.0, 0.0) / Complex::new(-0.01, TAU * f)
    });
    barely.std = barely.response.iter().map(|h| 0.3 * h.norm()).collect();
    let found = fit(&barely, &request(0, 1)).expect("a fit");
    assert!(!found.is_stable() && found.poles[0].std.re > found.poles[0].value.re);
    assert!(
        matches!(found.notices()[..], [FitNotice::Unstable { .. }, ..]),
        "{found:?}"
    );

    // A pair of poles does not cancel a real zero, however unsure both are.
    let pair = Transfer::new(&[1.0, 3.0], &[1.0, 6.0, 9.5]).expect("proper");
    let mut unsure = Frf::exact(&band(), |f| pair.response(f));
    unsure.std = unsure.response.iter().map(|h| 0.5 * h.norm()).collect();
    let found = fit(&unsure, &request(1, 2)).expect("a fit");
    assert!(
        found.poles[0].value.im != 0.0 && found.poles[0].std.re > 1.0,
        "{found:?}"
    );
    assert!(
        !found
            .notices()
            .iter()
            .any(|n| matches!(n, FitNotice::Cancels { .. })),
        "{found:?}"
    );

    let error = |frf: &Frf, request: Request| fit(frf, &request).expect_err("refused").to_string();
    assert!(
        error(&frf, request(3, 2))
            .starts_with("a numerator of order 3 over a denominator of order 2")
    );
    assert!(error(&frf, request(0, 0)).contains("the denominator's order is 1 to 12"));
    let held = Request {
        hold: Hold::ZeroOrder(0.01),
        ..request(2, 2)
    };
    assert!(error(&frf, held).ends_with("the numerator's at most 1"));
    let few = frf.band(0.1, 0.12).expect("lines");
    assert!(
        error(&few, request(2, 4))
            .starts_with("7 coefficients need at least 5 lines, the response has ")
    );
    assert!(
        error(
            &frf,
            Request {
                delay: Delay::Known(-1.0),
                ..request(1, 2)
            }
        )
        .starts_with("delay = -1 s is outside")
    );
    let mut broken = frf;
    broken.response[3] = Complex::new(f64::NAN, 0.0);
    assert!(matches!(
        fit(&broken, &request(1, 2)),
        Err(FitError::Unusable { .. })
    ));
}
