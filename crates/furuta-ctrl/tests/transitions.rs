//! The table of transitions in docs/controllers.md is what the supervisor does: every mode, every event, tried and
//! compared.

use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::supervisor::{Mode, Request, Supervisor, SupervisorState};
use furuta_ctrl::{Config, Limits, Site};
use furuta_model::Rig;
use std::fmt::Write as _;

const MODES: [Mode; 6] = [
    Mode::Idle,
    Mode::SwingUp,
    Mode::Balance,
    Mode::Stopping,
    Mode::Braking,
    Mode::Fault,
];
const HANGING: f64 = std::f64::consts::PI;

/// What may happen, in the table's words.
const EVENTS: [&str; 10] = [
    "start asked for",
    "stop asked for",
    "reset asked for",
    "the pendulum can be caught",
    "the pendulum falls",
    "both axes at rest for half a second",
    "the arm has stopped",
    "the arm beyond its limit",
    "an axis beyond its speed limit",
    "a measured angle not finite",
];

struct Bench(Supervisor<f64>);

impl Bench {
    fn sample(&self, state: &mut SupervisorState<f64>, theta: f64, alpha: f64) -> f64 {
        let out = self
            .0
            .update(state, &Measurement::new(theta, alpha, 0.0), 0.0);
        assert_eq!(out.mode, state.mode());
        assert!(matches!(out.mode, Mode::SwingUp | Mode::Balance | Mode::Braking) || out.u == 0.0);
        out.u
    }

    /// In this mode, and where the pendulum then is.
    fn bring_to(&self, mode: Mode) -> (SupervisorState<f64>, f64) {
        let mut state = self.0.start();
        let alpha = if matches!(mode, Mode::Balance | Mode::Idle) {
            0.0
        } else {
            HANGING
        };
        match mode {
            Mode::Idle => {}
            Mode::SwingUp | Mode::Balance => {
                assert!(state.request(Request::Start));
            }
            Mode::Stopping => {
                assert!(state.request(Request::Start) && state.request(Request::Stop));
            }
            Mode::Fault => {
                self.sample(&mut state, f64::NAN, 0.0);
            }
            Mode::Braking => {
                assert!(state.request(Request::Start));
                // The arm runs at 1 rad/s into its limit of 2 rad.
                for k in 0.. {
                    self.sample(&mut state, 0.002 * f64::from(k), HANGING);
                    if state.mode() == Mode::Braking {
                        return (state, HANGING);
                    }
                    assert!(k < 1100, "beyond its limit");
                }
            }
        }
        for _ in 0..3 {
            self.sample(&mut state, 0.0, alpha);
        }
        assert_eq!(state.mode(), mode, "before the event");
        (state, alpha)
    }

    fn after(&self, mode: Mode, event: &str) -> Mode {
        let (mut state, alpha) = self.bring_to(mode);
        let ask = |state: &mut SupervisorState<f64>, request| {
            let before = state.mode();
            let granted = state.request(request);
            assert_eq!(granted, state.mode() != before, "{before:?}, {request:?}");
        };
        match event {
            "start asked for" => ask(&mut state, Request::Start),
            "stop asked for" => ask(&mut state, Request::Stop),
            "reset asked for" => ask(&mut state, Request::Reset),
            "the pendulum can be caught" => {
                // It rises at 2 rad/s and is held upright.
                for k in 0..850 {
                    let risen = (alpha - 0.004 * f64::from(k)).max(0.0);
                    self.sample(&mut state, 0.0, risen);
                }
            }
            "the pendulum falls" => {
                for k in 0..400 {
                    self.sample(&mut state, 0.0, alpha + 0.005 * f64::from(k));
                }
            }
            "both axes at rest for half a second" => {
                for _ in 0..300 {
                    self.sample(&mut state, 0.0, alpha);
                }
            }
            "the arm has stopped" => {
                let theta = if mode == Mode::Braking { 2.0 } else { 0.0 };
                for _ in 0..60 {
                    self.sample(&mut state, theta, alpha);
                }
            }
            "the arm beyond its limit" => {
                for k in 0..1100 {
                    self.sample(&mut state, 0.002 * f64::from(k), alpha);
                }
            }
            "an axis beyond its speed limit" => {
                for k in 0..60 {
                    self.sample(&mut state, 0.03 * f64::from(k), alpha);
                }
            }
            "a measured angle not finite" => {
                self.sample(&mut state, 0.0, f64::INFINITY);
            }
            _ => unreachable!("an event without a trial: {event}"),
        }
        state.mode()
    }
}

/// The table, as it stands in the documentation.
fn table() -> String {
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    let limits = Limits {
        arm_angle: Some(2.0),
        arm_speed: Some(10.0),
        pendulum_speed: Some(50.0),
    };
    let site = Site {
        limits,
        ..Site::of(&rig, 0.002)
    };
    let bench = Bench(Supervisor::design(&Config::default(), &site).expect("possible"));
    let mut text = String::from("| in the mode |");
    for mode in MODES {
        let _ = write!(text, " {} |", mode.name());
    }
    text.push_str("\n|---|");
    text.push_str(&"---|".repeat(MODES.len()));
    for event in EVENTS {
        let _ = write!(text, "\n| {event} |");
        for mode in MODES {
            let next = bench.after(mode, event);
            let _ = write!(text, " {} |", if next == mode { "" } else { next.name() });
        }
    }
    text
}

#[test]
fn the_documented_table_is_what_happens() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/controllers.md");
    let page = std::fs::read_to_string(path).expect("the page is part of the project");
    let table = table();
    assert!(
        page.contains(&table),
        "docs/controllers.md must hold this table:\n{table}"
    );
}
