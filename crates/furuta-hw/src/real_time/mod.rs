//! What an operating system can do for a loop that must not be late: a real-time priority, memory that is not paged
//! out, a processor of its own, no deep sleep. Each is asked for and may be refused; the loop then runs all the same,
//! and the report says what it has to do without.
//!
//! On Linux; elsewhere everything is refused. How to grant it: `docs/realtime.md`.

mod wake_up;

use std::collections::BTreeMap;

use serde::Serialize;

pub use wake_up::{Metronome, WakeUp, measure_wake_up};

/// What a loop asks of the system. By default nothing.
///
/// ```
/// use furuta_hw::RealTime;
/// assert!(!RealTime::default().is_asked());
/// assert!(RealTime { priority: Some(80), cpu: None }.is_asked());
/// ```
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct RealTime {
    /// Priority under `SCHED_FIFO`, 1 to 99; with it, all memory that the process has is locked and processors are kept
    /// from sleeping deeply. 80 is above what a PREEMPT_RT kernel gives its interrupt threads (50).
    pub priority: Option<u8>,
    /// The processor that the loop stays on.
    pub cpu: Option<usize>,
}

/// One thing asked for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Measure {
    /// `scheduling`, `memory`, `sleep` or `processor`.
    pub what: &'static str,
    /// What was asked for, in words.
    pub asked: String,
    /// Why it was refused, and what to do; `None`: it was granted.
    pub refused: Option<String>,
}

/// What became of a [`RealTime`] wish.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Granted {
    /// One by one; empty where nothing was asked for.
    pub measures: Vec<Measure>,
    /// Whether the kernel is a PREEMPT_RT one.
    pub preempt_rt: bool,
}

impl Granted {
    /// As it is logged: by [`Measure::what`], `granted: ...` or `refused: ...`; and `preempt_rt`.
    #[must_use]
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let measures = self.measures.iter().map(|m| {
            let outcome = match &m.refused {
                None => format!("granted: {}", m.asked),
                Some(why) => format!("refused: {} ({why})", m.asked),
            };
            (m.what.to_owned(), outcome)
        });
        let kernel = ("preempt_rt".to_owned(), self.preempt_rt.to_string());
        measures.chain([kernel]).collect()
    }

    /// True where this ([`Measure::what`]) was asked for and granted.
    #[must_use]
    pub fn has(&self, what: &str) -> bool {
        self.measures
            .iter()
            .any(|m| m.what == what && m.refused.is_none())
    }
}

/// A line for a person: what was granted, what was not and why.
impl std::fmt::Display for Granted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.measures.is_empty() {
            return f.write_str("not asked for (--priority)");
        }
        let (granted, refused): (Vec<_>, Vec<_>) =
            self.measures.iter().partition(|m| m.refused.is_none());
        let mut parts: Vec<String> = granted.iter().map(|m| m.asked.clone()).collect();
        parts.extend(refused.iter().map(|m| {
            let why = m.refused.as_deref().unwrap_or_default();
            format!("without {} ({why})", m.asked)
        }));
        f.write_str(&parts.join(", "))?;
        if !self.preempt_rt {
            f.write_str("; no PREEMPT_RT kernel")?;
        }
        Ok(())
    }
}

impl RealTime {
    /// True where anything is asked for.
    #[must_use]
    pub fn is_asked(&self) -> bool {
        self.priority.is_some() || self.cpu.is_some()
    }

    /// Asks for it, on behalf of the calling thread. Threads that it starts from now on inherit priority and processor.
    #[must_use]
    pub fn enter(&self) -> (Granted, Held) {
        let mut granted = Granted {
            measures: Vec::new(),
            preempt_rt: system::is_preempt_rt(),
        };
        let mut held = Held::default();
        let mut asked = |what, asked, outcome: Result<(), String>| {
            granted.measures.push(Measure {
                what,
                asked,
                refused: outcome.err(),
            });
        };
        if let Some(cpu) = self.cpu {
            asked("processor", format!("processor {cpu}"), system::pin(cpu));
        }
        if let Some(priority) = self.priority {
            // Memory first: what the lock costs is then paid with ordinary priority.
            let locked = system::lock_memory();
            held.memory = locked.is_ok();
            asked("memory", "memory locked".to_owned(), locked);
            let awake = system::stay_awake();
            let (file, awake) = match awake {
                Ok(file) => (Some(file), Ok(())),
                Err(why) => (None, Err(why)),
            };
            held.awake = file;
            asked("sleep", "processors kept awake".to_owned(), awake);
            asked(
                "scheduling",
                format!("SCHED_FIFO {priority}"),
                system::fifo(priority),
            );
        }
        touch_stack();
        (granted, held)
    }
}

/// What lasts as long as this: locked memory, processors kept awake. The priority is the thread's, and ends with it.
#[derive(Debug, Default)]
pub struct Held {
    memory: bool,
    /// The kernel keeps the request as long as the file is open.
    awake: Option<std::fs::File>,
}

impl Drop for Held {
    fn drop(&mut self) {
        if self.memory {
            system::unlock_memory();
        }
    }
}

/// Stack that a control step may need: the largest of docs/firmware.md times ten.
const STACK: usize = 128 << 10;

/// Writes to the stack that the loop will use, so that no page of it is fetched at the first swing-up. (Locking memory
/// does the same, where granted.)
#[inline(never)]
fn touch_stack() {
    std::hint::black_box(&mut [0u8; STACK]);
}

#[cfg(target_os = "linux")]
mod system {
    //! The system calls, behind crates that make them safe.

    use std::fs::File;
    use std::io::Write;

    use rustix::mm::{MlockAllFlags, mlockall, munlockall};
    use rustix::thread::{CpuSet, sched_setaffinity};
    use thread_priority::{
        Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue,
        ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };

    pub(super) fn is_preempt_rt() -> bool {
        std::fs::read_to_string("/sys/kernel/realtime").is_ok_and(|text| text.trim() == "1")
    }

    pub(super) fn fifo(priority: u8) -> Result<(), String> {
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        const RANGE: &str = "priorities are 1 to 99";
        let value = ThreadPriorityValue::try_from(priority).map_err(|_| RANGE.to_owned())?;
        set_thread_priority_and_policy(
            thread_native_id(),
            ThreadPriority::Crossplatform(value),
            policy,
        )
        .map_err(|error| match error {
            Error::OS(code) => {
                let said = std::io::Error::from_raw_os_error(code);
                format!("{said}: needs rtprio in limits.conf or CAP_SYS_NICE")
            }
            Error::PriorityNotInRange(_) => RANGE.to_owned(),
            other => other.to_string(),
        })
    }

    /// What the process has now. What it will have later is not the loop's, and must not fail to be had because a limit
    /// is reached.
    pub(super) fn lock_memory() -> Result<(), String> {
        mlockall(MlockAllFlags::CURRENT)
            .map_err(|error| format!("{error}: needs memlock in limits.conf or CAP_IPC_LOCK"))
    }

    pub(super) fn unlock_memory() {
        // Nothing depends on it.
        let _ = munlockall();
    }

    /// Power-management quality of service: wake-ups within 0 us, so no idle state that takes longer to leave.
    pub(super) fn stay_awake() -> Result<File, String> {
        const PATH: &str = "/dev/cpu_dma_latency";
        let mut file = File::options()
            .write(true)
            .open(PATH)
            .map_err(|error| format!("{PATH}: {error}"))?;
        file.write_all(&0i32.to_ne_bytes())
            .map_err(|error| format!("{PATH}: {error}"))?;
        Ok(file)
    }

    pub(super) fn pin(cpu: usize) -> Result<(), String> {
        if cpu >= CpuSet::MAX_CPU {
            return Err(format!("processors are 0 to {}", CpuSet::MAX_CPU - 1));
        }
        let mut set = CpuSet::new();
        set.set(cpu);
        sched_setaffinity(None, &set)
            .map_err(|error| format!("{error}: see the processors that `nproc` counts"))
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    //! Nothing of this is built for other systems.

    const WHY: &str = "only on Linux";

    pub(super) fn is_preempt_rt() -> bool {
        false
    }

    pub(super) fn fifo(_: u8) -> Result<(), String> {
        Err(WHY.to_owned())
    }

    pub(super) fn lock_memory() -> Result<(), String> {
        Err(WHY.to_owned())
    }

    pub(super) fn unlock_memory() {}

    pub(super) fn stay_awake() -> Result<std::fs::File, String> {
        Err(WHY.to_owned())
    }

    pub(super) fn pin(_: usize) -> Result<(), String> {
        Err(WHY.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_said_and_nothing_stops() {
        let impossible = RealTime {
            priority: Some(100),
            cpu: Some(1023),
        };
        let (granted, held) = impossible.enter();
        assert!(!granted.has("scheduling") && !granted.has("processor"));
        let text = granted.to_string();
        assert!(
            text.contains("without SCHED_FIFO 100 (") && text.contains("without processor 1023 ("),
            "{text}"
        );
        drop(held);
    }

    /// In a thread of its own, which takes its priority with it. What the system says of the thread is what the report
    /// says.
    #[cfg(target_os = "linux")]
    #[test]
    fn what_is_granted_is_true() {
        let asked = RealTime {
            priority: Some(10),
            cpu: Some(0),
        };
        let (granted, policy, allowed) = std::thread::spawn(move || {
            let (granted, _held) = asked.enter();
            let stat = std::fs::read_to_string("/proc/thread-self/stat").expect("Linux");
            let fields: Vec<_> = stat
                .rsplit_once(')')
                .expect("a name")
                .1
                .split_whitespace()
                .map(str::to_owned)
                .collect();
            // proc(5): fields 40 and 41, rt_priority and policy; the first here is number 3.
            let policy = (fields[37].clone(), fields[38].clone());
            let status = std::fs::read_to_string("/proc/thread-self/status").expect("Linux");
            let allowed = status
                .lines()
                .find(|l| l.starts_with("Cpus_allowed_list"))
                .map(str::to_owned);
            (granted, policy, allowed)
        })
        .join()
        .expect("no panic");
        let is_fifo = policy == ("10".to_owned(), "1".to_owned());
        assert_eq!(granted.has("scheduling"), is_fifo, "{granted} {policy:?}");
        if granted.has("processor") {
            assert!(allowed.is_some_and(|a| a.ends_with("\t0")), "{granted}");
        }
        assert_eq!(granted.measures.len(), 4);
    }
}
