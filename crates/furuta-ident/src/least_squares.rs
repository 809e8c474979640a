//! Levenberg and Marquardt's method, for every nonlinear least-squares problem of this crate.
//!
//! A problem says what a place costs, how it looks when it is linearised there, and where a step leads. The method
//! decides how far to trust the linear model: a step that lowers the cost is taken and the damping eased, one that does
//! not is repeated with more damping.

/// What the method minimises, over places: parameters, with what was computed there.
pub(crate) trait LeastSquares<Place> {
    /// The problem linearised at a place.
    type Linear;
    /// A step away from a place.
    type Step;

    /// The sum of squares at a place.
    fn cost(&self, place: &Place) -> f64;

    /// The problem linearised at a place, which may hold that already.
    fn linearise(&self, place: &mut Place) -> Self::Linear;

    /// The same at another place, by what was found at the place `before`; `None` where that says nothing of it.
    fn again(&self, place: &mut Place, before: Self::Linear) -> Option<Self::Linear> {
        let _ = (place, before);
        None
    }

    /// The damped step, and by how much the linear model says that it lowers the cost. `None` where there is none.
    fn step(&self, place: &Place, linear: &Self::Linear, damping: f64)
    -> Option<(Self::Step, f64)>;

    /// Where a step leads. After the `last` one nothing is linearised.
    fn trial(&self, place: &Place, linear: &Self::Linear, step: &Self::Step, last: bool) -> Place;

    /// Whether to try a step that is predicted to lower the cost by `predicted`, after `iteration` others.
    fn is_worth_a_step(&self, place: &Place, predicted: f64, iteration: usize) -> bool {
        let _ = (place, predicted, iteration);
        true
    }

    /// Called for each place that was reached, which it may improve; whether to go on after `gain`.
    fn reached(&self, place: &mut Place, gain: f64, iteration: usize) -> bool;

    /// Called where no step helps; whether the place was improved otherwise, and steps are tried again.
    fn mend(&self, place: &mut Place) -> bool {
        let _ = place;
        false
    }
}

/// A step by an older linear form is to gain less than this share of what the last step gained, or it is found anew:
/// what all further ones gain, a geometric series, is then less than a third of the last.
pub(crate) const CONTRACTION: f64 = 0.25;

/// How the damping changes, and when the method ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    /// Steps that are tried.
    pub(crate) iterations: usize,
    /// Damping of the first step, in units of the curvature.
    pub(crate) damping: f64,
    /// A step taken eases the damping by this factor, down to the second number.
    pub(crate) ease: (f64, f64),
    /// A step refused multiplies the damping by this factor, to the second number at least.
    pub(crate) stiffen: (f64, f64),
    /// Beyond this damping no step helps.
    pub(crate) most: f64,
    /// A refused step that was predicted to gain less than this share of the cost ends the method.
    pub(crate) abandoned: f64,
}

/// The best place found from `start`, and the problem linearised there, or before a last step that was not worth
/// another; `None` where the steps ran out.
pub(crate) fn minimise<Place, P: LeastSquares<Place>>(
    problem: &P,
    start: Place,
    rules: &Rules,
) -> (Place, Option<P::Linear>) {
    let mut here = start;
    let mut damping = rules.damping;
    let mut linear = problem.linearise(&mut here);
    // Whether it was found elsewhere: the end of the method, and a step that does not help, are judged by one that was
    // not.
    let mut old = false;
    for iteration in 0..rules.iterations {
        let Some((step, predicted)) = problem.step(&here, &linear, damping) else {
            break;
        };
        if !problem.is_worth_a_step(&here, predicted, iteration) {
            break;
        }
        let last = iteration + 1 == rules.iterations;
        let before = problem.cost(&here);
        let mut trial = problem.trial(&here, &linear, &step, last);
        let gain = before - problem.cost(&trial);
        if gain > 0.0 {
            let on = problem.reached(&mut trial, gain, iteration);
            here = trial;
            damping = (damping * rules.ease.0).max(rules.ease.1);
            if last {
                return (here, None);
            }
            if on {
                let again = problem.again(&mut here, linear);
                let leads_on = |again: &P::Linear| {
                    let step = problem.step(&here, again, rules.ease.1);
                    step.is_none_or(|(_, predicted)| predicted < CONTRACTION * gain)
                };
                let again = again.filter(leads_on);
                old = again.is_some();
                linear = again.unwrap_or_else(|| problem.linearise(&mut here));
            } else if std::mem::take(&mut old) {
                linear = problem.linearise(&mut here);
            } else {
                break;
            }
        } else if std::mem::take(&mut old) {
            linear = problem.linearise(&mut here);
        } else {
            damping = (damping * rules.stiffen.0).max(rules.stiffen.1);
            if predicted.abs() < rules.abandoned * before || damping > rules.most {
                if !problem.mend(&mut here) {
                    break;
                }
                damping = rules.damping;
                linear = problem.linearise(&mut here);
            }
        }
    }
    (here, Some(linear))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x² + astray`: steps move `x` alone.
    struct Parabola;

    struct At {
        x: f64,
        astray: f64,
    }

    impl LeastSquares<At> for Parabola {
        type Linear = f64;
        type Step = f64;

        fn cost(&self, at: &At) -> f64 {
            at.x * at.x + at.astray
        }

        fn linearise(&self, at: &mut At) -> f64 {
            at.x
        }

        fn step(&self, _: &At, slope: &f64, damping: f64) -> Option<(f64, f64)> {
            let step = slope / (1.0 + damping);
            Some((step, step * slope))
        }

        fn trial(&self, at: &At, _: &f64, step: &f64, _: bool) -> At {
            At {
                x: at.x - step,
                ..*at
            }
        }

        fn reached(&self, _: &mut At, _: f64, _: usize) -> bool {
            true
        }

        fn mend(&self, at: &mut At) -> bool {
            std::mem::take(&mut at.astray) > 0.0
        }
    }

    /// `x²`, whose older linear forms lead to [`Led::ASTRAY`] in half steps.
    struct Led;

    impl Led {
        const ASTRAY: f64 = 0.5;
    }

    impl LeastSquares<f64> for Led {
        type Linear = f64;
        type Step = f64;

        fn cost(&self, x: &f64) -> f64 {
            x * x
        }

        fn linearise(&self, x: &mut f64) -> f64 {
            *x
        }

        fn again(&self, x: &mut f64, _: f64) -> Option<f64> {
            Some(*x - Self::ASTRAY)
        }

        fn step(&self, _: &f64, slope: &f64, _: f64) -> Option<(f64, f64)> {
            let step = 0.5 * slope;
            Some((step, step * slope))
        }

        fn trial(&self, x: &f64, _: &f64, step: &f64, _: bool) -> f64 {
            x - step
        }

        fn reached(&self, _: &mut f64, gain: f64, _: usize) -> bool {
            gain > 1e-6
        }
    }

    #[test]
    fn the_end_is_judged_by_a_linear_form_that_was_found_there() {
        let rules = Rules {
            iterations: 100,
            ..RULES
        };
        let (end, _) = minimise(&Led, 3.0, &rules);
        assert!(end.abs() < 1e-2, "{end}");
    }

    const RULES: Rules = Rules {
        iterations: 40,
        damping: 1e-3,
        ease: (0.2, 1e-8),
        stiffen: (8.0, 1e-4),
        most: 1e4,
        abandoned: 1e-5,
    };

    #[test]
    fn steps_go_to_the_minimum_and_where_none_helps_the_place_is_mended() {
        for x in [3.0, 0.0] {
            let (end, _) = minimise(&Parabola, At { x, astray: 1.0 }, &RULES);
            assert!(
                end.x.abs() < 1e-6 && end.astray == 0.0,
                "{} {}",
                end.x,
                end.astray
            );
        }
    }
}
