//! `furuta identify frf` on what `furuta simulate` records, run as a person would.

use crate::common;

use common::{Folder, furuta};
use serde_json::Value;

/// What a command that succeeds prints, and what it says beside.
fn answer(args: &[&str]) -> (Value, String) {
    let output = furuta(args).output().expect("the binary runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (json, said)
}

fn numbers(line: &Value) -> Vec<f64> {
    let numbers = line.as_array().expect("an array");
    numbers
        .iter()
        .map(|v| v.as_f64().expect("a number"))
        .collect()
}

/// A voltage that the amplifier adds drives a free arm away; pulled to its middle it stays, and the joint input-output
/// estimate does not see the pull.
#[test]
fn a_pulled_arm_stays_and_its_response_is_that_of_the_free_one() {
    let folder = Folder::new("centring");
    let record = |name: &str, more: &[&str]| {
        let path = folder.path(name).display().to_string();
        let mut args = vec!["simulate", "--rig", "qube-servo-2", "--input", "noise"];
        args.extend(["--amplitude", "0.5", "--duration", "120", "--rate", "250"]);
        args.extend(["--band", "0.3,10", "--output", &path]);
        args.extend(more);
        answer(&args);
        path
    };
    let bias = ["--hide", "motor.bias:voltage=0.05"];
    let free = record("free.csv", &[]);
    let drifting = record("drifting.csv", &bias);
    let pulled = record("pulled.csv", &[&bias[..], &["--centre", "2"]].concat());

    let furthest = |path: &str| -> f64 {
        let text = std::fs::read_to_string(path).expect("a recording");
        let rows = text
            .lines()
            .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
        rows.map(|row| {
            let theta: f64 = row
                .split(',')
                .nth(2)
                .expect("theta")
                .parse()
                .expect("a number");
            theta.abs()
        })
        .fold(0.0, f64::max)
    };
    // 0.05 V turn this arm by 0.15 rad/s, 18 rad in all.
    assert!(furthest(&drifting) > 10.0);
    // 0.05 V over the pull's gain is 0.3 rad; the noise moves it by half a radian about that.
    assert!(furthest(&pulled) < 1.5, "{}", furthest(&pulled));

    let response = |path: &str, more: &[&str]| {
        let mut args = vec!["identify", "frf", path, "--json", "--band", "0.5,9"];
        args.extend(more);
        answer(&args)
    };
    let (truth, _) = response(&free, &[]);
    let (joint, said) = response(&pulled, &["--reference", "reference"]);
    assert!(!said.contains("feedback"), "{said}");
    let (_, said) = response(&pulled, &[]);
    assert!(said.contains("feedback"), "{said}");
    let [re, im, std] = ["real", "imaginary", "std"].map(|k| numbers(&joint[k]));
    let [re0, im0, std0] = ["real", "imaginary", "std"].map(|k| numbers(&truth[k]));
    assert!(re.len() > 50 && re.len() == re0.len());
    // Both are estimates: their difference, in their deviations, is of a circular normal.
    let inside = (0..re.len())
        .filter(|&k| {
            let apart = (re[k] - re0[k]).hypot(im[k] - im0[k]);
            apart < 2.5 * std[k].hypot(std0[k])
        })
        .count();
    assert!(10 * inside >= 9 * re.len(), "{inside} of {}", re.len());
}

#[test]
fn a_response_is_fitted_compared_and_written() {
    let folder = Folder::new("frequency");
    let path = |name: &str| folder.path(name).display().to_string();
    let (data, page, table, json) = (
        path("run.csv"),
        path("page.html"),
        path("table.csv"),
        ["--json"],
    );
    let mut args = vec![
        "simulate",
        "--rig",
        "fong2014-emecs",
        "--input",
        "noise",
        "--amplitude",
        "0.5",
    ];
    args.extend(["--duration", "60", "--band", "0.2,15", "--output", &data]);
    answer(&args);
    let measure = [
        data.as_str(),
        "--band",
        "0.3,10",
        "--report",
        &page,
        "--csv",
        &table,
    ];
    for (what, more, columns) in [
        ("frf", &[][..], 7),
        ("tf", &["--orders", "1/3"][..], 9),
        ("compare", &["--rig", "fong2014-emecs"][..], 13),
    ] {
        for file in [&page, &table] {
            let _ = std::fs::remove_file(file);
        }
        let args = [&["identify", what][..], &measure, more, &json].concat();
        let (line, _) = answer(&args);
        assert_eq!(line["what"], "alpha / u");
        let page = std::fs::read_to_string(&page).expect("a page");
        assert!(page.starts_with("<!doctype html>") && page.contains("<polyline"));
        let table = std::fs::read_to_string(&table).expect("a table");
        let mut rows = table.lines().map(|l| l.split(',').collect::<Vec<_>>());
        assert_eq!(rows.next().map(|r| r.len()), Some(columns), "{table}");
        assert!(rows.clone().count() > 40);
        assert!(rows.all(|r| r.len() == columns && r.iter().all(|v| v.parse::<f64>().is_ok())));
    }
}
