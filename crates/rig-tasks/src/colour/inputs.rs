//! What is read: a range image of one camera, an image of another, and how they sit to each other.

use std::path::{Path, PathBuf};

use camera_model::Camera;
use commands::plan::{CorrectImagePointOptions, CorrectRangeOptions, FlagOptions, PointCloudOptions, Stage, to_ranges};
use commands::{Progress, root_of};
use nalgebra::Isometry3;
use pipeline::survey::{OpenSurvey, View, ViewData, read_calibration};
use pipeline::{Error, Plan, Result, process_each};
use range_image::{RangeFrame, Raster};
use range_io::calibration::Calibration;
use range_io::grey::read_colours;
use range_io::survey::{FrameEntry, Level, Survey};

use crate::colour::mountings::read_mountings;
use crate::colour::run::ColourRequest;
use crate::file::{CameraEntry, RigFile};

/// Name of the table of mountings.
pub(super) const MOUNTINGS: &str = "mountings.csv";

/// A range image and a colour image of one epoch.
pub(super) struct Pair {
    /// Names of the two cameras.
    pub(super) names: [String; 2],
    pub(super) frame: RangeFrame,
    pub(super) range_camera: Camera,
    pub(super) image: [Raster<f32>; 3],
    pub(super) colour_camera: Camera,
    /// Of the range camera and of the other.
    pub(super) rig_from_camera: [Isometry3<f64>; 2],
    /// Seconds between both, where both surveys state the times, and how long the longer exposure took.
    pub(super) apart_s: Option<[f64; 2]>,
}

/// A camera of the rig with its survey.
struct Member<'r> {
    entry: &'r CameraEntry,
    root: PathBuf,
    survey: Survey,
}

impl<'r> Member<'r> {
    fn new(rig: &Path, entry: &'r CameraEntry) -> Result<Self> {
        let root = rig.join(entry.folder());
        Ok(Self { entry, survey: Survey::read(&root)?, root })
    }
}

impl Pair {
    pub(super) fn read(request: &ColourRequest, progress: &dyn Progress) -> Result<Self> {
        let rig = RigFile::read(&request.rig)?;
        let members: Vec<Member<'_>> =
            rig.cameras.iter().map(|entry| Member::new(&request.rig, entry)).collect::<Result<_>>()?;
        let range = chosen(&members, request.from.as_deref(), "--from", |level| level != Level::Intensity)?;
        let colour = chosen(&members, request.by.as_deref(), "--by", |level| level == Level::Intensity)?;
        let calibrated = request.calibration.as_deref().unwrap_or(&request.rig);
        let table = calibrated.join(MOUNTINGS);
        let mountings = read_mountings(&table)?;
        let mounting = |member: &Member<'_>| {
            let own = mountings.iter().find(|(name, _)| *name == member.entry.name).map(|(_, pose)| *pose);
            own.ok_or_else(|| wrong(&table, format!("has no camera `{}`", member.entry.name)))
        };
        progress.begin("read ranges", 1);
        let (frame, range_camera, range_entry) = ranges(request, range)?;
        progress.begin("read image", 1);
        let (image, colour_camera, colour_entry) = colours(request, colour)?;
        progress.finish();
        Ok(Self {
            names: [range.entry.name.clone(), colour.entry.name.clone()],
            frame,
            range_camera,
            image,
            colour_camera,
            rig_from_camera: [mounting(range)?, mounting(colour)?],
            apart_s: apart(&range_entry, &colour_entry),
        })
    }
}

fn wrong(path: &Path, message: String) -> Error {
    Error::Survey { path: path.to_owned(), message }
}

/// The camera that is named, or the first one of its kind.
fn chosen<'m, 'r>(
    members: &'m [Member<'r>],
    name: Option<&str>,
    option: &str,
    is_kind: impl Fn(Level) -> bool,
) -> Result<&'m Member<'r>> {
    let fits = |member: &&Member<'_>| match name {
        Some(name) => member.entry.name == name,
        None => is_kind(member.survey.level),
    };
    let kind = if option == "--from" { "ranges" } else { "images alone" };
    let found = members.iter().find(fits);
    let request = |message: String| Error::Request { command: "colour", message };
    match (found, name) {
        (Some(member), _) if is_kind(member.survey.level) => Ok(member),
        (Some(member), _) => {
            Err(request(format!("{option}: the survey of camera `{}` is none of {kind}", member.entry.name)))
        }
        (None, Some(name)) => Err(request(format!("{option}: the rig has no camera `{name}`"))),
        (None, None) => Err(request(format!("the rig has no camera of {kind}"))),
    }
}

/// Where the calibration of a camera lies: in the results of the rig's, or in its own folder.
fn calibration_of(request: &ColourRequest, member: &Member<'_>) -> PathBuf {
    match &request.calibration {
        Some(results) => results.join(&member.entry.name).join(Calibration::FILE_NAME),
        None => member.root.join(Calibration::FILE_NAME),
    }
}

/// The corrected ranges of the epoch, freed of all that is known to be wrong with them.
fn ranges(request: &ColourRequest, member: &Member<'_>) -> Result<(RangeFrame, Camera, FrameEntry)> {
    let entry = entry(request, member)?.clone();
    let known = read_calibration(&member.root, Some(&calibration_of(request, member)))?;
    let restores = known.0.as_ref().is_some_and(|calibration| calibration.scattering.is_some());
    let corrects = known.0.as_ref().is_some_and(|calibration| !calibration.range_models.is_empty());
    let mut stages = to_ranges(member.survey.level, restores);
    stages.extend(corrects.then(|| Stage::CorrectRange(CorrectRangeOptions::default())));
    stages.push(Stage::CorrectImagePoint(CorrectImagePointOptions::default()));
    stages.push(Stage::PointCloud(PointCloudOptions::default()));
    stages.push(Stage::Flag(FlagOptions::default()));
    let plan = Plan { name: "colour".to_owned(), source: None, calibrate: None, stages };
    let mut found = None;
    let mut keep = |view: View, _: &OpenSurvey| {
        if view.station == request.epoch && found.is_none() {
            let ViewData::Range(frame) = view.data else {
                return Err(Error::Needs { stage: "colour", needs: "Unwrap" });
            };
            found = Some(frame);
        }
        Ok(())
    };
    let processed = process_each(&plan, &member.root, known, &mut keep, &commands::Silent)?;
    let frame =
        found.ok_or_else(|| wrong(&member.root, format!("no frame of station `{}` was left", request.epoch)))?;
    Ok((frame, processed.camera, entry))
}

/// The image of the epoch, and its camera.
fn colours(request: &ColourRequest, member: &Member<'_>) -> Result<([Raster<f32>; 3], Camera, FrameEntry)> {
    let entry = entry(request, member)?;
    let file = root_of(&member.root).join(&entry.file);
    let image = read_colours(&file)?;
    let camera = Calibration::read(calibration_of(request, member))?.camera()?;
    let (own, expected) = ([image[0].width(), image[0].height()], [camera.format.width, camera.format.height]);
    if own != expected {
        let message = format!("has {} x {} pixels, the calibration {} x {}", own[0], own[1], expected[0], expected[1]);
        return Err(wrong(&file, message));
    }
    Ok((image, camera, entry.clone()))
}

/// The first frame of the epoch.
fn entry<'m>(request: &ColourRequest, member: &'m Member<'_>) -> Result<&'m FrameEntry> {
    let own = member.survey.frames.iter().find(|entry| entry.station == request.epoch);
    own.ok_or_else(|| wrong(&member.root, format!("has no frame of station `{}`", request.epoch)))
}

fn apart(range: &FrameEntry, colour: &FrameEntry) -> Option<[f64; 2]> {
    let longest = range.integration_time_s.unwrap_or(0.0).max(colour.integration_time_s.unwrap_or(0.0));
    Some([(range.timestamp_s? - colour.timestamp_s?).abs(), longest])
}
