//! A calibration made ready for a stream, which may happen on another thread.

use std::fmt;
use std::sync::Arc;

use camera_model::{Camera, RayTable};
use error_models::{FixedPattern, InterpolatedModel, ModelSet, PreparedCorrection, RangeErrorModel, WarmUp};
use phase_unwrap::{ImageGeometry, SpatialOptions};
use range_image::{Demodulator, Modulation};
use range_io::calibration::{Calibration, ValidSpan};
use scattering_deconvolution::{OutsideLightDetector, OutsideLightOptions, RestorationOptions, Restorer};

use crate::camera::{Exposure, LiveCamera};
use crate::error::{Error, Result};
use crate::stages::{DriftStage, Stages};

/// Longest range where nothing else bounds it, metre: that of a room, as in a pipeline.
pub(crate) const FURTHEST_M: f64 = 15.0;
/// Modulation frequencies (relative) that are the same, as in a pipeline: a group refractive index of air makes 0.0003; the
/// channels that keep cameras apart differ by 0.03.
const SAME_FREQUENCY: f64 = 1e-3;
/// Times (relative) that are the same: they went through a file or a unit's conversion.
const SAME_TIME: f64 = 1e-6;
/// Integration times whose corrections are kept: those of a camera that changes between a few.
const KEPT_TIMES: usize = 8;

/// A calibration with all that is computed of it once: rays, filters, corrections.
///
/// Made apart, on any thread, and then handed to [`Processor::set_calibration`](crate::Processor::set_calibration), which only
/// exchanges it.
pub struct PreparedCalibration {
    pub(crate) camera: Camera,
    live: LiveCamera,
    pub(crate) rays: RayTable,
    pub(crate) demodulator: Demodulator,
    pub(crate) scattering: Option<Scattering>,
    pub(crate) geometry: ImageGeometry,
    pub(crate) span: ValidSpan,
    set: ModelSet,
    pattern: Option<Arc<FixedPattern>>,
    drift: Option<WarmUp>,
    /// Whether there is anything to correct.
    corrects: bool,
    /// Corrections of all frequencies by integration time.
    corrections: Vec<(Option<f64>, Vec<PreparedCorrection>)>,
}

/// What takes scattered light off.
pub(crate) struct Scattering {
    pub(crate) restorer: Restorer,
    pub(crate) outside: Option<OutsideLightDetector>,
}

impl PreparedCalibration {
    /// Makes a calibration ready for frames of a camera and the stages of its processor.
    ///
    /// # Errors
    /// [`Error::OtherCamera`] for another size or other frequencies, [`Error::FrameRate`], and what the parts refuse.
    pub fn new(live: &LiveCamera, calibration: &Calibration, stages: &Stages) -> Result<Self> {
        live.validate()?;
        let of_file = |error: range_io::Error| Error::Calibration(error.to_string());
        calibration.validate().map_err(of_file)?;
        let camera = calibration.camera().map_err(of_file)?;
        let size = |width: usize, height: usize| format!("{width} x {height} pixels");
        let (found, expected) = (size(camera.format.width, camera.format.height), size(live.width, live.height));
        if found != expected {
            return Err(Error::OtherCamera { what: "size", found, expected });
        }
        let noise = Some(live.demodulation.noise).filter(range_image::NoiseModel::is_known);
        let mut demodulation = live.demodulation.clone();
        demodulation.noise = noise.or(calibration.noise).unwrap_or_default();
        let drift = calibration.warm_up.as_ref().filter(|_| stages.drift == DriftStage::Apply);
        if drift.is_some_and(|drift| drift.model.frame_rate.is_some()) {
            return Err(Error::FrameRate);
        }
        Ok(Self {
            rays: RayTable::new(&camera)?,
            demodulator: Demodulator::new(&demodulation)?.without_offset(),
            scattering: scattering(live, calibration, stages)?,
            geometry: image_geometry(&camera),
            span: calibration.span,
            set: model_set(live, calibration)?,
            pattern: calibration.fixed_pattern.clone().map(Arc::new),
            drift: drift.map(|drift| drift.model.clone()),
            corrects: !calibration.range_models.is_empty() || calibration.warm_up.is_some(),
            corrections: Vec::new(),
            live: live.clone(),
            camera,
        })
    }

    /// Makes the corrections of an integration time ready as well, which the first frame with it would have to wait for.
    ///
    /// # Errors
    /// [`Error::Exposure`] where the calibration has nothing for it.
    pub fn prepare_exposure(&mut self, integration_time_s: Option<f64>) -> Result<()> {
        if self.corrects { self.correction_index(integration_time_s).map(drop) } else { Ok(()) }
    }

    /// The camera that frames are made for.
    pub fn live_camera(&self) -> &LiveCamera {
        &self.live
    }

    /// Drift at a frame, metre; zero where there is none.
    pub(crate) fn drift_m(&self, exposure: &Exposure) -> Result<f64> {
        let Some(drift) = &self.drift else { return Ok(0.0) };
        let time_s = self.live.power_on_s.map(|power_on_s| exposure.timestamp_s - power_on_s);
        if !drift.transients.is_empty() && time_s.is_none() {
            return Err(Error::Unstated { what: "the time since power-on (`LiveCamera::power_on_s`)" });
        }
        if drift.temperature.is_some() && exposure.temperature_c.is_none() {
            return Err(Error::Unstated { what: "the camera's temperature" });
        }
        Ok(drift.value(time_s, exposure.temperature_c)?)
    }

    /// Whether the temperature of a frame lies outside of what the calibration rests on.
    pub(crate) fn too_warm_or_cold(&self, exposure: &Exposure) -> bool {
        let outside = |([low, high], value): ([f64; 2], f64)| value < low || value > high;
        self.corrects && self.span.temperature_c.zip(exposure.temperature_c).is_some_and(outside)
    }

    /// Makes the corrections for a frame ready; their place, `None` where the calibration has nothing to correct.
    pub(crate) fn ready(&mut self, exposure: &Exposure, drift_m: f64) -> Result<Option<usize>> {
        if !self.corrects {
            return Ok(None);
        }
        let index = self.correction_index(exposure.integration_time_s)?;
        for correction in &mut self.corrections[index].1 {
            correction.set_drift(drift_m);
        }
        Ok(Some(index))
    }

    /// One correction a frequency.
    pub(crate) fn corrections(&self, index: usize) -> &[PreparedCorrection] {
        self.corrections.get(index).map_or(&[], |(_, corrections)| corrections)
    }

    fn correction_index(&mut self, time_s: Option<f64>) -> Result<usize> {
        let same = |known: Option<f64>| known.map(f64::to_bits) == time_s.map(f64::to_bits);
        if let Some(index) = self.corrections.iter().position(|(known, _)| same(*known)) {
            return Ok(index);
        }
        let (format, point_mm) = (self.camera.format, self.camera.interior.principal_point_mm);
        let models = self.models(time_s)?;
        let ready = models.iter().map(|model| model.prepare(&format, point_mm, self.pattern.clone()));
        let ready = ready.collect::<std::result::Result<Vec<_>, _>>()?;
        if self.corrections.len() == KEPT_TIMES {
            self.corrections.remove(0);
        }
        self.corrections.push((time_s, ready));
        Ok(self.corrections.len() - 1)
    }

    /// The models for an integration time, as a pipeline chooses them.
    fn models(&self, time_s: Option<f64>) -> Result<Vec<InterpolatedModel>> {
        let refused = |time: f64, reason: String| Error::Exposure { integration_time_s: time, reason };
        if let (Some(time), Some([low, high])) = (time_s, self.span.integration_time_s)
            && (time < low - SAME_TIME * low.abs() || time > high + SAME_TIME * high.abs() || time.is_nan())
        {
            return Err(refused(time, format!("the calibration's span is {low} to {high} s: calibrate there as well")));
        }
        match (time_s, self.set.entries.as_slice()) {
            (_, []) => {
                let intervals = self.live.modulations.iter().map(Modulation::ambiguity_interval_m);
                Ok(intervals.map(|interval_m| RangeErrorModel::error_free(interval_m).into()).collect())
            }
            (Some(time), _) => self.set.at(time).map_err(|error| match error {
                error_models::Error::NoModelForIntegrationTime { .. } => refused(time, error.to_string()),
                error => error.into(),
            }),
            (None, [(_, models)]) => Ok(models.iter().cloned().map(InterpolatedModel::from).collect()),
            (None, _) => Err(Error::Unstated { what: "the integration time" }),
        }
    }

    /// How the counts of one frequency are found, as a pipeline does.
    pub(crate) fn spatial_options(&self, maximum_range_m: Option<f64>) -> SpatialOptions {
        let interval_m = self.live.modulations.first().map_or(f64::INFINITY, Modulation::ambiguity_interval_m);
        let maximum_wraps = (maximum_range_m.unwrap_or(FURTHEST_M) / interval_m).floor().max(0.0) as u16;
        SpatialOptions { maximum_wraps, geometry: Some(self.geometry), ..SpatialOptions::default() }
    }
}

impl fmt::Debug for PreparedCalibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PreparedCalibration")
            .field("camera", &self.camera)
            .field("span", &self.span)
            .finish_non_exhaustive()
    }
}

fn scattering(live: &LiveCamera, calibration: &Calibration, stages: &Stages) -> Result<Option<Scattering>> {
    let (Some(psf), Some(stage)) = (&calibration.scattering, &stages.deconvolve) else { return Ok(None) };
    let options = RestorationOptions { regularisation: stage.regularisation, ..RestorationOptions::default() };
    let restorer = Restorer::new(psf, live.width, live.height, &options)?;
    let outside = if stage.outside_light && !psf.is_empty() {
        Some(OutsideLightDetector::new(psf, live.width, live.height, &OutsideLightOptions::default())?)
    } else {
        None
    };
    Ok(Some(Scattering { restorer, outside }))
}

/// The range models of the camera's frequencies, in their order.
fn model_set(live: &LiveCamera, calibration: &Calibration) -> Result<ModelSet> {
    let of_file = |error: range_io::Error| Error::Calibration(error.to_string());
    let mut set = calibration.model_set().map_err(of_file)?;
    let known = calibration.modulations().map_err(of_file)?;
    if known.is_empty() {
        return Ok(set);
    }
    let words = |modulations: &[Modulation]| {
        let each = modulations.iter().map(|one| format!("{} MHz", one.frequency_hz().round() / 1e6));
        each.collect::<Vec<_>>().join(", ")
    };
    let place = |one: &Modulation| {
        let off = |other: &Modulation| (other.frequency_hz() / one.frequency_hz() - 1.0).abs();
        let nearest = (0..known.len()).min_by(|&a, &b| off(&known[a]).total_cmp(&off(&known[b])));
        nearest.filter(|&index| off(&known[index]) <= SAME_FREQUENCY).ok_or_else(|| Error::OtherCamera {
            what: "modulation",
            found: words(&known),
            expected: words(&live.modulations),
        })
    };
    let places = live.modulations.iter().map(place).collect::<Result<Vec<_>>>()?;
    for (_, models) in &mut set.entries {
        *models = places.iter().map(|&place| models[place].clone()).collect();
    }
    Ok(set)
}

/// What unwrapping needs to know of the camera, in pixels.
fn image_geometry(camera: &Camera) -> ImageGeometry {
    let format = camera.format;
    let [column, row] = format.pixel_from_image(camera.interior.principal_point_mm);
    // One principal distance serves both directions, as in a pipeline.
    let pitch = f64::midpoint(format.pixel_pitch_mm[0], format.pixel_pitch_mm[1]);
    ImageGeometry {
        principal_distance_px: (camera.interior.principal_distance_mm / pitch) as f32,
        principal_point_px: [column as f32, row as f32],
    }
}
