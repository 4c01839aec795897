//! The certificate of a rig: what holds for all cameras together. Each camera has one of its own beside its calibration.

use calibration_tasks::{HeldOut, HeldOutPart, TestVerdict};
use commands::{Doubt, DoubtKind, InputDigest};
use report::{Column, Document};
use serde::Serialize;
use statistics::{Distribution, bonferroni};

use crate::summary::{CameraSummary, RigSummary};

/// Coverage factor: about 95 % of a normal distribution.
const COVERAGE: f64 = 2.0;
/// Probability that cameras which sat still are said to have moved, at any epoch. Larger, and more sound rigs are doubted.
const MOVED_LEVEL: f64 = 2e-3;

/// Everything on a rig's certificate but its date.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigCertificate {
    /// Program and version.
    pub software: String,
    /// Who calibrated.
    pub operator: Option<String>,
    /// Files that were read.
    pub inputs: Vec<InputDigest>,
    /// What every test of the rig says; those of each camera are in its own certificate.
    pub verdicts: Vec<TestVerdict>,
    /// The mountings with expanded uncertainties.
    pub mountings: Vec<CertifiedMounting>,
    /// The check on epochs left out, camera by camera.
    pub hold_out: Vec<CameraCheck>,
}

/// A mounting with its expanded uncertainty (k = 2).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CertifiedMounting {
    /// The camera.
    pub camera: String,
    /// Perspective centre in the frame of the first camera, metre.
    pub position_m: [f64; 3],
    /// Expanded uncertainty of the position, metre; `None` of the first camera.
    pub expanded_position_m: Option<[f64; 3]>,
    /// Omega, phi and kappa, degree.
    pub angles_deg: [f64; 3],
    /// Expanded uncertainty of the angles, degree.
    pub expanded_angles_deg: Option<[f64; 3]>,
}

/// What the other cameras and epochs predict of one camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraCheck {
    /// The camera.
    pub camera: String,
    /// The check.
    pub check: HeldOut,
}

impl RigCertificate {
    /// `doubts`: of each camera, in its own certificate.
    pub(crate) fn new(
        summary: &RigSummary,
        operator: Option<String>,
        inputs: Vec<InputDigest>,
        hold_out: Vec<CameraCheck>,
        failed: &[(String, Vec<String>)],
    ) -> Self {
        let scale = summary.sigma0.unwrap_or(1.0).max(1.0);
        let expanded = |sigmas: Option<[f64; 3]>| sigmas.map(|sigmas| sigmas.map(|sigma| COVERAGE * scale * sigma));
        let mounting = |camera: &CameraSummary| CertifiedMounting {
            camera: camera.name.clone(),
            position_m: camera.position_m,
            expanded_position_m: expanded(camera.sigma_position_m),
            angles_deg: camera.angles_deg,
            expanded_angles_deg: expanded(camera.sigma_angles_deg),
        };
        let mut verdicts: Vec<TestVerdict> = failed.iter().map(|(camera, failed)| of_camera(camera, failed)).collect();
        verdicts.extend(at_rest(&summary.cameras, scale));
        verdicts.extend(hold_out.iter().flat_map(held_out));
        Self {
            software: format!("rangecam {}", env!("CARGO_PKG_VERSION")),
            operator,
            inputs,
            verdicts,
            mountings: summary.cameras.iter().map(mounting).collect(),
            hold_out,
        }
    }

    /// Doubts of what only the rig's certificate tests.
    pub(crate) fn doubts(&self) -> impl Iterator<Item = Doubt> {
        let failed = self.verdicts.iter().filter(|verdict| verdict.test == AT_REST && verdict.passed == Some(false));
        failed.map(|verdict| Doubt::new(DoubtKind::Contradiction, verdict.words.clone()))
    }
}

const AT_REST: &str = "cameras at rest on the rig";

/// Whether the tests of a camera's own certificate passed.
fn of_camera(camera: &str, failed: &[String]) -> TestVerdict {
    let words = match failed {
        [] => "none of the tests of its own certificate failed".to_owned(),
        failed => format!("failed in its own certificate: {}", failed.join("; ")),
    };
    let rows = format!("those of {camera}/residuals.csv");
    TestVerdict { test: format!("camera {camera}"), passed: Some(failed.is_empty()), words, rows }
}

/// Whether any camera sat otherwise at one epoch than at all, by more than its observations there are uncertain by.
fn at_rest(cameras: &[CameraSummary], scale: f64) -> Option<TestVerdict> {
    let all = || cameras.iter().flat_map(|camera| camera.by_epoch.iter().map(move |residual| (camera, residual)));
    let count = all().count();
    let (camera, worst) = all().max_by(|a, b| a.1.largest_in_sigmas.total_cmp(&b.1.largest_in_sigmas))?;
    // Six components of each; the scatter of the observations widens them.
    let limit = scale * Distribution::Normal.critical(bonferroni(MOVED_LEVEL, 6 * count));
    let passed = worst.largest_in_sigmas <= limit;
    let words = format!(
        "camera {} sat otherwise at epoch {} than at all by {:.1} standard deviations ({}; by chance up to {limit:.1} in {count} \
         mountings of single epochs)",
        camera.name,
        worst.epoch,
        worst.largest_in_sigmas,
        if passed { "the most" } else { "it moved on the rig, or was exposed at another moment" },
    );
    Some(TestVerdict { test: AT_REST.to_owned(), passed: Some(passed), words, rows: "mounting residuals".to_owned() })
}

fn held_out(check: &CameraCheck) -> Vec<TestVerdict> {
    let test = format!("prediction of epochs left out: camera {}", check.camera);
    match &check.check {
        HeldOut::NotMade { reason } => {
            vec![TestVerdict { test, passed: None, words: format!("not made: {reason}"), rows: "none".to_owned() }]
        }
        HeldOut::Made(made) => {
            let rows = format!("epochs {}", made.stations.join(", "));
            let parts = [("image points", Some(&made.image)), ("ranges", made.range.as_ref())];
            let verdict = |(what, part): (&str, Option<&HeldOutPart>)| {
                let part = part?;
                let passed = part.p_value.map(|_| !part.fails);
                Some(TestVerdict {
                    test: format!("{test}: {what}"),
                    passed,
                    words: part.to_string(),
                    rows: rows.clone(),
                })
            };
            parts.into_iter().filter_map(verdict).collect()
        }
    }
}

/// The verdicts as a table.
pub(crate) fn verdicts(page: &mut Document, certificate: &RigCertificate) {
    let row = |verdict: &TestVerdict| {
        let passed = match verdict.passed {
            Some(true) => "passed",
            Some(false) => "failed",
            None => "–",
        };
        vec![verdict.test.clone(), passed.to_owned(), verdict.words.clone(), verdict.rows.clone()]
    };
    let rows: Vec<_> = certificate.verdicts.iter().map(row).collect();
    page.long_table(["test", "verdict", "what was found", "rows"], rows);
}

/// The page to be printed and signed; the date is the only thing on it that a second run on another day would change.
pub(crate) fn page(certificate: &RigCertificate, summary: &RigSummary, date: &str) -> String {
    let operator = certificate.operator.as_deref().unwrap_or("not given");
    let lead = format!("Rig: {}; date: {date}; operator: {operator}; software: {}", summary.rig, certificate.software);
    let mut page = Document::for_print("Certificate of calibration of a rig", lead);
    page.section("Result");
    let verdict = match summary.doubts.len() {
        0 => "Nothing speaks against this calibration.".to_owned(),
        count => format!("{count} doubts speak against using this calibration before they are cleared:"),
    };
    let sigma0 = summary.sigma0.map_or_else(|| "not known".to_owned(), |sigma0| format!("{sigma0:.3}"));
    page.paragraph(format!(
        "{verdict} {} cameras, {} epochs, {} observed values, {} unknowns, redundancy {}, sigma0 {sigma0}.",
        summary.cameras.len(),
        summary.epochs,
        summary.observations,
        summary.unknowns,
        summary.redundancy
    ));
    page.list(&summary.doubts);
    page.list(&summary.diagnosis);
    page.section("Mountings");
    page.paragraph(format!(
        "Perspective centre and rotation in the frame of the first camera, with half widths of intervals with the coverage factor \
         k = {COVERAGE} (about 95 %), scaled with sigma0 where that is above 1."
    ));
    let three = |values: [f64; 3], digits: usize| values.map(|value| format!("{value:.digits$}")).join(", ");
    let held = || "held".to_owned();
    let row = |mounting: &CertifiedMounting| {
        vec![
            mounting.camera.clone(),
            three(mounting.position_m, 5),
            mounting.expanded_position_m.map_or_else(held, |u| three(u.map(|u| 1e3 * u), 3)),
            three(mounting.angles_deg, 4),
            mounting.expanded_angles_deg.map_or_else(held, |u| three(u, 5)),
        ]
    };
    let columns = ["x, y, z, m", "U, mm", "omega, phi, kappa, deg", "U, deg"].map(Column::words);
    let columns: Vec<Column> = std::iter::once(Column::words("camera")).chain(columns).collect();
    page.table(columns, certificate.mountings.iter().map(row).collect());
    page.sheet("Verdicts");
    verdicts(&mut page, certificate);
    page.sheet("Files read");
    let rows =
        certificate.inputs.iter().map(|input| vec![input.file.clone(), input.bytes.to_string(), input.sha256.clone()]);
    page.long_table(["file read", "bytes", "SHA-256"], rows.collect());
    page.signature("Place, date, signature");
    page.html()
}
