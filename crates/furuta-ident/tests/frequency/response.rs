use super::{exact, filtered, white};
use furuta_ident::frequency::{Estimator, Frf, Settings, Spectra, Stretch, Window, periodic};
use furuta_model::signals::{Harmonics, Multisine, Phases};

const H: f64 = 0.002;

fn stretch<'a>(u: &'a [f64], y: &'a [f64]) -> Stretch<'a> {
    Stretch { u, y, r: None }
}

/// H1 with output noise: the 95 % circles hold the truth at 95 % of the lines, over 20 recordings of 100 lines each.
/// Lines under Hann's window are correlated, some 2000 / 1.94 are independent: 3 standard deviations are 2.0 %.
#[test]
fn circles_hold_the_truth_as_often_as_they_say() {
    for (overlap, window) in [
        (0, Window::Rectangular),
        (0, Window::Hann),
        (150, Window::Hann),
        (200, Window::Blackman),
    ] {
        let (mut inside, mut all) = (0, 0);
        for seed in 0..20 {
            let n = 12_000;
            let u = white(2 * seed, n);
            let noise = white(2 * seed + 1, n);
            let y: Vec<f64> = filtered(&u)
                .iter()
                .zip(&noise)
                .map(|(y, e)| y + e)
                .collect();
            let settings = Settings {
                segment: 300,
                overlap,
                window,
            };
            let spectra = Spectra::of(&[stretch(&u, &y)], H, &settings).expect("good data");
            let frf = Frf::of(&spectra, Estimator::H1).expect("many segments");
            let radius = frf.confidence(0.95).expect("a probability");
            // Far from the resonance, where leakage is nothing beside the noise.
            for k in (50..150).filter(|k| *k < frf.frequency.len()) {
                let error = (frf.response[k] - exact(frf.frequency[k], H)).norm();
                inside += usize::from(error <= radius[k]);
                all += 1;
            }
        }
        let share = f64::from(inside as u32) / f64::from(all as u32);
        assert!((share - 0.95).abs() < 0.02, "{window:?} {overlap}: {share}");
    }
}

#[test]
fn noise_on_the_input_makes_h1_small_and_h2_right() {
    let n = 60_000;
    let u = white(1, n);
    let y = filtered(&u);
    let seen: Vec<f64> = u
        .iter()
        .zip(white(2, n))
        .map(|(u, e)| u + 0.7 * e)
        .collect();
    let spectra = Spectra::of(&[stretch(&seen, &y)], H, &Settings::new(512)).expect("good data");
    let at = |estimator| {
        let frf = Frf::of(&spectra, estimator).expect("many segments");
        let ratio: f64 = (20..60)
            .map(|k| frf.response[k].norm() / exact(frf.frequency[k], H).norm())
            .sum::<f64>();
        ratio / 40.0
    };
    // H1 is too small by 1 / (1 + 0.49); 40 lines of 230 averages leave 0.5 %.
    assert!((at(Estimator::H1) - 1.0 / 1.49).abs() < 0.02);
    assert!((at(Estimator::H2) - 1.0).abs() < 0.02);
}

/// Feedback `u = r - 0.8 y` with strong noise on the output: H1 is pulled towards -1/0.8, the joint estimate is not.
#[test]
fn in_closed_loop_only_the_joint_estimate_is_right() {
    let n = 100_000;
    let (r, e) = (white(3, n), white(4, n));
    let (mut u, mut x, mut y) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 2..n {
        x[k] = 1.6 * x[k - 1] - 0.8 * x[k - 2] + 0.3 * u[k - 1] + 0.1 * u[k - 2];
        y[k] = x[k] + 2.0 * e[k];
        u[k] = r[k] - 0.3 * y[k];
    }
    let data = [Stretch {
        u: &u,
        y: &y,
        r: Some(&r),
    }];
    let spectra = Spectra::of(&data, H, &Settings::new(512)).expect("good data");
    let [plain, joint] =
        [Estimator::H1, Estimator::Joint].map(|e| Frf::of(&spectra, e).expect("many segments"));
    let radius = joint.confidence(0.95).expect("a probability");
    let (mut inside, mut worst_plain, mut worst_joint) = (0, 0.0_f64, 0.0_f64);
    for (k, radius) in radius.iter().enumerate().take(230).skip(10) {
        let truth = exact(joint.frequency[k], H);
        let error = (joint.response[k] - truth).norm();
        inside += usize::from(error <= *radius);
        worst_joint = worst_joint.max(error);
        worst_plain = worst_plain.max((plain.response[k] - truth).norm());
    }
    assert!((200..=219).contains(&inside), "{inside} of 220 within 95 %");
    assert!(
        worst_plain > 3.0 * worst_joint,
        "{worst_plain} {worst_joint}"
    );
}

/// A multisine over whole periods: without noise the response is exact, with noise within its deviation.
#[test]
fn periods_have_no_leakage() {
    let signal =
        Multisine::new(1.0, 0.5, 0.5, 40.0, Harmonics::Odd, Phases::Schroeder).expect("valid");
    let n = 8000; // 8 periods of 1000
    let u: Vec<f64> = (0..n).map(|k| signal.volts(k as f64 * H)).collect();
    let y = filtered(&u);
    let frf = periodic::response(&[stretch(&u, &y)], H, 2.0, 1)
        .expect("periodic")
        .0;
    assert_eq!(frf.frequency.len(), 40);
    for (f, h) in frf.frequency.iter().zip(&frf.response) {
        // What rings after the first period is 0.8^500.
        assert!((h - exact(*f, H)).norm() < 1e-9, "{f} Hz");
    }
    let (mut errors, mut variances) = (0.0, 0.0);
    for seed in 0..20 {
        let noisy: Vec<f64> = y.iter().zip(white(seed, n)).map(|(y, e)| y + e).collect();
        let frf = periodic::response(&[stretch(&u, &noisy)], H, 2.0, 1)
            .expect("periodic")
            .0;
        for k in 0..40 {
            errors += (frf.response[k] - exact(frf.frequency[k], H)).norm_sqr();
            variances += frf.std[k].powi(2);
        }
    }
    // 800 squared errors of two degrees of freedom, 800 variances of twelve.
    assert!(
        (errors / variances - 1.0).abs() < 0.13,
        "{}",
        errors / variances
    );
}

/// No segment may run across a gap.
#[test]
fn stretches_are_averaged_apart() {
    let u = white(5, 4000);
    let y = filtered(&u);
    let whole = Spectra::of(
        &[stretch(&u, &y)],
        H,
        &Settings {
            overlap: 0,
            ..Settings::new(500)
        },
    )
    .expect("good");
    let parts: Vec<_> = (0..8)
        .map(|k| stretch(&u[500 * k..500 * (k + 1)], &y[500 * k..500 * (k + 1)]))
        .collect();
    let cut = Spectra::of(&parts, H, &Settings::new(500)).expect("good");
    assert_eq!((whole.segments, cut.segments), (8, 8));
    for (a, b) in whole.uy.iter().zip(&cut.uy) {
        assert!((a - b).norm() <= 1e-14 * a.norm());
    }
}

#[test]
fn windows_know_how_wide_their_lines_are() {
    // Hann: 1 + 2 (4/9) + 2 (1/36).
    assert!((Window::Hann.lines_for_one() - 35.0 / 18.0).abs() < 1e-12);
    assert!((Window::Rectangular.lines_for_one() - 1.0).abs() < 1e-12);
}
