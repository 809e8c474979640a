//! Exact derivatives by dual numbers, against the complex step and against differences.
//!
//! The complex step, `f'(x) = Im f(x + i e) / e` with `e = 1e-30`, subtracts nothing and is as exact as `f` itself; its
//! arithmetic has nothing in common with that of [`Jet`].

use crate::exactness::plants::{any_state, effect, rigs};
use furuta_model::{CATALOGUE, Effect, Jet, Plant, RARE, Rig, Scalar, State, linearize};
use nalgebra::Complex;
use proptest::prelude::*;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A complex number as the model's scalar; branches are taken by its real part.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Step(Complex<f64>);

macro_rules! operators {
    ($($operator:ident :: $name:ident),+) => {$(
        impl $operator for Step {
            type Output = Self;
            fn $name(self, o: Self) -> Self {
                Self(self.0.$name(o.0))
            }
        }
    )+};
}
operators!(Add::add, Sub::sub, Mul::mul, Div::div);

impl Neg for Step {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
impl AddAssign for Step {
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}
impl SubAssign for Step {
    fn sub_assign(&mut self, o: Self) {
        self.0 -= o.0;
    }
}

impl Scalar for Step {
    type Real = f64;
    const ZERO: Self = Self(Complex::new(0.0, 0.0));
    const ONE: Self = Self(Complex::new(1.0, 0.0));
    fn from_f64(x: f64) -> Self {
        Self(Complex::new(x, 0.0))
    }
    fn from_real(x: f64) -> Self {
        Self::from_f64(x)
    }
    fn real(self) -> f64 {
        self.0.re
    }
    fn value(self) -> f64 {
        self.0.re
    }
    fn scale(self, k: f64) -> Self {
        Self(self.0 * k)
    }
    fn sin_cos(self) -> (Self, Self) {
        (Self(self.0.sin()), Self(self.0.cos()))
    }
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    fn exp(self) -> Self {
        Self(self.0.exp())
    }
    fn if_less(self, other: Self, then: Self, otherwise: Self) -> Self {
        if self.0.re < other.0.re {
            then
        } else {
            otherwise
        }
    }
}

const E: f64 = 1e-30;

/// `x` with a step in component `i`.
fn stepped(x: State<f64>, i: usize) -> State<Step> {
    let mut x = x.to_array().map(Step::from_f64);
    if let Some(x) = x.get_mut(i) {
        x.0.im = E;
    }
    State::from(x)
}

/// `[A B]` by the complex step.
fn by_complex_step(plant: &Plant<f64>, x: State<f64>, u: f64) -> [[f64; 5]; 4] {
    let plant: Plant<Step> = plant.cast();
    let mut jacobian = [[0.0; 5]; 4];
    for column in 0..5 {
        let u = Step(Complex::new(u, if column == 4 { E } else { 0.0 }));
        let rate = plant.rate(Step::ZERO, &stepped(x, column), plant.volts(u), 1e3);
        for (row, r) in jacobian.iter_mut().zip(rate.to_array()) {
            row[column] = r.0.im / E;
        }
    }
    jacobian
}

/// `[A B]` by differences from below and from above. A derivative lies between the two: on a smooth stretch they differ
/// by the second derivative times the step; at a kink it is one of them; at a jump one of them is as large as can be.
fn by_differences(plant: &Plant<f64>, x: State<f64>, u: f64) -> [[[f64; 2]; 5]; 4] {
    let h = 1e-5;
    let mut jacobian = [[[0.0; 2]; 5]; 4];
    for column in 0..5 {
        let rate = |h: f64| {
            let mut v = [x.theta, x.alpha, x.theta_dot, x.alpha_dot, u];
            v[column] += h;
            let x = State::new(v[0], v[1], v[2], v[3]);
            plant.rate(0.0, &x, plant.volts(v[4]), 1e3).to_array()
        };
        let (up, here, down) = (rate(h), rate(0.0), rate(-h));
        for (r, row) in jacobian.iter_mut().enumerate() {
            row[column] = [(here[r] - down[r]) / h, (up[r] - here[r]) / h];
        }
    }
    jacobian
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Every rig, without and with each effect.
    #[test]
    fn linearize_is_exact(x in any_state(), u in -5.0_f64..5.0, size in 0.1..3.0_f64) {
        // About where an axis stops or the command changes sign, curves are sharper than the differences' step.
        let far = |v: f64| v.abs() > 0.05;
        let smooth = far(x.theta_dot) && far(x.alpha_dot) && far(u);
        for rig in rigs() {
            for spec in [None]
                .into_iter()
                .chain(CATALOGUE.iter().chain(RARE).copied().map(Some)) {
                let effects: Vec<_> = spec.iter().map(|s| effect(s, &rig.params, size)).collect();
                let plant = Plant::new(&rig.params, &effects).expect("valid");
                let id = spec.map_or("none", |s| s.id);
                let linear = linearize(&plant, x, u);
                let complex = by_complex_step(&plant, x, u);
                let differences = by_differences(&plant, x, u);
                let rate = plant.rate(0.0, &x, plant.volts(u), 1e3).to_array();
                for r in 0..4 {
                    // Rounding of the largest terms of a row.
                    let scale = complex[r].iter().fold(1.0 + rate[r].abs(), |m, v| m.max(v.abs()));
                    for c in 0..5 {
                        let exact = if c < 4 { linear.a[(r, c)] } else { linear.b[r] };
                        prop_assert!((exact - complex[r][c]).abs() <= 1e-12 * scale,
                            "{} {id} [{r},{c}]: {exact} {}", rig.name, complex[r][c]);
                        // truncation 1e-10 of the third derivative, rounding 1e-16/1e-5 of the rate
                        let [below, above] = differences[r][c];
                        let between = exact >= below.min(above) - 1e-6 * scale && exact <= below.max(above) + 1e-6 * scale;
                        prop_assert!(!smooth || between,
                            "{} {id} [{r},{c}]: {exact} is not between {below} and {above}", rig.name);
                    }
                }
            }
        }
    }
}

/// Half a second through whatever events an effect has, derivatives with respect to where it starts, to the command and
/// to the effect's parameters.
#[test]
fn sensitivities_of_trajectories_are_exact() {
    const N: usize = crate::MANY;
    type Number = Jet<f64, N>;
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let start = [0.1, 2.4, 0.3, -0.2];
    let volts = 1.5;
    for spec in CATALOGUE.iter().chain(RARE) {
        let e = effect(spec, &rig.params, 1.0);
        let values = e.values();
        let reals = 5 + values.len();
        assert!(reals <= N, "room for {} parameters", values.len());
        let by_jet = end(&rig, spec.id, &values, start, volts, |i, v| {
            Number::variable(v, i)
        });
        for i in 0..reals {
            let by_step = end(&rig, spec.id, &values, start, volts, |j, v| {
                Step(Complex::new(v, if i == j { E } else { 0.0 }))
            });
            for (jet, step) in by_jet.iter().zip(by_step) {
                // Both took the same way: to rounding of 250 steps.
                assert!((jet.v - step.0.re).abs() < 1e-12, "{}", spec.id);
                let (jet, step) = (jet.d[i], step.0.im / E);
                // Sensitivities grow to 1e3 here; rounding by as much.
                assert!(
                    (jet - step).abs() < 1e-9 * (1.0 + step.abs()),
                    "{} with respect to {i}: {jet} {step}",
                    spec.id
                );
            }
        }
    }
}

/// What the encoders read and the state after half a second; `number` makes the `i`-th of start, command and
/// parameters.
fn end<S: Scalar<Real = f64>>(
    rig: &Rig,
    id: &str,
    values: &[f64],
    start: [f64; 4],
    volts: f64,
    number: impl Fn(usize, f64) -> S,
) -> [S; 6] {
    let x: Vec<S> = start
        .iter()
        .enumerate()
        .map(|(i, v)| number(i, *v))
        .collect();
    let u = number(4, volts);
    let v: Vec<S> = values
        .iter()
        .enumerate()
        .map(|(i, v)| number(5 + i, *v))
        .collect();
    let effect = Effect::new(id, &v).expect("valid");
    let plant = Plant::new(&rig.params.cast(), &[effect]).expect("one");
    let mut s = plant.rest(State::new(x[0], x[1], x[2], x[3]));
    for k in 0..250 {
        let swing = (0.02 * f64::from(k / 4 * 4)).sin();
        plant.step(&mut s, u.scale(swing), 2e-3);
    }
    let (x, y) = (s.x.to_array(), plant.measure(&s));
    [x[0], x[1], x[2], x[3], y[0], y[1]]
}
