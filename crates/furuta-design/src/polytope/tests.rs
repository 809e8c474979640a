use super::*;
use furuta_model::{Rig, State, linearize};

fn rig() -> Rig {
    Rig::builtin("fong2014-emecs").expect("built in")
}

#[test]
fn corners_are_the_models_of_those_rigs() {
    let mut rig = rig();
    let off = LENGTHS_AND_MASS.map(|key| Uncertain { key, share: 0.2 });
    let found = polytope(&rig.params, &off).expect("not too wide");
    assert_eq!((found.control_points.len(), found.corners.len()), (27, 8));
    for (params, model) in &found.corners {
        rig.params = *params;
        let expected = linearize(&rig.nominal_plant(), State::upright(), 0.0);
        assert!((model.a - expected.a).norm() < 1e-11 * expected.a.norm());
        assert!((model.b - expected.b).norm() < 1e-11 * expected.b.norm());
        assert!(found.control_points.contains(model));
    }
}

/// A rig inside the box is the convex combination that the theory says, for every parameter that can be given.
#[test]
fn rigs_inside_are_convex_combinations() {
    for (seed, keys) in keys().collect::<Vec<_>>().chunks(4).enumerate() {
        let off: Vec<_> = keys
            .iter()
            .map(|key| Uncertain { key, share: 0.3 })
            .collect();
        let mut rig = rig();
        let found = polytope(&rig.params, &off).expect("not too wide");
        // Where in the box, 0 to 1 on each axis; of R, by its reciprocal.
        let at: Vec<f64> = (0..keys.len())
            .map(|i| 0.15 + 0.19 * ((i + seed) % 4) as f64)
            .collect();
        let mut p = rig.params.to_array();
        for (u, t) in off.iter().zip(&at) {
            let index = furuta_model::params::RANGES
                .iter()
                .position(|r| r.key == u.key)
                .expect("known");
            let (low, high) = (1.0 - u.share, 1.0 + u.share);
            p[index] *= if u.key == "motor.resistance" {
                1.0 / (1.0 / low + t * (1.0 / high - 1.0 / low))
            } else {
                low + t * (high - low)
            };
        }
        rig.params = Params::from_array(rig.params.motor.actuation, p);
        let expected = linearize(&rig.nominal_plant(), State::upright(), 0.0);
        // Bernstein weights times the control points' determinants, which polytope() does not give out: solve for
        // the combination with the known weights by taking them from the quotient's two equal forms.
        let bernstein = |degree: usize, k: usize, t: f64| match (degree, k) {
            (1, 0) => 1.0 - t,
            (1, _) => t,
            (_, 0) => (1.0 - t) * (1.0 - t),
            (_, 1) => 2.0 * t * (1.0 - t),
            _ => t * t,
        };
        let degrees: Vec<usize> = keys
            .iter()
            .map(|key| KEYS.iter().find(|k| k.0 == *key).expect("known").1)
            .collect();
        let determinants = determinants(
            &Rig::builtin("fong2014-emecs").expect("built in").params,
            &off,
            &degrees,
        );
        let (mut a, mut b, mut total) = (
            SMatrix::<f64, 4, 4>::zeros(),
            SVector::<f64, 4>::zeros(),
            0.0,
        );
        for (i, point) in found.control_points.iter().enumerate() {
            let (mut rest, mut weight) = (i, determinants[i]);
            for (degree, t) in degrees.iter().zip(&at) {
                weight *= bernstein(*degree, rest % (degree + 1), *t);
                rest /= degree + 1;
            }
            assert!(weight >= 0.0);
            a += point.a * weight;
            b += point.b * weight;
            total += weight;
        }
        assert!(
            (a / total - expected.a).norm() < 1e-10 * expected.a.norm(),
            "{keys:?}"
        );
        assert!(
            (b / total - expected.b).norm() < 1e-10 * expected.b.norm(),
            "{keys:?}"
        );
    }
}

/// Bernstein coefficients of the determinant, by another way than the code under test: blossoming at the ends.
fn determinants(params: &Params<f64>, off: &[Uncertain], degrees: &[usize]) -> Vec<f64> {
    let count: usize = degrees.iter().map(|d| d + 1).product();
    let value = |share: &[f64]| {
        let mut p = params.to_array();
        for (u, s) in off.iter().zip(share) {
            let index = furuta_model::params::RANGES
                .iter()
                .position(|r| r.key == u.key)
                .expect("known");
            p[index] *= 1.0 + u.share * s;
        }
        Fraction::of(
            &Params::from_array(params.motor.actuation, p),
            &Slopes::NONE,
        )
        .determinant
    };
    (0..count)
        .map(|i| {
            let mut rest = i;
            let index: Vec<usize> = degrees
                .iter()
                .map(|d| {
                    let k = rest % (d + 1);
                    rest /= d + 1;
                    k
                })
                .collect();
            // f's polar form at (-1, 1) is 2 f(0) - (f(-1) + f(1)) / 2; take all combinations.
            let mut terms = vec![(1.0, Vec::new())];
            for (d, k) in degrees.iter().zip(&index) {
                let choices: &[(f64, f64)] = match (d, k) {
                    (_, 0) => &[(1.0, -1.0)],
                    (2, 1) => &[(2.0, 0.0), (-0.5, -1.0), (-0.5, 1.0)],
                    _ => &[(1.0, 1.0)],
                };
                terms = terms
                    .iter()
                    .flat_map(|(w, at): &(f64, Vec<f64>)| {
                        choices
                            .iter()
                            .map(move |(cw, c)| (w * cw, at.iter().copied().chain([*c]).collect()))
                    })
                    .collect();
            }
            terms.iter().map(|(w, at)| w * value(at)).sum()
        })
        .collect()
}

#[test]
fn errors_name_the_cause() {
    let p = rig().params;
    let one = |key, share| polytope(&p, &[Uncertain { key, share }]);
    assert!(matches!(
        one("pendulum.mass", 1.0),
        Err(PolytopeError::Share { .. })
    ));
    assert!(matches!(
        one("pendulum.mass", f64::NAN),
        Err(PolytopeError::Share { .. })
    ));
    assert!(matches!(
        one("environment.gravity", 0.1),
        Err(PolytopeError::UnknownKey { .. })
    ));
    assert!(
        key("pendulum.lenght")
            .expect_err("misspelt")
            .to_string()
            .contains("pendulum.com")
    );
    let twice = [Uncertain {
        key: "arm.length",
        share: 0.1,
    }; 2];
    assert_eq!(
        polytope(&p, &twice),
        Err(PolytopeError::Twice { key: "arm.length" })
    );
    let all: Vec<_> = keys().map(|key| Uncertain { key, share: 0.1 }).collect();
    assert_eq!(
        polytope(&p, &all),
        Err(PolytopeError::TooMany { count: 81 * 512 })
    );
}
