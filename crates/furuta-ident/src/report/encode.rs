//! Recordings as data for the page's script: small, and exact enough for a chart.
//!
//! Angles and commands become 16-bit integers over their range, models the same as residuals (measured minus
//! predicted), so that a residual of a milliradian is not drowned by the angle's range.

use serde_json::{Value, json};

use crate::diagnose::result::RunCurves;

/// Numbers over all runs of a plot: about 2.7 characters each, so some 1.5 MB for the two plots together.
const BUDGET: usize = 300_000;
/// Series of a run: command, two angles, three models of two angles; and the time stamps, which count as two.
const SERIES: usize = 11;
/// The integer that stands for a value that is not there.
const GONE: i16 = i16::MIN;

/// Every how many samples are kept so that the runs fit the budget.
pub(super) fn stride(runs: &[RunCurves]) -> usize {
    let numbers: usize = runs.iter().map(|run| SERIES * run.t.len()).sum();
    numbers.div_ceil(BUDGET).max(1)
}

/// The runs as JSON that is safe inside a script element.
pub(super) fn runs(runs: &[RunCurves]) -> String {
    let stride = stride(runs);
    let runs: Value = runs.iter().map(|run| encode(run, stride)).collect();
    // `</script>` in a file's name must not end the element; in JSON a `<` only occurs in strings.
    runs.to_string().replace('<', "\\u003c")
}

fn encode(run: &RunCurves, stride: usize) -> Value {
    let keep = |values: &[f64]| -> Vec<f64> { values.iter().copied().step_by(stride).collect() };
    let measured = run.measured.each_ref().map(|values| keep(values));
    let residual = |model: &[Vec<f64>; 2]| -> Value {
        let pairs = measured.iter().zip(model);
        pairs
            .map(|(measured, model)| {
                let model = keep(model);
                let residual: Vec<f64> = measured
                    .iter()
                    .zip(&model)
                    .map(|(measured, model)| measured - model)
                    .collect();
                series(&residual)
            })
            .collect()
    };
    let times: Vec<u8> = keep(&run.t)
        .into_iter()
        .flat_map(|t| (t as f32).to_le_bytes())
        .collect();
    json!({
        "name": run.name,
        "t": base64(&times),
        "u": series(&keep(&run.u)),
        "unit": if run.unit.is_empty() { "V" } else { &run.unit },
        "measured": measured.iter().map(|values| series(values)).collect::<Value>(),
        "residual": {"nominal": residual(&run.nominal), "recalibrated": residual(&run.recalibrated),
            "augmented": residual(&run.augmented)},
        "restarts": run.restarts.iter().map(|index| index.div_ceil(stride)).collect::<Vec<_>>(),
    })
}

/// `{lo, hi, data}`, or null for a series that is not there. Time is little endian, as every machine is that shows the
/// page.
fn series(values: &[f64]) -> Value {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (
        finite().fold(f64::INFINITY, f64::min),
        finite().fold(f64::NEG_INFINITY, f64::max),
    );
    // Beyond this, a model that ran away would spoil the scale (and the difference could overflow).
    let (low, high) = (low.max(-1e6), high.min(1e6));
    if low > high {
        return Value::Null;
    }
    let per_step = 65_534.0 / if high > low { high - low } else { 1.0 };
    let integer = |value: f64| {
        if value.is_finite() {
            ((value.clamp(low, high) - low) * per_step - 32_767.0).round() as i16
        } else {
            GONE
        }
    };
    let data: Vec<u8> = values
        .iter()
        .flat_map(|&value| integer(value).to_le_bytes())
        .collect();
    json!({"lo": low, "hi": if high > low { high } else { low + 1.0 }, "data": base64(&data)})
}

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digit = |bits: u32| char::from(*ALPHABET.get((bits & 63) as usize).unwrap_or(&b'A'));
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = chunk
            .iter()
            .fold(0_u32, |bits, &byte| bits << 8 | u32::from(byte))
            << (8 * (3 - chunk.len()));
        text.push(digit(bits >> 18));
        text.push(digit(bits >> 12));
        text.push(if chunk.len() > 1 {
            digit(bits >> 6)
        } else {
            '='
        });
        text.push(if chunk.len() > 2 { digit(bits) } else { '=' });
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 4648, section 10.
    #[test]
    fn base64_of_the_standard() {
        let encoded =
            ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(|text| base64(text.as_bytes()));
        assert_eq!(
            encoded,
            [
                "", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"
            ]
        );
    }

    #[test]
    fn ends_of_the_range_and_what_is_not_there_are_kept() {
        let json = series(&[-2.0, 3.0, f64::NAN, 0.5]);
        assert_eq!(
            (json["lo"].as_f64(), json["hi"].as_f64()),
            (Some(-2.0), Some(3.0))
        );
        // -32767, 32767, -32768, 0 in little endian.
        assert_eq!(
            json["data"],
            base64(&[0x01, 0x80, 0xff, 0x7f, 0x00, 0x80, 0x00, 0x00])
        );
        assert!(series(&[]).is_null() && series(&[f64::NAN]).is_null());
        assert!(series(&[f64::MAX, -f64::MAX]).is_object());
    }

    #[test]
    fn long_recordings_are_thinned_to_the_budget_and_names_cannot_end_the_script() {
        let n = 200_000;
        let line = |k: usize| k as f64 * 1e-3;
        let series: Vec<f64> = (0..n).map(line).collect();
        let both = || [series.clone(), series.clone()];
        let run = RunCurves {
            name: "</script><b>".into(),
            t: series.clone(),
            u: series.clone(),
            measured: both(),
            nominal: both(),
            recalibrated: both(),
            augmented: both(),
            restarts: vec![0, 1000],
            unit: "rad/s2".into(),
            held_out: false,
        };
        let json = runs(&[run]);
        assert!(json.contains(r#""unit":"rad/s2""#));
        assert!(json.len() < 1_200_000, "{}", json.len());
        assert!(!json.contains("</script>"));
        assert_eq!(stride(&[RunCurves::default()]), 1);
    }
}
