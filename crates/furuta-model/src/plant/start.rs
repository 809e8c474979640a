//! States to start from: after a long rest, or after known commands and angles.

use super::Plant;
use super::state::{Contact, PlantState};
use crate::effects::Acts;
use crate::scalar::Scalar;
use crate::state::State;

impl<S: Scalar> Plant<S> {
    /// The plant's state with the mechanical state `x`, after a long time without command.
    #[must_use]
    pub fn rest(&self, x: State<S>) -> PlantState<S> {
        self.rest_under(x, S::ZERO)
    }

    /// The plant's state with the mechanical state `x`, after a long time under the command `u`.
    ///
    /// A drive with backlash touches on the side on which it then passes torque on (in the middle of its backlash if
    /// none), a flexible one is twisted by that torque; friction that remembers has slid in the direction of the arm's
    /// speed.
    #[must_use]
    pub fn rest_under(&self, x: State<S>, u: S) -> PlantState<S> {
        let mut s = PlantState::blank();
        self.settle(&mut s, x, u);
        s
    }

    /// [`Plant::rest_under`] for a state that is there already.
    fn settle(&self, s: &mut PlantState<S>, x: State<S>, u: S) {
        s.run = 0;
        s.t = S::ZERO;
        s.x = x;
        s.voltage = self.mapped(S::ZERO, u);
        s.ringing = self.settled(s.voltage);
        s.rotor = [x.theta, x.theta_dot];
        s.contact = Contact::Free;
        s.memory = self.slid(x.theta_dot);
        self.relax(s);
        s.commands.fill(u);
        s.readings.fill([S::ZERO; 4]);
        s.period = S::Real::ONE;
        if self.acts.includes(Acts::DRIVE) {
            self.engage(s);
        }
        if self.acts.includes(Acts::SENSOR_DELAY) {
            let [theta, alpha] = self.prompt_reading(s);
            s.readings.fill([theta, alpha, S::ZERO, S::ZERO]);
        }
    }

    /// How far a motor that rings is behind a command that it has followed for long.
    pub(super) fn settled(&self, volts: S) -> [S; 2] {
        if self.acts.includes(Acts::RESONANCE) {
            self.resonance.settled(volts)
        } else {
            [S::ZERO; 2]
        }
    }

    /// The plant's state with the mechanical state `x` at time `t` (s), after the commands `past` (oldest first, each
    /// held for `h` seconds).
    ///
    /// What the effects remember comes from the commands alone, so a recording can be entered at any sample.
    #[must_use]
    pub fn resume(&self, x: State<S>, t: S::Real, past: &[S::Real], h: S::Real) -> PlantState<S> {
        let mut s = PlantState::blank();
        self.enter(&mut s, x, t, past, h);
        s
    }

    /// [`Plant::resume`] for a state that is there already: it is large, and need not be made anew for each of many
    /// short rollouts.
    ///
    /// ```
    /// use furuta_model::{Plant, Rig, State};
    /// let rig = Rig::builtin("qube-servo-2").expect("built in");
    /// let plant: Plant<f64> = Plant::new(&rig.params, &[])?;
    /// let mut s = plant.rest(State::hanging());
    /// plant.step(&mut s, 3.0, 0.002);
    /// plant.enter(&mut s, State::hanging(), 0.0, &[], 0.002);
    /// assert_eq!(s.x, State::hanging());
    /// # Ok::<(), furuta_model::PlantError>(())
    /// ```
    pub fn enter(
        &self,
        s: &mut PlantState<S>,
        x: State<S>,
        t: S::Real,
        past: &[S::Real],
        h: S::Real,
    ) {
        let first = past.first().map_or(S::ZERO, |u| S::from_real(*u));
        self.settle(s, x, first);
        let lagging = self.acts.includes(Acts::LAG);
        let rings = self.acts.includes(Acts::RESONANCE);
        if lagging || rings || self.acts.includes(Acts::DELAY) {
            #[allow(clippy::cast_precision_loss)]
            let mut ago = past.len() as f64;
            let decay = (-(S::from_real(h) / self.lag)).exp();
            for u in past {
                let u = S::from_real(*u);
                s.commands.push(u);
                if lagging || rings {
                    let now = S::from_real(t) - S::from_real(h).scale(S::Real::from_f64(ago));
                    let target = self.mapped(now, self.delayed(s, u, h));
                    let before = s.voltage;
                    s.voltage = if lagging {
                        target + (before - target) * decay
                    } else {
                        target
                    };
                    if rings {
                        let mean = if lagging {
                            (before + s.voltage).scale(S::Real::from_f64(0.5))
                        } else {
                            target
                        };
                        s.ringing = self.resonance.after(s.ringing, mean, S::from_real(h));
                    }
                }
                ago -= 1.0;
            }
        } else if let Some(last) = past.last() {
            s.voltage = self.mapped(S::from_real(t), S::from_real(*last));
        }
        s.t = S::from_real(t);
        self.relax(s);
        if self.acts.includes(Acts::DRIVE) {
            self.engage(s);
        }
    }

    /// Lets the friction that remembers know where the arm has been before: its angles (rad), the last one now. Other
    /// plants do not listen.
    pub fn recall(&self, s: &mut PlantState<S>, angles: impl IntoIterator<Item = S::Real>) {
        if !self.acts.includes(Acts::MEMORY) {
            return;
        }
        let mut angles = angles.into_iter();
        let Some(mut last) = angles.next() else {
            return;
        };
        s.memory = S::ZERO;
        for angle in angles {
            s.memory = self.travelled(s.memory, S::from_real(angle - last));
            last = angle;
        }
    }
}
