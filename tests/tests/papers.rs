//! The papers' printed matrices and gains, recomputed from the built-in rigs.

use furuta_ctrl::design::{Weights, is_hurwitz, lqr, poles};
use furuta_model::{Linear, Rig, State, linearize};
use nalgebra::{RowVector4, SMatrix, SVector};

fn upright(name: &str) -> Linear {
    let rig = Rig::builtin(name).expect("built in");
    linearize(&rig.nominal_plant(), State::upright(), 0.0)
}

/// Every printed entry against the recomputed one; `tolerance` is relative.
fn agree(found: &[f64], printed: &[f64], tolerance: f64) {
    for (found, printed) in found.iter().zip(printed) {
        assert!(
            (found - printed).abs() <= tolerance * printed.abs(),
            "{found} is not the printed {printed}"
        );
    }
}

fn lower_rows(linear: &Linear) -> Vec<f64> {
    [2, 3]
        .into_iter()
        .flat_map(|row| (1..4).map(move |col| (row, col)))
        .map(|at| linear.a[at])
        .collect()
}

#[test]
fn fong_2014_equation_24() {
    let linear = upright("fong2014-emecs");
    let printed = [5.9796, -8.1419, -0.1098, 57.6254, -6.9788, -1.0584];
    // Four digits; the entries with C2 to the three that its corrected value was found from.
    agree(&lower_rows(&linear), &printed, 5e-4);
    agree(linear.b.as_slice(), &[0.0, 0.0, 28.8442, 24.7236], 1e-4);
    let mut real: Vec<f64> = poles(&linear.a)
        .expect("finite")
        .iter()
        .map(|p| p.re)
        .collect();
    real.sort_by(f64::total_cmp);
    agree(&real, &[-9.84652, -6.27353, 0.0, 6.91975], 1e-4);
}

#[test]
fn fong_2014_prints_a_friction_that_cannot_be() {
    // Erratum: with the Table 1 digits 390 read as 3.9e-4 neither entry with C2 comes out as printed.
    let mut rig = Rig::builtin("fong2014-emecs").expect("built in");
    rig.params.pendulum.viscous = 3.9e-4;
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    assert!((linear.a[(2, 3)] + 0.1098).abs() > 0.02);
    assert!((linear.a[(3, 3)] + 1.0584).abs() > 0.2);
}

#[test]
fn fong_2014_downward_signs() {
    // Eq. (26)-(28): measured from hanging, coupling and gravity change sign.
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    let up = upright("fong2014-emecs");
    let down = linearize(&rig.nominal_plant(), State::hanging(), 0.0);
    for (at, sign) in [
        ((2, 1), 1.0),
        ((3, 1), -1.0),
        ((2, 3), -1.0),
        ((3, 2), -1.0),
        ((2, 2), 1.0),
    ] {
        assert!((down.a[at] - sign * up.a[at]).abs() < 1e-9, "{at:?}");
    }
    assert!((down.b[3] + up.b[3]).abs() < 1e-9);
}

#[test]
fn shahzad_2022_matrices_and_gain() {
    let linear = upright("shahzad2022-srv02");
    let printed = [54.06, -20.38, 0.0, 109.56, -19.22, 0.0];
    agree(&lower_rows(&linear), &printed, 2e-4);
    agree(linear.b.as_slice(), &[0.0, 0.0, 35.84, 33.81], 2e-4);

    // The gain of the printed matrices with Q = I, R = 1: the published one to 0.3 %.
    #[rustfmt::skip]
    let a = SMatrix::<f64, 4, 4>::from_row_slice(&[
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
        0.0, 54.06, -20.38, 0.0,
        0.0, 109.56, -19.22, 0.0,
    ]);
    let b = SVector::<f64, 4>::new(0.0, 0.0, 35.84, 33.81);
    let weights = Weights::diagonal([1.0; 4], [1.0]);
    let gain = lqr(&a, &b, &weights).expect("stabilisable").gain;
    agree(gain.as_slice(), &[-1.000, 27.660, -2.019, 3.553], 2e-4);
    let published = RowVector4::new(-1.0, 27.68, -2.02, 3.56);
    agree(gain.as_slice(), published.as_slice(), 3e-3);
    // With the rig's own linearisation, not rounded to print, every printed digit of the published gain comes out: Q = I, R = 1
    // are the weights the paper does not tell.
    let own = lqr(&linear.a, &linear.b, &weights)
        .expect("stabilisable")
        .gain;
    for (own, published) in own.iter().zip(published.iter()) {
        assert!((own - published).abs() < 0.005, "{own} {published}");
    }

    let closed = a - b * published;
    let mut found: Vec<(f64, f64)> = poles(&closed)
        .expect("finite")
        .iter()
        .map(|p| (p.re, p.im.abs()))
        .collect();
    found.sort_by(|p, q| p.0.total_cmp(&q.0));
    let expected = [
        (-54.95, 0.0),
        (-6.266, 2.165),
        (-6.266, 2.165),
        (-0.869, 0.0),
    ];
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found.0 - expected.0).abs() < 6e-3 && (found.1 - expected.1).abs() < 2e-3,
            "{found:?}"
        );
    }
}

#[test]
fn ramos_velasco_gain_with_the_motor_corrected() {
    // Published for beta = -alpha and the order [alpha_arm, beta, alpha_arm', beta']; u = -K x.
    let linear = upright("ramos-velasco");
    let gain = RowVector4::new(-0.66, 43.25, -1.33, 13.5);
    let closed = linear.a - linear.b * gain;
    assert!(is_hurwitz(&closed));
    let mut real: Vec<f64> = poles(&closed)
        .expect("finite")
        .iter()
        .map(|p| p.re)
        .collect();
    real.sort_by(f64::total_cmp);
    agree(&real, &[-91.22, -2.287, -0.872, -0.872], 2e-3);
}
