use std::f64::consts::TAU;
use std::sync::Arc;

use camera_model::RayTable;
use error_models::FixedPattern;
use nalgebra::Point3;
use rand::RngExt;
use range_image::RawFrame;
use scattering_deconvolution::Scatterer;

use crate::light::Lighting;
use crate::random::{mix, row_generator};
use crate::render::{Channel, Image, Renderer};
use crate::samples::sample_frame;
use crate::scene::Scene;
use crate::spec::SimulationSpec;
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
    /// The samples.
    pub raw: RawFrame,
    /// What they should show; shared by the frames of a station.
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
    lighting: Lighting,
    channels: Vec<Channel>,
    pattern: Option<FixedPattern>,
}

/// What one station sees, before noise: as many frames as wanted can be taken of it.
#[derive(Debug, Clone)]
pub struct StationImage {
    spec: Arc<SimulationSpec>,
    station: usize,
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
    let total = spec.stations.len() * spec.exposure.frames_per_station;
    let mut frames = Vec::new();
    for station in 0..spec.stations.len() {
        let image = simulator.station(station)?;
        for frame in 0..spec.exposure.frames_per_station {
            frames.push(simulator.frame(&image, frame, seed)?);
            progress(frames.len(), total);
        }
    }
    Ok(SimulatedSurvey { frames, fixed_pattern: simulator.pattern })
}

/// Simulates one frame of one station: the same bits as that frame of [`simulate`].
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
            lighting: Lighting::new(&spec.illumination, &spec.exposure, spec.errors.multipath.as_ref()),
            channels: channels(spec)?,
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
        let place = self.spec.stations.get(station).ok_or(Error::NoSuch { what: "station", index: station, count })?;
        let renderer = Renderer {
            scene: &self.scene,
            camera: &self.spec.camera.geometry,
            lighting: &self.lighting,
            channels: &self.channels,
            pattern: self.pattern.as_ref(),
            mixed_pixels: self.spec.errors.mixed_pixels,
            world_from_camera: place.world_from_camera(),
        };
        let (mut image, truth) = renderer.render()?;
        // Before the scattering, which does not ask where light comes from.
        if let Some(gross) = &self.spec.errors.gross_errors {
            spoil(&mut image, gross, station);
        }
        self.scatter(&mut image)?;
        Ok(StationImage { spec: Arc::clone(&self.spec), station, image, truth: Arc::new(truth) })
    }

    /// Takes one frame of a station, with noise of its own.
    ///
    /// # Errors
    /// A frame that the description does not have; an image of another simulator.
    pub fn frame(&self, image: &StationImage, frame: usize, seed: u64) -> Result<SimulatedFrame> {
        if !Arc::ptr_eq(&self.spec, &image.spec) {
            return Err(Error::ForeignImage);
        }
        let (exposure, stations) = (self.spec.exposure, &self.spec.stations);
        let count = exposure.frames_per_station;
        if frame >= count {
            return Err(Error::NoSuch { what: "frame", index: frame, count });
        }
        let number = image.station * count + frame;
        Ok(SimulatedFrame {
            station: stations[image.station].name.clone(),
            station_index: image.station,
            frame_index: frame,
            timestamp_s: exposure.start_s + number as f64 * exposure.frame_interval_s,
            integration_time_s: exposure.integration_time_s,
            raw: sample_frame(&self.spec, &image.image, seed, number)?,
            truth: Arc::clone(&image.truth),
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

fn channels(spec: &SimulationSpec) -> Result<Vec<Channel>> {
    let models = spec.errors.range.as_deref().unwrap_or_default();
    let channel = |(index, modulation): (usize, range_image::Modulation)| Channel {
        ambiguity_interval_m: modulation.ambiguity_interval_m(),
        model: models.get(index).cloned(),
    };
    Ok(spec.camera.modulations()?.into_iter().enumerate().map(channel).collect())
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
