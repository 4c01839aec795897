//! What a file or folder holds, before anything is done with it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use commands::plan::{DemodulateOptions, DriftTreatment, Stage, ruled_out};
use commands::{Doubt, DoubtKind, Judged, root_of};
use pipeline::stages::{Line, corrects_ranges};
use pipeline::survey::plausibility::{self, FrameWatch, SenseVotes, StoredWatch};
use pipeline::survey::{Purpose, compatible, open, read_calibration};
use pipeline::{Error, Result};
use range_io::calibration::{CalibratedDrift, Calibration};
use range_io::ply::read_cloud;
use range_io::survey::{FrameEntry, Level, Survey, read_frame};
use report::{Column, Document};
use serde::Serialize;

/// Stations whose phases are judged.
const MOST_JUDGED: usize = 8;

/// What was found, by name, in an order for reading, and what speaks against it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Inspection {
    entries: Vec<Entry>,
    doubts: Vec<Doubt>,
}

#[derive(Debug, Clone, Serialize)]
struct Entry {
    name: &'static str,
    value: String,
}

impl Inspection {
    fn add(&mut self, name: &'static str, value: impl fmt::Display) {
        self.entries.push(Entry { name, value: value.to_string() });
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it, for people.
fn document(found: &Inspection) -> Document {
    let mut document = Document::new("rangecam: inspect", "");
    let rows = found.entries.iter().map(|entry| vec![entry.name.to_owned(), entry.value.clone()]);
    document.table([Column::words("what"), Column::words("found")], rows.collect());
    document.warnings(&found.doubts);
    document
}

impl Judged for Inspection {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

/// Looks into a survey's folder, a `calibration.ron` or a `.ply` cloud.
pub fn inspect(path: &Path) -> Result<Inspection> {
    let mut found = Inspection::default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if path.extension().is_some_and(|ending| ending == "ply") {
        inspect_cloud(path, &mut found)?;
    } else if name == "calibration.ron" {
        inspect_calibration(path, &mut found)?;
    } else if path.is_dir() || name == Survey::FILE_NAME {
        inspect_survey(path, &mut found)?;
    } else {
        return Err(Error::Survey {
            path: path.to_owned(),
            message:
                "this can't be inspected; expected a survey's folder, calibration.ron, a cloud (.ply), or a recording"
                    .to_owned(),
        });
    }
    Ok(found)
}

fn inspect_survey(path: &Path, found: &mut Inspection) -> Result<()> {
    let survey = Survey::read(path)?;
    let camera = &survey.camera;
    let mut stations: BTreeMap<&str, usize> = BTreeMap::new();
    for frame in &survey.frames {
        *stations.entry(&frame.station).or_default() += 1;
    }
    found.add("survey", path.display());
    found.add("level", survey.level.name());
    found.add("size", format!("{} x {} pixels", camera.width, camera.height));
    // To a nanometre: what binary fractions add is nobody's statement.
    let principal_distance_mm = (camera.principal_distance_mm * 1e6).round() / 1e6;
    found.add("principal distance", format!("{principal_distance_mm} mm (nominal)"));
    for modulation in camera.modulations()? {
        let megahertz = modulation.frequency_hz() / 1e6;
        found.add(
            "frequency",
            format!("{megahertz} MHz, ambiguity interval {:.4} m", modulation.ambiguity_interval_m()),
        );
    }
    found.add("frames", survey.frames.len());
    let stations: Vec<String> = stations.iter().map(|(name, frames)| format!("{name} ({frames})")).collect();
    found.add("stations (frames)", stations.join(", "));
    if let Some(power_on_s) = survey.power_on_s {
        found.add("switched on", format!("at {power_on_s} s on the clock of the frames"));
    }
    if let Some(path) = &survey.reference_path {
        let ([left, right], [top, bottom]) = (path.columns, path.rows);
        let words = format!("columns {left} to {right}, rows {top} to {bottom}: {} m", path.length_m);
        found.add("optical reference", words);
    }
    found.add("truth", if survey.truth.is_some() { "yes" } else { "no" });
    inspect_frames(path, &survey, found)?;
    let blocked = ruled_out(survey.level);
    let open: Vec<&str> = Stage::NAMES.iter().filter(|name| !blocked.contains_key(**name)).copied().collect();
    found.add("stages possible", open.join(", "));
    for (stage, reason) in &blocked {
        found.add("ruled out", format!("{stage}: {reason}"));
    }
    Ok(())
}

/// Images of light alone: whether they can be read is all that there is to judge.
fn inspect_images(path: &Path, survey: &Survey, found: &mut Inspection) {
    let root = root_of(path);
    let frames = survey.frames.iter().enumerate();
    let unreadable: Vec<_> =
        frames.filter_map(|(index, entry)| Some((entry, read_frame(survey, &root, index).err()?.into()))).collect();
    found.doubts.extend(plausibility::of_survey(&survey.camera));
    tell_readable(survey, &unreadable, found);
}

fn tell_readable(survey: &Survey, unreadable: &[(&FrameEntry, Error)], found: &mut Inspection) {
    let readable = survey.frames.len() - unreadable.len();
    found.add("frames readable", if unreadable.is_empty() { "all".to_owned() } else { format!("{readable}") });
    if let Some((first, error)) = unreadable.first() {
        let words = format!("{} of {} frames cannot be read: {error}", unreadable.len(), survey.frames.len());
        found.doubts.push(Doubt::about(DoubtKind::UnreadableFrames, &first.station, words));
    }
}

/// Reads all frames, one in memory at a time, and judges them.
fn inspect_frames(path: &Path, survey: &Survey, found: &mut Inspection) -> Result<()> {
    found.doubts.extend(fit(path, survey)?);
    if survey.frames.is_empty() {
        found.doubts.extend(plausibility::of_survey(&survey.camera));
        found.add("frames readable", "none listed");
        return Ok(());
    }
    if survey.level == Level::Intensity {
        inspect_images(path, survey, found);
        return Ok(());
    }
    let opened = open(path, (None, String::new()), Purpose::Camera)?;
    let stages: &[Stage] = match survey.level {
        Level::Samples => &[Stage::Demodulate(DemodulateOptions::default())],
        _ => &[],
    };
    let mut line = Line::new(stages, &opened)?;
    let (mut watch, mut votes, mut stored) = (FrameWatch::default(), SenseVotes::default(), StoredWatch::default());
    let (mut unreadable, mut judged) = (Vec::new(), BTreeSet::new());
    for (index, entry) in survey.frames.iter().enumerate() {
        let view = match opened.view(index) {
            Ok(view) => view,
            Err(error) => {
                unreadable.push((entry, error));
                continue;
            }
        };
        watch.look(&view);
        stored.look(&opened, &view);
        // One frame of a station tells the sense of the phase.
        if survey.level <= Level::Phase && judged.insert(&entry.station) && judged.len() <= MOST_JUDGED {
            for view in &line.apply(vec![Ok(view)], &mut ())? {
                votes.look_at(view);
            }
        }
    }
    tell_readable(survey, &unreadable, found);
    if let Some(words) = votes.in_words() {
        found.add("phase", words);
    }
    for (name, words) in stored.in_words() {
        found.add(name, words);
    }
    found.doubts.extend(opened.doubts);
    found.doubts.extend(watch.doubts());
    found.doubts.extend(votes.doubt());
    found.doubts.extend(stored.doubts());
    Ok(())
}

/// What does not fit of the calibration beside the survey.
fn fit(path: &Path, survey: &Survey) -> Result<Vec<Doubt>> {
    let (Some(calibration), _) = read_calibration(&root_of(path), None)? else { return Ok(Vec::new()) };
    let ranges = if corrects_ranges(&calibration) { Purpose::Ranges(DriftTreatment::Apply) } else { Purpose::Camera };
    Ok(match compatible(survey, &calibration, ranges) {
        Ok(fit) => fit.doubts,
        Err(error) => vec![Doubt::about(DoubtKind::Calibration, Calibration::FILE_NAME, error.to_string())],
    })
}

fn inspect_calibration(path: &Path, found: &mut Inspection) -> Result<()> {
    let calibration = Calibration::read(path)?;
    found.add("calibration", path.display());
    found.add("method", &calibration.provenance.method);
    found.add("size", format!("{} x {} pixels", calibration.camera.width, calibration.camera.height));
    let ranges = calibration.range_models.iter().flat_map(|model| &model.parameters);
    let drift = calibration.warm_up.iter().flat_map(CalibratedDrift::parameters).collect::<Vec<_>>();
    for parameter in calibration.parameters.iter().chain(ranges).chain(&drift) {
        let sigma = if parameter.sigma > 0.0 { format!(" +- {:.3e}", parameter.sigma) } else { String::new() };
        found.add(
            "parameter",
            format!(
                "{:<4} {:>13.6e}{sigma} {} ({:?})",
                parameter.name, parameter.value, parameter.unit, parameter.status
            ),
        );
    }
    let scattering = calibration.scattering.as_ref();
    found.add(
        "scattering",
        scattering.map_or_else(|| "none".to_owned(), |psf| format!("{:.2} % of the light", 100.0 * psf.total_weight())),
    );
    Ok(())
}

fn inspect_cloud(path: &Path, found: &mut Inspection) -> Result<()> {
    let cloud = read_cloud(path)?;
    found.add("cloud", path.display());
    found.add("points", cloud.points.len());
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let values = cloud.points.iter().map(|point| point[axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        found.add(name, format!("{low:.3} m to {high:.3} m"));
    }
    if let Some(flags) = &cloud.flags {
        let flagged = flags.iter().filter(|flags| **flags != 0).count();
        found.add("flagged", format!("{flagged} points"));
    }
    Ok(())
}
