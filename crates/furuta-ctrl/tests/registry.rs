//! What every controller and every estimator of the catalogues must do, whichever there are: a new one is tested here
//! by being listed.

use furuta_ctrl::config::{self, SECTIONS};
use furuta_ctrl::controllers::{self, AnyController, Controller, Design, SwingUp};
use furuta_ctrl::estimators::{self, AnyEstimator, Estimator, Measurement};
use furuta_ctrl::settings::{MAX_NUMBERS, Settings, Shape};
use furuta_ctrl::supervisor::{Request, Supervisor};
use furuta_ctrl::{Config, ConfigError, ControllerFile, Plan, Real, Site};
use furuta_model::{Rig, State};
use proptest::prelude::*;

const PERIOD: f64 = 0.002;

/// A state from anywhere: any bit pattern, or near where controllers work.
fn any_state() -> impl Strategy<Value = [f64; 4]> {
    let near = [-2.0..2.0, -7.0..7.0, -20.0..20.0, -30.0..30.0f64];
    prop_oneof![prop::array::uniform4(prop::num::f64::ANY), near]
}

/// A section's settings, every parameter left out or somewhere in its range.
fn any_settings(spec: &'static furuta_ctrl::settings::Spec) -> impl Strategy<Value = Settings> {
    let each: Vec<_> = spec
        .parameters
        .iter()
        .map(|p| {
            let (min, max, whole) = (
                p.min,
                p.max,
                !matches!(p.shape, Shape::Number | Shape::Numbers(_)),
            );
            // Ranges reach over many decades: ordinary values shall occur, too.
            let value = prop_oneof![
                min..=max,
                (-3.0..3.0).prop_map(move |x: f64| x.clamp(min, max)),
                Just(min),
                Just(max)
            ];
            let value = value.prop_map(move |x| if whole { x.floor().max(min) } else { x });
            prop::option::weighted(0.4, prop::collection::vec(value, p.shape.len()))
        })
        .collect();
    each.prop_map(move |values| {
        let mut settings = Settings::new(spec);
        for (p, values) in spec.parameters.iter().zip(values) {
            if let Some(values) = values {
                settings = settings.with(p.name, &values).expect("within its range");
            }
        }
        settings
    })
}

fn any_controller_settings() -> impl Strategy<Value = Settings> {
    prop::sample::select(controllers::CATALOGUE.to_vec()).prop_flat_map(any_settings)
}

/// Runs a controller over states and checks every command; what it remembers is replaced by a fresh start now and then,
/// and once by that of a take-over.
fn check<T: Real, C: Controller<T>>(
    c: &C,
    states: &[([f64; 4], [f64; 4])],
    limit: f64,
) -> Result<(), TestCaseError> {
    let cast = |x: &[f64; 4]| State::from(x.map(T::from_f64));
    let mut memory = c.start();
    for (k, (x, r)) in states.iter().enumerate() {
        let (x, r) = (cast(x), cast(r));
        if k == 10 {
            memory = c.take_over(&x, &r, T::from_f64(0.5 * limit));
        }
        let u = c.update(&mut memory, &x, &r, T::from_f64(PERIOD)).value();
        // In single precision the limit is rounded.
        prop_assert!(u.is_finite() && u.abs() <= limit * (1.0 + 1e-6), "{u} V");
    }
    // Whatever has been seen, sound states give sound commands again.
    let u = c.update(
        &mut memory,
        &State::upright(),
        &State::upright(),
        T::from_f64(PERIOD),
    );
    prop_assert!(u.value().is_finite());
    Ok(())
}

/// Runs a whole control system over measurements and checks every command.
fn check_system<T: Real>(
    config: &Config,
    site: &Site<'_>,
    samples: &[([f64; 4], u32)],
) -> Result<(), TestCaseError> {
    let Ok(supervisor) = Supervisor::<T>::design(config, site) else {
        return Ok(()); // which may be is checked below
    };
    let mut state = supervisor.start();
    for (numbers, periods) in samples {
        let [theta, alpha, held, target] = numbers.map(T::from_f64);
        state.request(Request::Reset);
        state.request(Request::Start);
        let m = Measurement {
            theta,
            alpha,
            held,
            periods: *periods,
        };
        let u = supervisor.update(&mut state, &m, target).u.value();
        prop_assert!(
            u.is_finite() && u.abs() <= site.command_limit * (1.0 + 1e-6),
            "{u} V"
        );
    }
    Ok(())
}

proptest! {
    #[test]
    fn every_controller_gives_finite_bounded_commands(
        states in prop::collection::vec((any_state(), any_state()), 1..30),
        random in any_controller_settings(),
    ) {
        for name in Rig::VOLTAGE {
            let rig = Rig::builtin(name).expect("built in");
            let site = Site::of(&rig, PERIOD);
            let limit = site.command_limit;
            let swing_up = Settings::new(&controllers::SWING_UP);
            check(&SwingUp::<f64>::design(&swing_up, &site).expect("suits any rig"), &states, limit)?;
            check(&SwingUp::<f32>::design(&swing_up, &site).expect("suits any rig"), &states, limit)?;
            let standard = controllers::CATALOGUE.iter().map(|spec| Settings::new(spec));
            for settings in standard.chain([random.clone()]) {
                match AnyController::<f64>::design(&settings, &site) {
                    Ok(c) => check(&c, &states, limit)?,
                    Err(_) => continue, // which may be is checked below
                }
                let c = AnyController::<f32>::design(&settings, &site).expect("as in f64");
                check(&c, &states, limit)?;
            }
        }
    }

    /// The whole control system with every controller and every estimator, from measurements on.
    #[test]
    fn every_control_system_gives_finite_bounded_commands(
        samples in prop::collection::vec((any_state(), 1u32..60), 1..20),
        random in any_controller_settings(),
    ) {
        let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
        let site = Site::of(&rig, PERIOD);
        for estimator in estimators::CATALOGUE {
            let standard = controllers::CATALOGUE.iter().map(|spec| Settings::new(spec));
            for controller in standard.chain([random.clone()]) {
                let config = Config { estimator: Settings::new(estimator), ..Config::with_controller(controller) };
                check_system::<f64>(&config, &site, &samples)?;
                check_system::<f32>(&config, &site, &samples)?;
            }
        }
    }

    #[test]
    fn settings_survive_the_wire_and_the_file(random in any_controller_settings()) {
        let config = Config::with_controller(random);
        let bytes = postcard::to_slice(&config, &mut [0; 2048]).map(|b| b.to_vec()).expect("fits");
        prop_assert_eq!(&postcard::from_bytes::<Config>(&bytes).expect("own bytes"), &config);
        let file = ControllerFile { config, ..ControllerFile::default() };
        let again = ControllerFile::from_toml(&file.to_toml()).expect("own text");
        prop_assert_eq!(again, file);
    }

    /// A microcontroller does not trust what it is sent.
    #[test]
    fn any_bytes_are_answered(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        if let Ok(plan) = postcard::from_bytes::<Plan>(&bytes) {
            let _ = plan.supervisor::<f32>();
        }
    }

    #[test]
    fn damaged_plans_are_answered(place in 0usize..400, byte: u8) {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let plan = Plan::new(Config::default(), &Site::of(&rig, PERIOD));
        let mut bytes = postcard::to_slice(&plan, &mut [0; 1024]).map(|b| b.to_vec()).expect("fits");
        let place = place % bytes.len();
        bytes[place] = byte;
        if let Ok(plan) = postcard::from_bytes::<Plan>(&bytes) {
            let _ = plan.supervisor::<f32>();
        }
    }
}

/// Nothing given, every controller works on every rig, or says why it does not suit it.
#[test]
fn every_controller_can_be_had_for_every_rig() {
    for name in Rig::VOLTAGE {
        let rig = Rig::builtin(name).expect("built in");
        for spec in controllers::CATALOGUE {
            for h in [0.001, 0.002, 0.005] {
                match AnyController::<f64>::design(&Settings::new(spec), &Site::of(&rig, h)) {
                    Ok(c) => assert_eq!(c.spec().id, spec.id),
                    Err(ConfigError::Unsuitable { section, .. }) => assert_eq!(section, spec.id),
                    Err(e) => panic!("{name}, {}, {h} s: {e}", spec.id),
                }
            }
        }
    }
}

#[test]
fn every_estimator_follows_a_swing() {
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    let plant = rig.plant::<f64>();
    for spec in estimators::CATALOGUE {
        let e = AnyEstimator::<f64>::design(&Settings::new(spec), &Site::of(&rig, PERIOD))
            .expect(spec.id);
        let (mut memory, mut truth) = (e.start(), plant.rest(State::new(0.0, 2.0, 0.0, 0.0)));
        let mut worst: f64 = 0.0;
        for k in 0..1000 {
            let u = if k % 200 < 100 { 1.0 } else { -1.0 };
            let [theta, alpha] = plant.measure(&truth);
            let x = e
                .update(&mut memory, &Measurement::new(theta, alpha, u))
                .now;
            if k > 200 {
                worst = worst.max((x.alpha_dot - truth.x.alpha_dot).abs());
            }
            plant.step(&mut truth, u, PERIOD);
        }
        // The pendulum swings at up to 11 rad/s; the slowest estimator, a derivative, lags by 2/230 s times 60 rad/s^2.
        assert!(worst < 1.0, "{}: {worst} rad/s", spec.id);
    }
}

#[test]
fn ids_are_unique_and_sections_fit() {
    let ids: Vec<_> = config::specs().map(|spec| spec.id).collect();
    for (i, id) in ids.iter().enumerate() {
        assert!(!ids[..i].contains(id), "{id} twice");
        assert!(id.len() <= 32, "{id} does not fit on the wire");
    }
    for spec in config::specs() {
        let numbers: usize = spec.parameters.iter().map(|p| p.shape.len()).sum();
        assert!(
            numbers <= MAX_NUMBERS && spec.parameters.len() <= 32,
            "{}",
            spec.id
        );
        for p in spec.parameters {
            assert!(
                p.min <= p.max && !p.shape.is_empty(),
                "{}.{}",
                spec.id,
                p.name
            );
            assert!(
                p.default.is_none_or(|d| d >= p.min && d <= p.max),
                "{}.{}",
                spec.id,
                p.name
            );
            assert_ne!(p.name, "kind", "{} names a key that files use", spec.id);
        }
    }
    assert_eq!(SECTIONS.len(), Config::default().sections().len());
}
