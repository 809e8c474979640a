//! The extended Kalman filter.

use super::noise::{COMMAND, Noise, PENDULUM, READING};
use super::predictor::{Belief, PREDICT, Predictor};
use super::{Design, Estimate, Estimator, Measurement};
use crate::error::ConfigError;
use crate::real::{Real, c};
use crate::section::{Settings, Spec};
use crate::site::Site;
use furuta_model::{Jet, Plant, Scalar, State};

/// What a controller file may say of it.
pub(super) static SPEC: Spec = Spec {
    id: "ekf",
    sentence: "Extended Kalman filter: carries along how sure it is, with the model's own Jacobian at \
        every sample, friction and the like included",
    parameters: &[COMMAND, PENDULUM, READING, PREDICT],
};

/// Four derivatives by the state, one by the motor's voltage.
type Tangent<T> = Jet<T, 5>;
type Matrix<T> = [[T; 4]; 4];

/// Extended Kalman filter on the rig's model with its effects.
///
/// The state is carried by the integrator itself, stiction and all; its covariance by `F P F' + Q` with
/// `F = I + A h + (A h)^2 / 2` from the exact Jacobian `A` at the sample. A held arm's speed is certain: friction takes
/// what noise does to it. The measurements correct one after the other, which needs no matrix inverse.
#[derive(Clone, Debug)]
pub struct ExtendedKalman<T: Real> {
    predictor: Predictor<T>,
    tangent: Plant<Tangent<T>>,
    /// Of the command, V².
    command: T,
    /// Of the pendulum's acceleration, rad²/s⁴.
    pendulum: T,
    /// Of the readings, rad².
    reading: [T; 2],
    /// Of the speeds at the start, rad²/s².
    speed: T,
}

/// A belief and its covariance.
#[derive(Clone, Debug)]
pub struct UncertainBelief<T: Real> {
    belief: Belief<T>,
    /// Covariance of `[theta, alpha, theta_dot, alpha_dot]`.
    p: Matrix<T>,
    held: T,
}

impl<T: Real> UncertainBelief<T> {
    /// Covariance of the error of `[theta, alpha, theta_dot, alpha_dot]`, as the filter sees it; rad and rad/s.
    pub fn covariance(&self) -> &[[T; 4]; 4] {
        &self.p
    }
}

impl<T: Real> Design for ExtendedKalman<T> {
    fn design(settings: &Settings, site: &Site<'_>) -> Result<Self, ConfigError> {
        let predictor = Predictor::design(settings, site)?;
        let noise = Noise::of(settings, site);
        let square = |x: f64| T::from_f64(x * x);
        Ok(Self {
            tangent: predictor.plant.cast(),
            predictor,
            command: square(noise.command),
            pendulum: square(noise.pendulum),
            reading: noise.reading.map(square),
            speed: square(3.0 * site.frequency()),
        })
    }
}

impl<T: Real> ExtendedKalman<T> {
    /// At the start the angles are as good as their readings, the speeds those of a swing.
    fn unsure(&self) -> Matrix<T> {
        let [theta, alpha] = self.reading;
        diagonal([theta, alpha, self.speed, self.speed])
    }

    /// The covariance a period after `p` at the state `x` under the command `u`.
    fn carried(&self, p: &Matrix<T>, x: &State<T>, u: T) -> Matrix<T> {
        let h = self.predictor.period;
        let mut i = 0;
        let x = State::from(x.to_array().map(|v| {
            i += 1;
            Tangent::variable(v, i - 1)
        }));
        let volts = self.predictor.plant.volts(u);
        let rate = self
            .tangent
            .rate(
                Tangent::ZERO,
                &x,
                Tangent::variable(volts, 4),
                T::ONE / h,
            )
            .to_array();
        let a: Matrix<T> = core::array::from_fn(|r| core::array::from_fn(|k| rate[r].d[k] * h));
        let twice = product(&a, &a);
        let f: Matrix<T> = core::array::from_fn(|r| {
            core::array::from_fn(|k| {
                let one = if r == k { T::ONE } else { T::ZERO };
                one + a[r][k] + c::<T>(0.5) * twice[r][k]
            })
        });
        let mut next = product(&product(&f, p), &transposed(&f));
        // What a volt more, and a push on the pendulum, do in a period.
        let half = c::<T>(0.5) * h;
        let [arm, pendulum] = [rate[2].d[4] * h, rate[3].d[4] * h];
        let kick = [T::ZERO, T::ZERO, arm, pendulum];
        let driven: [T; 4] = core::array::from_fn(|r| {
            kick[r] + c::<T>(0.5) * (a[r][2] * arm + a[r][3] * pendulum)
        });
        let pushed = [T::ZERO, half * h, T::ZERO, h];
        for r in 0..4 {
            for k in 0..4 {
                next[r][k] +=
                    self.command * driven[r] * driven[k] + self.pendulum * pushed[r] * pushed[k];
            }
        }
        next
    }
}

impl<T: Real> Estimator<T> for ExtendedKalman<T> {
    type State = UncertainBelief<T>;

    fn start(&self) -> UncertainBelief<T> {
        UncertainBelief {
            belief: self.predictor.start(),
            p: self.unsure(),
            held: T::ZERO,
        }
    }

    fn update(&self, s: &mut UncertainBelief<T>, m: &Measurement<T>) -> Estimate<T> {
        let before = self.predictor.seen(&s.belief);
        let innovation = self.predictor.follow(&mut s.belief, m, T::ZERO);
        if let Some(innovation) = innovation {
            let mut p = s.p;
            for _ in 0..m.periods {
                p = self.carried(&p, &before, s.held);
            }
            let mut change = [T::ZERO; 4];
            for i in 0..2 {
                let certain = T::ONE / (p[i][i] + self.reading[i]);
                let gain: [T; 4] = core::array::from_fn(|r| p[r][i] * certain);
                // The reading before has told something of this one already.
                let surprise = innovation[i] - change[i];
                for r in 0..4 {
                    change[r] += gain[r] * surprise;
                }
                let row = p[i];
                for r in 0..4 {
                    for k in 0..4 {
                        p[r][k] -= gain[r] * row[k];
                    }
                }
            }
            self.predictor.correct(&mut s.belief, change);
            s.p = sound(&p).unwrap_or_else(|| self.unsure());
        } else {
            s.p = self.unsure();
        }
        s.held = m.held;
        self.predictor.estimate(&s.belief, T::ZERO)
    }
}

fn diagonal<T: Real>(d: [T; 4]) -> Matrix<T> {
    core::array::from_fn(|r| core::array::from_fn(|k| if r == k { d[r] } else { T::ZERO }))
}

fn transposed<T: Real>(a: &Matrix<T>) -> Matrix<T> {
    core::array::from_fn(|r| core::array::from_fn(|k| a[k][r]))
}

fn product<T: Real>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    core::array::from_fn(|r| {
        core::array::from_fn(|k| (0..4).fold(T::ZERO, |sum, i| sum + a[r][i] * b[i][k]))
    })
}

/// Made symmetric again; `None` where it is no covariance any more.
fn sound<T: Real>(p: &Matrix<T>) -> Option<Matrix<T>> {
    let half = c::<T>(0.5);
    let p: Matrix<T> =
        core::array::from_fn(|r| core::array::from_fn(|k| half * (p[r][k] + p[k][r])));
    let finite = p.iter().flatten().all(|v| v.value().is_finite());
    (finite && (0..4).all(|i| p[i][i] > T::ZERO)).then_some(p)
}
