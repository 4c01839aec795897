//! One calibration of a rig: folders of surveys in, results out.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use atomic_output::{Destination, write_text};
use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CalibrationSummary, CameraFiles, HeldOut, Method,
    OffsetModel,
};
use commands::{Doubt, DoubtKind, InputDigest, Inputs, Progress, json, produce, today};
use nalgebra::Point3;
use pipeline::{Error, Result};
use range_io::tables::{Station, Target, write_stations, write_targets};
use rig_calibration::self_calibration::{AdjustedStation, AdjustedTarget, Error as Cause};
use rig_calibration::{Error as RigError, MountedCamera, Rig, RigCamera, RigOutcome};

use crate::certificate::{CameraCheck, RigCertificate, page};
use crate::document::document;
use crate::file::RigFile;
use crate::summary::{DESCRIBE, METHOD, RigSummary, sigmas_of};

/// Files that are read, where they are there: beside `rig.ron`, and in each camera's folder.
const OF_THE_RIG: [&str; 2] = ["rig.ron", "targets.csv"];
const OF_A_CAMERA: [&str; 6] =
    ["survey.ron", "observations.csv", "stations.csv", "targets.csv", "distances.csv", "calibration.ron"];

/// Calibrates the rig in the folder `request.survey` and writes the results into the request's output folder.
///
/// Each camera starts from the `calibration.ron` of its folder or its nominal camera. Terms, datum, rejection and
/// defaults are those of the request; what it asks for besides (another method, a lens survey, an offset of pixels, a
/// calibration) is refused. With `certificate.hold_out` every so many epochs are left out and predicted, camera by camera
/// ([`rig_calibration::hold_out`]).
///
/// # Errors
/// As [`calibration_tasks::calibrate`]: [`Error::Refused`] where the observations do not determine or contradict what was
/// asked for, with the camera's name.
pub fn calibrate_rig(request: &CalibrateRequest, progress: &dyn Progress) -> Result<RigSummary> {
    check(request)?;
    let folder = &request.survey;
    let rig = RigFile::read(folder)?;
    let inputs = rig
        .cameras
        .iter()
        .fold(Inputs::default().path(folder), |inputs, camera| inputs.survey(&folder.join(camera.folder())));
    produce(&request.out, &inputs, |destination| calibrate_into(destination, request, &rig, progress))
}

/// What a rig has not.
fn check(request: &CalibrateRequest) -> Result<()> {
    let unfit = [
        (request.method != CalibrateMethod::Network(Method::OneStep), "--method: a rig is calibrated in one step"),
        (request.lens_survey.is_some(), "--lens-survey: a rig is calibrated in one step"),
        (request.offset != OffsetModel::Constant, "--offset: that is found from frames of planes, camera by camera"),
        (request.calibration.is_some(), "--calibration: each camera of a rig starts from the one in its own folder"),
    ];
    match unfit.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, message)) => Err(Error::Request { command: "calibrate", message: message.to_owned() }),
        None => Ok(()),
    }
}

fn calibrate_into(
    destination: &Destination,
    request: &CalibrateRequest,
    file: &RigFile,
    progress: &dyn Progress,
) -> Result<RigSummary> {
    let clock = Instant::now();
    progress.begin("read rig", file.cameras.len());
    let targets = request.survey.join("targets.csv");
    let targets = Some(targets.as_path()).filter(|path| path.is_file());
    let (mut files, mut cameras) = (Vec::new(), Vec::new());
    for (index, entry) in file.cameras.iter().enumerate() {
        let folder = request.survey.join(entry.folder());
        let read = CameraFiles::read(&folder, targets, request)?;
        cameras.push(RigCamera {
            name: entry.name.clone(),
            network: read.network().clone(),
            terms: entry.terms.clone(),
            approximate: entry.about.map(|about| about.rig_from_camera()),
        });
        files.push(read);
        progress.advance(index + 1);
    }
    check_targets(&request.survey, targets, &cameras)?;
    let rig = Rig { cameras };
    check_station_names(&request.survey, &rig, &request.options)?;
    progress.begin("adjust rig", 1);
    let outcome = rig_calibration::calibrate_rig(&rig, &request.options);
    progress.finish();
    let name = request.survey.display().to_string();
    match outcome {
        Ok(outcome) => {
            let mut summary = RigSummary::new(name, file, &files, &outcome);
            summary.out.clone_from(&request.out);
            let checks = hold_outs(&rig, request, &outcome, progress);
            let certified = certified(request, &files, &outcome, &checks)?;
            certify(request, file, &mut summary, checks, &certified)?;
            summary.seconds = commands::made::seconds_since(clock);
            write(destination, request, Results { files: &files, outcome: &outcome, certified }, &summary)?;
            Ok(summary)
        }
        Err(error) => {
            let error = placed(error, &rig, &files);
            let mut summary = RigSummary::refused(name, error.to_string());
            summary.out.clone_from(&request.out);
            summary.seconds = commands::made::seconds_since(clock);
            Err(refusal(error, &summary)?)
        }
    }
}

/// Refuses coordinates of one target that differ between two cameras, where each folder has a table of its own.
fn check_targets(folder: &Path, shared: Option<&Path>, cameras: &[RigCamera]) -> Result<()> {
    let mut known: BTreeMap<&str, (&str, Point3<f64>)> = BTreeMap::new();
    for camera in cameras.iter().filter(|_| shared.is_none()) {
        for (target, point) in camera.network.targets.iter().filter_map(|target| Some((target, target.point?))) {
            let (other, earlier) = *known.entry(&target.name).or_insert((&camera.name, point));
            if earlier != point {
                let message = format!(
                    "target `{}` has other coordinates in targets.csv of camera `{}` than in that of camera `{other}`: \
                     give one targets.csv for all beside rig.ron",
                    target.name, camera.name
                );
                return Err(Error::Survey { path: folder.to_owned(), message });
            }
        }
    }
    Ok(())
}

/// A name that no station has would silently leave nothing out.
fn check_station_names(folder: &Path, rig: &Rig, options: &CalibrationOptions) -> Result<()> {
    let known =
        |name: &String| rig.cameras.iter().any(|camera| camera.network.stations.iter().any(|s| s.name == *name));
    match options.without_ranges.iter().find(|name| !known(name)) {
        None => Ok(()),
        Some(unknown) => {
            let message = format!("--without-ranges: no camera has a station `{unknown}`");
            Err(Error::Survey { path: folder.to_owned(), message })
        }
    }
}

/// Names file and line of the value that contradicts most.
fn placed(error: RigError, rig: &Rig, files: &[CameraFiles]) -> RigError {
    match error {
        RigError::Camera { camera, source } => {
            let own = rig.cameras.iter().position(|known| known.name == camera).and_then(|index| files.get(index));
            let source = match own {
                Some(files) => Box::new(files.placed(*source)),
                None => source,
            };
            RigError::Camera { camera, source }
        }
        error => error,
    }
}

/// What the data do not show is refused, with its summary; slips in what was given are wrong input.
fn refusal(error: RigError, summary: &RigSummary) -> Result<Error> {
    match refused_summary(&error, summary)? {
        Some(summary) => Ok(Error::Refused { summary, source: error.into(), written: None }),
        None => Ok(Error::Request { command: "calibrate", message: error.to_string() }),
    }
}

/// The text of a refusal's summary; `None` where the input is wrong.
fn refused_summary(error: &RigError, summary: &RigSummary) -> Result<Option<String>> {
    match error {
        RigError::TooFewCameras { .. } | RigError::DuplicateCamera(_) | RigError::Unfit { .. } | RigError::Datum(_) => {
            Ok(None)
        }
        RigError::Camera { source, .. } => match source.as_ref() {
            Cause::Contradiction(contradiction) if contradiction.is_wrong_input() => Ok(None),
            cause => match Error::not_calibrated(cause.clone(), summary)? {
                Error::Refused { summary, .. } => Ok(Some(summary)),
                _ => Ok(None),
            },
        },
        _ => Ok(Some(json(summary)?)),
    }
}

/// The check on epochs left out, of each camera.
fn hold_outs(rig: &Rig, request: &CalibrateRequest, outcome: &RigOutcome, progress: &dyn Progress) -> Vec<HeldOut> {
    let every = request.certificate.hold_out;
    let made = every.map(|every| {
        progress.begin("check epochs left out", 1);
        rig_calibration::hold_out(rig, &request.options, outcome, every)
    });
    progress.finish();
    match made {
        None => rig.cameras.iter().map(|_| HeldOut::not_asked()).collect(),
        Some(Ok(all)) => all.into_iter().map(|check| HeldOut::made(every.unwrap_or(0), check)).collect(),
        Some(Err(error)) => rig.cameras.iter().map(|_| HeldOut::NotMade { reason: error.to_string() }).collect(),
    }
}

/// Summary of each camera with its certificate, and the certificate's page.
fn certified(
    request: &CalibrateRequest,
    files: &[CameraFiles],
    outcome: &RigOutcome,
    checks: &[HeldOut],
) -> Result<Vec<(CalibrationSummary, String)>> {
    let own = |((camera, files), check): ((&MountedCamera, &CameraFiles), &HeldOut)| {
        let mut own = files.summary(&camera.calibration, METHOD, DESCRIBE);
        own.out = request.out.join(&camera.name);
        files.certified(request, &camera.calibration, own, check.clone())
    };
    outcome.cameras.iter().zip(files).zip(checks).map(own).collect()
}

/// The certificate of the rig, and what its tests and those of left-out epochs speak against.
fn certify(
    request: &CalibrateRequest,
    file: &RigFile,
    summary: &mut RigSummary,
    checks: Vec<HeldOut>,
    certified: &[(CalibrationSummary, String)],
) -> Result<()> {
    let names: Vec<String> = summary.cameras.iter().map(|camera| camera.name.clone()).collect();
    let failed = |(own, _): &(CalibrationSummary, String)| {
        let verdicts = own.certificate.iter().flat_map(|certificate| &certificate.verdicts);
        verdicts.filter(|verdict| verdict.passed == Some(false)).map(|verdict| verdict.test.clone()).collect()
    };
    let failed: Vec<(String, Vec<String>)> = names.iter().cloned().zip(certified.iter().map(failed)).collect();
    for (name, check) in names.iter().zip(&checks) {
        let doubt = check.doubt();
        summary.doubts.extend(doubt.map(|doubt| Doubt::about(DoubtKind::Prediction, name.as_str(), doubt.words)));
        let excuse = check.excuse(request.certificate.hold_out);
        summary.diagnosis.extend(excuse.map(|words| format!("camera `{name}`: {words}")));
    }
    let checks = names.into_iter().zip(checks).map(|(camera, check)| CameraCheck { camera, check }).collect();
    let (operator, inputs) = (request.certificate.operator.clone(), digests(&request.survey, file)?);
    let certificate = RigCertificate::new(summary, operator, inputs, checks, &failed);
    summary.doubts.extend(certificate.doubts());
    summary.certificate = Some(certificate);
    Ok(())
}

/// Digests of all files that were read, in a fixed order.
fn digests(root: &Path, file: &RigFile) -> Result<Vec<InputDigest>> {
    let own = file.cameras.iter().flat_map(|camera| OF_A_CAMERA.map(|name| root.join(camera.folder()).join(name)));
    let files = OF_THE_RIG.map(|name| root.join(name)).into_iter().chain(own).filter(|path| path.is_file());
    files.map(InputDigest::of).collect()
}

/// What is written beside the summary.
struct Results<'a> {
    files: &'a [CameraFiles],
    outcome: &'a RigOutcome,
    certified: Vec<(CalibrationSummary, String)>,
}

fn write(
    destination: &Destination,
    request: &CalibrateRequest,
    results: Results<'_>,
    summary: &RigSummary,
) -> Result<()> {
    let Results { files, outcome, certified } = results;
    let folder = destination.open()?;
    for ((camera, files), (mut own, page)) in outcome.cameras.iter().zip(files).zip(certified) {
        own.seconds = summary.seconds;
        files.write(&folder, &camera.name, &camera.calibration, (&own, &page))?;
    }
    if let Some(certificate) = &summary.certificate {
        let date = request.certificate.date.clone().unwrap_or_else(today);
        write_text(folder.file("certificate.html")?, &page(certificate, summary, &date))?;
    }
    write_text(folder.file("mountings.csv")?, &summary.mountings_csv())?;
    let epoch = |station: &AdjustedStation| {
        let sigmas = sigmas_of(&station.world_from_camera, &station.covariance);
        Station {
            station: station.name.clone(),
            world_from_camera: station.world_from_camera,
            sigma_position_m: sigmas.map(|sigmas| sigmas.0),
            sigma_attitude_rad: sigmas.map(|sigmas| sigmas.1),
            doubt: None,
        }
    };
    write_stations(folder.file("adjusted_epochs.csv")?, &outcome.epochs.iter().map(epoch).collect::<Vec<_>>())?;
    let target = |target: &AdjustedTarget| {
        let sigma = [0, 1, 2].map(|axis| target.covariance[(axis, axis)].sqrt());
        Target {
            target: target.name.clone(),
            position_m: target.point.coords.into(),
            sigma_m: Some(sigma).filter(|sigma| sigma.iter().all(|sigma| sigma.is_finite() && *sigma > 0.0)),
        }
    };
    write_targets(folder.file("adjusted_targets.csv")?, &outcome.targets.iter().map(target).collect::<Vec<_>>())?;
    write_text(folder.file("summary.json")?, &json(summary)?)?;
    write_text(folder.file("report.html")?, &document(summary).html())?;
    Ok(folder.commit()?)
}
