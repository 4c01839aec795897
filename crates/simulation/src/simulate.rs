use std::f64::consts::TAU;
use std::sync::Arc;

use camera_model::RayTable;
use error_models::{FixedPattern, RangeErrorModel, WarmUp};
use nalgebra::Point3;
use rand::RngExt;
use range_image::RawFrame;
use scattering_deconvolution::Scatterer;

use crate::light::Lighting;
use crate::random::{mix, row_generator};
use crate::render::{Channel, Image, Reference, Renderer};
use crate::samples::sample_frame;
use crate::scene::Scene;
use crate::spec::SimulationSpec;
use crate::spec::camera::ReferencePathSpec;
use crate::spec::errors::GrossErrorsSpec;
use crate::{Error, FrameTruth, Result};

/// One simulated frame.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedFrame {
    /// Name of the station.
    pub station: String,
    /// Index of the station in the description.
    pub station_index: usize,
    /// Index of the frame at its station.
    pub frame_index: usize,
    /// When it was taken.
    pub timestamp_s: f64,
    /// Integration time of a sample.
    pub integration_time_s: f64,
    /// Temperature of the camera, degree Celsius, where the description has one.
    pub temperature_c: Option<f64>,
    /// The samples.
    pub raw: RawFrame,
    /// What they should show; shared by the frames of a station with one integration time, unless the camera drifts.
    pub truth: Arc<FrameTruth>,
}

/// All frames of a simulation, station by station.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedSurvey {
    /// The frames in the order in which they were taken.
    pub frames: Vec<SimulatedFrame>,
    /// The pixels' own range offsets, where there are any.
    pub fixed_pattern: Option<FixedPattern>,
}

/// A simulation that is ready to run, station by station, for those who do not want all frames in memory.
pub struct Simulator {
    spec: Arc<SimulationSpec>,
    scene: Scene,
    /// One for each integration time.
    exposures: Vec<Exposure>,
    pattern: Option<FixedPattern>,
}

/// Light and range errors of one integration time.
struct Exposure {
    integration_time_s: f64,
    lighting: Lighting,
    channels: Vec<Channel>,
}

/// What one station sees, before noise: as many frames as wanted can be taken of it.
#[derive(Debug, Clone)]
pub struct StationImage {
    spec: Arc<SimulationSpec>,
    station: usize,
    /// One for each integration time; none where the camera drifts from frame to frame.
    views: Vec<Exposed>,
}

/// What the sensor shows without noise, and the truth of it.
#[derive(Debug, Clone)]
struct Exposed {
    image: Image,
    truth: Arc<FrameTruth>,
}

/// Simulates all frames. `progress` is told the frames done and their total, from the calling thread.
///
/// The same description and seed give the same bits, whatever the number of threads.
///
/// # Errors
/// What [`SimulationSpec::validate`] finds, or an observed range that the range errors do not determine.
pub fn simulate(spec: &SimulationSpec, seed: u64, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<SimulatedSurvey> {
    let simulator = Simulator::new(spec)?;
    let total = spec.stations.len() * spec.exposure.frames_at_station();
    let mut frames = Vec::new();
    for station in 0..spec.stations.len() {
        let image = simulator.station(station)?;
        for frame in 0..spec.exposure.frames_at_station() {
            frames.push(simulator.frame(&image, frame, seed)?);
            progress(frames.len(), total);
        }
    }
    Ok(SimulatedSurvey { frames, fixed_pattern: simulator.pattern })
}

/// Simulates one frame of one station: the same bits as that frame of [`simulate`].
///
/// ```
/// use simulation::{SimulationSpec, simulate_frame};
///
/// // A room seen by a camera of 44 by 36 pixels at 30 MHz without any error.
/// let spec = SimulationSpec::from_ron(r#"(
///     scene: (objects: [(name: "room", shape: Room(min_m: (0, 0, 0), max_m: (7, 5, 3)), albedo: 0.6)]),
///     camera: (
///         geometry: (
///             format: (width: 44, height: 36, pixel_pitch_mm: (0.16, 0.16)),
///             interior: (principal_point_mm: (0, 0), principal_distance_mm: 5),
///         ),
///         modulation_hz: [30e6],
///         phase_steps: 4,
///     ),
///     illumination: (source_power: 4e6),
///     exposure: (frames_per_station: 2, integration_time_s: 0.002),
///     stations: [(name: "A", position_m: (1, 2, 1.4), attitude: LookAt(target_m: (5, 2.4, 1.1)))],
/// )"#)?;
/// let frame = simulate_frame(&spec, 1, 0, 1)?;
/// assert_eq!(frame.raw.phase_steps(), 4);
/// assert!(frame.truth.range[(22, 18)] > 5.0); // metre, to the wall
/// # Ok::<(), simulation::Error>(())
/// ```
pub fn simulate_frame(spec: &SimulationSpec, seed: u64, station: usize, frame: usize) -> Result<SimulatedFrame> {
    let simulator = Simulator::new(spec)?;
    simulator.frame(&simulator.station(station)?, frame, seed)
}

impl Simulator {
    /// Checks the description and makes it ready for rays.
    pub fn new(spec: &SimulationSpec) -> Result<Self> {
        spec.validate()?;
        let scene = Scene::new(&spec.scene)?;
        require_free_stations(spec, &scene)?;
        // Refuses a lens whose rays are not unique inside the image.
        RayTable::new(&spec.camera.geometry)?;
        let format = spec.camera.geometry.format;
        Ok(Self {
            scene,
            exposures: spec
                .exposure
                .integration_times_s()
                .map(|time| Exposure::new(spec, time))
                .collect::<Result<_>>()?,
            pattern: spec.errors.fixed_pattern.map(|pattern| pattern.pattern(format.width, format.height)),
            spec: Arc::new(spec.clone()),
        })
    }

    /// The description.
    pub fn spec(&self) -> &SimulationSpec {
        &self.spec
    }

    /// The pixels' own range offsets, where there are any.
    pub fn fixed_pattern(&self) -> Option<&FixedPattern> {
        self.pattern.as_ref()
    }

    /// Renders what one station sees.
    pub fn station(&self, station: usize) -> Result<StationImage> {
        let count = self.spec.stations.len();
        if station >= count {
            return Err(Error::NoSuch { what: "station", index: station, count });
        }
        let drifts = self.spec.errors.warm_up.is_some();
        let still = self.exposures.iter().filter(|_| !drifts);
        let views = still.map(|exposure| self.expose(station, exposure, 0.0)).collect::<Result<_>>()?;
        Ok(StationImage { spec: Arc::clone(&self.spec), station, views })
    }

    /// Renders a station's image at an integration time, all ranges too long by a drift.
    fn expose(&self, station: usize, exposure: &Exposure, drift_m: f64) -> Result<Exposed> {
        let (camera, errors) = (&self.spec.camera, &self.spec.errors);
        let mut channels = exposure.channels.clone();
        for channel in channels.iter_mut().filter(|_| drift_m != 0.0) {
            let interval_m = channel.ambiguity_interval_m;
            channel.model.get_or_insert_with(|| RangeErrorModel::error_free(interval_m).into()).add_offset(drift_m);
        }
        let reference =
            |spec: ReferencePathSpec| Reference { spec, amplitude: spec.power * exposure.integration_time_s };
        let renderer = Renderer {
            scene: &self.scene,
            camera: &camera.geometry,
            lighting: &exposure.lighting,
            channels: &channels,
            pattern: self.pattern.as_ref(),
            mixed_pixels: errors.mixed_pixels,
            reference: camera.reference_path.map(reference),
            world_from_camera: self.spec.stations[station].world_from_camera(),
        };
        let (mut image, truth) = renderer.render()?;
        // Before the scattering, which does not ask where light comes from.
        if let Some(gross) = &errors.gross_errors {
            spoil(&mut image, gross, station);
        }
        self.scatter(&mut image)?;
        Ok(Exposed { image, truth: Arc::new(truth) })
    }

    /// Takes one frame of a station, with noise of its own.
    ///
    /// # Errors
    /// A frame that the description does not have; an image of another simulator.
    pub fn frame(&self, image: &StationImage, frame: usize, seed: u64) -> Result<SimulatedFrame> {
        if !Arc::ptr_eq(&self.spec, &image.spec) {
            return Err(Error::ForeignImage);
        }
        let (spec, count) = (&self.spec.exposure, self.spec.exposure.frames_at_station());
        if frame >= count {
            return Err(Error::NoSuch { what: "frame", index: frame, count });
        }
        let (station, number) = (image.station, image.station * count + frame);
        let timestamp_s = spec.timestamp_s(number);
        let temperature_c = spec.temperature_c(timestamp_s);
        let setting = frame / spec.frames_per_station;
        let exposure = &self.exposures[setting];
        let drifted;
        let exposed = match (image.views.get(setting), &self.spec.errors.warm_up) {
            (Some(exposed), _) => exposed,
            (None, drift) => {
                let time_s = spec.power_on_s.map(|power_on_s| timestamp_s - power_on_s);
                let follows = drift.as_ref().is_some_and(|drift| drift.frame_rate.is_some());
                let rates = if follows { spec.rates()? } else { None };
                let value = |drift: &WarmUp| drift.value_at_rates(time_s, temperature_c, rates.as_ref());
                let drift_m = drift.as_ref().map_or(Ok(0.0), value)?;
                drifted = self.expose(station, exposure, drift_m)?;
                &drifted
            }
        };
        Ok(SimulatedFrame {
            station: self.spec.stations[station].name.clone(),
            station_index: station,
            frame_index: frame,
            timestamp_s,
            integration_time_s: exposure.integration_time_s,
            temperature_c,
            raw: sample_frame(&self.spec, &exposed.image, seed, number)?,
            truth: Arc::clone(&exposed.truth),
        })
    }

    /// `z + psf * z` on each frequency; the mean sample is light too and spreads in the same way.
    fn scatter(&self, image: &mut Image) -> Result<()> {
        let Some(psf) = &self.spec.errors.scattering else { return Ok(()) };
        let format = self.spec.camera.geometry.format;
        let mut seen_by = psf.without_phases();
        let mut scatterer = Scatterer::new(&seen_by, format.width, format.height)?;
        let mut nothing = vec![0.0; image.offset.len()];
        scatterer.apply(&mut image.offset, &mut nothing)?;
        for ([real, imaginary], modulation) in image.channels.iter_mut().zip(self.spec.camera.modulations()?) {
            let modulated = psf.at_modulation(&modulation);
            if modulated != seen_by {
                scatterer = Scatterer::new(&modulated, format.width, format.height)?;
                seen_by = modulated;
            }
            scatterer.apply(real, imaginary)?;
        }
        Ok(())
    }
}

/// Keeps the draws of gross errors apart from those of the noise with the same seed.
const GROSS_ERRORS: u64 = 0x6772_6f73_7300;

/// Turns the light of some pixels by any angle.
fn spoil(image: &mut Image, gross: &GrossErrorsSpec, station: usize) {
    let mut generator = row_generator(mix(gross.seed, GROSS_ERRORS), station, 0);
    for pixel in 0..image.offset.len() {
        let is_wrong = generator.random::<f64>() < gross.share;
        for [real, imaginary] in &mut image.channels {
            // Drawn whether wrong or not: which pixels are wrong does not depend on the number of frequencies' draws.
            let (sin, cos) = (TAU * generator.random::<f64>()).sin_cos();
            if is_wrong {
                let (x, y) = (f64::from(real[pixel]), f64::from(imaginary[pixel]));
                real[pixel] = (cos * x - sin * y) as f32;
                imaginary[pixel] = (sin * x + cos * y) as f32;
            }
        }
    }
}

impl Exposure {
    fn new(spec: &SimulationSpec, integration_time_s: f64) -> Result<Self> {
        let models = spec.errors.range_at(integration_time_s)?;
        let channel = |(index, modulation): (usize, range_image::Modulation)| Channel {
            ambiguity_interval_m: modulation.ambiguity_interval_m(),
            model: models.get(index).cloned(),
        };
        Ok(Self {
            integration_time_s,
            lighting: Lighting::new(&spec.illumination, integration_time_s, spec.errors.multipath.as_ref()),
            channels: spec.camera.modulations()?.into_iter().enumerate().map(channel).collect(),
        })
    }
}

fn require_free_stations(spec: &SimulationSpec, scene: &Scene) -> Result<()> {
    for (index, station) in spec.stations.iter().enumerate() {
        if let Some(object) = scene.solid_around(&Point3::from(station.position_m)) {
            return Err(Error::Field {
                field: format!("stations[{index}].position_m"),
                value: format!("{:?} (inside scene.objects[{object}])", station.position_m),
                expected: "a place outside all solid objects",
            });
        }
    }
    Ok(())
}
