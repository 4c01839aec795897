//! What commands share that add one estimated term to a calibration.

use std::path::Path;

use atomic_output::{Destination, write_text};
use commands::root_of;
use error_models::ModelSet;
use pipeline::Result;
use pipeline::survey::{Purpose, compatible, read_calibration};
use range_io::calibration::{Calibration, Provenance};
use range_io::survey::Survey;

/// The calibration that a term is added to, in words too: the one named, the one beside the survey, or else one of
/// which nothing but the nominal camera is known.
pub(crate) fn start(survey: &Path, named: Option<&Path>) -> Result<(Calibration, String)> {
    let (path, survey) = (survey, Survey::read(survey)?);
    if let (Some(calibration), words) = read_calibration(&root_of(path), named)? {
        compatible(&survey, &calibration, Purpose::Camera)?;
        return Ok((calibration, words));
    }
    let camera = survey.camera.nominal_camera()?;
    let mut calibration = Calibration::from_models(&camera, &ModelSet::default(), None)?;
    calibration.provenance = Provenance::default();
    Ok((calibration, "the survey's nominal camera".to_owned()))
}

/// The calibration's own history, if it has one, with the new term behind it.
pub(crate) fn provenance_with(
    known: &Provenance,
    survey: &Path,
    method: &str,
    redundancy: i64,
    sigma0: f64,
) -> Provenance {
    if known.method.is_empty() {
        return Provenance {
            survey: survey.display().to_string(),
            method: method.to_owned(),
            redundancy: usize::try_from(redundancy).ok(),
            sigma0: Some(sigma0).filter(|sigma0| sigma0.is_finite()),
            created: None,
        };
    }
    Provenance { method: format!("{}; {method}", known.method), ..known.clone() }
}

/// Writes calibration, summary and report.
pub(crate) fn write(
    destination: &Destination,
    calibration: Option<&Calibration>,
    summary: &str,
    report: &str,
) -> Result<()> {
    let folder = destination.open()?;
    write_text(folder.file("summary.json")?, summary)?;
    if let Some(calibration) = calibration {
        calibration.write(folder.file(Calibration::FILE_NAME)?)?;
    }
    write_text(folder.file("report.html")?, report)?;
    folder.commit()?;
    Ok(())
}
