//! Recordings as people really have them: each defect is mended with a notice or refused by name, never silently.

mod angles;
mod bad_input;
mod bounded;
mod columns;
mod conventions;
mod damage;
mod logs;
mod sampling;
mod select;
mod transcode;

use std::f64::consts::PI;

use furuta_model::Sensors;
use furuta_recording::{NoticeKind, Recording, RecordingError};

const PERIOD: f64 = 0.004;
const SAMPLES: usize = 1000;

/// A pendulum hanging and swinging, on an arm that turns: the equation of motion, integrated by small steps, and
/// rounded to encoder counts.
fn swing() -> Vec<[f64; 4]> {
    let sensors = Sensors {
        arm_counts_per_rev: 2048.0,
        pendulum_counts_per_rev: 2048.0,
    };
    let (mut alpha, mut alpha_dot) = (PI + 0.4, 0.0);
    let steps = 20;
    let step = PERIOD / f64::from(steps);
    let mut rows = Vec::new();
    for k in 0..SAMPLES {
        let t = k as f64 * PERIOD;
        let theta = |t: f64| 0.5 * (7.0 * t).sin() + 0.2 * (17.0 * t).sin();
        let theta_ddot = |t: f64| -0.5 * 49.0 * (7.0 * t).sin() - 0.2 * 289.0 * (17.0 * t).sin();
        let [arm, pendulum] = sensors.quantised([theta(t), alpha]);
        rows.push([t, (7.0 * t).cos(), arm, pendulum]);
        for i in 0..steps {
            let now = t + f64::from(i) * step;
            alpha_dot += step
                * (110.0 * f64::sin(alpha) + 0.9 * f64::cos(alpha) * theta_ddot(now)
                    - 0.3 * alpha_dot);
            alpha += step * alpha_dot;
        }
    }
    rows
}

fn csv(rows: &[[f64; 4]]) -> String {
    rows.iter()
        .fold("t,u,theta,alpha\n".into(), |text, [t, u, theta, alpha]| {
            text + &format!("{t:.6},{u:.6},{theta:.7},{alpha:.7}\n")
        })
}

fn read(text: &str) -> Result<(Recording, Vec<NoticeKind>), RecordingError> {
    let (recording, notices) = Recording::from_csv("run.csv", text.as_bytes())?;
    Ok((
        recording,
        notices.into_iter().map(|notice| notice.kind).collect(),
    ))
}

fn refused(text: &str) -> (RecordingError, String) {
    let error = read(text).expect_err("should be refused");
    let message = error.to_string();
    assert!(
        message.starts_with("run.csv: ") && !message.contains('\n'),
        "{message}"
    );
    (error, message)
}
