//! The rig as the optimisation sees it: its equations of motion with exact derivatives.

use furuta_ctrl::Site;
use furuta_model::dynamics::{Angle, mass_matrix};
use furuta_model::effects::{Acts, Clock, Instant, Law};
use furuta_model::{Effect, Jet, Plant, PlantError, Rig, Scalar, State};
use nalgebra::{SMatrix, SVector};

/// Dry friction turns round within this speed, of the pendulum's small-angle frequency: `F v / sqrt(v^2 + e^2)`.
const SOFT: f64 = 0.1;
/// Steps of RK4 in an interval of the grid.
const SUBSTEPS: u32 = 2;

/// State, command and length of an interval: what a step is differentiated by.
type Number = Jet<f64, 6>;

/// What [`Model`] takes over: torques of state and command without memory, dry friction in a smooth approximation.
const TAKEN_OVER: Acts = Acts::TORQUE
    .and(Acts::DRY_FRICTION)
    .and(Acts::SHAPE)
    .and(Acts::ANGLE)
    .and(Acts::SHAFT)
    .and(Acts::ARM)
    .and(Acts::CURRENT);

/// A rig with its smooth effects, dry friction softened.
#[derive(Clone, Debug)]
pub(super) struct Model {
    plant: Plant<f64>,
    dual: Plant<Number>,
    dry: Vec<Effect<f64>>,
    /// Speed within which dry friction turns round, rad/s.
    soft: f64,
    /// Small-angle frequency of the hanging pendulum, rad/s.
    pub(super) frequency: f64,
    /// Effects of the rig file that are not in it.
    pub(super) left_out: Vec<&'static str>,
}

/// A step of the model and its derivatives.
#[derive(Copy, Clone, Debug)]
pub(super) struct Step {
    pub(super) x: SVector<f64, 4>,
    pub(super) a: SMatrix<f64, 4, 4>,
    pub(super) b: SVector<f64, 4>,
    /// By the interval's length, 1/s.
    pub(super) c: SVector<f64, 4>,
}

impl Model {
    pub(super) fn of(rig: &Rig) -> Result<Self, PlantError> {
        rig.try_plant::<f64>()?;
        let (mut smooth, mut dry, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        for effect in rig.effects.iter().filter(|e| !e.is_off()) {
            let acts = effect.spec().acts;
            if !TAKEN_OVER.includes(acts) {
                left_out.push(effect.spec().id);
            } else if acts.includes(Acts::DRY_FRICTION) {
                dry.push(*effect);
            } else {
                smooth.push(*effect);
            }
        }
        let plant = Plant::new(&rig.params, &smooth)?;
        let frequency = Site::of(rig, 0.002).frequency();
        Ok(Self {
            dual: plant.cast(),
            plant,
            dry,
            soft: SOFT * frequency,
            frequency,
            left_out,
        })
    }

    /// `dx/dt` under the voltage `u` (V).
    fn rate<S: Scalar>(&self, plant: &Plant<S>, x: &State<S>, u: S) -> State<S> {
        let rate = plant.rate(S::ZERO, x, u, S::Real::ONE);
        if self.dry.is_empty() {
            return rate;
        }
        let at = Instant {
            clock: Clock::at(S::ZERO),
            x,
            angle: Angle::of(x.alpha),
            coefficients: &plant.coefficients,
            memory: S::ZERO,
            volts: u,
        };
        let soft = S::from_f64(self.soft * self.soft);
        let mut torque = [S::ZERO; 2];
        for effect in &self.dry {
            let effect = effect.cast::<S>();
            let (limit, smooth) = (effect.dry_friction(&at), effect.torque(&at));
            for (axis, v) in [x.theta_dot, x.alpha_dot].into_iter().enumerate() {
                torque[axis] += smooth[axis] - limit[axis] * v / (v * v + soft).sqrt();
            }
        }
        let more = mass_matrix(&plant.coefficients, at.angle)
            .inverse()
            .times(torque);
        rate + State::new(S::ZERO, S::ZERO, more[0], more[1])
    }

    /// RK4 over `h` seconds.
    fn flow<S: Scalar>(
        &self,
        plant: &Plant<S>,
        mut x: State<S>,
        u: S,
        h: S,
        steps: u32,
    ) -> State<S> {
        let h = h * S::from_f64(1.0 / f64::from(steps));
        let half = h * S::from_f64(0.5);
        let two = S::from_f64(2.0);
        for _ in 0..steps {
            let k1 = self.rate(plant, &x, u);
            let k2 = self.rate(plant, &(x + k1 * half), u);
            let k3 = self.rate(plant, &(x + k2 * half), u);
            let k4 = self.rate(plant, &(x + k3 * h), u);
            x = x + (k1 + k2 * two + k3 * two + k4) * (h * S::from_f64(1.0 / 6.0));
        }
        x
    }

    /// The state after an interval of `h` seconds.
    pub(super) fn advance(&self, x: &SVector<f64, 4>, u: f64, h: f64) -> SVector<f64, 4> {
        self.flow(&self.plant, State::from(*x), u, h, SUBSTEPS)
            .into()
    }

    /// The same with a step of the integrator every `finest` seconds at least.
    pub(super) fn advance_finely(
        &self,
        x: &SVector<f64, 4>,
        u: f64,
        h: f64,
        finest: f64,
    ) -> SVector<f64, 4> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let steps = (h / finest).ceil().clamp(1.0, 1e6) as u32;
        self.flow(&self.plant, State::from(*x), u, h, steps).into()
    }

    /// The state after an interval, and its derivatives.
    pub(super) fn step(&self, x: &SVector<f64, 4>, u: f64, h: f64) -> Step {
        let at = State::new(
            Number::variable(x[0], 0),
            Number::variable(x[1], 1),
            Number::variable(x[2], 2),
            Number::variable(x[3], 3),
        );
        let next = self
            .flow(
                &self.dual,
                at,
                Number::variable(u, 4),
                Number::variable(h, 5),
                SUBSTEPS,
            )
            .to_array();
        Step {
            x: SVector::from_fn(|i, _| next[i].v),
            a: SMatrix::from_fn(|i, j| next[i].d[j]),
            b: SVector::from_fn(|i, _| next[i].d[4]),
            c: SVector::from_fn(|i, _| next[i].d[5]),
        }
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::{Spec, effects};

    use super::*;

    /// Every effect of the catalogue changes the model's motion, or is said to be left out.
    #[test]
    fn no_effect_is_left_out_silently() {
        let rig = Rig::builtin("qube-servo-2").expect("built in");
        let bare = Model::of(&rig).expect("no effect");
        let rest = SVector::from([0.4, 2.5, 9.0, -8.0]);
        let acts = |spec: &&Spec| spec.acts.not_on(rig.params.motor.actuation).is_none();
        for spec in effects::all().filter(acts) {
            let typical: Vec<f64> = (spec.parameters.iter())
                .map(|p| p.off + p.typical(&rig.params))
                .collect();
            let Ok(effect) = Effect::checked(spec, &typical) else {
                panic!("{}: {typical:?}", spec.id);
            };
            let mut with = rig.clone();
            with.effects = vec![effect];
            let model = Model::of(&with).expect("one effect");
            let moves = (model.step(&rest, 10.0, 0.02).x - bare.step(&rest, 10.0, 0.02).x).amax();
            let is_named = model.left_out.contains(&spec.id);
            assert_eq!(is_named, moves == 0.0, "{}: {moves}", spec.id);
            // The optimisation does not know when a run begins.
            assert!(is_named || !spec.acts.includes(Acts::CLOCK), "{}", spec.id);
        }
    }
}
