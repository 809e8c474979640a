//! Controllers as a controller file gives them, in closed loop on every built-in rig.

use furuta_ctrl::Site;
use furuta_ctrl::controllers::{self, AnyController};
use furuta_ctrl::settings::Settings;
use furuta_design::closed_loop::{ClosedLoop, Sample, Sensing};
use furuta_design::largest_sine;
use furuta_model::{Rig, State};

const PERIOD: f64 = 0.002;
const TRACKERS: [&str; 3] = ["output_regulator", "normal_form_sliding", "lqr_sliding"];

fn run(
    rig: &Rig,
    settings: &Settings,
    start: State<f64>,
    duration: f64,
    reference: impl Fn(f64) -> State<f64>,
) -> Vec<Sample> {
    let control =
        AnyController::<f64>::design(settings, &Site::of(rig, PERIOD)).expect("suits any rig");
    ClosedLoop {
        plants: vec![(0.0, rig.plant().into())],
        start,
        period: PERIOD,
        substeps: 2,
        duration,
        sensing: Sensing::Perfect,
    }
    .run(&control, reference)
}

fn settings(id: &str) -> Settings {
    controllers::settings(id).expect("listed")
}

fn both_ways(id: &str) -> Vec<Settings> {
    if id == "lqr_sliding" {
        vec![
            settings(id),
            settings(id).with("reaching", &[1.0]).expect("a word"),
        ]
    } else {
        vec![settings(id)]
    }
}

/// Nothing given, they balance; the arm comes to where it is asked to.
#[test]
fn every_tracker_balances_every_rig() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        for settings in TRACKERS.iter().flat_map(|id| both_ways(id)) {
            let target = State::new(0.3, 0.0, 0.0, 0.0);
            let samples = run(
                &rig,
                &settings,
                State::new(0.0, 0.03, 0.0, 0.0),
                25.0,
                |_| target,
            );
            let last = samples.last().expect("samples").x;
            // 25 s are ten times the slowest closed-loop pole's time of these rigs; the super-twisting's ripple
            // remains.
            assert!(
                last.alpha.abs() < 2e-3 && (last.theta - 0.3).abs() < 0.02,
                "{name} {}: {last:?}",
                settings.spec().id
            );
        }
    }
}

/// A sine of a third of what the pendulum can follow at all: the error is that of the series and of holding the command
/// over a sample.
#[test]
fn every_tracker_follows_a_sine_on_every_rig() {
    let lambda = 2.0;
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        let amplitude =
            largest_sine::amplitude(&rig.params.coefficients(), lambda).map_or(0.1, |a| a / 3.0);
        let amplitude = amplitude.min(0.1);
        for settings in TRACKERS.iter().flat_map(|id| both_ways(id)) {
            let settings = settings.with("lambda", &[lambda]).expect("possible");
            let settings = settings.with("order", &[7.0]).expect("possible");
            let samples = run(&rig, &settings, State::upright(), 25.0, |t| {
                let (sin, cos) = (lambda * t).sin_cos();
                State::new(0.0, amplitude * sin, 0.0, amplitude * lambda * cos)
            });
            let late = samples.iter().filter(|s| s.t > 20.0);
            let error = late
                .map(|s| (s.x.alpha - s.reference.alpha).abs())
                .fold(0.0, f64::max);
            assert!(samples.last().is_some_and(|s| s.t > 24.9), "{name} fell");
            assert!(
                error < 0.05 * amplitude,
                "{name} {}: {error} of {amplitude}",
                settings.spec().id
            );
        }
    }
}
