//! Settings of the loop.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use furuta_ctrl::supervisor::Brake;
use furuta_model::{Limits, Rig};

use crate::real_time::RealTime;
use crate::rig_time::RigClock;
use crate::safety;

/// Settings of the loop: [`LoopSettings::new`] for those of a rig, and what shall be otherwise.
///
/// ```
/// use furuta_hw::LoopSettings;
/// use std::time::Duration;
/// let rig = furuta_model::Rig::builtin("shahzad2022-srv02").ok_or("no such rig")?;
/// let settings = LoopSettings {
///     probe: Some(LoopSettings::PROBE),
///     ..LoopSettings::new(&rig, 0.002, Duration::from_secs(10))
/// };
/// assert_eq!(settings.limits, rig.limits);
/// assert_eq!(settings.brake.periods(), 125); // a quarter of a second
/// # Ok::<(), &str>(())
/// ```
#[derive(Copy, Clone, Debug)]
pub struct LoopSettings<'a> {
    /// The run ends after this time of the rig's clock.
    pub duration: Duration,
    /// The run ends where one of these is exceeded.
    pub limits: Limits,
    /// How the arm is stopped there; [`Brake::none`] only cuts the motor off. A replay takes it to be that of
    /// [`LoopSettings::new`].
    pub brake: Brake<f64>,
    /// The run ends where no sample comes for so long; one that is repeated or old counts as none.
    pub silence: Duration,
    /// Whether the rig's clock is compared with the host's; and how long the run may last on that, whatever the rig's
    /// says: [`RigClock::longest`].
    pub clock: RigClock,
    /// Set from elsewhere, for example on Ctrl-C, to end the run.
    pub stop: Option<&'a AtomicBool>,
    /// How often the way to the rig and back is timed, by a query after a command; never where not given.
    pub probe: Option<Duration>,
    /// What [`crate::Session::run`] asks of the system.
    pub real_time: RealTime,
}

impl LoopSettings<'_> {
    /// A run of this length on this rig at this sample period (s): the rig file's limits, and [`Brake::new`] up to its
    /// command limit where one is exceeded; [`Self::SILENCE`]; a rig whose clock shows real time; no flag stops it, the
    /// line is not timed, nothing is asked of the system.
    #[must_use]
    pub fn new(rig: &Rig, period: f64, duration: Duration) -> Self {
        Self {
            duration,
            limits: rig.limits,
            brake: safety::brake(rig, period),
            silence: Self::SILENCE,
            clock: RigClock::Real,
            stop: None,
            probe: None,
            real_time: RealTime::default(),
        }
    }

    /// Silence after which a rig counts as dead where nothing else is said: long against any hiccup of an operating
    /// system, since the rig's own watchdog has long switched the motor off by then.
    pub const SILENCE: Duration = Duration::from_millis(500);
    /// How often the way there and back is timed where nothing else is said: a query and its answer are 80 bytes at
    /// most, once in 50 periods of 2 ms.
    pub const PROBE: Duration = Duration::from_millis(100);
}
