//! The dynamics: one derivative, one RK4 step in several scalars, a whole trajectory, thousands of them at once.
//!
//! `native` is the same work written by hand for `f64` with nothing around it: the yardstick in the same run.

use std::hint::black_box;

use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use furuta_model::dynamics::acceleration;
use furuta_model::params::Coefficients;
use furuta_model::simulate::{Keep, OpenLoop, Rollout, Run, batch, trajectory};
use furuta_model::{Effect, Jet, Plant, Rig, Scalar, State, trig::sin_cos_f64};

fn rig() -> Rig {
    Rig::builtin("fong2014-emecs").expect("built in")
}

fn plant<S: Scalar>(effects: &[Effect<S>]) -> Plant<S> {
    Plant::new(&rig().params.cast(), effects).expect("few effects")
}

fn effect(id: &str, values: &[f64]) -> Effect<f64> {
    Effect::new(id, values).expect("valid")
}

type Group<'a> = BenchmarkGroup<'a, criterion::measurement::WallTime>;

fn derivative<S: Scalar>(g: &mut Group<'_>, name: &str) {
    let plant = plant::<S>(&[]);
    let x = State::new(0.1, 0.2, -0.3, 0.4).map(S::from_f64);
    let u = S::from_f64(0.5);
    g.bench_function(name, |b| {
        b.iter(|| acceleration(&plant.coefficients, black_box(&x), black_box(u)));
    });
}

fn step<S: Scalar>(g: &mut Group<'_>, name: &str, effects: &[Effect<f64>]) {
    let effects: Vec<_> = effects.iter().map(Effect::cast).collect();
    let plant = plant::<S>(&effects);
    let (u, h) = (S::from_f64(0.5), S::Real::from_f64(0.001));
    let start = plant.rest(State::new(0.1, 2.9, -0.3, 0.4).map(S::from_f64));
    // A chain of steps, each from the last: what a simulation does, not what a pipelined loop over one state shows.
    let mut state = start.clone();
    let mut left = 0;
    g.bench_function(name, |b| {
        b.iter(|| {
            if left == 0 {
                (state, left) = (start.clone(), 10_000);
            }
            left -= 1;
            plant.step(&mut state, black_box(u), h);
            state.x.alpha
        });
    });
}

/// The upright or hanging rig as one would write it down for this purpose alone.
fn native(c: &Coefficients<f64>, mut x: [f64; 4], commands: &[f64], h: f64) -> [f64; 4] {
    let rate = |x: &[f64; 4], u: f64| {
        let (s, k) = sin_cos_f64(x[1]);
        let (m11, m12) = (c.arm + c.swing * s * s, -c.coupling * k);
        let twist = c.swing * s * k * x[2];
        let a =
            c.drive * u - c.arm_damping * x[2] - 2.0 * twist * x[3] - c.coupling * s * x[3] * x[3];
        let b = c.weight * s - c.pendulum_damping * x[3] + twist * x[2];
        let over = 1.0 / (m11 * c.pendulum - m12 * m12);
        [
            x[2],
            x[3],
            (c.pendulum * a - m12 * b) * over,
            (m11 * b - m12 * a) * over,
        ]
    };
    let along = |x: &[f64; 4], k: &[f64; 4], h: f64| {
        [
            x[0] + h * k[0],
            x[1] + h * k[1],
            x[2] + h * k[2],
            x[3] + h * k[3],
        ]
    };
    for u in commands {
        let k1 = rate(&x, *u);
        let k2 = rate(&along(&x, &k1, 0.5 * h), *u);
        let k3 = rate(&along(&x, &k2, 0.5 * h), *u);
        let k4 = rate(&along(&x, &k3, h), *u);
        for i in 0..4 {
            x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
    }
    x
}

fn model(c: &mut Criterion) {
    let mut g = c.benchmark_group("derivative");
    g.throughput(Throughput::Elements(1));
    derivative::<f32>(&mut g, "f32");
    derivative::<f64>(&mut g, "f64");
    derivative::<Jet<f64, 4>>(&mut g, "dual, 4 derivatives");
    g.finish();

    let mut g = c.benchmark_group("rk4 step");
    g.throughput(Throughput::Elements(1));
    step::<f32>(&mut g, "f32", &[]);
    step::<f64>(&mut g, "f64", &[]);
    step::<Jet<f64, 4>>(&mut g, "dual, 4 derivatives", &[]);
    step::<Jet<f64, 16>>(&mut g, "dual, 16 derivatives", &[]);
    step::<Jet<f64, 28>>(&mut g, "dual, 28 derivatives", &[]);
    let spring = effect("arm.spring", &[1e-3, 0.0]);
    let friction = effect("arm.coulomb", &[5e-3]);
    step::<f64>(&mut g, "f64, spring", &[spring]);
    step::<f64>(
        &mut g,
        "f64, spring and Coulomb friction",
        &[spring, friction],
    );
    step::<f64>(
        &mut g,
        "f64, backlash",
        &[effect("drive.backlash", &[0.03, 0.4, 0.0])],
    );
    // A kick that never comes has the plant look for events in each step.
    let coupling = effect("drive.compliance", &[0.05, 1e-4, 0.3, 0.0]);
    let never = effect("disturbance.kick", &[1e-3, 1e6, 0.1, 0.0]);
    let looks = [coupling, never];
    step::<f64>(&mut g, "f64, flexible coupling", &looks[..1]);
    step::<f64>(&mut g, "f64, flexible coupling, events looked for", &looks);
    step::<Jet<f64, 16>>(
        &mut g,
        "dual, 16 derivatives, flexible coupling",
        &looks[..1],
    );
    step::<Jet<f64, 16>>(
        &mut g,
        "dual, 16 derivatives, flexible coupling, events looked for",
        &looks,
    );
    g.finish();

    let mut g = c.benchmark_group("10 s at 1 kHz");
    g.throughput(Throughput::Elements(10_000));
    let plant = plant::<f64>(&[]);
    let commands: Vec<f64> = (0..10_000)
        .map(|k| 0.5 * (f64::from(k) * 2e-3).sin())
        .collect();
    let start = State::new(0.1, 2.9, -0.3, 0.4);
    g.bench_function("native", |b| {
        b.iter(|| {
            native(
                &plant.coefficients,
                start.to_array(),
                black_box(&commands),
                1e-3,
            )
        });
    });
    g.bench_function("trajectory", |b| {
        b.iter(|| {
            trajectory(
                &plant,
                plant.rest(start),
                black_box(&commands),
                1e-3,
                1,
                |_| true,
            )
        });
    });
    g.finish();

    let mut g = c.benchmark_group("batch of 10,000 x 2 s at 1 kHz");
    g.sample_size(10);
    g.throughput(Throughput::Elements(10_000 * 2_000));
    let rollouts: Vec<_> = (0..10_000)
        .map(|i| Rollout {
            params: rig().params,
            effects: vec![],
            start: State::new(0.0, 3.0 - 1e-4 * f64::from(i), 0.0, 0.0),
        })
        .collect();
    let run = Run {
        period: 1e-3,
        samples: 2_000,
        keep: Keep::Last,
    };
    g.bench_function("all cores", |b| {
        b.iter(|| batch(&rollouts, &OpenLoop(black_box(&commands)), run, &|_| ()));
    });
    g.finish();
    let mut g = c.benchmark_group("batch of 800 x 2 s at 1 kHz");
    g.sample_size(10);
    g.throughput(Throughput::Elements(800 * 2_000));
    let spring: Vec<_> = rollouts[..800]
        .iter()
        .map(|r| Rollout {
            effects: vec![spring],
            ..r.clone()
        })
        .collect();
    g.bench_function("with a spring", |b| {
        b.iter(|| batch(&spring, &OpenLoop(black_box(&commands)), run, &|_| ()));
    });
    let friction: Vec<_> = rollouts[..800]
        .iter()
        .map(|r| Rollout {
            effects: vec![friction],
            ..r.clone()
        })
        .collect();
    g.bench_function("with Coulomb friction, one by one", |b| {
        b.iter(|| batch(&friction, &OpenLoop(black_box(&commands)), run, &|_| ()));
    });
    g.finish();
}

criterion_group!(benches, model);
criterion_main!(benches);
