//! What cannot give a response is refused by name, with what to do; what is doubtful is said.

use super::{filtered, white};
use furuta_ident::frequency::record::{Columns, Taken};
use furuta_ident::frequency::{
    Estimator, FrequencyError, FrequencyNotice, Frf, Settings, Spectra, Stretch, local, periodic,
};
use furuta_ident::recording::Recording;

const H: f64 = 0.01;

fn data(n: usize) -> (Vec<f64>, Vec<f64>) {
    let u = white(1, n);
    let y = filtered(&u);
    (u, y)
}

fn spectra(u: &[f64], y: &[f64], segment: usize) -> Result<Spectra, FrequencyError> {
    Spectra::of(&[Stretch { u, y, r: None }], H, &Settings::new(segment))
}

#[test]
fn too_short_for_the_resolution() {
    let (u, y) = data(500);
    let error = spectra(&u, &y, 1000).expect_err("5 s cannot have lines 0.1 Hz apart");
    assert_eq!(
        error.to_string(),
        "a resolution of 0.1000 Hz needs 10.000 s without a gap, and the longest stretch has 5.000 s: ask for a \
         coarser resolution (at least 0.4000 Hz), or record longer"
    );
    let one = spectra(&u, &y, 500).expect("one segment");
    let error = Frf::of(&one, Estimator::H1).expect_err("no average");
    assert!(
        matches!(error, FrequencyError::OneSegment { .. }),
        "{error}"
    );
}

#[test]
fn a_resolution_and_a_period_that_cannot_be() {
    let (u, y) = data(500);
    let stretch = [Stretch {
        u: &u,
        y: &y,
        r: None,
    }];
    for resolution in [0.0, -0.1, f64::NAN, 50.0] {
        let error = local::response(&stretch, H, resolution, None).expect_err("no such lines");
        let wanted = "must be above 0 and below 50 Hz, half the sampling rate";
        assert!(error.to_string().ends_with(wanted), "{error}");
    }
    for period in [-1.0, 0.0, 0.07] {
        let error = periodic::response(&stretch, H, period, 0).expect_err("no such period");
        let wanted = "it must be a whole number of at least 8";
        assert!(error.to_string().contains(wanted), "{error}");
    }
}

#[test]
fn constant_input() {
    let (_, y) = data(500);
    let error = spectra(&[2.0; 500], &y, 100).expect_err("nothing excited");
    assert!(
        error
            .to_string()
            .starts_with("input is constant at 2: it excites nothing")
    );
    let error = spectra(&y, &[0.5; 500], 100).expect_err("nothing moves");
    assert!(error.to_string().starts_with("output is constant at 0.5"));
}

#[test]
fn numbers_and_lengths() {
    let (u, mut y) = data(500);
    assert!(matches!(
        spectra(&u, &y[..499], 100),
        Err(FrequencyError::Lengths {
            given: 499,
            expected: 500,
            ..
        })
    ));
    y[17] = f64::NAN;
    let error = spectra(&u, &y, 100).expect_err("not a number");
    assert_eq!(
        error.to_string(),
        "output: sample 17 is NaN; mend or cut the recording there"
    );
    let settings = Settings {
        overlap: 100,
        ..Settings::new(100)
    };
    let error = Spectra::of(
        &[Stretch {
            u: &u,
            y: &u,
            r: None,
        }],
        H,
        &settings,
    )
    .expect_err("it would never end");
    assert_eq!(
        error.to_string(),
        "overlap = 100 is outside the allowed range [0, 99] samples"
    );
    assert_eq!(
        Spectra::of(&[], H, &Settings::new(100)),
        Err(FrequencyError::NoData)
    );
}

#[test]
fn few_averages_and_aliasing_are_said() {
    let (u, y) = data(1000);
    let measure = |y: &[f64], segment| {
        Frf::measure(
            &[Stretch { u: &u, y, r: None }],
            H,
            &Settings::new(segment),
            Estimator::H1,
        )
        .expect("a response")
        .1
    };
    assert!(matches!(measure(&y, 400)[..],
            [FrequencyNotice::FewAverages { averages, .. }] if (3.5..4.1).contains(&averages)));
    assert!(measure(&y, 50).is_empty());
    // White up to half the sampling rate: what was above is not known.
    let notices = measure(&white(2, 1000), 50);
    assert!(
        matches!(notices[..], [FrequencyNotice::AliasingSuspected { share, .. }] if (0.15..0.25).contains(&share))
    );
    assert!(
        notices[0]
            .to_string()
            .contains("may have folded down; sample faster")
    );
}

#[test]
fn periods() {
    let u: Vec<f64> = (0..1000)
        .map(|k| (f64::from(k) * std::f64::consts::TAU / 100.0).sin())
        .collect();
    let respond = |u: &[f64], period, discard| {
        periodic::response(&[Stretch { u, y: u, r: None }], H, period, discard)
            .expect_err("refused")
            .to_string()
    };
    assert!(respond(&u, 1.005, 0).starts_with(
        "a period of 1.005 s is 100.500 samples of 0.01 s: it must be a whole number"
    ));
    assert!(
        respond(&u, 6.0, 0)
            .starts_with("whole periods of 6 s in the data after the first 0: 1; at least 2")
    );
    assert!(
        respond(&u, 1.0, 9).starts_with("whole periods of 1 s in the data after the first 9: 1")
    );
    assert!(respond(&white(3, 1000), 1.0, 0).starts_with("the input does not repeat after 1 s"));
}

fn recording(rows: impl Iterator<Item = (f64, f64)>, more: &str) -> Recording {
    let mut csv = format!(
        "t,u,theta,alpha{}\n",
        if more.is_empty() { "" } else { ",mode" }
    );
    for (t, u) in rows {
        csv += &format!(
            "{t:.4},{u},{},{}{more}\n",
            (3.0 * t).sin(),
            3.1 + 0.1 * (7.0 * t + u).sin()
        );
    }
    Recording::from_csv("r.csv", csv.as_bytes())
        .expect("a recording")
        .0
}

#[test]
fn recordings_with_gaps_and_feedback() {
    let u = white(9, 2000);
    // A second is missing after 10 s, and another after 10.5 s more.
    let time = |k: usize| {
        k as f64 * H
            + if k > 1050 {
                2.0
            } else if k > 1000 {
                1.0
            } else {
                0.0
            }
    };
    let gaps = recording((0..2000).map(|k| (time(k), u[k])), "");
    let columns = Columns {
        input: "u",
        output: "alpha",
        external: None,
    };
    let all = [gaps];
    let taken = Taken::from_recordings(&all, columns).expect("columns");
    assert_eq!(taken.stretches.len(), 3);
    let (_, notices) = Frf::measure(
        &taken.stretches,
        taken.sample_period,
        &Settings::new(200),
        Estimator::H1,
    )
    .expect("a response");
    assert!(
        notices.contains(&FrequencyNotice::Gaps {
            stretches: 3,
            unused: 1
        }),
        "{notices:?}"
    );

    let closed = [recording(
        (0..2000).map(|k| (k as f64 * H, u[k])),
        ",balance",
    )];
    let taken = Taken::from_recordings(&closed, columns).expect("columns");
    assert!(
        matches!(&taken.notices[..], [FrequencyNotice::FeedbackSuspected { mode }] if mode == "balance")
    );

    let missing = Columns {
        external: Some("excitation"),
        ..columns
    };
    let error = Taken::from_recordings(&closed, missing).expect_err("not there");
    assert_eq!(
        error.to_string(),
        "r.csv has no column of numbers `excitation`; it has t, u, theta, alpha, mode"
    );
    let text = Columns {
        external: Some("mode"),
        ..columns
    };
    assert!(
        Taken::from_recordings(&closed, text)
            .expect_err("text")
            .to_string()
            .ends_with("that one holds text")
    );
    let slow = [
        recording((0..2000).map(|k| (k as f64 * H, u[k])), ""),
        recording((0..2000).map(|k| (k as f64 * 0.02, u[k])), ""),
    ];
    assert!(matches!(
        Taken::from_recordings(&slow, columns),
        Err(FrequencyError::Rates { .. })
    ));
    let again = [slow[0].clone(), slow[0].clone()];
    assert!(matches!(
        Taken::from_recordings(&again, columns),
        Err(FrequencyError::Twice(_))
    ));
    let itself = Columns {
        output: columns.input,
        ..columns
    };
    assert!(matches!(
        Taken::from_recordings(&slow[..1], itself),
        Err(FrequencyError::OneColumn { .. })
    ));
    let frf = Frf::of(
        &spectra(&u, &filtered(&u), 100).expect("good"),
        Estimator::H1,
    )
    .expect("good");
    assert!(matches!(
        frf.band(0.1, 0.2),
        Err(FrequencyError::EmptyBand { .. })
    ));
    assert!(frf.confidence(1.0).is_err());
}
