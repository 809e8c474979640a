//! A law as a short list of operations on a stack: it runs on any scalar, exact derivatives included, and allocates
//! nothing.

use crate::scalar::Scalar;
use arrayvec::ArrayVec;

/// The most operations of one law.
pub const MAX_OPERATIONS: usize = 64;
/// The most intermediate results of a law at once.
pub(super) const MAX_DEPTH: usize = 12;

/// What a law can read of a moment.
#[cfg_attr(not(feature = "std"), allow(dead_code))] // only a parser makes them
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Variable {
    Theta,
    Alpha,
    ThetaDot,
    AlphaDot,
    U,
    T,
    /// The law's own state.
    State,
    /// Sine and cosine of the pendulum's angle, which the equations of motion have already.
    SinAlpha,
    CosAlpha,
}

/// One operation; each takes its arguments from the stack and leaves its result there.
#[cfg_attr(not(feature = "std"), allow(dead_code))] // only a parser makes them
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Operation {
    Number(f64),
    Parameter(u8),
    Variable(Variable),
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    Power(u8),
    Sin,
    Cos,
    Tanh,
    Exp,
    Sqrt,
    Abs,
    Min,
    Max,
    /// `tanh(x / width)`.
    Sign,
}

impl Operation {
    /// How many it takes from the stack; each leaves one there.
    #[cfg_attr(not(feature = "std"), allow(dead_code))] // only a parser makes them
    pub(super) const fn takes(self) -> usize {
        match self {
            Self::Number(_) | Self::Parameter(_) | Self::Variable(_) => 0,
            Self::Negate
            | Self::Power(_)
            | Self::Sin
            | Self::Cos
            | Self::Tanh
            | Self::Exp
            | Self::Sqrt
            | Self::Abs => 1,
            Self::Add
            | Self::Subtract
            | Self::Multiply
            | Self::Divide
            | Self::Min
            | Self::Max
            | Self::Sign => 2,
        }
    }
}

/// What a law reads at one moment.
pub(super) struct Moment<S> {
    pub(super) theta: S,
    pub(super) alpha: S,
    pub(super) theta_dot: S,
    pub(super) alpha_dot: S,
    pub(super) u: S,
    pub(super) t: S,
    pub(super) state: S,
    /// Sine and cosine of the pendulum's angle.
    pub(super) angle: [S; 2],
}

/// A law, compiled; of no operations: zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tape {
    pub(super) operations: ArrayVec<Operation, MAX_OPERATIONS>,
}

impl Tape {
    /// The law's value. One copy for each scalar, called: what a rig without such a law runs does not grow by it.
    #[inline(never)]
    pub(super) fn value<S: Scalar>(&self, parameters: &[S], at: &Moment<S>) -> S {
        let mut stack: ArrayVec<S, MAX_DEPTH> = ArrayVec::new();
        for operation in &self.operations {
            let mut next = || stack.pop().unwrap_or(S::ZERO);
            let result = match *operation {
                Operation::Number(x) => S::from_f64(x),
                Operation::Parameter(i) => {
                    parameters.get(usize::from(i)).copied().unwrap_or(S::ZERO)
                }
                Operation::Variable(v) => at.of(v),
                Operation::Negate => -next(),
                Operation::Power(n) => power(next(), n),
                Operation::Sin => next().sin_cos().0,
                Operation::Cos => next().sin_cos().1,
                Operation::Tanh => tanh(next()),
                Operation::Exp => next().exp(),
                Operation::Sqrt => next().sqrt(),
                Operation::Abs => next().abs(),
                two => {
                    let (b, a) = (next(), next());
                    match two {
                        Operation::Add => a + b,
                        Operation::Subtract => a - b,
                        Operation::Multiply => a * b,
                        Operation::Divide => a / b,
                        Operation::Min => b.if_less(a, b, a),
                        Operation::Max => a.if_less(b, b, a),
                        _ => tanh(a / b),
                    }
                }
            };
            let _ = stack.try_push(result); // the parser sees to it that there is room
        }
        stack.pop().unwrap_or(S::ZERO)
    }
}

impl<S: Scalar> Moment<S> {
    #[inline(always)]
    fn of(&self, variable: Variable) -> S {
        match variable {
            Variable::Theta => self.theta,
            Variable::Alpha => self.alpha,
            Variable::ThetaDot => self.theta_dot,
            Variable::AlphaDot => self.alpha_dot,
            Variable::U => self.u,
            Variable::T => self.t,
            Variable::State => self.state,
            Variable::SinAlpha => self.angle[0],
            Variable::CosAlpha => self.angle[1],
        }
    }
}

/// `x` to a whole power from 0.
fn power<S: Scalar>(x: S, n: u8) -> S {
    (0..n).fold(S::ONE, |product, _| product * x)
}

/// `(1 - e) / (1 + e)` with `e = exp(-2 |x|)`, which never overflows.
fn tanh<S: Scalar>(x: S) -> S {
    let size = x.abs();
    let e = (-(size + size)).exp();
    let value = (S::ONE - e) / (S::ONE + e);
    x.if_less(S::ZERO, -value, value)
}
