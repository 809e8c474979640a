//! What the missing torque looks like, in few numbers and in words.

use serde::{Deserialize, Serialize};

use super::{Channel, null_if_not_finite, significant};

/// How a torque depends on a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// The same everywhere.
    Constant,
    /// In proportion to it.
    Proportional,
    /// With its sign alone.
    Sign,
    /// With its square and its sign.
    Quadratic,
}

impl Shape {
    pub(crate) const ALL: [Self; 4] = [
        Self::Constant,
        Self::Proportional,
        Self::Sign,
        Self::Quadratic,
    ];

    /// The shape at size one.
    pub(crate) fn value(self, x: f64) -> f64 {
        match self {
            Self::Constant => 1.0,
            Self::Proportional => x,
            Self::Sign => x.signum(),
            Self::Quadratic => x * x.abs(),
        }
    }

    /// The size's unit for a state of this unit.
    pub(crate) fn unit(self, state: &str) -> String {
        match self {
            Self::Constant | Self::Sign => "N m".into(),
            Self::Proportional => format!("N m/({state})"),
            Self::Quadratic => format!("N m/({state})^2"),
        }
    }
}

/// A torque that the refitted model lacks on one axis, against the state on which it depends most.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MissingTorque {
    /// The axis it acts on.
    pub axis: Channel,
    /// `theta`, `theta_dot`, `alpha`, `alpha_dot` or `u`.
    pub state: String,
    /// How it depends on the state, where that is simple.
    pub shape: Option<Shape>,
    /// Factor of the shape; without a shape the largest torque.
    #[serde(with = "null_if_not_finite")]
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// Share of the squared error above the noise that it explains, 0 to 1.
    #[serde(with = "null_if_not_finite")]
    pub share_of_gap: f64,
}

impl MissingTorque {
    /// In one sentence, for a person.
    ///
    /// ```
    /// use furuta_ident::diagnose::result::{Channel, MissingTorque, Shape};
    /// let friction = MissingTorque {
    ///     axis: Channel::Theta,
    ///     state: "theta_dot".into(),
    ///     shape: Some(Shape::Sign),
    ///     size: -0.0041,
    ///     unit: "N m".into(),
    ///     share_of_gap: 0.93,
    /// };
    /// assert_eq!(
    ///     friction.sentence(),
    ///     "On the arm a torque against the sign of the arm's speed is missing (-0.0041 N m): it would \
    ///      explain 93 % of the gap."
    /// );
    /// ```
    #[must_use]
    pub fn sentence(&self) -> String {
        let state = match self.state.as_str() {
            "theta" => "the arm's angle",
            "theta_dot" => "the arm's speed",
            "alpha" => "the pendulum's angle",
            "alpha_dot" => "the pendulum's speed",
            _ => "the command",
        };
        let with = if self.size < 0.0 { "against" } else { "with" };
        let torque = match self.shape {
            Some(Shape::Constant) => "a constant torque is missing".into(),
            Some(Shape::Proportional) => format!("a torque in proportion to {state} is missing"),
            Some(Shape::Sign) => format!("a torque {with} the sign of {state} is missing"),
            Some(Shape::Quadratic) => {
                format!("a torque {with} the square of {state} is missing")
            }
            None => format!("a torque that depends on {state} is missing"),
        };
        let most = if self.shape.is_none() { "up to " } else { "" };
        format!(
            "On the {} {torque} ({most}{} {}): it would explain {:.0} % of the gap.",
            self.axis.part(),
            significant(self.size, 2),
            self.unit,
            100.0 * self.share_of_gap
        )
    }
}
