//! What leads from one mode to another: the table of [the module above](super).

use super::fault::Fault;
use super::mode::{Mode, Request};
use super::system::{CATCH_BRAKE, LAST_BRAKE, SMALL_JUMP, Supervisor, SupervisorState};
use crate::controllers::Controller;
use crate::real::{Real, c, wrap};
use crate::reference::arm_at;
use crate::trajectory::FollowerState;
use furuta_model::State;

impl<T: Real> Supervisor<T> {
    /// The mode from this sample on.
    pub(super) fn next_mode(
        &self,
        state: &mut SupervisorState<T>,
        now: &State<T>,
        ahead: &State<T>,
        periods: T,
    ) -> Mode {
        match state.mode {
            Mode::SwingUp if self.gives_up(state) => Mode::Stopping,
            Mode::SwingUp => {
                state.since_test = state.since_test.saturating_add(1);
                if state.since_test < self.thresholds.catch_every {
                    return Mode::SwingUp;
                }
                state.since_test = 0;
                if self.runs_away(ahead, CATCH_BRAKE) {
                    state.catch_jump = None;
                    return Mode::SwingUp;
                }
                let ratio = self.swing_up.weight_ratio(&state.swing_up);
                let jump = self
                    .catch
                    .travel_weighing(ahead, ratio)
                    .map(|_| self.jump(state, ahead));
                let before = core::mem::replace(&mut state.catch_jump, jump);
                let small = c::<T>(SMALL_JUMP) * self.thresholds.command_limit;
                match (before, jump) {
                    (None, None) => Mode::SwingUp,
                    // It will be smoother yet.
                    (None, Some(now)) if now > small => Mode::SwingUp,
                    (Some(before), Some(now)) if now > small && now < before => Mode::SwingUp,
                    // The smoothest moment, or just after it.
                    _ => Mode::Balance,
                }
            }
            Mode::Balance if self.is_lost(state, ahead) => Mode::SwingUp,
            Mode::Stopping => {
                let rest = self.thresholds.rest_speed;
                let moving = now.theta_dot.abs() > rest || now.alpha_dot.abs() > rest;
                state.resting = if moving {
                    T::ZERO
                } else {
                    state.resting + self.h * periods
                };
                if state.resting > c(0.5) {
                    Mode::Idle
                } else {
                    Mode::Stopping
                }
            }
            mode => mode,
        }
    }

    /// Whether the trajectory is not followed any more, and nothing else shall be done.
    pub(super) fn gives_up(&self, state: &SupervisorState<T>) -> bool {
        let follower = self.follower.as_ref();
        follower.is_some_and(|follower| follower.gives_up(&state.following))
    }

    /// Whether the arm, going outwards, would stop beyond this share of its limit under full braking.
    fn runs_away(&self, x: &State<T>, share: f64) -> bool {
        let stop = self.swing_up.stops_at(x).abs();
        x.theta * x.theta_dot > T::ZERO && stop > c::<T>(share) * self.thresholds.arm_angle_limit
    }

    /// By how much the command would jump if the balance controller took over now, V.
    fn jump(&self, state: &SupervisorState<T>, x: &State<T>) -> T {
        // Before the limit, or all that saturate would be alike.
        let u = self.catch.feedback.unlimited(x, &arm_at(x.theta));
        (u - state.u).abs()
    }

    /// Whether the pendulum falls whatever the balance controller does: better swing it up again than let the arm run
    /// after it. While it still rises, nothing is lost: a catch at the edge of what the model promises would be given
    /// up and tried again at every other sample.
    fn is_lost(&self, state: &SupervisorState<T>, x: &State<T>) -> bool {
        let alpha = wrap(x.alpha);
        let falling = alpha * x.alpha_dot > T::ZERO;
        let doubtful = falling && alpha.abs() > self.thresholds.doubt_angle;
        // The arm is on its way into its limit: the swing-up brakes.
        self.runs_away(x, LAST_BRAKE)
            || alpha.abs() > self.thresholds.release_angle
            || doubtful
                && !self.catch.holds_weighing(
                    x,
                    state.arm_reference,
                    self.swing_up.weight_ratio(&state.swing_up),
                )
    }

    /// A limit passed while the motor drives: it brakes first. Where the motor is off already, or nothing is known, it
    /// is off.
    pub(super) fn find(&self, state: &mut SupervisorState<T>, fault: Fault, now: &State<T>) {
        let known = fault != Fault::NotANumber;
        match state.mode {
            Mode::Fault => return,
            Mode::Braking if known => return,
            Mode::SwingUp | Mode::Balance if known => {
                state.mode = Mode::Braking;
                state.braking = self.brake.begin(now.theta_dot);
            }
            _ => state.mode = Mode::Fault,
        }
        state.fault = Some(fault);
    }

    /// What a mode begins with.
    pub(super) fn enter(&self, state: &mut SupervisorState<T>, mode: Mode, x: &State<T>) {
        state.mode = mode;
        match mode {
            // From where the arm is, and from the command so far: no jump in either.
            Mode::Balance => {
                state.arm_reference = x.theta;
                state.bump = None;
                state.balance = self.balance.take_over(x, &arm_at(x.theta), state.u);
            }
            Mode::SwingUp => {
                state.catch_jump = None;
                state.swing_up = self.swing_up.again(&state.swing_up);
                state.following = FollowerState::new();
            }
            Mode::Idle | Mode::Stopping | Mode::Braking | Mode::Fault => {}
        }
    }
}

impl<T: Real> SupervisorState<T> {
    /// Asks for a change of mode; false where it makes no sense in the present one.
    pub fn request(&mut self, request: Request) -> bool {
        let next = match (self.mode, request) {
            (Mode::Idle | Mode::Stopping, Request::Start) => Mode::SwingUp,
            (Mode::SwingUp | Mode::Balance, Request::Stop) => Mode::Stopping,
            (Mode::Fault, Request::Reset) => Mode::Idle,
            _ => return false,
        };
        self.mode = next;
        self.following = FollowerState::new();
        self.fault = None;
        self.since_test = u32::MAX;
        self.resting = T::ZERO;
        true
    }
}
