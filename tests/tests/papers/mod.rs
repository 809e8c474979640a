//! The papers behind the built-in rigs, reproduced number by number; one file each. What they printed is in
//! `furuta_model::published`, with the tolerance that rounding in print asks for. An erratum has a test of its own: the
//! equation as printed and as corrected, both evaluated, and which of them the model is.

mod fong2014;
mod ramos_velasco;
mod ramos_velasco_regulator;
mod shahzad2022;

use furuta_ctrl::design::{Weights, lqr, poles};
use furuta_model::published::{PAPERS, Paper, Quantity};
use furuta_model::{Linear, Rig, State, linearize};
use nalgebra::SMatrix;

/// Relative difference within which two ways of computing the same closed form agree in `f64`.
const ROUNDING: f64 = 1e-11;

fn rig(name: &str) -> Rig {
    Rig::builtin(name).expect("built in")
}

fn upright(rig: &Rig) -> Linear {
    linearize(&rig.nominal_plant(), State::upright(), 0.0)
}

fn hanging(rig: &Rig) -> Linear {
    linearize(&rig.nominal_plant(), State::hanging(), 0.0)
}

/// The gain for Q = I, R = 1.
fn identity_gain(linear: &Linear) -> Option<[f64; 4]> {
    let weights = Weights::diagonal([1.0; 4], [1.0]);
    let gain = lqr(&linear.a, &linear.b, &weights).ok()?.gain;
    Some([gain[0], gain[1], gain[2], gain[3]])
}

/// What the paper of this rig prints for a quantity.
fn printed(rig: &str, quantity: Quantity) -> f64 {
    let paper = Paper::of(rig).expect("a paper's rig");
    paper.figure(quantity).expect("a printed figure").printed
}

/// Poles as (real, imaginary) part, sorted, conjugates both.
fn sorted_poles<const N: usize>(a: &SMatrix<f64, N, N>) -> Vec<(f64, f64)>
where
    nalgebra::Const<N>: nalgebra::DimSub<nalgebra::U1>,
    nalgebra::DefaultAllocator: nalgebra::allocator::Allocator<
            nalgebra::Const<N>,
            nalgebra::DimDiff<nalgebra::Const<N>, nalgebra::U1>,
        > + nalgebra::allocator::Allocator<nalgebra::DimDiff<nalgebra::Const<N>, nalgebra::U1>>,
{
    let mut found: Vec<(f64, f64)> = poles(a)
        .expect("finite")
        .iter()
        .map(|p| (p.re, p.im))
        .collect();
    found.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
    found
}

/// Each found number within `within` of the expected one.
fn assert_poles(found: &[(f64, f64)], expected: &[(f64, f64)], within: f64) {
    assert_eq!(found.len(), expected.len());
    for (f, e) in found.iter().zip(expected) {
        assert!(
            (f.0 - e.0).abs() <= within && (f.1 - e.1).abs() <= within,
            "{found:?} {expected:?}"
        );
    }
}

/// Both accelerations equal, relative to the larger of them.
fn same(found: [f64; 2], expected: [f64; 2]) -> bool {
    let scale = expected[0].abs().max(expected[1].abs()).max(1.0);
    (0..2).all(|i| (found[i] - expected[i]).abs() <= ROUNDING * scale)
}

/// States all over the place, and commands: the same ones in every run.
fn states() -> impl Iterator<Item = (State<f64>, f64)> {
    let mut seed = 1_u64;
    let mut next = move |size: f64| {
        // Knuth's linear congruential generator; its upper bits are good enough for spread.
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        size * ((seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    (0..200).map(move |_| {
        let x = State::new(next(3.0), next(3.1), next(15.0), next(20.0));
        (x, next(10.0))
    })
}

#[test]
fn every_printed_figure_that_can_be_is_reproduced() {
    let mut reproduced = 0;
    for paper in PAPERS {
        let rig = rig(paper.rig);
        for figure in paper.figures {
            let ours = figure.recompute(&rig, identity_gain);
            match (figure.within, ours) {
                (Some(within), Some(ours)) => {
                    assert!(
                        (ours - figure.printed).abs() <= within,
                        "{}: {figure:?}: {ours}",
                        paper.rig
                    );
                    reproduced += 1;
                }
                (Some(_), None) => panic!("{}: {figure:?}", paper.rig),
                (None, _) => assert!(!figure.remark.is_empty(), "{}: {figure:?}", paper.rig),
            }
        }
    }
    assert_eq!(reproduced, 20 + 21 + 11);
}
