//! Angles and speeds from counts: the rig's model, corrected by what is measured.

use furuta_model::{Plant, PlantState, State};

use super::Measurement;

/// Observer with the model as its predictor and fixed gains, such that the correction of each axis, taken alone, has a
/// double pole: angle by `1 - z^2`, speed by `(1 - z)^2 / h`, `z = exp(-bandwidth * h)`.
///
/// A differentiating filter alone would lag behind by the accelerations, which the model knows; and the model bridges
/// lost samples and the period's delay until a command acts.
#[derive(Clone, Debug)]
pub(crate) struct Observer {
    plant: Plant<f64>,
    period: f64,
    angle_gain: f64,
    speed_gain: f64,
}

/// What an [`Observer`] remembers.
#[derive(Clone, Debug)]
pub(crate) struct Belief {
    now: PlantState<f64>,
    held: f64,
    started: bool,
}

/// More lost samples than this are not bridged: the belief starts anew at the angles measured.
const BRIDGED: u32 = 50;

impl Observer {
    pub(crate) fn new(plant: Plant<f64>, period: f64, bandwidth: f64) -> Self {
        let z = (-bandwidth * period).exp();
        Self {
            plant,
            period,
            angle_gain: 1.0 - z * z,
            speed_gain: (1.0 - z) * (1.0 - z) / period,
        }
    }

    pub(crate) fn start(&self) -> Belief {
        Belief {
            now: self.plant.rest(State::default()),
            held: 0.0,
            started: false,
        }
    }

    /// State at this sample.
    pub(crate) fn correct(&self, belief: &mut Belief, m: &Measurement) -> State<f64> {
        if !belief.started || m.periods > BRIDGED {
            belief.started = true;
            let [theta, alpha] = self.unread(m);
            belief.now.x = State::new(theta, alpha, 0.0, 0.0);
        } else {
            for _ in 0..m.periods {
                self.plant.step(&mut belief.now, belief.held, self.period);
            }
            let [theta, alpha] = self.plant.measure(&belief.now);
            let (e, f) = (m.theta - theta, m.alpha - alpha);
            let x = &mut belief.now.x;
            x.theta += self.angle_gain * e;
            x.alpha += self.angle_gain * f;
            x.theta_dot += self.speed_gain * e;
            x.alpha_dot += self.speed_gain * f;
        }
        belief.held = m.held;
        belief.now.x
    }

    /// State at the next sample, when a command given now begins to act.
    pub(crate) fn predict(&self, belief: &Belief) -> PlantState<f64> {
        let mut next = belief.now.clone();
        self.plant.step(&mut next, belief.held, self.period);
        next
    }

    /// True angles behind measured ones, where the model knows of an offset.
    fn unread(&self, m: &Measurement) -> [f64; 2] {
        let [theta, alpha] = self.plant.reading([m.theta, m.alpha]);
        [2.0 * m.theta - theta, 2.0 * m.alpha - alpha]
    }
}
