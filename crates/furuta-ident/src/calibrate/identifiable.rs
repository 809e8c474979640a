//! What recordings can tell, before anything is fitted: from the Fisher information, scaled by each parameter's size.
//!
//! With all parameters counted in their own sizes and the initial states eliminated, an eigenvalue of the information
//! is one over the squared relative standard deviation of its eigenvector's combination. Where two parameters change
//! the motion in the same way, the matrix is singular, and how one can be replaced by others is a regression within it.

use nalgebra::{DMatrix, DVector};

use crate::answer::significant;

use super::result::{Direction, Held, Identifiability, Partner, Why};

/// Relative standard deviation up to which a parameter is fitted without being asked for.
const UNASKED: f64 = 0.2;
/// The same for one that was asked for.
const ASKED: f64 = 1.0;
/// A parameter of which this share of the information is left beside others (in squares) is its own.
const OWN: f64 = 1e-7;
/// Alone, a parameter that would be known no better than to this many times itself does not show.
const SHOWS: f64 = 10.0;
/// Eigenvalues below this share of the largest are rounding.
const ROUNDING: f64 = 1e-11;
/// A partner that changes by less than this for one per cent of the other is not spoken of.
const PARTNER: f64 = 0.02;

/// Who is asked about, and how.
pub(super) struct Question<'a> {
    /// Keys of all parameters.
    pub(super) keys: Vec<&'a str>,
    /// In which order they are to be fitted if they can be; the others are only reported.
    pub(super) order: Vec<usize>,
    /// Whether a person named them.
    pub(super) asked: bool,
}

/// Which parameters to fit, and why not the others.
pub(super) fn select(
    question: &Question<'_>,
    information: &DMatrix<f64>,
) -> (Vec<usize>, Identifiability) {
    let known_enough = if question.asked { ASKED } else { UNASKED };
    let mut free: Vec<usize> = Vec::new();
    for &i in &question.order {
        let Some((_, left)) = beside(information, &free, i) else {
            continue;
        };
        if left <= OWN * information[(i, i)] {
            continue;
        }
        let mut more = free.clone();
        more.push(i);
        let known = deviations(information, &more);
        if known.is_some_and(|std| std.iter().all(|s| *s < known_enough)) {
            free = more;
        }
    }
    let held = (0..question.keys.len())
        .filter(|i| !free.contains(i))
        .map(|i| held(question, information, &free, i))
        .collect();
    (free.clone(), report(question, information, &free, held))
}

/// How parameter `i` is imitated by `free` (their changes for a change of it), and the information left then.
fn beside(information: &DMatrix<f64>, free: &[usize], i: usize) -> Option<(DVector<f64>, f64)> {
    let own = information[(i, i)];
    if free.is_empty() {
        return Some((DVector::zeros(0), own));
    }
    let n = free.len();
    let among = DMatrix::from_fn(n, n, |a, b| information[(free[a], free[b])]);
    let cross = DVector::from_fn(n, |a, _| information[(free[a], i)]);
    let imitation = among.cholesky()?.solve(&cross);
    let left = own - cross.dot(&imitation);
    Some((imitation, left))
}

/// Relative standard deviations of `free`, all fitted together.
pub(super) fn deviations(information: &DMatrix<f64>, free: &[usize]) -> Option<Vec<f64>> {
    let n = free.len();
    let among = DMatrix::from_fn(n, n, |a, b| information[(free[a], free[b])]);
    let inverse = among.cholesky()?.inverse();
    Some((0..n).map(|i| inverse[(i, i)].sqrt()).collect())
}

fn held(question: &Question<'_>, information: &DMatrix<f64>, free: &[usize], i: usize) -> Held {
    let key = question.keys[i].to_owned();
    let alone = 1.0 / information[(i, i)].max(1e-300).sqrt();
    let (imitation, left) = beside(information, free, i).unwrap_or((DVector::zeros(0), 0.0));
    let freed = 1.0 / left.max(1e-300).sqrt();
    let partners: Vec<Partner> = free
        .iter()
        .zip(imitation.iter())
        .filter(|(_, change)| change.abs() > PARTNER)
        .map(|(&f, change)| Partner {
            key: question.keys[f].to_owned(),
            change: *change,
        })
        .collect();
    let (why, sentence) = if alone >= SHOWS {
        (
            Why::NoInfluence,
            format!("{key} does not show in these recordings"),
        )
    } else if left <= OWN * information[(i, i)] {
        (Why::OnlyTogether, together(&key, &partners))
    } else if !question.order.contains(&i) {
        (
            Why::NotAsked,
            format!(
                "{key}: would be known to {} if named with --free",
                per_cent(freed)
            ),
        )
    } else {
        (
            Why::TooWeak,
            format!(
                "{key} shows too weakly: fitted as well, it would be known to {} only",
                per_cent(freed)
            ),
        )
    };
    Held {
        key,
        why,
        partners,
        alone,
        freed,
        sentence,
    }
}

/// In words, what a held parameter can be exchanged for.
fn together(key: &str, partners: &[Partner]) -> String {
    if let [one] = partners {
        if (one.change - 1.0).abs() < PARTNER {
            return format!("{key} and {}: only their product shows", one.key);
        }
        if (one.change + 1.0).abs() < PARTNER {
            return format!("{key} and {}: only their ratio shows", one.key);
        }
    }
    let changes: Vec<String> = partners
        .iter()
        .map(|p| format!("{:+.2} % {}", p.change, p.key))
        .collect();
    if changes.is_empty() {
        return format!("{key} does not show beside what is fitted");
    }
    format!("1 % more {key} looks like {}", changes.join(", "))
}

fn report(
    question: &Question<'_>,
    information: &DMatrix<f64>,
    free: &[usize],
    held: Vec<Held>,
) -> Identifiability {
    let n = question.keys.len();
    let eigen = information.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let rank = order
        .iter()
        .filter(|&&i| eigen.eigenvalues[i] > ROUNDING * largest)
        .count();
    let directions = order
        .iter()
        .take(rank)
        .map(|&i| {
            let vector = eigen.eigenvectors.column(i);
            direction(
                question,
                1.0 / eigen.eigenvalues[i].sqrt(),
                vector.as_slice(),
            )
        })
        .collect();
    Identifiability {
        rank,
        parameters: n,
        condition: condition(information, free),
        directions,
        held,
    }
}

/// Condition number of the scaled sensitivities of `free`.
fn condition(information: &DMatrix<f64>, free: &[usize]) -> f64 {
    if free.is_empty() {
        return f64::NAN;
    }
    let n = free.len();
    let own =
        DMatrix::from_fn(n, n, |a, b| information[(free[a], free[b])]).symmetric_eigenvalues();
    (own.max() / own.min()).sqrt()
}

/// An eigenvector as a product of powers.
fn direction(question: &Question<'_>, std: f64, vector: &[f64]) -> Direction {
    const LEAST: f64 = 0.15;
    let mut parts: Vec<(usize, f64)> = vector.iter().copied().enumerate().collect();
    parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let sign = parts.first().map_or(1.0, |p| p.1.signum());
    let exponents: Vec<Partner> = parts
        .iter()
        .filter(|p| p.1.abs() > LEAST)
        .map(|(i, e)| Partner {
            key: question.keys[*i].to_owned(),
            change: sign * e,
        })
        .collect();
    let words: Vec<String> = exponents
        .iter()
        .map(|p| format!("{}^{:.2}", p.key, p.change))
        .collect();
    Direction {
        std,
        words: words.join(" · "),
        exponents,
    }
}

/// `12 %`, with as many digits as say something.
pub(super) fn per_cent(relative: f64) -> String {
    let x = 100.0 * relative;
    if x.is_finite() && x < 1e4 {
        format!("±{} %", significant(x, 2))
    } else {
        "no better than a hundredfold".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two numbers of which only the product shows, and a third on its own.
    fn product() -> DMatrix<f64> {
        let rows = [[1.0, 1.0, 0.2], [0.9, 0.9, -0.5], [0.3, 0.3, 1.0]];
        let j = DMatrix::from_fn(3, 3, |a, b| 100.0 * rows[a][b]);
        j.transpose() * j
    }

    #[test]
    fn a_product_is_named_as_one() {
        let question = Question {
            keys: vec!["a", "b", "c"],
            order: vec![0, 1, 2],
            asked: false,
        };
        let (free, report) = select(&question, &product());
        assert_eq!(free, [0, 2]);
        assert_eq!(report.rank, 2);
        assert_eq!(report.held.len(), 1);
        assert_eq!(report.held[0].why, Why::OnlyTogether);
        assert_eq!(report.held[0].sentence, "b and a: only their product shows");
    }

    #[test]
    fn the_condition_is_that_of_what_is_fitted() {
        let question = Question {
            keys: vec!["a", "b"],
            order: vec![0, 1],
            asked: false,
        };
        let information = DMatrix::from_diagonal(&DVector::from_vec(vec![1e6, 1e4]));
        let (free, report) = select(&question, &information);
        assert_eq!(free, [0, 1]);
        assert!((report.condition - 10.0).abs() < 1e-9);
        assert!((report.directions[0].std - 1e-3).abs() < 1e-12);
    }
}
