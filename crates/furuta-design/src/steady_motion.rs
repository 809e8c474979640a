//! The regulator equation's solution to an order that is chosen when the program runs.
//!
//! A controller's series has a capacity that is fixed when it is compiled ([`SteadyMotion`], order 7). On a host the
//! capacity follows from the order.

use furuta_ctrl::design::{RegulatorError, SteadyMotion};
use furuta_model::State;
use furuta_model::linear_plant::Load;
use furuta_model::params::Coefficients;
use furuta_model::series::{Series, terms};

/// The highest order there is: beyond some 17, rounding in double precision spoils the terms of the highest degree.
pub const HIGHEST: usize = 15;

/// The steady motion on which a pendulum follows a sine, to any order up to [`HIGHEST`].
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Frequency of the sine, rad/s.
    pub lambda: f64,
    order: usize,
    solved: Solved,
}

/// By capacity.
#[derive(Clone, Debug, PartialEq)]
enum Solved {
    Low(Box<SteadyMotion<f64>>),
    High(Box<SteadyMotion<f64, { terms(HIGHEST) }>>),
}

/// The same for each capacity.
macro_rules! each {
    ($solved:expr, $steady:ident => $value:expr) => {
        match $solved {
            Solved::Low($steady) => $value,
            Solved::High($steady) => $value,
        }
    };
}

impl Motion {
    /// For a model with these coefficients, to `order` at the frequency `lambda` (rad/s).
    ///
    /// # Errors
    /// Those of [`SteadyMotion::solve`]; the highest order is [`HIGHEST`].
    ///
    /// ```
    /// use furuta_design::steady_motion::Motion;
    /// use furuta_model::Rig;
    /// let c = Rig::builtin("qube-servo-2").ok_or("no such rig")?.params.coefficients();
    /// let missed = |order| Motion::solve(&c, 4.0, order).map(|m| m.residual(&c, 0.03));
    /// assert!(missed(7)? < 0.5 * missed(5)? && missed(11)? < 0.5 * missed(9)?);
    /// let error = Motion::solve(&c, 4.0, 16).unwrap_err();
    /// assert!(error.to_string().contains("1 to 15 are"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn solve(
        coefficients: &Coefficients<f64>,
        lambda: f64,
        order: usize,
    ) -> Result<Self, RegulatorError> {
        Self::solve_under(coefficients, &Load::NONE, lambda, order)
    }

    /// The same on a rig whose effects pull with this `load`.
    ///
    /// # Errors
    /// Those of [`SteadyMotion::solve_under`]; the highest order is [`HIGHEST`].
    ///
    /// ```
    /// use furuta_design::steady_motion::Motion;
    /// use furuta_model::linear_plant::{Hold, Load};
    /// use furuta_model::{Effect, Plant, Rig};
    /// let rig = Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let plant = Plant::new(&rig.params, &[Effect::new("arm.spring", &[0.02, 0.0])?])?;
    /// let load = Load::of(&plant, Hold::Arm(0.0))?;
    /// let [free, held] = [Load::NONE, load].map(|l| Motion::solve_under(&plant.coefficients, &l, 4.0, 5));
    /// let (free, held) = (free?.coefficients(0, 1), held?.coefficients(0, 1));
    /// assert!(held[0] == free[0] && held[2] != free[2]); // the same motion by another command
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn solve_under(
        coefficients: &Coefficients<f64>,
        load: &Load<f64>,
        lambda: f64,
        order: usize,
    ) -> Result<Self, RegulatorError> {
        let solved = match order {
            // An order that is not possible is refused by the larger one, which knows the highest.
            1..=7 => Solved::Low(Box::new(SteadyMotion::to_order_under(
                coefficients,
                load,
                lambda,
                order,
            )?)),
            _ => Solved::High(Box::new(SteadyMotion::to_order_under(
                coefficients,
                load,
                lambda,
                order,
            )?)),
        };
        Ok(Self {
            lambda,
            order,
            solved,
        })
    }

    /// The order that was asked for.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// The coefficients of `w1^i w2^j` in the arm's angle (rad), its speed (rad/s) and the command (V).
    #[must_use]
    pub fn coefficients(&self, i: usize, j: usize) -> [f64; 3] {
        fn of<const N: usize>(s: &SteadyMotion<f64, N>, i: usize, j: usize) -> [f64; 3] {
            let each: [&Series<f64, N>; 3] = [&s.angle, &s.speed, &s.command];
            each.map(|series| series.coefficient(i, j))
        }
        each!(&self.solved, s => of(s, i, j))
    }

    /// The steady state `pi(w)`.
    #[must_use]
    pub fn state(&self, w: [f64; 2]) -> State<f64> {
        each!(&self.solved, s => s.state(w))
    }

    /// See [`SteadyMotion::residual`].
    #[must_use]
    pub fn residual(&self, coefficients: &Coefficients<f64>, amplitude: f64) -> f64 {
        each!(&self.solved, s => s.residual(coefficients, amplitude))
    }
}
