//! The regulator equation of Francis, Byrnes and Isidori for a pendulum that is to follow a sine, solved as a power
//! series.
//!
//! An oscillator `w1' = lambda w2`, `w2' = -lambda w1` generates the reference `alpha = w2`. Output regulation asks for
//! a state `pi(w)` and a command `c(w)` on which the pendulum follows exactly:
//!
//! ```text
//! d(pi)/dw s(w) = f(pi(w)) + g(pi(w)) c(w)        pi_alpha(w) = w2
//! ```
//!
//! `pi_alpha = w2` and its rate `-lambda w1` are given; left is the arm's angle, whose second rate along the oscillator
//! must be what the [zero dynamics](furuta_model::zero_dynamics) demand. A rate along the oscillator maps homogeneous
//! polynomials of degree `d` into themselves, with the eigenvalues `i lambda (d - 2k)`: for odd `d` none is zero, and
//! the model, which a turn by `w -> -w` carries into itself, has no terms of even degree. So one degree follows from
//! those below it, by substitution. No series of the right-hand side is needed: the model's own functions run on
//! [`Series`].
//!
//! A. Isidori, C. I. Byrnes, *Output regulation of nonlinear systems*, IEEE Trans. Automatic Control 35 (1990) 131-140;
//! J. Huang, W. J. Rugh, *On a nonlinear multivariable servomechanism problem*, Automatica 26 (1990) 963-972.

use crate::real::{Real, c, wrap};
use furuta_model::State;
use furuta_model::linear_plant::Load;
use furuta_model::params::Coefficients;
use furuta_model::series::{Series, TERMS};
use furuta_model::zero_dynamics;

/// Why the regulator equation has no series to give.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RegulatorError {
    /// An order beyond what the series has terms for.
    #[error(
        "order = {order} is not possible; 1 to {capacity} are, the capacity of the series in use (even terms are zero)"
    )]
    Order {
        /// What was asked for.
        order: usize,
        /// The highest degree that the series has terms for.
        capacity: usize,
    },
    /// The oscillator's frequency is not a positive number.
    #[error("lambda = {value} rad/s is not possible; a finite frequency above 0 is needed")]
    Frequency {
        /// What was given.
        value: f64,
    },
    /// The right-hand side is not a series in `w`: a parameter is not finite, or the arm has no hold on the pendulum.
    #[error(
        "the zero dynamics are not finite at w1^{i} w2^{j}: check that arm length, pendulum mass and com are above 0"
    )]
    NotFinite {
        /// Power of `w1`.
        i: usize,
        /// Power of `w2`.
        j: usize,
    },
    /// What effects pull the pendulum with depends on the arm's angle or speed, as under a tilted base: then one degree
    /// does not follow from those below it.
    #[error(
        "the effects' torque on the pendulum changes by {value} N m per {unit} of the arm's {what}; a steady motion is \
         only found where that is 0: leave out arm.tilt, or the law of one's own that does it"
    )]
    Load {
        /// N m per rad, or N m per rad/s.
        value: f64,
        /// "rad" or "rad/s".
        unit: &'static str,
        /// "angle" or "speed".
        what: &'static str,
    },
    /// The right-hand side has a term of even degree, to which the oscillator may resonate.
    #[error(
        "the zero dynamics have an even term, {value} w1^{i} w2^{j}; only odd ones can be solved for"
    )]
    Even {
        /// Power of `w1`.
        i: usize,
        /// Power of `w2`.
        j: usize,
        /// Its coefficient.
        value: f64,
    },
    /// Substituted into the equation, the series does not satisfy it: the right-hand side depends linearly on the arm's
    /// motion.
    #[error(
        "the series misses the zero dynamics by {residual} at degree {degree} (1e-14 is possible): the model's torque \
         on the pendulum depends on the arm's angle or speed to first order; leave that effect out"
    )]
    Residual {
        /// The degree that does not fit.
        degree: usize,
        /// Largest difference of a coefficient, relative to the largest of that degree.
        residual: f64,
    },
}

/// The steady motion on which a pendulum follows `alpha = w2`: the solution `pi(w)`, `c(w)` of the regulator equation
/// as polynomials.
///
/// The amplitude of the reference is the length of `w`; one solution serves all amplitudes for which the series is good
/// enough ([`SteadyMotion::residual`]).
///
/// `N` is the capacity of its series: [`furuta_model::series::terms`] of the highest order. That of a controller is
/// order 7; a host may take more (`furuta_design::steady_motion` chooses it by the order that is asked for).
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SteadyMotion<T, const N: usize = TERMS> {
    /// Frequency of the oscillator, rad/s.
    pub lambda: T,
    /// The arm's angle `pi_theta(w)`, rad.
    pub angle: Series<T, N>,
    /// The arm's speed, the rate of `angle` along the oscillator, rad/s.
    pub speed: Series<T, N>,
    /// The command `c(w)`, V.
    pub command: Series<T, N>,
    /// What effects pull with beside the model's own torques.
    pub load: Load<T>,
}

impl<T: Real> SteadyMotion<T> {
    /// For a model with these coefficients, to `order` (1 to 7) at the frequency `lambda` (rad/s).
    ///
    /// # Errors
    /// An order or a frequency that is not possible; a model in which the arm does not act on the pendulum.
    ///
    /// ```
    /// use furuta_ctrl::design::SteadyMotion;
    /// use furuta_model::{Rig, params::Coefficients};
    /// let rig = Rig::builtin("ramos-velasco").ok_or("no such rig")?;
    /// let planar = Coefficients { swing: 0.0, ..rig.params.coefficients() };
    /// let steady = SteadyMotion::solve(&planar, 1.0, 5)?;
    /// // The paper's beta is -alpha, so its -81.23 w2 is ours with the other sign.
    /// assert!((steady.angle.coefficient(0, 1) - 81.230_77).abs() < 1e-5);
    /// assert!((steady.angle.coefficient(2, 1) - 18.692_31).abs() < 1e-5);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn solve(
        coefficients: &Coefficients<T>,
        lambda: T,
        order: usize,
    ) -> Result<Self, RegulatorError> {
        Self::to_order(coefficients, lambda, order)
    }

    /// The same on a rig whose effects pull with this `load`: the arm's motion allows for what pulls the pendulum, the
    /// command for what pulls the arm.
    ///
    /// # Errors
    /// As [`SteadyMotion::solve`]; [`RegulatorError::Load`].
    ///
    /// ```
    /// use furuta_ctrl::design::SteadyMotion;
    /// use furuta_model::Rig;
    /// use furuta_model::linear_plant::Load;
    /// let c = Rig::builtin("qube-servo-2").ok_or("no such rig")?.params.coefficients();
    /// let spring = Load { slope: [[-0.02, 0.0, 0.0, 0.0], [0.0; 4]] };
    /// let [free, held] = [Load::NONE, spring].map(|load| SteadyMotion::solve_under(&c, &load, 4.0, 5));
    /// let (free, held) = (free?, held?);
    /// assert_eq!(held.angle, free.angle);
    /// let more = held.command.at(0.0, 0.03) - free.command.at(0.0, 0.03);
    /// assert!((more - 0.02 * free.angle.at(0.0, 0.03) / c.drive).abs() < 1e-12);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn solve_under(
        coefficients: &Coefficients<T>,
        load: &Load<T>,
        lambda: T,
        order: usize,
    ) -> Result<Self, RegulatorError> {
        Self::to_order_under(coefficients, load, lambda, order)
    }
}

impl<T: Real, const N: usize> SteadyMotion<T, N> {
    /// The same with series of another capacity: `N` is [`furuta_model::series::terms`] of the highest order.
    ///
    /// # Errors
    /// As [`SteadyMotion::solve`]; an order beyond the capacity says it.
    ///
    /// ```
    /// use furuta_ctrl::design::{RegulatorError, SteadyMotion};
    /// use furuta_model::Rig;
    /// use furuta_model::series::terms;
    /// let c = Rig::builtin("qube-servo-2").ok_or("no such rig")?.params.coefficients();
    /// let seventh = SteadyMotion::solve(&c, 4.0, 7)?;
    /// let eleventh = SteadyMotion::<f64, { terms(11) }>::to_order(&c, 4.0, 11)?;
    /// assert!(eleventh.residual(&c, 0.03) < 0.2 * seventh.residual(&c, 0.03));
    /// let beyond = SteadyMotion::solve(&c, 4.0, 9);
    /// assert_eq!(beyond, Err(RegulatorError::Order { order: 9, capacity: 7 }));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn to_order(
        coefficients: &Coefficients<T>,
        lambda: T,
        order: usize,
    ) -> Result<Self, RegulatorError> {
        Self::to_order_under(coefficients, &Load::NONE, lambda, order)
    }

    /// [`SteadyMotion::solve_under`] with series of another capacity.
    ///
    /// # Errors
    /// Those of [`SteadyMotion::solve_under`]; an order beyond the capacity says it.
    pub fn to_order_under(
        coefficients: &Coefficients<T>,
        load: &Load<T>,
        lambda: T,
        order: usize,
    ) -> Result<Self, RegulatorError> {
        for (i, what, unit) in [(0, "angle", "rad"), (2, "speed", "rad/s")] {
            let value = load.slope[1][i].value();
            if value != 0.0 {
                return Err(RegulatorError::Load { value, unit, what });
            }
        }
        let model = coefficients.cast::<Series<T, N>>();
        let pull = load.cast::<Series<T, N>>();
        let angle = arm_angle(lambda, order, |x, alpha_ddot| {
            zero_dynamics::arm_acceleration_under(&model, pull.torque(x), x, alpha_ddot)
        })?;
        let steady = Self {
            lambda,
            angle,
            speed: angle.rate(lambda),
            command: Series::constant(T::ZERO),
            load: *load,
        };
        let (x, alpha_ddot) = steady.series();
        Ok(Self {
            command: zero_dynamics::command_under(&model, pull.torque(&x), &x, alpha_ddot)
                .truncated(order),
            ..steady
        })
    }

    /// The state as a series, and the pendulum's acceleration.
    fn series(&self) -> (State<Series<T, N>>, Series<T, N>) {
        along(self.lambda, &self.angle)
    }

    /// The steady state `pi(w)`.
    pub fn state(&self, [w1, w2]: [T; 2]) -> State<T> {
        State::new(
            self.angle.at(w1, w2),
            w2,
            self.speed.at(w1, w2),
            -(self.lambda * w1),
        )
    }

    /// The oscillator's state under which pendulum and reference agree, from the reference's `alpha` and `alpha_dot`.
    ///
    /// ```
    /// # use furuta_ctrl::design::SteadyMotion;
    /// # let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let steady = SteadyMotion::solve(&rig.params.coefficients(), 2.0, 3)?;
    /// let x = steady.state([0.03, 0.04]);
    /// assert_eq!(steady.oscillator(&x), [0.03, 0.04]);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn oscillator(&self, reference: &State<T>) -> [T; 2] {
        [-reference.alpha_dot / self.lambda, reference.alpha]
    }

    /// The command (V) under which the pendulum in state `x` accelerates by `alpha_ddot` (rad/s²), by the model with
    /// these coefficients and the [load](SteadyMotion::load), whose place of rest has the arm at `middle` (rad).
    ///
    /// The voltage that holds the arm there is not in it: `[compensate] hold` adds that.
    ///
    /// ```
    /// # use furuta_ctrl::design::SteadyMotion;
    /// # use furuta_model::State;
    /// # let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
    /// let c = rig.params.coefficients();
    /// let steady = SteadyMotion::solve(&c, 2.0, 3)?;
    /// let u = steady.inverse(&c, &State::upright(), 0.0, 7.0);
    /// assert!((furuta_model::dynamics::acceleration(&c, &State::upright(), u)[1] - 7.0).abs() < 1e-9);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn inverse(
        &self,
        coefficients: &Coefficients<T>,
        x: &State<T>,
        middle: T,
        alpha_ddot: T,
    ) -> T {
        let distance = State {
            theta: x.theta - middle,
            alpha: wrap(x.alpha),
            ..*x
        };
        let torque = self.load.torque(&distance);
        zero_dynamics::command_under(coefficients, torque, x, alpha_ddot)
    }

    /// The same in another precision.
    pub fn cast<U: Real>(&self) -> SteadyMotion<U, N> {
        let series = |s: &Series<T, N>| s.map(|_, _, c| U::from_f64(c.value()));
        SteadyMotion {
            lambda: U::from_f64(self.lambda.value()),
            angle: series(&self.angle),
            speed: series(&self.speed),
            command: series(&self.command),
            load: self.load.cast(),
        }
    }

    /// How well the series solves the equation at an `amplitude` (rad): largest difference between the arm's
    /// acceleration and the one that the zero dynamics demand, over a turn of the oscillator, as a part of the largest
    /// acceleration.
    ///
    /// It falls with the amplitude to the power of the order + 1 and tells from which amplitude on a series says
    /// nothing: with the centrifugal moment of a real rotary pendulum there is one beyond which no periodic motion of
    /// the arm exists at all.
    pub fn residual(&self, coefficients: &Coefficients<T>, amplitude: T) -> T {
        let acceleration = self.speed.rate(self.lambda);
        let (mut worst, mut largest) = (T::ZERO, T::ZERO);
        for k in 0..64 {
            let (s, c) = c::<T>(f64::from(k) * core::f64::consts::TAU / 64.0).sin_cos();
            let w = [amplitude * c, amplitude * s];
            let x = self.state(w);
            let demanded = zero_dynamics::arm_acceleration_under(
                coefficients,
                self.load.torque(&x),
                &x,
                -(self.lambda * self.lambda * w[1]),
            );
            let difference = (acceleration.at(w[0], w[1]) - demanded).abs();
            worst = worst.if_less(difference, difference, worst);
            largest = largest.if_less(demanded.abs(), demanded.abs(), largest);
        }
        if largest > T::ZERO {
            worst / largest
        } else {
            T::ZERO
        }
    }
}

/// `pi(w)` as a series for this angle of the arm, and `alpha''`.
fn along<T: Real, const N: usize>(
    lambda: T,
    angle: &Series<T, N>,
) -> (State<Series<T, N>>, Series<T, N>) {
    let alpha = Series::variable(T::ZERO, 1);
    let alpha_dot = alpha.rate(lambda);
    let x = State::new(*angle, alpha, angle.rate(lambda), alpha_dot);
    (x, alpha_dot.rate(lambda))
}

/// The odd series `theta(w)` whose second rate along the oscillator is `arm_acceleration(pi(w), alpha'')`.
///
/// The function may depend on the arm's motion through terms that raise the degree only, such as `sin(alpha) theta'²`;
/// what a model of one's own does otherwise is found out by substitution.
///
/// # Errors
/// See [`RegulatorError`].
pub fn arm_angle<T: Real, const N: usize>(
    lambda: T,
    order: usize,
    arm_acceleration: impl Fn(&State<Series<T, N>>, Series<T, N>) -> Series<T, N>,
) -> Result<Series<T, N>, RegulatorError> {
    let capacity = Series::<T, N>::DEGREE;
    if order == 0 || order > capacity {
        return Err(RegulatorError::Order { order, capacity });
    }
    if !(lambda > T::ZERO) || !lambda.value().is_finite() {
        return Err(RegulatorError::Frequency {
            value: lambda.value(),
        });
    }
    let demanded = |angle: &Series<T, N>| {
        let (x, alpha_ddot) = along(lambda, angle);
        arm_acceleration(&x, alpha_ddot)
    };
    let mut angle = Series::constant(T::ZERO);
    for degree in (1..=order).step_by(2) {
        let wanted = demanded(&angle);
        check(&wanted, degree)?;
        let speed = integral(&wanted, degree, lambda);
        angle += integral(&speed, degree, lambda);
    }
    // Rounding grows with the products of the degrees; the parts by which degrees are solved must not have moved since.
    let (found, wanted) = (angle.rate(lambda).rate(lambda), demanded(&angle));
    for degree in 1..=order {
        let (mut worst, mut largest) = (0.0, 0.0);
        for j in 0..=degree {
            let (f, w) = (
                found.coefficient(degree - j, j).value(),
                wanted.coefficient(degree - j, j).value(),
            );
            worst = f64::max(worst, libm::fabs(f - w));
            largest = f64::max(largest, libm::fabs(w));
        }
        // 100 roundings, whatever the precision: one step of T at 1 is 2^-52 or 2^-23.
        let step = if T::from_f64(1.0 + 1e-9) == T::ONE {
            f64::from(f32::EPSILON)
        } else {
            f64::EPSILON
        };
        if !(worst <= 100.0 * step * largest) {
            return Err(RegulatorError::Residual {
                degree,
                residual: worst / largest,
            });
        }
    }
    Ok(angle)
}

/// Everything up to `degree` is finite, and nothing of it even.
fn check<T: Real, const N: usize>(
    wanted: &Series<T, N>,
    degree: usize,
) -> Result<(), RegulatorError> {
    for d in 0..=degree {
        for j in 0..=d {
            let (i, value) = (d - j, wanted.coefficient(d - j, j).value());
            if !value.is_finite() {
                return Err(RegulatorError::NotFinite { i, j });
            }
            if d % 2 == 0 && value != 0.0 {
                return Err(RegulatorError::Even { i, j, value });
            }
        }
    }
    Ok(())
}

/// The homogeneous polynomial of odd `degree` whose rate along the oscillator is that part of `rate`.
///
/// With `a_j` the coefficient of `w1^(d-j) w2^j`, the rate has `lambda ((d-j+1) a_(j-1) - (j+1) a_(j+1))`: the odd
/// `a_j` follow from below, the even ones from above.
fn integral<T: Real, const N: usize>(
    rate: &Series<T, N>,
    degree: usize,
    lambda: T,
) -> Series<T, N> {
    #[allow(clippy::cast_precision_loss)]
    let number = |n: usize| c::<T>(n as f64);
    let r = |j: usize| rate.coefficient(degree - j, j) / lambda;
    // One for each monomial of the degree; no degree has as many as the whole series.
    let mut a = [T::ZERO; N];
    for j in (0..degree).step_by(2) {
        let before = if j > 0 {
            number(degree - j + 1) * a[j - 1]
        } else {
            T::ZERO
        };
        a[j + 1] = (before - r(j)) / number(j + 1);
    }
    for j in (1..=degree).rev().step_by(2) {
        let after = if j < degree {
            number(j + 1) * a[j + 1]
        } else {
            T::ZERO
        };
        a[j - 1] = (after + r(j)) / number(degree - j + 1);
    }
    Series::from_fn(|i, j| if i + j == degree { a[j] } else { T::ZERO })
}
