//! What a control step costs: prints a table. Run under `-icount`: `make firmware-cost`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod table {
    use core::mem::size_of;

    use furuta_ctrl::controllers::{
        Controller, Design, LqrSliding, Mpc, NormalFormSliding, StateFeedback, settings,
    };
    use furuta_ctrl::estimators::{
        self, DisturbanceObserver, Estimator, ExtendedKalman, Kalman, Measurement, Observer,
    };
    use furuta_ctrl::supervisor::{Mode, Request, Supervisor};
    use furuta_ctrl::{Config, ConfigError, Site};
    use furuta_model::{Plant, State};
    use mps2::measure::{Cost, Meter};
    use mps2::{say, the_rig};
    use rig::{EmulatedMechanics, OnChip, Pilot};

    /// Cycles of a period at 168 MHz.
    const BUDGET: u32 = 168 * the_rig::PERIOD_US;
    /// Cycles that an instruction takes on a Cortex-M4 with its floating-point unit: most take one; loads, taken
    /// branches and multiplications that wait for each other two or three, divisions fourteen.
    const CYCLES_PER_INSTRUCTION: f64 = 1.5;
    /// Seconds of each closed loop.
    const SAMPLES: u32 = 1000;

    fn row(what: &str, configuration: usize, memory: usize, cost: &Cost) {
        let share = 100.0 * CYCLES_PER_INSTRUCTION * f64::from(cost.max) / f64::from(BUDGET);
        say!(
            "| {what} | {configuration} | {memory} | {} | {} | {} | {share:.1} % |",
            cost.stack,
            cost.mean,
            cost.max
        );
    }

    /// A controller that knows the state, on a step of the arm by a radian with the pendulum leaning.
    fn controller<C: Controller<f32> + Design>(
        what: &str,
        id: &str,
        meter: &mut Meter,
        site: &Site<'_>,
        plant: &Plant<f32>,
        start: State<f32>,
    ) -> Result<(), ConfigError> {
        let settings = settings(id).unwrap_or_else(|| Config::default().controller);
        // The pendulum may lean by 0.05 rad: on the way over a radian of the arm, the limit is active.
        let settings = match settings.clone().with("pendulum_angle", &[0.05]) {
            Ok(limited) => limited,
            Err(_) => settings,
        };
        let controller = C::design(&settings, site)?;
        let mut memory = controller.start();
        let mut mechanics = plant.rest(start);
        let mut cost = Cost::default();
        let (h, upright) = (site.period as f32, State::upright());
        for _ in 0..SAMPLES {
            let x = mechanics.x;
            let (call, u) = meter.measure(|| controller.update(&mut memory, &x, &upright, h));
            cost.add(&call);
            plant.step(&mut mechanics, u, h);
        }
        row(what, size_of::<C>(), size_of::<C::State>(), &cost);
        Ok(())
    }

    /// An estimator on a balanced rig, as its encoders see it.
    fn estimator<E: Estimator<f32> + Design>(
        what: &str,
        id: &str,
        meter: &mut Meter,
        site: &Site<'_>,
        plant: &Plant<f32>,
    ) -> Result<(), ConfigError> {
        let settings = estimators::settings(id).unwrap_or_else(|| Config::default().estimator);
        let estimator = E::design(&settings, site)?;
        let balance = StateFeedback::<f32>::design(&Config::default().controller, site)?;
        let mut memory = estimator.start();
        let mut mechanics = plant.rest(State::new(0.2, 0.02, 0.0, 0.0));
        let mut cost = Cost::default();
        let (h, mut held) = (site.period as f32, 0.0);
        let counts = site.resolution.map(|angle| angle as f32);
        let read = |angle: f32, count: f32| (angle / count) as i32 as f32 * count;
        for _ in 0..SAMPLES {
            let x = mechanics.x;
            let measurement =
                Measurement::new(read(x.theta, counts[0]), read(x.alpha, counts[1]), held);
            let (call, estimate) = meter.measure(|| estimator.update(&mut memory, &measurement));
            cost.add(&call);
            plant.step(&mut mechanics, held, h);
            held = balance.update(&mut (), &estimate.ahead, &State::upright(), h);
        }
        row(what, size_of::<E>(), size_of::<E::State>(), &cost);
        Ok(())
    }

    /// The whole step, encoder counts to voltage, on the emulated mechanics: by mode.
    fn whole(
        what: &str,
        config: &Config,
        meter: &mut Meter,
        site: &Site<'_>,
    ) -> Result<(), ConfigError> {
        let hello = the_rig::hello();
        let (counts, period) = (the_rig::COUNTS, the_rig::PERIOD_US);
        let mut mechanics = EmulatedMechanics::new(site.params, site.effects, counts, period)?;
        let mut pilot = OnChip::new(Supervisor::design(config, site)?, &hello);
        pilot.request(Request::Start);
        let mut end = furuta_wire::RigEnd::new(hello);
        let (mut swing_up, mut balance) = (Cost::default(), Cost::default());
        for k in 0..3 * SAMPLES {
            let (theta, alpha) = mechanics.counts();
            let sample = end.tick(u64::from(k * the_rig::PERIOD_US), theta, alpha);
            let (call, volts) = meter.measure(|| pilot.decide(&sample));
            match pilot.mode() {
                Mode::SwingUp => swing_up.add(&call),
                Mode::Balance => balance.add(&call),
                _ => {}
            }
            end.command(volts.unwrap_or_default());
            mechanics.advance(sample.volts);
        }
        let size = size_of::<OnChip>();
        for (mode, cost) in [("swing-up", swing_up), ("balance", balance)] {
            say!(
                "| {what}, {mode} | {size} | | {} | {} | {} | {:.1} % |",
                cost.stack,
                cost.mean,
                cost.max,
                100.0 * CYCLES_PER_INSTRUCTION * f64::from(cost.max) / f64::from(BUDGET)
            );
        }
        Ok(())
    }

    pub(super) fn print(meter: &mut Meter) -> Result<(), the_rig::Unusable> {
        let rig = the_rig::TheRig::new()?;
        let site = &rig.site();
        let plant: &Plant<f32> = &Plant::<f64>::new(site.params, site.effects)?.cast();
        let near = State::new(0.02, 0.01, 0.0, 0.0);
        let far = State::new(1.0, 0.05, 0.0, 0.0);
        say!(
            "| control step, `f32` | settings, B | memory, B | stack, B | instructions, mean | most | \
             most, of 2 ms at 168 MHz |"
        );
        say!("|---|---|---|---|---|---|---|");
        controller::<StateFeedback<f32>>("LQR", "lqr", meter, site, plant, far)?;
        controller::<LqrSliding<f32>>(
            "sliding mode, LQR's surface",
            "lqr-sliding",
            meter,
            site,
            plant,
            far,
        )?;
        controller::<NormalFormSliding<f32>>(
            "sliding mode, normal form",
            "normal-form-sliding",
            meter,
            site,
            plant,
            near,
        )?;
        controller::<Mpc<f32>>("MPC, limits far", "mpc", meter, site, plant, near)?;
        controller::<Mpc<f32>>("MPC, limits active", "mpc", meter, site, plant, far)?;
        estimator::<Observer<f32>>("observer", "observer", meter, site, plant)?;
        estimator::<Kalman<f32>>("Kalman filter", "kalman", meter, site, plant)?;
        estimator::<DisturbanceObserver<f32>>(
            "disturbance observer",
            "disturbance-observer",
            meter,
            site,
            plant,
        )?;
        estimator::<ExtendedKalman<f32>>(
            "extended Kalman filter",
            "extended-kalman",
            meter,
            site,
            plant,
        )?;
        whole(
            "counts to voltage: observer, LQR",
            &Config::default(),
            meter,
            site,
        )?;
        if let (Some(mpc), Some(kalman)) = (settings("mpc"), estimators::settings("kalman")) {
            let config = Config {
                estimator: kalman,
                ..Config::with_controller(mpc)
            };
            whole("counts to voltage: Kalman, MPC", &config, meter, site)?;
        }
        Ok(())
    }
}

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use mps2::{measure::Meter, say, semihosting::process};
    let Some(mut meter) = Meter::new() else {
        say!("time does not count instructions here: start QEMU with -icount shift=10");
        process::exit(1)
    };
    match table::print(&mut meter) {
        Ok(()) => process::exit(0),
        Err(error) => {
            say!("{error}");
            process::exit(1)
        }
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this program is for the board: make firmware-cost");
}
