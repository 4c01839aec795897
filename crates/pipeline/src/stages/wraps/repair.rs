use phase_unwrap::{ImageGeometry, RepairOptions, RepairVerdict, SpatialOptions, repair_ranges};
use range_image::Flags;
use range_io::survey::Level;

use crate::stages::line::Making;
use crate::stages::wraps::unwrap::image_geometry;
use crate::stages::{Found, ViewStage};
use crate::survey::records::StageSummary;
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::RepairWrapsOptions;
use commands::{Doubt, DoubtKind};

/// Finding: views whose ambiguity intervals nothing tells.
const UNJUDGED_VIEWS: &str = "views_without_amplitude";

/// Whole ambiguity intervals that the camera's ranges have lost are added where they are sure.
pub(crate) struct Repair {
    options: RepairWrapsOptions,
    geometry: ImageGeometry,
}

impl Repair {
    pub(crate) fn new(options: &RepairWrapsOptions, making: &Making<'_>) -> Result<Self> {
        let level = making.survey.survey.level;
        if level < Level::Range {
            let needs = "range` or `depth";
            return Err(Error::RuledOut { stage: "RepairWraps", needs, level: level.name() });
        }
        let geometry = image_geometry(&making.survey.calibrated_camera.unwrap_or(making.camera));
        Ok(Self { options: options.clone(), geometry })
    }
}

impl ViewStage for Repair {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let options = &self.options;
        let interval_m = interval(view, options)?;
        let maximum_wraps = (options.maximum_range_m / interval_m).floor().clamp(0.0, f64::from(u16::MAX)) as u16;
        let standard = RepairOptions::default();
        let spatial = SpatialOptions {
            maximum_wraps,
            minimum_confidence: options.minimum_confidence as f32,
            geometry: Some(self.geometry),
            ..standard.spatial
        };
        let amplitude_kind = options.amplitudes.into();
        let repaired = repair(view, interval_m, &RepairOptions { spatial, amplitude_kind, ..standard })?;
        found.add("repaired_px", repaired.added);
        found.add("unsure_px", repaired.unsure);
        if repaired.unjudged > 0 {
            found.add(UNJUDGED_VIEWS, 1);
            found.add("unjudged_px", repaired.unjudged);
        }
        Ok(())
    }
}

/// The interval named, or that of the survey's modulation.
fn interval(view: &View, options: &RepairWrapsOptions) -> Result<f64> {
    let known = view.modulation.map(|modulation| modulation.ambiguity_interval_m());
    options.interval_m.or(known).ok_or_else(|| {
        let message = "the survey states no modulation frequency: name the ambiguity interval with `interval_m`";
        Error::unfit("RepairWraps", &view.name(), message)
    })
}

/// What became of a view's pixels.
struct Repaired {
    /// With intervals added.
    added: usize,
    /// Flagged.
    unsure: usize,
    /// Left as they were, as nothing tells their counts, and not flagged: it concerns the view and not these pixels.
    unjudged: usize,
}

fn repair(view: &mut View, interval_m: f64, options: &RepairOptions) -> Result<Repaired> {
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
    let added = found.wraps.as_slice().iter().filter(|wraps| **wraps != 0).count();
    let usable = found.unsure.as_slice().iter().zip(mask.as_slice()).filter(|(unsure, usable)| **unsure && **usable);
    let open = usable.count();
    if matches!(found.verdict, RepairVerdict::Relative { .. }) {
        return Ok(Repaired { added, unsure: 0, unjudged: open });
    }
    for (flags, unsure) in frame.flags.as_mut_slice().iter_mut().zip(found.unsure.as_slice()) {
        if *unsure {
            flags.insert(Flags::UNWRAP_UNSURE);
        }
    }
    Ok(Repaired { added, unsure: open, unjudged: 0 })
}

/// What to say where nothing tells the counts of whole views.
pub(crate) fn unjudged(stages: &[StageSummary]) -> Option<Doubt> {
    let findings = &stages.iter().find(|stage| stage.name == "RepairWraps")?.findings;
    let (views, pixels) = (findings.get(UNJUDGED_VIEWS)?, findings.get("unjudged_px")?);
    Some(Doubt::new(
        DoubtKind::Wraps,
        format!(
            "without amplitudes nothing tells how many ambiguity intervals the ranges have lost: {pixels} pixels of \
             {views} views are left as they are; give amplitudes, or leave RepairWraps out where all is nearer than one \
             interval"
        ),
    ))
}
