//! One calibration: survey in, results out.

use std::path::Path;
use std::time::Instant;

use atomic_output::{Destination, OutputFolder, write_text};
use commands::plan::DriftTreatment;
use commands::{Inputs, Progress, json, produce, today};
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use range_io::tables::{write_residuals, write_stations, write_targets};
use report::Document;
use self_calibration::{CalibrationOptions, CalibrationOutcome, Error as Cause, Method, hold_out};

use crate::calibrate::document::certificate_page::render_certificate;
use crate::calibrate::document::figures::Figures;
use crate::calibrate::document::page::document;
use crate::calibrate::network::network_check::check;
use crate::calibrate::network::network_files::{NetworkFiles, read_network};
use crate::calibrate::planes;
use crate::calibrate::planes::attempt::{Attempt, Calibrated};
use crate::calibrate::planes::offset::FoundTable;
use crate::calibrate::request::{CalibrateMethod, CalibrateRequest, CertificateRequest, OffsetModel};
use crate::calibrate::results::certificate::{Certificate, HeldOut, Source};
use crate::calibrate::results::summary::CalibrationSummary;
use crate::calibrate::results::{calibration_file, tables};
use crate::calibrate::start::Start;
use crate::calibrate::surfaces;

/// Calibrates a survey and writes the results into the request's output folder.
///
/// # Errors
/// [`Error::Refused`] where the survey does not determine what was asked for: then the diagnosis is written, beside an
/// older result where there is one. Every other error leaves what was there.
pub fn calibrate(request: &CalibrateRequest, progress: &dyn Progress) -> Result<CalibrationSummary> {
    let surveys = [Some(&request.survey), request.lens_survey.as_ref()].into_iter().flatten();
    let inputs = surveys.fold(Inputs::default(), |inputs, survey| inputs.survey(survey));
    let inputs = inputs.maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| calibrate_into(destination, request, progress))
}

fn calibrate_into(
    destination: &Destination,
    request: &CalibrateRequest,
    progress: &dyn Progress,
) -> Result<CalibrationSummary> {
    let clock = Instant::now();
    let survey = request.survey.display().to_string();
    let (start, outcome) = match request.method {
        CalibrateMethod::Network(_) | CalibrateMethod::Surfaces if request.offset != OffsetModel::Constant => {
            return Err(no_pixels(request));
        }
        CalibrateMethod::Network(network_method) => calibrate_networks(request, network_method, progress)?,
        CalibrateMethod::Planes => planes::calibrate_planes(request, progress)?,
        CalibrateMethod::Surfaces => surfaces::calibrate_on_the_job(request, progress)?,
    };
    let finish = |mut summary: CalibrationSummary| {
        summary.seconds = commands::made::seconds_since(clock);
        summary.out.clone_from(&request.out);
        summary
    };
    match outcome {
        Ok(Calibrated { outcome, table, check }) => {
            let table = table.as_ref();
            let mut summary = CalibrationSummary::new(survey, request.method, &start, &outcome, table);
            let hold_out = HeldOut::new(request.certificate.hold_out, check);
            let file = file(&outcome, &start, table, &summary)?;
            let (outcome, start) = (&outcome, &start);
            let source = Source { request, start, outcome, file: &file, hold_out };
            let page = certify(source, &mut summary)?;
            let summary = finish(summary);
            // Surfaces find what targets found: where a calibration is given, both stand beside each other.
            let beside = start.calibration.as_ref().filter(|given| !given.range_models.is_empty());
            let figures = match request.method {
                CalibrateMethod::Surfaces => Figures::new(outcome, table)?.with_range_terms(outcome, beside),
                _ => Figures::new(outcome, table)?,
            };
            let results = Results { outcome, figures, file: &file, certificate_page: &page };
            write(destination, results, &summary, progress)?;
            progress.finish();
            Ok(summary)
        }
        Err(source) => {
            progress.finish();
            let reason = source.to_string();
            let summary = finish(CalibrationSummary::refused(survey, request.method, &start, reason));
            Err(Error::not_calibrated(source, &summary)?)
        }
    }
}

/// Certifies a calibration: its summary gets the certificate and what the check on left-out stations says; the certificate's page.
pub(crate) fn certify(source: Source<'_>, summary: &mut CalibrationSummary) -> Result<String> {
    let CertificateRequest { hold_out, date, .. } = &source.request.certificate;
    let date = date.clone().unwrap_or_else(today);
    summary.doubts.extend(source.hold_out.doubt());
    summary.diagnosis.extend(source.hold_out.excuse(*hold_out));
    let certificate = Certificate::new(source, summary)?;
    let page = render_certificate(&certificate, summary, &date);
    summary.certificate = Some(certificate);
    Ok(page)
}

fn no_pixels(request: &CalibrateRequest) -> Error {
    let message =
        "a table of offsets or a surface beside d0 is found from frames of planes, by `--method planes`; from \
                   targets, name `surface2` (its order behind it) among the terms"
            .to_owned();
    Error::Survey { path: request.survey.clone(), message }
}

fn calibrate_networks(request: &CalibrateRequest, method: Method, progress: &dyn Progress) -> Result<Attempt> {
    progress.begin("read survey", 1);
    let files =
        read_network(&request.survey, request.calibration.as_deref(), None, &request.defaults, request.warm_up)?;
    let options = CalibrationOptions { method, ..request.options.clone() };
    check_station_names(&files, &options)?;
    let outcome = if method == Method::TwoStepIndependent {
        let Some(folder) = &request.lens_survey else {
            let message = "the two-step independent method calibrates the lens from another survey: name it with \
                           --lens-survey"
                .to_owned();
            return Err(Error::Survey { path: request.survey.clone(), message });
        };
        let calibration = request.calibration.as_deref();
        let lens = read_network(folder, calibration, None, &request.defaults, DriftTreatment::Leave)?;
        check(&lens, Method::TwoStepDependent, options.datum)?;
        progress.begin("adjust networks", 2);
        self_calibration::calibrate_two_networks(&lens.network, &files.network, &options)
    } else {
        check(&files, method, options.datum)?;
        progress.begin("adjust network", 2);
        self_calibration::calibrate(&files.network, &options)
    };
    progress.advance(2);
    let outcome = outcome.map_err(|error| placed(error, &files));
    let outcome = match outcome {
        // All of a column is wrong: a slip in the input, not a finding about the network.
        Err(Cause::Contradiction(contradiction)) if contradiction.is_wrong_input() => {
            let path = files.observations.file().to_owned();
            return Err(Error::Survey { path, message: contradiction.to_string() });
        }
        outcome => outcome,
    };
    let calibrated = outcome.map(|outcome| {
        let check = request.certificate.hold_out.map(|every| {
            progress.begin("check stations left out", 1);
            hold_out(&files.network, &options, &outcome, every)
        });
        Calibrated { outcome, table: None, check }
    });
    Ok((files.start, calibrated))
}

/// Names file and line of the observed value that contradicts most.
pub(crate) fn placed(mut error: Cause, files: &NetworkFiles) -> Cause {
    if let Cause::Contradiction(contradiction) = &mut error
        && let Some(worst) = &mut contradiction.worst
    {
        let file = files.observations.file().display();
        worst.place = Some(format!("{file}, line {}", files.observations.line(worst.sighting)));
    }
    error
}

/// A name that no station has would silently leave nothing out.
fn check_station_names(files: &NetworkFiles, options: &CalibrationOptions) -> Result<()> {
    let stations = &files.network.stations;
    match options.without_ranges.iter().find(|name| !stations.iter().any(|station| station.name == **name)) {
        None => Ok(()),
        Some(unknown) => {
            let names: Vec<&str> = stations.iter().map(|station| station.name.as_str()).collect();
            let message = format!("--without-ranges: there is no station `{unknown}`, only {}", names.join(", "));
            Err(Error::Survey { path: files.observations.file().to_owned(), message })
        }
    }
}

/// The calibration to write.
fn file(
    outcome: &CalibrationOutcome,
    start: &Start,
    table: Option<&FoundTable>,
    summary: &CalibrationSummary,
) -> Result<Calibration> {
    let mut calibration = calibration_file::calibration(outcome, start, &summary.survey, summary.method)?;
    if let Some(table) = table {
        // It takes the place of an older one, which was not taken off the ranges.
        calibration.fixed_pattern = table.worth_applying();
    }
    Ok(calibration)
}

/// What is written beside the summary.
struct Results<'a> {
    outcome: &'a CalibrationOutcome,
    figures: Figures,
    file: &'a Calibration,
    certificate_page: &'a str,
}

fn write(
    destination: &Destination,
    results: Results<'_>,
    summary: &CalibrationSummary,
    progress: &dyn Progress,
) -> Result<()> {
    let Results { outcome, figures, file, certificate_page } = results;
    progress.begin("write results", 2);
    let page = document(summary, figures);
    let folder = destination.open()?;
    write_files(&folder, Path::new(""), outcome, file, summary, &page)?;
    progress.advance(1);
    write_text(folder.file("certificate.html")?, certificate_page)?;
    progress.advance(2);
    Ok(folder.commit()?)
}

/// Writes all of one camera but the certificate, below `name`.
pub(crate) fn write_files(
    folder: &OutputFolder,
    name: &Path,
    outcome: &CalibrationOutcome,
    file: &Calibration,
    summary: &CalibrationSummary,
    page: &Document,
) -> Result<()> {
    file.write(folder.file(name.join(Calibration::FILE_NAME))?)?;
    write_stations(folder.file(name.join("adjusted_stations.csv"))?, &tables::stations(outcome))?;
    write_targets(folder.file(name.join("adjusted_targets.csv"))?, &tables::targets(outcome))?;
    write_residuals(folder.file(name.join("residuals.csv"))?, &tables::residuals(outcome))?;
    write_text(folder.file(name.join("summary.json"))?, &json(summary)?)?;
    Ok(write_text(folder.file(name.join("report.html"))?, &page.html())?)
}
