//! What a run is asked to do, as its log keeps it.

use furuta_model::signals::{Centring, Excitation};
use serde::{Deserialize, Serialize};

use super::Reference;

/// What a run is asked to do. With the rig file and the controller file it makes the pilot, so that a log that holds
/// all three can be replayed.
///
/// ```
/// use furuta_hw::{Reference, Task};
/// let task = Task::Balance { reference: Reference::Steps { amplitude: 0.2, hold: 2.0 } };
/// assert_eq!(task.to_json(), r#"{"balance":{"reference":{"steps":{"amplitude":0.2,"hold":2.0}}}}"#);
/// assert_eq!(Task::from_json(&task.to_json())?, task);
/// # Ok::<(), furuta_hw::pilot::TaskError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Task {
    /// Swing up and balance, the arm at a reference: a [`super::SwingUpBalance`].
    Balance {
        /// Where the arm is to be.
        reference: Reference,
    },
    /// Drive the motor with a test signal: a [`super::OpenLoop`].
    Excite {
        /// Which.
        excitation: Box<Excitation>,
        /// A pull of the arm beside it, if any.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        centring: Option<Centring>,
    },
}

/// A text is no [`Task`].
#[derive(Debug, thiserror::Error)]
#[error("not the task of a run: {0}")]
pub struct TaskError(#[from] serde_json::Error);

impl Task {
    /// As one line of JSON.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Numbers and names in a tree: there is nothing that JSON cannot hold.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// From what [`Self::to_json`] wrote: the same task, bit for bit.
    ///
    /// # Errors
    /// [`TaskError`] where the text is not JSON, not a task, or one of a signal that cannot be.
    pub fn from_json(text: &str) -> Result<Self, TaskError> {
        Ok(serde_json::from_str(text)?)
    }
}

#[cfg(test)]
mod tests {
    use furuta_model::signals::{
        Chirp, FreeDecay, Harmonics, Multisine, Noise, Phases, Prbs, Ramp, Signal, Step, Steps,
        Sweep,
    };

    use super::*;

    fn signals() -> [Signal; 9] {
        let third = 1.0 / 3.0;
        let multisine = Multisine::new(third, 0.1, 0.2, 6.0, Harmonics::Odd, Phases::Random(7));
        [
            FreeDecay.into(),
            Step::new(third, 0.1).expect("valid").into(),
            Steps::new(-2.0, 0.7).expect("valid").into(),
            Ramp::new(0.0, third, 9.9).expect("valid").into(),
            Chirp::new(1.5, 8.0, 0.1, 10.0, Sweep::Logarithmic)
                .expect("valid")
                .into(),
            multisine.clone().expect("valid").into(),
            multisine.expect("valid").optimised(2).0.into(),
            Prbs::new(third, 7, 0.05, 1 << 63).expect("valid").into(),
            Noise::new(0.3, 0.2, 6.0, u64::MAX).expect("valid").into(),
        ]
    }

    #[test]
    fn every_signal_comes_back_bit_for_bit() {
        let rig = furuta_model::Rig::builtin("qube-servo-2").expect("built in");
        let pull = Centring::returning(&rig.params.coefficients(), 3.0).expect("valid");
        for signal in signals() {
            let excitation = Excitation::new(signal, 8.1)
                .and_then(|e| e.faded(0.1, 0.3))
                .expect("valid");
            for excitation in [excitation.clone(), excitation.limited(0.7).expect("valid")] {
                let task = Task::Excite {
                    excitation: Box::new(excitation.clone()),
                    centring: Some(pull),
                };
                let text = task.to_json();
                let Task::Excite {
                    excitation: again,
                    centring,
                } = Task::from_json(&text).unwrap_or_else(|e| panic!("{text}: {e}"))
                else {
                    panic!("{text}");
                };
                assert_eq!((&*again, centring), (&excitation, Some(pull)), "{text}");
                for k in 0..4000 {
                    let t = f64::from(k) * 0.002;
                    assert_eq!(again.volts(t).to_bits(), excitation.volts(t).to_bits());
                }
            }
        }
        for reference in [
            Reference::Constant(-0.1),
            Reference::Noise(Noise::new(0.3, 0.2, 6.0, 3).expect("valid")),
        ] {
            let task = Task::Balance { reference };
            assert_eq!(Task::from_json(&task.to_json()).expect("own text"), task);
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let excite = |signal: &str| {
            let text = format!(
                r#"{{"excite":{{"excitation":{{
                    "signal":{signal},"duration":1.0,"fade_in":0.0,"fade_out":0.0,"limit":null
                }}}}}}"#
            );
            Task::from_json(&text)
        };
        assert!(excite(r#"{"kind":"free-decay"}"#).is_ok());
        for (signal, says) in [
            (
                r#"{"kind":"prbs","amplitude":1.0,"order":99,"clock":0.1,"seed":0}"#,
                "order = 99",
            ),
            (
                r#"{"kind":"step","amplitude":1e9,"start":0.0}"#,
                "amplitude",
            ),
            (
                r#"{"kind":"step","amplitude":1.0,"begin":0.0}"#,
                "unknown field `begin`",
            ),
            (
                r#"{"kind":"multisine","rms":1.0,"fundamental":0.1,
                    "lines":[{"harmonic":2,"phase":0.0},{"harmonic":1,"phase":0.0}]}"#,
                "rising harmonics",
            ),
            (r#"{"kind":"whistle"}"#, "unknown variant `whistle`"),
        ] {
            let error = excite(signal).expect_err(signal).to_string();
            assert!(error.contains(says), "{error}");
        }
        assert!(Task::from_json("swing").is_err());
        let pulled = |gain: &str| {
            let signal = r#"{"signal":{"kind":"free-decay"},"duration":1.0,"fade_in":0.0,"fade_out":0.0,"limit":null}"#;
            Task::from_json(&format!(
                r#"{{"excite":{{"excitation":{signal},"centring":{{"gain":{gain}}}}}}}"#
            ))
        };
        assert!(pulled("0.5").is_ok());
        assert!(
            pulled("-0.5")
                .expect_err("pushes")
                .to_string()
                .contains("gain = -0.5")
        );
    }
}
