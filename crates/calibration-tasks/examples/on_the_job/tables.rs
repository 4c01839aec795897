//! What the figures of all surveys say together.

use std::fmt::Write;

use calibration_tasks::{DiffRequest, diff};

use crate::points::{CLASSES, Squares};
use crate::survey::{Bench, LEVEL, MOVED_M, SurveyFigures};

/// All tables of these surveys.
pub fn tables(all: &[SurveyFigures], bench: &Bench) -> String {
    let mut text = String::new();
    let ratios: Vec<f64> = all.iter().map(|survey| survey.medians_m[0] / survey.medians_m[1]).collect();
    let largest = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (mean, _) = mean(&ratios);
    // Writing to a string can't fail.
    let _ = writeln!(text, "\nmedian error with own over true calibration: mean {mean:.3}, largest {largest:.3}");
    of_terms(&mut text, all);
    of_points(&mut text, all);
    of_checks(&mut text, all);
    of_pairs(&mut text, all, bench);
    text
}

/// Mean and its standard deviation.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (square / n).sqrt())
}

fn of_terms(text: &mut String, all: &[SurveyFigures]) {
    let _ =
        writeln!(text, "{:>6} {:>11} {:>11} {:>11} {:>12}", "term", "mean error", "scatter", "stated", "squared/var");
    let mut names: Vec<&String> = Vec::new();
    for (name, ..) in all.iter().flat_map(|survey| &survey.terms) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        let of_term = all.iter().flat_map(|survey| survey.terms.iter().filter(|term| term.0 == *name));
        let (errors, sigmas): (Vec<f64>, Vec<f64>) = of_term.map(|term| (term.1, term.2)).unzip();
        let n = errors.len() as f64;
        let (middle, of_middle) = mean(&errors);
        let stated = (sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>() / n).sqrt();
        let squares = errors.iter().zip(&sigmas).map(|(error, sigma)| (error / sigma).powi(2)).sum::<f64>() / n;
        let scatter = of_middle * n.sqrt();
        let _ = writeln!(text, "{name:>6} {middle:>11.2e} {scatter:>11.2e} {stated:>11.2e} {squares:>12.2}");
    }
    let ratios: Vec<f64> = all.iter().map(|survey| survey.of_truth.0 / survey.of_truth.1 as f64).collect();
    let (ratio, of_ratio) = mean(&ratios);
    let surveys = all.len();
    let _ = writeln!(
        text,
        "squared error over variance of all terms together, {surveys} surveys: {ratio:.2} +- {of_ratio:.2} (1 expected)"
    );
}

fn of_points(text: &mut String, all: &[SurveyFigures]) {
    let _ = writeln!(
        text,
        "points of the clouds: squared error over covariance, a direction (1 expected); beyond 5 sigma along the ray"
    );
    for (at, class) in CLASSES.iter().enumerate() {
        let ratios: Vec<f64> =
            all.iter().map(|survey| survey.points[at].squared / survey.points[at].directions).collect();
        let (ratio, of_ratio) = mean(&ratios);
        let sum = |count: fn(&Squares) -> usize| all.iter().map(|survey| count(&survey.points[at])).sum::<usize>();
        let off = 100.0 * sum(|of| of.off) as f64 / sum(|of| of.points) as f64;
        let _ = writeln!(text, "{class:>13} {ratio:>8.3} +- {of_ratio:.3} {off:>8.3} %");
    }
}

fn of_checks(text: &mut String, all: &[SurveyFigures]) {
    let count = |found: fn(&SurveyFigures) -> &Option<(f64, bool, bool)>| {
        let found = all.iter().filter_map(|survey| *found(survey));
        found.fold([0, 0, 0], |[all, moved, matters], found| {
            [all + 1, moved + u32::from(found.1), matters + u32::from(found.2)]
        })
    };
    let [checks, moved, matters] = count(|survey| &survey.of_earlier);
    let _ = writeln!(
        text,
        "`check` of the survey before's calibration: {checks}; moved at {LEVEL}: {moved}, and by what matters: {matters}"
    );
    let [checks, moved, matters] = count(|survey| &survey.of_moved);
    let by = 1e3 * MOVED_M;
    let _ =
        writeln!(text, "the same with d0 moved by {by} mm: {checks}; moved: {moved}, and by what matters: {matters}");
}

/// The test of `check` between the own calibrations of all pairs of surveys, and of those pairs that have no survey in common.
fn of_pairs(text: &mut String, all: &[SurveyFigures], bench: &Bench) {
    let (mut pairs, mut alone) = ([0, 0], [0, 0]);
    for (k, survey) in all.iter().enumerate() {
        for (j, other) in all[..k].iter().enumerate() {
            let request = DiffRequest { first: bench.own(other.seed), second: bench.own(survey.seed), level: LEVEL };
            let Some(joint) = diff(&request).ok().and_then(|found| found.joint) else { continue };
            let of_these = [1, u32::from(joint.significant)];
            pairs.iter_mut().zip(of_these).for_each(|(sum, one)| *sum += one);
            if k % 2 == 1 && j + 1 == k {
                alone.iter_mut().zip(of_these).for_each(|(sum, one)| *sum += one);
            }
        }
    }
    let [of_pairs, of_alone] = [pairs, alone].map(|[all, moved]: [u32; 2]| 100.0 * f64::from(moved) / f64::from(all));
    let _ = writeln!(
        text,
        "own calibrations of two surveys differ at {LEVEL}: {of_pairs:.1} % of all {} pairs; {of_alone:.1} % of {} pairs that have no \
         survey in common",
        pairs[0], alone[0]
    );
}
