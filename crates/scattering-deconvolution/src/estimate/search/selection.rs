//! How many Gaussians there are, and whether the captures tell.

use crate::estimate::result::{Ambiguity, Candidate};
use crate::estimate::search::fit::{Fit, Problem, StartTerm, Unknown};
use crate::estimate::search::start::Dictionary;
use crate::estimate::{EstimationOptions, TermCount};

/// Standard deviation of the logarithm of a width beyond which the width is not known: a factor of 1.4 either way. A
/// choice; a larger one states widths that another capture contradicts.
const LARGEST_LOG_DEVIATION: f64 = 0.35;
/// Share of the longer side of the image from which on a width that is not known is one that the image is too small
/// for. A choice; it decides between two verdicts on a width and no number.
const WIDE: f64 = 0.4;
/// By how much Schwarz's criterion has to be better for an adjustment that was refused to be missed. Odds of 150 to 1
/// `[Schwarz1978]`.
const MISSED: f64 = 10.0;

/// The adjustment that was chosen.
pub(in crate::estimate) struct Choice {
    pub(in crate::estimate) fit: Fit,
    /// Whether its widest width was held.
    pub(in crate::estimate) reduced: bool,
    /// What is not known.
    pub(in crate::estimate) ambiguity: Option<Ambiguity>,
    pub(in crate::estimate) candidates: Vec<Candidate>,
}

/// Tries the numbers of Gaussians asked for and takes the best that is determined.
pub(in crate::estimate) fn choose(problem: &Problem<'_>, dictionary: &Dictionary) -> Result<Choice, adjust::Error> {
    let empty = problem.fit_nothing()?;
    let mut candidates = vec![candidate(0, Ok(&empty), None)];
    let counts = match problem.options.terms {
        TermCount::AtMost(most) => 1..=most,
        TermCount::Exactly(count) => count..=count,
    };
    let exact = matches!(problem.options.terms, TermCount::Exactly(_));
    let mut best: Option<Choice> = None;
    let mut missed: Option<(f64, Ambiguity)> = None;
    for count in counts {
        let known = best.as_ref().map(|best| best.fit.bic());
        if !exact && !dictionary.promises_more(problem, best.as_ref().map_or(&empty, |best| &best.fit)) {
            break;
        }
        for (fit, reduced) in attempts(problem, dictionary, count) {
            let refused = match &fit {
                Ok(fit) => refusal(fit, problem),
                Err(failure) => Some(*failure),
            };
            candidates.push(candidate(count, fit.as_ref().map_err(|failure| *failure), refused));
            match (fit, refused) {
                (Ok(fit), None) if best.as_ref().is_none_or(|best| fit.bic() < best.fit.bic()) => {
                    let ambiguity = reduced.then_some(Ambiguity::WidthBeyondImage);
                    best = Some(Choice { fit, reduced, ambiguity, candidates: Vec::new() });
                }
                (Ok(fit), Some(why)) if missed.is_none_or(|(bic, _)| fit.bic() < bic) => {
                    missed = Some((fit.bic(), why));
                }
                (Err(why), _) if missed.is_none() => missed = Some((f64::INFINITY, why)),
                _ => {}
            }
        }
        // Where one Gaussian more is not determined or does not pay, two more are not and do not.
        if best.as_ref().map(|best| best.fit.bic()) == known {
            break;
        }
    }
    let none = || {
        // Where a number is asked for, its failure is the answer; otherwise only one that would have explained much.
        let explains = |bic: f64| bic < empty.bic() - MISSED;
        let ambiguity = missed.filter(|(bic, _)| exact || explains(*bic)).map(|(_, why)| why);
        Choice { fit: empty.clone(), reduced: false, ambiguity, candidates: Vec::new() }
    };
    let chosen = best.filter(|best| exact || best.fit.bic() < empty.bic()).unwrap_or_else(none);
    Ok(Choice { candidates, ..chosen })
}

/// The adjustment with free widths and, where the image is too small for the widest, the one with that width held.
fn attempts(problem: &Problem<'_>, dictionary: &Dictionary, count: usize) -> Vec<(Result<Fit, Ambiguity>, bool)> {
    let Some(start) = dictionary.start(count) else { return vec![(Err(Ambiguity::NoFit), false)] };
    let free = problem.fit(&start).map_err(|error| match error {
        adjust::Error::RankDeficient { .. } => Ambiguity::TermsIndistinguishable,
        _ => Ambiguity::NoFit,
    });
    let too_wide = match &free {
        Ok(fit) => refusal(fit, problem) == Some(Ambiguity::WidthBeyondImage),
        Err(_) => true,
    };
    let mut out = vec![(free, false)];
    if too_wide {
        let held = problem.fit(&with_widest_held(&start, problem));
        // Held or not, these Gaussians do not fit: that was said already.
        out.extend(held.ok().map(|fit| (Ok(fit), true)));
    }
    out
}

/// The widest Gaussian as wide as the image is long.
fn with_widest_held(start: &[StartTerm], problem: &Problem<'_>) -> Vec<StartTerm> {
    let mut out = start.to_vec();
    if let Some(widest) = out.iter_mut().max_by(|a, b| a.term.sigma_px[0].total_cmp(&b.term.sigma_px[0])) {
        let ratio = problem.longer_side / widest.term.sigma_px[0];
        widest.term.sigma_px = [problem.longer_side; 2];
        // What matters is the light that a pixel gets, weight over width squared.
        widest.term.weight = (widest.term.weight * ratio * ratio).min(0.5);
        widest.unknown = Unknown::Weight;
    }
    out
}

/// Why the parameters of an adjustment are not known, where they are not.
fn refusal(fit: &Fit, problem: &Problem<'_>) -> Option<Ambiguity> {
    let EstimationOptions { significance, .. } = *problem.options;
    let per_term = 1 + problem.options.widths_per_term();
    let doubts = fit.terms.iter().enumerate().filter_map(|(index, term)| {
        let first = index * per_term;
        let log_deviation =
            |axis: usize| fit.sigma(first + 1 + axis) / term.sigma_px[axis.min(term.sigma_px.len() - 1)];
        let width_unknown = (0..per_term - 1).any(|axis| log_deviation(axis) > LARGEST_LOG_DEVIATION);
        let weight_unknown = term.weight < significance * fit.sigma(first);
        let wide = term.sigma_px.iter().any(|sigma| *sigma > WIDE * problem.longer_side);
        match (term.weight > 0.0, width_unknown || weight_unknown) {
            (false, _) => Some(Ambiguity::NoFit),
            (true, false) => None,
            (true, true) if wide => Some(Ambiguity::WidthBeyondImage),
            (true, true) => Some(Ambiguity::TermsIndistinguishable),
        }
    });
    // Width before weight: where a Gaussian is too wide, the others look worse than they are.
    doubts.min_by_key(|doubt| u8::from(*doubt != Ambiguity::WidthBeyondImage))
}

fn candidate(terms: usize, fit: Result<&Fit, Ambiguity>, refused: Option<Ambiguity>) -> Candidate {
    let (bic, sigma0) = fit.map_or((f64::NAN, f64::NAN), |fit| (fit.bic(), fit.sigma0));
    Candidate { terms, bic, sigma0, refused }
}
