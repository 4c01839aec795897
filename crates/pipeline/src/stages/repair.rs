use phase_unwrap::{RepairOptions, SpatialOptions, repair_ranges};
use range_image::Flags;
use range_io::survey::Level;

use super::Findings;
use super::unwrap::image_geometry;
use crate::plan::RepairWrapsOptions;
use crate::progress::Progress;
use crate::view::{View, ViewData};
use crate::work::Work;
use crate::{Error, Result};

/// Whole ambiguity intervals that the camera's ranges have lost are added where they are sure.
pub(super) fn run(work: &mut Work, options: &RepairWrapsOptions, progress: &dyn Progress) -> Result<Findings> {
    if work.outcome.survey.level < Level::Range {
        let level = work.outcome.survey.level.name();
        let needs = "range` or `depth";
        return Err(Error::RuledOut { stage: "RepairWraps", needs, level });
    }
    let geometry = image_geometry(&work.calibrated_camera.unwrap_or(work.outcome.camera));
    let mut findings = Findings::new();
    for (index, view) in work.outcome.views.iter_mut().enumerate() {
        let interval_m = interval(view, options)?;
        let maximum_wraps = (options.maximum_range_m / interval_m).floor().clamp(0.0, f64::from(u16::MAX)) as u16;
        let standard = RepairOptions::default();
        let spatial = SpatialOptions {
            maximum_wraps,
            minimum_confidence: options.minimum_confidence as f32,
            geometry: Some(geometry),
            ..standard.spatial
        };
        let (repaired, unsure) = repair(view, interval_m, &RepairOptions { spatial, ..standard })?;
        *findings.entry("repaired_px".to_owned()).or_default() += repaired as f64;
        *findings.entry("unsure_px".to_owned()).or_default() += unsure as f64;
        progress.advance(index + 1);
    }
    Ok(findings)
}

/// The interval named, or that of the survey's modulation.
fn interval(view: &View, options: &RepairWrapsOptions) -> Result<f64> {
    let known = view.modulation.map(|modulation| modulation.ambiguity_interval_m());
    options.interval_m.or(known).ok_or_else(|| {
        let message = "the survey states no modulation frequency: name the ambiguity interval with `interval_m`";
        Error::unfit("RepairWraps", &view.name(), message)
    })
}

/// Repairs a view; pixels repaired and pixels left unsure.
fn repair(view: &mut View, interval_m: f64, options: &RepairOptions) -> Result<(usize, usize)> {
    let name = view.name();
    let ViewData::Range(frame) = &mut view.data else {
        return Err(Error::Needs { stage: "RepairWraps", needs: "Average" });
    };
    let mask = frame.flags.map(|flags| !flags.contains(Flags::NO_DATA));
    let known = frame.amplitude.as_slice().iter().any(|amplitude| amplitude.is_finite());
    let amplitude = Some(&frame.amplitude).filter(|_| known);
    let found = repair_ranges(&frame.range, amplitude, Some(&mask), interval_m, options);
    let found = found.map_err(Error::stage("RepairWraps", &name))?;
    frame.range = found.range;
    for (flags, unsure) in frame.flags.as_mut_slice().iter_mut().zip(found.unsure.as_slice()) {
        if *unsure {
            flags.insert(Flags::UNWRAP_UNSURE);
        }
    }
    let repaired = found.wraps.as_slice().iter().filter(|wraps| **wraps != 0).count();
    Ok((repaired, found.unsure.as_slice().iter().filter(|unsure| **unsure).count()))
}
