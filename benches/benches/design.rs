//! Controller design.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use furuta_ctrl::design::{
    Float, Noise, Weights, balance, balance_weights, dlqe, dlqr, lqi, lqr, place, poles,
};
use furuta_design::polytope::LENGTHS_AND_MASS;
use furuta_design::robust_rig::robust_rig;
use furuta_model::{Rig, State, linearize};
use nalgebra::{Complex, RowSVector, SMatrix};

/// Upright, dx/dt = A x + B u, of the rig of the papers.
fn upright() -> (SMatrix<f64, 4, 4>, SMatrix<f64, 4, 1>) {
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    let linear = linearize(&rig.nominal_plant(), State::upright(), 0.0);
    (linear.a, linear.b)
}

/// Two such rigs side by side, each lightly coupled to the other: 8 states, 2 motors.
fn two_rigs() -> (SMatrix<f64, 8, 8>, SMatrix<f64, 8, 2>) {
    let (a, b) = upright();
    let a = SMatrix::from_fn(|i, j| {
        if i / 4 == j / 4 {
            a[(i % 4, j % 4)]
        } else {
            0.01
        }
    });
    let b = SMatrix::from_fn(|i, j| if i / 4 == j { b[(i % 4, 0)] } else { 0.0 });
    (a, b)
}

/// The system held over `h` (s), by the power series.
fn hold<const N: usize, const M: usize>(
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, M>,
    h: f64,
) -> (SMatrix<f64, N, N>, SMatrix<f64, N, M>) {
    // The integral of exp(A t) over the sample.
    let (mut term, mut integral) = (SMatrix::identity() * h, SMatrix::zeros());
    for k in 2..12 {
        integral += term;
        term *= a * (h / f64::from(k));
    }
    (SMatrix::identity() + a * integral, integral * b)
}

fn riccati<T: Float, const N: usize, const M: usize>(
    c: &mut Criterion,
    label: &str,
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, M>,
) {
    let (sampled_a, sampled_b) = hold(a, b, 0.005);
    let cast = |x: f64| nalgebra::convert::<f64, T>(x);
    let (a, b) = (a.map(cast), b.map(cast));
    let (sampled_a, sampled_b) = (sampled_a.map(cast), sampled_b.map(cast));
    let weights = Weights::diagonal([T::one(); N], [T::one(); M]);
    c.bench_function(&format!("lqr, {label}"), |bench| {
        lqr(&a, &b, &weights).expect("has a solution");
        bench.iter(|| lqr(black_box(&a), &b, &weights));
    });
    c.bench_function(&format!("dlqr, {label}"), |bench| {
        dlqr(&sampled_a, &sampled_b, &weights).expect("has a solution");
        bench.iter(|| dlqr(black_box(&sampled_a), &sampled_b, &weights));
    });
    let measured = SMatrix::<T, 2, N>::from_fn(|i, j| {
        if j == i * N / 2 || j == i * N / 2 + 1 {
            T::one()
        } else {
            T::zero()
        }
    });
    let noise = Noise::diagonal([T::one(); N], [T::one(); 2]);
    c.bench_function(&format!("dlqe, {label}"), |bench| {
        dlqe(&sampled_a, &measured, &noise).expect("has a solution");
        bench.iter(|| dlqe(black_box(&sampled_a), &measured, &noise));
    });
}

fn placement<T: Float, const N: usize>(
    c: &mut Criterion,
    label: &str,
    a: &SMatrix<f64, N, N>,
    b: &SMatrix<f64, N, 1>,
) {
    let cast = |x: f64| nalgebra::convert::<f64, T>(x);
    let (a, b) = (a.map(cast), b.map(cast));
    let poles: [Complex<T>; N] =
        std::array::from_fn(|i| Complex::new(cast(-3.0 - i as f64), T::zero()));
    c.bench_function(&format!("place, {label}"), |bench| {
        place(&a, &b, &poles).expect("controllable");
        bench.iter(|| place(black_box(&a), &b, &poles));
    });
}

fn integral<T: Float>(
    c: &mut Criterion,
    label: &str,
    a: &SMatrix<f64, 4, 4>,
    b: &SMatrix<f64, 4, 1>,
) {
    let cast = |x: f64| nalgebra::convert::<f64, T>(x);
    let (a, b) = (a.map(cast), b.map(cast));
    let weights = Weights::<T, 5, 1>::diagonal([T::one(); 5], [T::one()]);
    let arm = RowSVector::<T, 4>::from_fn(|_, j| if j == 0 { T::one() } else { T::zero() });
    c.bench_function(&format!("lqi, {label}"), |bench| {
        lqi(&a, &b, &arm, &weights).expect("has a solution");
        bench.iter(|| lqi(black_box(&a), &b, &arm, &weights));
    });
}

fn design(c: &mut Criterion) {
    let (a, b) = upright();
    riccati::<f64, 4, 1>(c, "n = 4, f64", &a, &b);
    riccati::<f32, 4, 1>(c, "n = 4, f32", &a, &b);
    placement::<f64, 4>(c, "n = 4, f64", &a, &b);
    placement::<f32, 4>(c, "n = 4, f32", &a, &b);
    integral::<f64>(c, "n = 4 + 1, f64", &a, &b);
    integral::<f32>(c, "n = 4 + 1, f32", &a, &b);
    c.bench_function("poles, n = 4, f64", |bench| {
        bench.iter(|| poles(black_box(&a)));
    });
    let (a, b) = two_rigs();
    riccati::<f64, 8, 2>(c, "n = 8, f64", &a, &b);
    riccati::<f32, 8, 2>(c, "n = 8, f32", &a, &b);
    let one = b * nalgebra::Vector2::new(1.0, 2.0);
    placement::<f64, 8>(c, "n = 8, f64", &a, &one);
    placement::<f32, 8>(c, "n = 8, f32", &a, &one);
    let rig = Rig::builtin("fong2014-emecs").expect("built in");
    c.bench_function("balance gain from parameters", |bench| {
        bench.iter(|| balance(black_box(&rig.params), 0.001));
    });
}

fn robust(c: &mut Criterion) {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let weights = balance_weights(&rig.params);
    // A barrier method over 27 vertices takes a while: few samples.
    let mut group = c.benchmark_group("robust");
    group.sample_size(10);
    group.bench_function("27 vertices", |bench| {
        robust_rig(&rig, &LENGTHS_AND_MASS, 0.2, &weights).expect("has a gain");
        bench.iter(|| robust_rig(black_box(&rig), &LENGTHS_AND_MASS, 0.2, &weights));
    });
    group.finish();
}

criterion_group!(benches, design, robust);
criterion_main!(benches);
