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
