//! A diagnosis that is ended early, by a person or by its time limit, names nothing that it would not have named at its
//! end.

use crate::common;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use common::{RunSetup, names, qube, record, sweep};
use furuta_ident::diagnose::result::{Best, Diagnosis};
use furuta_ident::diagnose::{Options, Request, Verdict, diagnose_with};
use furuta_ident::recording::Recording;
use furuta_model::{Effect, Rig};

/// Two sweeps of a rig with these effects hidden.
fn recordings(hidden: &[(&str, &[f64])]) -> Vec<Recording> {
    let effects = hidden
        .iter()
        .map(|(id, values)| Effect::new(id, values).expect("valid"))
        .collect();
    let rig = Rig { effects, ..qube() };
    [(1.5, 0.0), (2.5, 1.0)]
        .iter()
        .map(|&(volts, phase)| record("run.csv", &rig, RunSetup::default(), sweep(volts, phase)))
        .collect()
}

/// The diagnosis, ended when the `last`-th candidate has been tried.
fn ended_after(last: usize, recordings: &[Recording]) -> Diagnosis {
    let request = Request {
        recordings,
        rig: &qube(),
        verify: &[],
    };
    let (flag, told) = (AtomicBool::new(false), AtomicUsize::new(0));
    let options = Options {
        stop: Some(&flag),
        ..Options::default()
    };
    let outcome = diagnose_with(&request, options, &|_| {
        if told.fetch_add(1, Ordering::Relaxed) + 1 >= last {
            flag.store(true, Ordering::Relaxed);
        }
    });
    outcome.expect("good recordings").diagnosis
}

/// Ends the diagnosis of a rig with these effects ever later: no name is given that the whole one does not give, and
/// nothing is named that explains nothing. How many effects of the whole one were suspected on the way.
fn suspected_early(hidden: &[(&str, &[f64])]) -> usize {
    let mut suspected = 0;
    let recordings = recordings(hidden);
    let whole = ended_after(usize::MAX, &recordings);
    assert!(whole.unfinished.is_empty());
    for last in [1, 60, 250] {
        let early = ended_after(last, &recordings);
        let new: Vec<_> = names(&early)
            .into_iter()
            .filter(|id| !names(&whole).contains(id))
            .collect();
        assert_eq!(new, [""; 0], "after {last}: {:?}", early.unfinished);
        for s in &early.suspected {
            assert!(!names(&early).contains(&s.id.as_str()), "{s:?} is named");
            suspected += usize::from(names(&whole).contains(&s.id.as_str()));
        }
        // What does not explain the data has no names that were not judged.
        if early.verdict == Verdict::Unexplained && early.interrupted {
            assert!(
                early.effects.is_empty(),
                "after {last}: {:?}",
                names(&early)
            );
        }
    }
    suspected
}

/// Nor is what the best set so far has lost, although the search ended before others were tried in its place: it is
/// suspected.
#[test]
fn what_is_named_early_is_named_at_the_end() {
    let suspected = suspected_early(&[("arm.coulomb", &[2e-3]), ("arm.spring", &[2e-3, 0.1])]);
    assert!(suspected > 0, "what was found early was forgotten");
}

/// What no usual effect explains is searched among all of them, four times.
#[test]
#[ignore = "two minutes: make test-long"]
fn what_is_in_no_catalogue_has_no_name_early() {
    suspected_early(&[("custom.1", &[-3e-5, 1.0, 2.0])]);
}

#[test]
fn the_time_limit_ends_a_search_that_is_no_interruption() {
    let recordings = recordings(&[("arm.coulomb", &[2e-3]), ("arm.spring", &[2e-3, 0.1])]);
    let request = Request {
        recordings: &recordings,
        rig: &qube(),
        verify: &[],
    };
    let options = Options {
        time_limit: Some(Duration::from_millis(1)),
        ..Options::default()
    };
    let percents = std::sync::Mutex::new(Vec::new());
    let told =
        |p: furuta_ident::diagnose::Progress| percents.lock().expect("whole").push(p.percent);
    let outcome = diagnose_with(&request, options, &told).expect("good recordings");
    // What was not judged on data kept apart is not written.
    assert_eq!(outcome.repaired, qube());
    let diagnosis = outcome.diagnosis;
    assert_eq!((diagnosis.best, &diagnosis.held_out), (Best::Given, &None));
    let written = diagnosis.written().expect("a sentence");
    assert!(written.starts_with("Nothing was judged"), "{written}");
    assert!(!diagnosis.interrupted && !diagnosis.unfinished.is_empty());
    assert!(diagnosis.effects.is_empty(), "{:?}", names(&diagnosis));
    let said = diagnosis.interruption().expect("a sentence");
    let advised = said.starts_with("The time limit ended") && said.contains("every");
    assert!(advised, "{said}");
    let percents = percents.into_inner().expect("whole");
    assert!(
        percents.iter().all(|p| (0.0..=100.0).contains(p)),
        "{percents:?}"
    );
}
