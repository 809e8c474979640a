//! Regions of attraction against what is known without simulating: the linear plant's null-controllable set, and
//! symmetry.

use furuta_ctrl::controllers::{self, AnyController, StateFeedback};
use furuta_ctrl::settings::Settings;
use furuta_ctrl::{ConfigError, Site};
use furuta_design::region::{Grid, On, Reach, Region};
use furuta_model::{Rig, State};

const PERIOD: f64 = 0.002;
/// Wider than any arm goes: the linear plant's may go anywhere.
const ANYWHERE: f64 = 1e9;

fn grid() -> Grid {
    Grid {
        points: 21,
        ..Grid::default()
    }
}

fn rigs() -> impl Iterator<Item = Rig> {
    Rig::VOLTAGE
        .iter()
        .map(|name| Rig::builtin(name).expect("built in"))
}

/// Every controller that suits the rig.
fn every_controller(rig: &Rig) -> Vec<AnyController<f64>> {
    let design = |settings| AnyController::design(&settings, &Site::of(rig, PERIOD));
    let made = controllers::CATALOGUE
        .iter()
        .map(|spec| design(Settings::new(spec)));
    made.filter(|c| !matches!(c, Err(ConfigError::Unsuitable { .. })))
        .map(|c| c.expect("designed"))
        .collect()
}

/// Starts of a region with whether they are inside.
fn starts(region: &Region) -> impl Iterator<Item = (State<f64>, bool)> {
    let n = region.alpha.len();
    region.inside.iter().enumerate().map(move |(k, inside)| {
        let x = State::new(0.0, region.alpha[k % n], 0.0, region.alpha_dot[k / n]);
        (x, *inside)
    })
}

#[test]
fn nothing_leaves_what_the_voltage_can_hold() {
    for rig in rigs() {
        let reach = Reach::of(&rig).expect("possible").expect("unstable");
        for c in every_controller(&rig) {
            let region = Region::of(&rig, On::Linear, &c, &grid(), PERIOD, ANYWHERE, &|_| ())
                .expect("possible");
            let name = (&rig.name, c.spec().id);
            for (x, inside) in starts(&region) {
                assert!(!inside || reach.holds(&x), "{name:?}: {x:?}");
            }
            assert!(region.share() > 0.05, "{name:?}: {}", region.share());
        }
    }
}

/// Full voltage against the unstable part, and nothing else, holds all that can be held: so the limit is no looser than
/// it must be.
#[test]
fn the_limit_is_reached() {
    for name in ["fong2014-emecs", "shahzad2022-srv02"] {
        let rig = Rig::builtin(name).expect("built in");
        let reach = Reach::of(&rig).expect("possible").expect("unstable");
        let linear = furuta_model::linearize(&rig.plant::<f64>(), State::upright(), 0.0);
        let grip: f64 = (0..4).map(|i| reach.normal[i] * linear.b[i]).sum();
        // Full voltage from a thirtieth of the limit on.
        let gain = 30.0 * rig.params.motor.command_limit / reach.offset * grip.signum();
        let control = StateFeedback {
            gain: reach.normal.map(|w| gain * w),
            command_limit: rig.params.motor.command_limit,
        };
        let region = Region::of(
            &rig,
            On::Linear,
            &control,
            &grid(),
            PERIOD,
            ANYWHERE,
            &|_| (),
        )
        .expect("possible");
        // Away from the limit by a fiftieth; the pendulum lies down on the way from far out.
        let safe = Reach {
            offset: 0.98 * reach.offset,
            ..reach
        };
        let held: Vec<_> = starts(&region)
            .filter(|(x, _)| safe.holds(x) && x.alpha.abs() < 0.5)
            .collect();
        let lost = held.iter().filter(|(_, inside)| !inside).count();
        assert!(
            held.len() > 40 && lost == 0,
            "{name}: {lost} of {}",
            held.len()
        );
    }
}

/// Rig and controllers are odd functions of the state, in every bit.
#[test]
fn regions_are_symmetric() {
    for rig in rigs() {
        for c in every_controller(&rig) {
            let region =
                Region::of(&rig, On::Rig, &c, &grid(), PERIOD, 6.3, &|_| ()).expect("possible");
            let mut turned = region.inside.clone();
            turned.reverse();
            assert_eq!(region.inside, turned, "{}, {}", rig.name, c.spec().id);
            // Upright at rest is in, leaning and falling at full speed is out.
            let middle = region.inside.len() / 2;
            assert!(region.inside[middle] && !region.inside[2 * middle]);
        }
    }
}

#[test]
fn more_voltage_holds_more() {
    let share = |volts: f64| {
        let mut rig = Rig::builtin("qube-servo-2").expect("built in");
        rig.params.motor.command_limit = volts;
        let lqr = &every_controller(&rig)[0];
        let region =
            Region::of(&rig, On::Rig, lqr, &grid(), PERIOD, 6.3, &|_| ()).expect("possible");
        region.share()
    };
    let shares = [2.0, 5.0, 10.0].map(share);
    assert!(
        shares[0] < 0.7 * shares[1] && shares[1] < shares[2],
        "{shares:?}"
    );
}
