//! Parts of recordings: every N-th sample, a span of time.

use furuta_recording::{Excerpt, Recording};

fn recording(gap: bool) -> Recording {
    let mut text = "t,u,theta,alpha,theta_dot,lamp\n".to_owned();
    for k in 0..1000 {
        let t = 0.002 * f64::from(k) + if gap && k >= 500 { 1.0 } else { 0.0 };
        let u = f64::from(k / 7 % 5);
        text += &format!(
            "{t},{u},{},3.1,0.5,{}\n",
            0.01 * f64::from(k),
            ["on", "off"][k as usize % 2]
        );
    }
    Recording::from_csv("run.csv", text.as_bytes()).unwrap().0
}

#[test]
fn the_command_of_a_thinned_recording_does_as_much() {
    let all = recording(false);
    let few = all.every(7).unwrap();
    assert_eq!(few.len(), 143);
    assert!((few.sample_period - 7.0 * all.sample_period).abs() < 1e-12);
    for (k, u) in few.u.iter().enumerate().take(142) {
        assert_eq!(*u, all.u[7 * k], "no command changes within a sample");
        assert_eq!((few.t[k], few.theta[k]), (all.t[7 * k], all.theta[7 * k]));
    }
    // Where it changes within, it is the mean: what it does until any sample is the same.
    let few = all.every(10).unwrap();
    for (k, u) in few.u.iter().enumerate() {
        let mean = all.u[10 * k..10 * k + 10].iter().sum::<f64>() / 10.0;
        assert!((u - mean).abs() < 1e-12);
    }
    assert_eq!(all.every(1).unwrap(), all);
    assert!(all.every(0).is_err());
    let error = all.every(100).unwrap_err().to_string();
    assert!(
        error.contains("run.csv: every 100th sample leaves no 20"),
        "{error}"
    );
}

#[test]
fn a_gap_stays_where_it_is() {
    let all = recording(true);
    assert_eq!(all.segments, [0..500, 500..1000]);
    let few = all.every(3).unwrap();
    assert_eq!(few.segments, [0..167, 167..334]);
    assert_eq!(few.t[167], all.t[500]);
    // The last command before the gap is of the samples before it alone.
    assert_eq!(few.u[166], (all.u[498] + all.u[499]) / 2.0);
}

#[test]
fn a_span_is_counted_from_the_first_sample() {
    let all = recording(true);
    let part = all.span(0.9, 2.5).unwrap();
    assert!((part.t[0] - 0.9).abs() < 2e-3 && (part.t[part.len() - 1] - 2.5).abs() < 2e-3);
    assert_eq!(part.segments.len(), 2);
    assert_eq!(part.segments[1].start, part.segments[0].end);
    let both = Excerpt {
        every: 2,
        span: Some(0.0..0.5),
        ..Excerpt::default()
    };
    assert_eq!(recording(false).select(&both).unwrap().len(), 126);
    let error = all.span(10.0, 20.0).unwrap_err().to_string();
    assert!(
        error.contains("between 10 and 20 s; the recording lasts 2.998 s"),
        "{error}"
    );
    assert!(all.span(2.0, 1.0).is_err());
    assert!(all.span(f64::NAN, 1.0).is_err());
}

/// A controller of 1 kHz of which every twentieth row is kept: read as smooth, the command takes a mass where it did.
/// Held from row to row it is half a row late, and as a straight line it is wrong by `h² u/6`.
#[test]
fn a_smooth_command_between_kept_rows_takes_a_mass_where_it_did() {
    let (w, h) = (25.0_f64, 0.02);
    let rows = (0..300).map(|k| [h * f64::from(k), (w * h * f64::from(k)).sin(), 0.0, 3.1]);
    let (kept, _) = Recording::from_samples("kept", rows).unwrap();
    let read = kept.smooth_command().unwrap();
    assert_eq!(read.segments, kept.segments);
    // By how much second differences of the places are off at most, as a share of those of x'' = sin(w t), in units of
    // the first terms of the series in w h.
    let off = |held: &dyn Fn(usize) -> f64| {
        let off = (2..297).map(|k| {
            let exact = (w * h * k as f64).sin() * (2.0 - 2.0 * (w * h).cos()) / (w * h).powi(2);
            ((held(k) + held(k - 1)) / 2.0 - exact).abs()
        });
        off.fold(0.0, f64::max)
    };
    let near =
        |found: f64, first: f64| assert!((found / first - 1.0).abs() < 0.1, "{found}, not {first}");
    near(off(&|k| read.u[k]), (w * h).powi(4) / 26.7);
    near(
        off(&|k| (kept.u[k] + kept.u[k + 1]) / 2.0),
        (w * h).powi(2) / 6.0,
    );
    near(off(&|k| kept.u[k]), w * h / 2.0);
}

#[test]
fn where_a_command_jumps_between_kept_rows_is_a_gap() {
    // Levels with a little feedback on them, and a gap of the recording's own.
    let row = |k: u32| {
        let t = 0.02 * f64::from(k) + if k < 200 { 0.0 } else { 1.0 };
        let level = [3.0, -2.0, 5.0, 5.0, 1.0][(k / 60) as usize];
        [t, level + 0.01 * (3.0 * t).sin(), 0.1 * t, 3.1]
    };
    let (kept, _) = Recording::from_samples("levels", (0..300).map(row)).unwrap();
    assert_eq!(kept.segments, [0..200, 200..300]);
    let read = kept.smooth_command().unwrap();
    assert_eq!(
        read.segments,
        [0..60, 60..120, 120..200, 200..240, 240..300]
    );
    for segment in &read.segments {
        // The row before a gap says nothing of what comes after it.
        assert_eq!(read.u[segment.end - 1], kept.u[segment.end - 1]);
        let [a, b, c] = [0, 1, 2].map(|k| kept.u[segment.start + k]);
        assert!((read.u[segment.start] - (5.0 * a + 8.0 * b - c) / 12.0).abs() < 1e-12);
    }
    let relay = |k: u32| {
        [
            0.02 * f64::from(k),
            if (k / 5).is_multiple_of(2) { 1.0 } else { -1.0 },
            0.0,
            3.1,
        ]
    };
    let (relay, _) = Recording::from_samples("relay", (0..300).map(relay)).unwrap();
    let error = relay.smooth_command().unwrap_err().to_string();
    assert!(
        error.starts_with("relay: the command jumps so often"),
        "{error}"
    );
}
