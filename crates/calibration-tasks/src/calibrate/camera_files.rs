//! The files of one camera among several that are calibrated together.

use std::path::{Path, PathBuf};

use atomic_output::{OutputFolder, write_text};
use pipeline::{Error, Result};
use self_calibration::{CalibrationOutcome, Error as Cause, Method, Network};

use crate::calibrate::document::figures::Figures;
use crate::calibrate::document::page::document;
use crate::calibrate::network::network_files::{NetworkFiles, read_network};
use crate::calibrate::request::{CalibrateMethod, CalibrateRequest};
use crate::calibrate::results::calibration_file;
use crate::calibrate::results::certificate::{HeldOut, Source};
use crate::calibrate::results::summary::CalibrationSummary;
use crate::calibrate::run::{certify, placed, write_files};

/// A camera's survey of target observations, read as [`calibrate`](crate::calibrate()) reads it.
#[derive(Debug, Clone)]
pub struct CameraFiles {
    survey: PathBuf,
    files: NetworkFiles,
}

impl CameraFiles {
    /// Reads the survey in `folder` with the defaults and the treatment of drift of a request; `targets` is a table of
    /// coordinates that stands in place of the one in the folder.
    ///
    /// # Errors
    /// What is missing or wrong in a file, by line and field; ranges of a camera that gives light alone.
    pub fn read(folder: &Path, targets: Option<&Path>, request: &CalibrateRequest) -> Result<Self> {
        let files = read_network(folder, None, targets, &request.defaults, request.warm_up)?;
        let light_alone = files.start.light_alone;
        if let Some(row) = files.network.sightings.iter().position(|seen| light_alone && seen.range_m.is_some()) {
            let reason = "is given, but the survey's level `intensity` has none: are these the rows of another camera?";
            return Err(files.observations.error(row, "range", reason).into());
        }
        if files.network.passive.is_some() {
            let message = "has a folder `passive`: on a rig it is a camera of its own, named in rig.ron".to_owned();
            return Err(Error::Survey { path: folder.to_owned(), message });
        }
        Ok(Self { survey: folder.to_owned(), files })
    }

    /// What the camera observed.
    pub fn network(&self) -> &Network {
        &self.files.network
    }

    /// Whether the camera gives light alone, and no ranges.
    pub fn is_of_light(&self) -> bool {
        self.files.start.light_alone
    }

    /// An error of this camera's network with file and line of the value that contradicts most.
    #[must_use]
    pub fn placed(&self, error: Cause) -> Cause {
        placed(error, &self.files)
    }

    /// The figures of the camera's part of a calibration; `method` and `describe` say of which.
    pub fn summary(
        &self,
        outcome: &CalibrationOutcome,
        method: &'static str,
        describe: &'static str,
    ) -> CalibrationSummary {
        let survey = self.survey.display().to_string();
        let one = CalibrateMethod::Network(Method::OneStep);
        CalibrationSummary {
            method,
            describe,
            ..CalibrationSummary::new(survey, one, &self.files.start, outcome, None)
        }
    }

    /// Certifies the camera's part of a calibration that was asked for by `request`: its summary with the certificate and what the check on
    /// left-out stations says, and the certificate's page.
    ///
    /// # Errors
    /// A file that can't be read again for its digest.
    pub fn certified(
        &self,
        request: &CalibrateRequest,
        outcome: &CalibrationOutcome,
        mut summary: CalibrationSummary,
        hold_out: HeldOut,
    ) -> Result<(CalibrationSummary, String)> {
        let start = &self.files.start;
        let file = calibration_file::calibration(outcome, start, &summary.survey, summary.method)?;
        let request = &CalibrateRequest { survey: self.survey.clone(), calibration: None, ..request.clone() };
        let page = certify(Source { request, start, outcome, file: &file, hold_out }, &mut summary)?;
        Ok((summary, page))
    }

    /// Writes `calibration.ron`, `adjusted_stations.csv`, `adjusted_targets.csv`, `residuals.csv`, `summary.json`, `report.html` and
    /// `certificate.html`, whose page is given, below `name` in an output folder.
    ///
    /// # Errors
    /// A figure or a file that can't be written.
    pub fn write(
        &self,
        folder: &OutputFolder,
        name: &str,
        outcome: &CalibrationOutcome,
        (summary, certificate): (&CalibrationSummary, &str),
    ) -> Result<()> {
        let calibration = calibration_file::calibration(outcome, &self.files.start, &summary.survey, summary.method)?;
        let page = document(summary, Figures::new(outcome, None)?);
        write_files(folder, Path::new(name), outcome, &calibration, summary, &page)?;
        Ok(write_text(folder.file(Path::new(name).join("certificate.html"))?, certificate)?)
    }
}
