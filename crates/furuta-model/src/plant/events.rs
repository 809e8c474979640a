//! Steps that end where something happens: an axis stops or is torn loose, a drive's backlash opens or closes.
//!
//! Between two events the equations are smooth and RK4 keeps its order. A trial step shows whether an event lies within
//! it; if so, the event is located by a cubic (or a line, where the equations do not jump), the step is cut there, and
//! what is left goes on after it. The last bit of the way to the event is a Newton step taken in the plant's own
//! scalar, which gives dual numbers the event's exact derivative.

use super::crossing::{Cubic, share};
use super::drive::TwoBody;
use super::friction::Dry;
use super::regime::{How, Regime};
use super::state::Contact;
use super::step::Driven;
use super::trial::Stages;
use super::{Plant, PlantState};
use crate::effects::Acts;
use crate::integrate::{Fixed, Length, Variable};
use crate::scalar::Scalar;
use crate::state::State;

/// After this many events the rest of a step goes on without looking for more.
const MOST_EVENTS: usize = 16;

/// What happens.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Event {
    /// This axis comes to rest (or turns, where friction remembers its way).
    Stop(usize),
    /// This axis is torn loose, to slide like this.
    Loose(usize, Dry),
    /// The rotor leaves the arm.
    Apart,
    /// The rotor meets the arm.
    Touch(Contact),
    /// The arm meets this end stop.
    Press(Contact),
    /// The arm, which had come off this end stop within it, presses again.
    Again(Contact),
    /// The arm leaves its end stop.
    Release,
}

/// What the event before has decided for the stretch after it.
#[derive(Copy, Clone, Debug, Default)]
struct Decided {
    loose: [Option<Dry>; 2],
    apart: bool,
    released: bool,
}

impl<S: Scalar> Plant<S> {
    /// Advances by `h`, from event to event.
    pub(super) fn flow<H: Length<S>>(&self, s: &mut PlantState<S>, u: S, h: H) {
        let mut decided = Decided::default();
        let Some(done) = self.until_event(s, u, h, &mut decided, true) else {
            return;
        };
        let mut left = h.of(S::ONE) - done;
        for n in 2..=MOST_EVENTS {
            if left.real() <= S::Real::ZERO {
                return;
            }
            let look = n < MOST_EVENTS;
            match self.until_event(s, u, Variable(left), &mut decided, look) {
                None => return,
                Some(done) => left -= done,
            }
        }
    }

    /// Advances by `h`, or to the first event if there is one before (and `look` says to look); then returns the time
    /// that took.
    fn until_event<H: Length<S>>(
        &self,
        s: &mut PlantState<S>,
        u: S,
        h: H,
        decided: &mut Decided,
        look: bool,
    ) -> Option<S> {
        let stages = self.stages(s, u, h);
        let regime = self.regime(s, &stages, core::mem::take(decided));
        let end = self.trial(s, &regime, &stages, h);
        let length = h.of(S::ONE);
        let event = if look {
            self.first_event(s, &regime, &stages, &end, length.real())
        } else {
            None
        };
        let Some((event, after)) = event else {
            self.accept(s, &end, &stages.driven, length);
            return None;
        };
        let h = Fixed(after);
        let stages = self.stages(s, u, h);
        let mut end = self.trial(s, &regime, &stages, h);
        let late = self.happen(s, event, &regime, &stages, &mut end, length.real(), decided);
        let done = S::from_real(after) + late;
        self.accept(s, &end, &stages.driven, done);
        match event {
            Event::Touch(side) => s.contact = side,
            Event::Press(side) | Event::Again(side) => s.pressed = side,
            _ => {}
        }
        Some(done)
    }

    fn accept(&self, s: &mut PlantState<S>, end: &TwoBody<S>, driven: &Driven<S>, length: S) {
        s.memory = self.memory_at(s, end);
        s.x = end.x;
        s.rotor = end.rotor;
        s.inner = end.inner;
        (s.voltage, s.ringing) = (driven.voltage, driven.ringing);
        s.t += length;
    }

    /// What holds from here on.
    fn regime(&self, s: &mut PlantState<S>, stages: &Stages<S>, decided: Decided) -> Regime<S> {
        if decided.released {
            s.pressed = Contact::Free;
        } else {
            self.press(s);
        }
        let here = self.body(s);
        let at = stages.moment(0, s.memory, s.pressed);
        if decided.apart {
            s.contact = Contact::Free;
        }
        let regime = self.forces(&here, s.contact, at, How::Decided(decided.loose));
        let side = s.contact.side::<S>();
        // A spring that has just met the flank is not yet bent, but for rounding of either sign: what still closes in
        // has not parted.
        let closing = self.drive.elastic() && self.depth(&here, side).1.real() > S::Real::ZERO;
        let parted =
            self.drive.loose() && !closing && (side * regime.passed).real() < S::Real::ZERO;
        if !parted {
            return regime;
        }
        s.contact = Contact::Free;
        self.forces(&here, s.contact, at, How::Decided(decided.loose))
    }

    /// The first event of a trial step of `length` seconds, and after how many seconds it comes.
    fn first_event(
        &self,
        s: &PlantState<S>,
        regime: &Regime<S>,
        stages: &Stages<S>,
        end: &TwoBody<S>,
        length: S::Real,
    ) -> Option<(Event, S::Real)> {
        let zero = S::Real::ZERO;
        let mut first: Option<(Event, S::Real)> = None;
        let mut found = |event: Event, after: S::Real| {
            let after = after.clamp(zero, length);
            if first.as_ref().is_none_or(|(_, t)| after < *t) {
                first = Some((event, after));
            }
        };
        // How things stand at the trial's end is worth computing only for some.
        let held = regime.dry.contains(&Dry::Held);
        let touching = self.drive.loose() && s.contact != Contact::Free;
        let start = self.body(s);
        let (before, after) = (
            self.rubbing(&start, s.contact),
            self.rubbing(end, s.contact),
        );
        let stops = [0, 1].map(|i| {
            let direction = match regime.dry[i] {
                Dry::Forward | Dry::Backward => regime.dry[i].direction(),
                // An arm whose friction remembers its way is followed from turn to turn.
                Dry::Absent if i == 0 && self.acts.includes(Acts::MEMORY) => before[0],
                Dry::Absent | Dry::Held => S::ZERO,
            };
            (direction.real() * after[i].real() < zero).then_some(direction.real())
        });
        if held || touching || stops.iter().any(Option::is_some) {
            let at = stages.moment(2, self.memory_at(s, end), s.pressed);
            let last = self.forces(end, s.contact, at, How::Kept(regime.dry));
            let rates = [regime, &last].map(|m| [m.rotor, m.acceleration[1]]);
            for i in 0..2 {
                if let Some(direction) = stops[i] {
                    let cubic = Cubic {
                        from: before[i].real() * direction,
                        to: after[i].real() * direction,
                        slope_from: rates[0][i].real() * direction * length,
                        slope_to: rates[1][i].real() * direction * length,
                    };
                    found(Event::Stop(i), cubic.falls_to_zero() * length);
                }
                if regime.dry[i] == Dry::Held {
                    let load = |m: &Regime<S>| (m.friction[i].abs() - m.limit[i]).real();
                    let (now, then) = (load(regime), load(&last));
                    if then > zero {
                        let way = if last.friction[i].real() > zero {
                            Dry::Backward
                        } else {
                            Dry::Forward
                        };
                        found(Event::Loose(i, way), share(-now, then) * length);
                    }
                }
            }
            if touching {
                let side = s.contact.side::<S>();
                let (now, then) = ((side * regime.passed).real(), (side * last.passed).real());
                if then < zero {
                    found(Event::Apart, share(now, -then) * length);
                }
            }
        }
        if self.drive.loose() && s.contact == Contact::Free {
            for side in [Contact::Negative, Contact::Positive] {
                let sign = side.side::<S>();
                let (depth, speed) = self.depth(end, sign);
                let (depth_before, speed_before) = self.depth(&start, sign);
                if depth.real() > zero && speed.real() > zero {
                    let cubic = Cubic {
                        from: -depth_before.real(),
                        to: -depth.real(),
                        slope_from: -(speed_before.real() * length),
                        slope_to: -(speed.real() * length),
                    };
                    found(Event::Touch(side), cubic.falls_to_zero() * length);
                }
            }
        }
        if let Some((event, after)) = self.at_the_stops(s, regime, stages, end, length) {
            found(event, after);
        }
        first
    }

    /// How far (rad) and how fast (rad/s) the rotor has gone beyond the backlash's end on the side `sign`.
    #[inline(always)]
    fn depth(&self, m: &TwoBody<S>, sign: S) -> (S, S) {
        (
            sign * (m.rotor[0] - m.x.theta) - self.drive.half_gap(),
            sign * (m.rotor[1] - m.x.theta_dot),
        )
    }

    /// Lets the event happen at `end`, which lies within rounding of it; returns by how much later (s) it is.
    #[allow(clippy::too_many_arguments)]
    fn happen(
        &self,
        s: &PlantState<S>,
        event: Event,
        regime: &Regime<S>,
        stages: &Stages<S>,
        end: &mut TwoBody<S>,
        length: S::Real,
        decided: &mut Decided,
    ) -> S {
        let distance_and_speed = |end: &TwoBody<S>, now: &Regime<S>| match event {
            Event::Stop(0) => (self.rubbing(end, s.contact)[0], now.rotor),
            Event::Stop(_) => (end.x.alpha_dot, now.acceleration[1]),
            Event::Touch(side) => self.depth(end, side.side()),
            Event::Press(side) => {
                let side = side.side::<S>();
                let depth = self.end_stop.depth(side, end.x.theta);
                (depth, side * end.x.theta_dot)
            }
            Event::Release => self.pressing(s.pressed, end, now.acceleration[0]),
            Event::Again(side) => self.pressing(side, end, now.acceleration[0]),
            Event::Loose(..) | Event::Apart => (S::ZERO, S::ONE),
        };
        let mut late = S::ZERO;
        match event {
            // The equations do not jump there: when exactly does not matter in first order.
            Event::Loose(i, way) => {
                if let Some(loose) = decided.loose.get_mut(i) {
                    *loose = Some(way);
                }
            }
            Event::Apart => decided.apart = true,
            Event::Stop(_)
            | Event::Touch(_)
            | Event::Press(_)
            | Event::Again(_)
            | Event::Release => {
                decided.released = event == Event::Release;
                let at = stages.moment(2, self.memory_at(s, end), s.pressed);
                let now = self.forces(end, s.contact, at, How::Kept(regime.dry));
                let (distance, speed) = distance_and_speed(end, &now);
                // Newton's last step, unless it would leave the stretch.
                if distance.abs().real() < speed.abs().real() * length {
                    late = -(distance / speed);
                }
                let a = now.acceleration;
                let rate = TwoBody {
                    x: State::new(end.x.theta_dot, end.x.alpha_dot, a[0], a[1]),
                    rotor: [end.rotor[1], now.rotor],
                    inner: self.inner_rates(end, &at),
                    own: end.own,
                };
                *end = TwoBody {
                    x: end.x + rate.x * late,
                    rotor: [
                        end.rotor[0] + rate.rotor[0] * late,
                        end.rotor[1] + rate.rotor[1] * late,
                    ],
                    inner: core::array::from_fn(|i| end.inner[i] + rate.inner[i] * late),
                    own: end.own,
                };
            }
        }
        match event {
            Event::Stop(0) => {
                end.rotor[1] = S::ZERO;
                if self.one_body(s.contact) {
                    end.x.theta_dot = S::ZERO;
                }
            }
            Event::Stop(_) => end.x.alpha_dot = S::ZERO,
            Event::Touch(side) => self.touch(end, side),
            Event::Loose(..)
            | Event::Apart
            | Event::Press(_)
            | Event::Again(_)
            | Event::Release => {}
        }
        late
    }

    /// Rotor and arm meet: rigid flanks do not bounce, rotor and arm go on at the speed that keeps their angular
    /// momentum.
    fn touch(&self, end: &mut TwoBody<S>, side: Contact) {
        end.rotor[0] = end.x.theta + side.side::<S>() * self.drive.half_gap();
        if self.drive.elastic() {
            return;
        }
        let angle = crate::dynamics::Angle::of(end.x.alpha);
        let inverse = crate::dynamics::mass_matrix(&self.load(), angle).inverse();
        let apart = end.rotor[1] - end.x.theta_dot;
        let impulse = apart / (S::ONE / self.rotor_inertia() + inverse.arm);
        end.x.theta_dot += inverse.arm * impulse;
        end.x.alpha_dot += inverse.coupling * impulse;
        end.rotor[1] = end.x.theta_dot;
    }
}
