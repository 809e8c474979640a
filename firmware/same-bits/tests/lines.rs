//! The comparison means something: every line is computed, sees its effect, and notices one bit.

use furuta_model::CATALOGUE;
use same_bits::{Fingerprint, Float, RIGS, trajectory};

const SECONDS: u32 = 4;

#[test]
fn the_fingerprint_is_fnv_1a() {
    // Test vectors published with the algorithm.
    for (text, expected) in [
        ("", "cbf29ce484222325"),
        ("a", "af63dc4c8601ec8c"),
        ("foobar", "85944171f73967e8"),
    ] {
        let mut sum = Fingerprint::new();
        text.bytes().for_each(|b| sum.byte(b));
        assert_eq!(sum.to_string(), expected);
    }
}

#[test]
fn no_line_is_refused() {
    let mut lines = String::new();
    same_bits::print(&mut lines).expect("a String takes all");
    let refused: Vec<_> = lines.lines().filter(|l| l.contains("refused")).collect();
    assert!(refused.is_empty(), "{refused:#?}");
}

fn every_effect_leaves_its_trace<F: Float>() {
    for (name, params) in RIGS {
        let plain = trajectory::<F>(params, &[], SECONDS).expect("possible");
        assert!(plain.state.is_finite(), "{name}");
        for spec in CATALOGUE {
            let with = trajectory::<F>(params, &[spec], SECONDS).expect("possible");
            assert!(with.state.is_finite(), "{name} {}", spec.id);
            assert_ne!(with.every_step, plain.every_step, "{name} {}", spec.id);
        }
    }
}

#[test]
fn every_effect_leaves_its_trace_in_single_precision() {
    every_effect_leaves_its_trace::<f32>();
}

#[test]
fn every_effect_leaves_its_trace_in_double_precision() {
    every_effect_leaves_its_trace::<f64>();
}

/// The smallest possible change of the pendulum's length.
#[test]
fn one_bit_of_a_parameter_changes_the_line() {
    for (name, params) in RIGS {
        let mut other = *params;
        other.pendulum.com = other.pendulum.com.next_up();
        let (a, b) = (
            trajectory::<f64>(params, &[], 1).expect("possible"),
            trajectory::<f64>(&other, &[], 1).expect("possible"),
        );
        assert_ne!(a, b, "{name}");
    }
}
