//! Numbers as text and JSON.

use nalgebra::{Complex, SMatrix};
use serde_json::{Value, json};

/// `-3.4 +- 2.4i`-like text for poles: conjugate pairs once, sorted from slow to fast.
pub(crate) fn poles(poles: &[Complex<f64>]) -> String {
    let mut sorted = poles.to_vec();
    sorted.sort_by(|p, q| q.re.total_cmp(&p.re).then(q.im.total_cmp(&p.im)));
    let texts: Vec<String> = sorted
        .iter()
        .filter(|p| p.im >= 0.0)
        .map(|p| {
            if p.im > 0.0 {
                format!("{} ± {}i", significant(p.re), significant(p.im))
            } else {
                significant(p.re)
            }
        })
        .collect();
    texts.join(", ")
}

/// Six significant digits without trailing zeros.
pub(crate) fn significant(x: f64) -> String {
    // Rounding noise of an eigenvalue at zero is not a digit.
    if x.abs() < 1e-9 {
        return "0".to_owned();
    }
    let digits = (5 - x.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Rows of right-aligned columns, each line indented.
pub(crate) fn matrix<const N: usize, const M: usize>(m: &SMatrix<f64, N, M>) -> String {
    let texts: Vec<Vec<String>> = m
        .row_iter()
        .map(|row| row.iter().map(|x| significant(*x)).collect())
        .collect();
    let width = texts.iter().flatten().map(String::len).max().unwrap_or(0);
    texts
        .iter()
        .map(|row| {
            let cells: Vec<String> = row.iter().map(|t| format!("{t:>width$}")).collect();
            format!("    {}\n", cells.join("  "))
        })
        .collect()
}

/// `[[re, im], ...]`.
pub(crate) fn poles_json(poles: &[Complex<f64>]) -> Value {
    poles.iter().map(|p| json!([p.re, p.im])).collect()
}

/// Rows of numbers.
pub(crate) fn matrix_json<const N: usize, const M: usize>(m: &SMatrix<f64, N, M>) -> Value {
    m.row_iter()
        .map(|row| row.iter().copied().collect::<Value>())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{poles, significant};
    use nalgebra::Complex;

    #[test]
    fn digits() {
        assert_eq!(significant(57.626_013), "57.626");
        assert_eq!(significant(-0.001_234_567_8), "-0.00123457");
        assert_eq!(significant(1e7), "10000000");
        assert_eq!(significant(-3e-17), "0");
    }

    #[test]
    fn pairs_are_written_once() {
        let p = [
            Complex::new(-5.0, -2.5),
            Complex::new(0.0, 0.0),
            Complex::new(-5.0, 2.5),
        ];
        assert_eq!(poles(&p), "0, -5 ± 2.5i");
    }
}
