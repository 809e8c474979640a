//! A course: states at the grid's points, commands held in between, and how long it all takes.

use nalgebra::SVector;

/// States at `N + 1` equidistant times, commands of the `N` intervals.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Course {
    pub(super) x: Vec<SVector<f64, 4>>,
    pub(super) u: Vec<f64>,
    /// Of all intervals together, s.
    pub(super) time: f64,
}

/// What a course may not pass.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Limits {
    /// Of arm, (pendulum: none), arm speed, pendulum speed; rad, rad/s.
    pub(super) state: [f64; 4],
    /// V.
    pub(super) command: f64,
    /// Shortest and longest, s.
    pub(super) time: [f64; 2],
}

impl Course {
    /// Length of an interval, s.
    pub(super) fn interval(&self) -> f64 {
        self.time / self.u.len() as f64
    }

    /// A pendulum that swings up in `swings` half swings of growing height, an arm that stays: no motion that the rig
    /// can make, but one to start from. It ends at 0, or at a whole turn.
    pub(super) fn guess(swings: u32, frequency: f64, intervals: usize, end: f64) -> Self {
        let pi = std::f64::consts::PI;
        let time = 1.15 * pi * f64::from(swings) / frequency;
        let at = |k: usize| {
            let s = k as f64 / intervals as f64;
            let (sin, cos) = (pi * f64::from(swings) * (1.0 - s)).sin_cos();
            let grown = s * s;
            let swing = (end - pi) * grown * cos;
            let speed = (end - pi) * (2.0 * s * cos + grown * pi * f64::from(swings) * sin) / time;
            SVector::from([0.0, pi + swing, 0.0, speed])
        };
        let mut x: Vec<_> = (0..=intervals).map(at).collect();
        x[0] = SVector::from([0.0, pi, 0.0, 0.0]);
        x[intervals] = SVector::from([0.0, end, 0.0, 0.0]);
        Self {
            x,
            u: vec![0.0; intervals],
            time,
        }
    }

    /// The same course on another grid.
    pub(super) fn on(&self, intervals: usize) -> Self {
        let n = self.u.len();
        let place = |k: usize| (k * n) as f64 / intervals as f64;
        let state = |k: usize| {
            let s = place(k);
            let i = (s as usize).min(n - 1);
            let share = s - i as f64;
            self.x[i] * (1.0 - share) + self.x[i + 1] * share
        };
        let command = |k: usize| {
            self.u[(((k as f64 + 0.5) * n as f64 / intervals as f64) as usize).min(n - 1)]
        };
        Self {
            x: (0..=intervals).map(state).collect(),
            u: (0..intervals).map(command).collect(),
            time: self.time,
        }
    }

    /// The same within limits.
    pub(super) fn within(mut self, limits: &Limits) -> Self {
        for x in &mut self.x {
            for i in [0, 2, 3] {
                x[i] = x[i].clamp(-limits.state[i], limits.state[i]);
            }
        }
        for u in &mut self.u {
            *u = u.clamp(-limits.command, limits.command);
        }
        self.time = self.time.clamp(limits.time[0], limits.time[1]);
        self
    }
}
