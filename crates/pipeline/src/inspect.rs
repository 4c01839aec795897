//! What a file or folder holds, before anything is done with it.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use range_io::calibration::{CalibratedDrift, Calibration};
use range_io::ply::read_cloud;
use range_io::survey::{Survey, read_frame};
use serde::Serialize;

use crate::load::root_of;
use crate::measure::ruled_out;
use crate::plan::Stage;
use crate::{Error, Result};

/// What was found, by name, in an order for reading.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub struct Inspection {
    entries: Vec<Entry>,
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
        for (index, entry) in self.entries.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{:<20} {}", entry.name, entry.value)?;
        }
        Ok(())
    }
}

/// Looks into a survey's folder, a `calibration.ron` or a `.ply` cloud.
pub fn inspect(path: &Path) -> Result<Inspection> {
    let mut found = Inspection { entries: Vec::new() };
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
            message: "can be inspected: a survey's folder, calibration.ron, a .ply cloud".to_owned(),
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
    found.add("principal distance", format!("{} mm (nominal)", camera.principal_distance_mm));
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
    let root = root_of(path);
    let readable = (0..survey.frames.len()).try_for_each(|index| read_frame(&survey, &root, index).map(|_| ()));
    found.add("frames readable", readable.map_or_else(|error| format!("no: {error}"), |()| "all".to_owned()));
    let blocked = ruled_out(survey.level);
    let open: Vec<&str> = Stage::NAMES.iter().filter(|name| !blocked.contains_key(**name)).copied().collect();
    found.add("stages possible", open.join(", "));
    for (stage, reason) in &blocked {
        found.add("ruled out", format!("{stage}: {reason}"));
    }
    Ok(())
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
