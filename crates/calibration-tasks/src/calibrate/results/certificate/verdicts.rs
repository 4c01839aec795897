//! What each test says, in words, and where its values stand.

use error_models::ParameterStatus;
use nalgebra::{DMatrix, DVector};
use self_calibration::{CalibrationOutcome, GlobalTest, GlobalVerdict, Verdict};
use serde::Serialize;
use statistics::Distribution;

use crate::calibrate::CalibrationSummary;
use crate::calibrate::results::certificate::HeldOut;

/// Level of the joint test of a group of terms.
const TERM_LEVEL: f64 = 0.05;
/// Rejected values that are listed with their lines.
const LISTED: usize = 40;
/// Terms that are tested together: those that networks hardly tell apart.
const TERM_GROUPS: [(&str, &[&str]); 7] = [
    ("principal point", &["xp", "yp"]),
    ("radial distortion", &["k1", "k2", "k3"]),
    ("decentring distortion", &["p1", "p2"]),
    ("affinity and shear", &["b1", "b2"]),
    ("offset and waves of the range error", &["d0", "d2", "d3", "d4", "d5", "d6", "d7"]),
    ("tilt of the range error over the image", &["e1", "e2"]),
    ("range error by amplitude", &["h1", "h2", "h3"]),
];

/// The verdict of one test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TestVerdict {
    /// What was tested.
    pub test: String,
    /// Whether it passed; `None` where nothing passes or fails, or was not tested.
    pub passed: Option<bool>,
    /// What was found, in words.
    pub words: String,
    /// Which rows of `residuals.csv` it rests on.
    pub rows: String,
}

impl TestVerdict {
    fn new(test: impl Into<String>, passed: Option<bool>, words: String, rows: String) -> Self {
        Self { test: test.into(), passed, words, rows }
    }
}

/// All verdicts, in the order in which a calibration is judged.
pub(crate) fn verdicts(
    outcome: &CalibrationOutcome,
    summary: &CalibrationSummary,
    hold_out: &HeldOut,
) -> Vec<TestVerdict> {
    let mut all = global(outcome);
    all.push(rejections(outcome));
    all.push(uncontrolled(outcome));
    all.extend(groups_of_terms(outcome));
    all.extend(summary.trends.iter().map(|trend| {
        let words = format!("{}{}", trend.verdict, trend.p_value.map_or(String::new(), |p| format!(" (p = {p:.3})")));
        let rows = "component `range`, verdict `used`".to_owned();
        TestVerdict::new(format!("range residuals against {}", trend.variable), Some(!trend.is_trend()), words, rows)
    }));
    all.extend(hold_out_verdicts(hold_out));
    let doubts = summary.doubts.iter().map(|doubt| {
        let words = doubt.to_string();
        TestVerdict::new("doubt", Some(false), words, "all".to_owned())
    });
    all.extend(doubts);
    all
}

/// Rows of a global test: of all values, or of a group by its name.
fn rows_of(subject: &str, outcome: &CalibrationOutcome) -> String {
    let used = |quality: &&self_calibration::ObservationQuality| {
        matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled)
    };
    let is_group = outcome.groups.iter().any(|group| group.name == subject);
    let rows = outcome.residuals.iter().filter(used).filter(|q| !is_group || q.component.name() == subject).count();
    let group = if is_group { format!("component `{subject}` and ") } else { String::new() };
    format!("{rows} rows with {group}verdict `used` or `uncontrolled`: sum of (residual / sigma)²")
}

fn global(outcome: &CalibrationOutcome) -> Vec<TestVerdict> {
    let tests = outcome.global_tests();
    if tests.is_empty() {
        let words = "not tested: there is no redundancy".to_owned();
        return vec![TestVerdict::new("standard deviations of all observations", None, words, "all".to_owned())];
    }
    let verdict = |test: &GlobalTest| {
        let rows = rows_of(&test.subject, outcome);
        let passed = test.verdict == GlobalVerdict::AsStated;
        TestVerdict::new(format!("standard deviations of {}", test.subject), Some(passed), test.to_string(), rows)
    };
    tests.iter().map(verdict).collect()
}

/// Line of a row of `residuals.csv`, whose first line is its head.
fn line(row: usize) -> usize {
    row + 2
}

fn rejections(outcome: &CalibrationOutcome) -> TestVerdict {
    let rejected = outcome.residuals.iter().enumerate().filter(|(_, quality)| quality.verdict == Verdict::Rejected);
    let lines: Vec<String> = rejected.map(|(row, _)| line(row).to_string()).collect();
    let words = match lines.len() {
        0 => "no value was rejected as a gross error".to_owned(),
        count => {
            format!("{count} of {} values were rejected as gross errors and took no part", outcome.residuals.len())
        }
    };
    let more = lines.len().saturating_sub(LISTED);
    let rows = if lines.is_empty() {
        "none with verdict `rejected`".to_owned()
    } else {
        format!("verdict `rejected`: lines {}", lines[..lines.len().min(LISTED)].join(", "))
    };
    let rows = if more > 0 { format!("{rows} and {more} more") } else { rows };
    TestVerdict::new("gross errors", None, words, rows)
}

fn uncontrolled(outcome: &CalibrationOutcome) -> TestVerdict {
    let count = outcome.residuals.iter().filter(|quality| quality.verdict == Verdict::Uncontrolled).count();
    let words = match count {
        0 => "every value used is checked by others".to_owned(),
        count => format!("{count} values are used that nothing checks: a gross error in them would not be found"),
    };
    TestVerdict::new("mutual control", Some(count == 0), words, "verdict `uncontrolled`".to_owned())
}

/// Joint tests of the estimated terms of each group (Wald): whether all of them may be zero.
fn groups_of_terms(outcome: &CalibrationOutcome) -> Vec<TestVerdict> {
    let mut all = Vec::new();
    let mut times: Vec<&str> =
        outcome.estimated.iter().map(|name| name.split_once('@').map_or("", |part| part.1)).collect();
    times.sort_unstable();
    times.dedup();
    for (name, members) in TERM_GROUPS {
        for time in &times {
            let is_member = |of: &str| {
                let (base, own) = of.split_once('@').unwrap_or((of, ""));
                own == *time && members.contains(&base)
            };
            let places: Vec<usize> =
                (0..outcome.estimated.len()).filter(|k| is_member(&outcome.estimated[*k])).collect();
            all.extend(joint(outcome, name, &places));
        }
    }
    all
}

fn joint(outcome: &CalibrationOutcome, name: &str, places: &[usize]) -> Option<TestVerdict> {
    let names: Vec<&str> = places.iter().map(|place| outcome.estimated[*place].as_str()).collect();
    let value = |name: &str| {
        let of = |parameter: &&self_calibration::CalibratedParameter| {
            parameter.name == name && parameter.status == ParameterStatus::Estimated
        };
        outcome.parameters.iter().find(of).map(|parameter| parameter.value)
    };
    let values = DVector::from_vec(names.iter().map(|name| value(name)).collect::<Option<Vec<f64>>>()?);
    if values.is_empty() {
        return None;
    }
    let sigmas: Vec<f64> = places.iter().map(|place| outcome.covariance[(*place, *place)].sqrt()).collect();
    // Coefficients of very different sizes: the correlation matrix is what can be inverted.
    let correlation = DMatrix::from_fn(places.len(), places.len(), |i, j| {
        outcome.covariance[(places[i], places[j])] / (sigmas[i] * sigmas[j])
    });
    let scaled = DVector::from_fn(values.len(), |i, _| values[i] / sigmas[i]);
    let statistic = scaled.dot(&correlation.cholesky()?.solve(&scaled));
    let p = Distribution::ChiSquared { dof: values.len() as f64 }.survival(statistic);
    let p_words = if p < 1e-3 { format!("p = {p:.0e}") } else { format!("p = {p:.3}") };
    let words = if p < TERM_LEVEL {
        format!("{} differ from zero together ({p_words})", names.join(", "))
    } else {
        format!("{} may all be zero ({p_words}): the observations do not show them", names.join(", "))
    };
    Some(TestVerdict::new(format!("significance: {name}"), None, words, "all: covariance of the parameters".to_owned()))
}

fn hold_out_verdicts(hold_out: &HeldOut) -> Vec<TestVerdict> {
    let test = "prediction of stations left out";
    match hold_out {
        HeldOut::NotMade { reason } => {
            vec![TestVerdict::new(test, None, format!("not made: {reason}"), "none".to_owned())]
        }
        HeldOut::Made(check) => {
            let rows = format!("stations {}", check.stations.join(", "));
            let parts = [("image points", Some(&check.image)), ("ranges", check.range.as_ref())];
            parts
                .into_iter()
                .filter_map(|(what, part)| Some((what, part?)))
                .map(|(what, part)| {
                    let passed = part.test.as_ref().map(|_| !part.fails);
                    TestVerdict::new(format!("{test}: {what}"), passed, part.to_string(), rows.clone())
                })
                .collect()
        }
    }
}
