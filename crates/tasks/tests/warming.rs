//! Captures of a wall by a camera that warms up, written as surveys.

use std::path::{Path, PathBuf};

use error_models::{Transient, WarmUp};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{ComplexFrame, PhaseConvention, PhaseSense, Raster};
use range_io::survey::{FrameEntry, InputFrame, Level, ReferencePath, Survey, SurveyCamera, write_frame};

pub const SIZE: [usize; 2] = [16, 12];
/// Time of the first frame on the camera's clock, and of power-on.
pub const FIRST_S: f64 = 5000.0;
pub const POWER_ON_S: f64 = 4940.0;
const INTERVAL_S: f64 = 12.0;
const SIGMA_M: f64 = 0.005;

/// What is written.
pub struct Warming {
    pub level: Level,
    pub frames: usize,
    /// Of the wall, metre.
    pub range_m: f64,
    pub power_on_s: Option<f64>,
    pub reference_path: Option<ReferencePath>,
    /// Changes the entry of a frame, and the range of a pixel of it.
    pub entry: fn(usize, &mut FrameEntry),
    pub change: fn(usize, [usize; 2], f64) -> f64,
}

impl Default for Warming {
    fn default() -> Self {
        let (entry, change) = (|_: usize, _: &mut FrameEntry| {}, |_: usize, _: [usize; 2], range_m: f64| range_m);
        let (power_on_s, reference_path) = (Some(POWER_ON_S), None);
        Self { level: Level::Range, frames: 300, range_m: 2.1, power_on_s, reference_path, entry, change }
    }
}

/// The drift of the camera.
pub fn truth() -> WarmUp {
    let transients = vec![Transient { amplitude_m: -0.01, time_constant_s: 600.0 }];
    WarmUp { transients, ..WarmUp::default() }
}

impl Warming {
    /// Writes the survey and gives its folder.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let root = folder.join("survey");
        std::fs::create_dir(&root).unwrap();
        let mut random = Pcg64::new(5, 1);
        let camera = camera();
        let mut entries = Vec::new();
        for index in 0..self.frames {
            let timestamp_s = FIRST_S + INTERVAL_S * index as f64;
            let drift = truth().value(Some(timestamp_s - POWER_ON_S), None).unwrap();
            let range = Raster::from_fn(SIZE[0], SIZE[1], |col, row| {
                let unit: f64 = StandardNormal.sample(&mut random);
                let range_m = self.range_m + 0.01 * row as f64;
                ((self.change)(index, [col, row], range_m) + drift + SIGMA_M * unit) as f32
            });
            let file = format!("{index:04}.npz");
            write_frame(root.join(&file), &self.frame(range, &camera)).unwrap();
            let mut entry = FrameEntry {
                file: file.into(),
                station: "A".to_owned(),
                timestamp_s: Some(timestamp_s),
                integration_time_s: Some(1e-3),
                temperature_c: None,
            };
            (self.entry)(index, &mut entry);
            entries.push(entry);
        }
        let mut survey = Survey::new(camera, self.level, entries);
        (survey.power_on_s, survey.reference_path) = (self.power_on_s, self.reference_path);
        survey.write(root.join(Survey::FILE_NAME)).unwrap();
        root
    }

    fn frame(&self, range: Raster<f32>, camera: &SurveyCamera) -> InputFrame {
        if self.level == Level::Range {
            return InputFrame::Range { range, amplitude: None, confidence: None };
        }
        let modulations = camera.modulations().unwrap();
        let planes = |value: &dyn Fn(f64) -> f64| -> Vec<Raster<f32>> {
            let radians = modulations.iter().map(|one| one.phase_from_range(1.0));
            radians.map(|radians| range.map(|range| value(f64::from(*range) * radians) as f32)).collect()
        };
        let phase = planes(&|phase| phase.rem_euclid(std::f64::consts::TAU));
        let amplitude = planes(&|_| 100.0);
        let convention = PhaseConvention { phase_sense: PhaseSense::Positive, phase_offset_rad: 0.0 };
        InputFrame::Phase(ComplexFrame::from_phase(modulations, phase, amplitude, &convention).unwrap())
    }
}

fn camera() -> SurveyCamera {
    SurveyCamera {
        width: SIZE[0],
        height: SIZE[1],
        pixel_pitch_mm: [0.04, 0.04],
        principal_distance_mm: 1.0,
        principal_point_mm: [0.0, 0.0],
        modulation_hz: vec![30e6],
        phase_steps: None,
        phase_sense: PhaseSense::Positive,
        phase_offset_rad: 0.0,
        saturation: None,
        raw_scale: 1.0,
    }
}
