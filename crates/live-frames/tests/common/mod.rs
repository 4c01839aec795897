//! Simulated frames of a moving camera, with truth, and a calibration of all its errors.

pub mod judge;

use live_frames::error_models::{AmplitudeHyperbola, FixedPattern, ModelSet, RangeErrorModel, RangeTerms};
use live_frames::range_image::{Modulation, NoiseModel};
use live_frames::range_io::calibration::{Calibration, ValidSpan};
use live_frames::{LiveCamera, Stages};
use simulation::scattering_deconvolution::{GaussianTerm, Psf};
use simulation::{SimulatedFrame, SimulationSpec, Simulator};

/// What a sequence shows.
#[derive(Debug, Clone)]
pub struct Sequence {
    pub width: usize,
    pub height: usize,
    pub modulation_hz: Vec<f64>,
    pub phase_steps: usize,
    /// Standard deviations of the samples' noise, counts.
    pub dark_sigma: f64,
    /// Rays a pixel's side, which mix at edges.
    pub rays: usize,
    pub errors: bool,
    /// Nothing moves.
    pub still: bool,
    /// Frames after the beginning of all motions that the first one is.
    pub first: usize,
}

impl Default for Sequence {
    fn default() -> Self {
        Self {
            width: 128,
            height: 96,
            modulation_hz: vec![30e6],
            phase_steps: 4,
            dark_sigma: 3.0,
            rays: 2,
            errors: true,
            still: false,
            first: 0,
        }
    }
}

/// Seconds from frame to frame.
pub const INTERVAL_S: f64 = 1.0 / 30.0;

pub fn psf() -> Psf {
    Psf::Gaussians(vec![GaussianTerm { weight: 0.05, sigma_px: [9.0, 9.0] }])
}

/// Range terms of a few centimetres.
pub fn model(interval_m: f64) -> RangeErrorModel {
    let terms = RangeTerms { d0: 0.012, periodic: [0.004, -0.003, 0.002, 0.001, -0.002, 0.003], e1: 5e-4, e2: -3e-4 };
    let hyperbola = AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [5.0, 20_000.0] };
    let range_span_m = Some([0.1, 20.0]);
    RangeErrorModel { terms, hyperbola: Some(hyperbola), range_span_m, ..RangeErrorModel::error_free(interval_m) }
}

impl Sequence {
    pub fn camera(&self) -> LiveCamera {
        LiveCamera {
            width: self.width,
            height: self.height,
            phase_steps: self.phase_steps,
            modulations: self.modulation_hz.iter().map(|&hz| Modulation::new(hz).unwrap()).collect(),
            demodulation: self.spec(0.0).demodulation_options(),
            power_on_s: None,
        }
    }

    /// A calibration of the camera with all of its errors.
    pub fn calibration(&self) -> Calibration {
        let spec = self.spec(0.0);
        let modulations = spec.camera.modulations().unwrap();
        let models = modulations.iter().map(|modulation| model(modulation.ambiguity_interval_m())).collect();
        let set = ModelSet { entries: vec![(0.002, models)] };
        let mut calibration = Calibration::from_models(&spec.camera.geometry, &set, Some(&psf())).unwrap();
        calibration.noise = Some(NoiseModel { shot_variance_per_unit: 0.05, dark_sigma: self.dark_sigma });
        calibration.span =
            ValidSpan { range_m: Some([0.5, 8.0]), amplitude: Some([30.0, 1.5e4]), ..ValidSpan::default() };
        let offsets = (0..self.width * self.height).map(|pixel| 1e-4 * ((pixel * 7 % 23) as f32 - 11.0)).collect();
        let (width, height) = (self.width, self.height);
        calibration.fixed_pattern = Some(FixedPattern { width, height, offset_m: offsets, sigma_m: Vec::new() });
        calibration
    }

    /// The room at a time: hand-held motion, a person who crosses it, a ball that swings, a board that slides in.
    fn spec(&self, time_s: f64) -> SimulationSpec {
        let sway =
            |amplitude: f64, hz: f64, phase: f64| amplitude * (std::f64::consts::TAU * hz * time_s + phase).sin();
        let (x, y, z) = (0.6 + sway(0.05, 0.4, 0.0), 2.5 + sway(0.08, 0.3, 1.0), 1.5 + sway(0.03, 0.9, 2.0));
        let (to_y, to_z) = (2.6 + sway(0.5, 0.25, 0.5), 1.2 + sway(0.2, 0.6, 0.0));
        let person_y = 4.6 - 1.2 * time_s.rem_euclid(4.0);
        let (ball_y, ball_z) = (2.5 + sway(0.9, 0.5, 0.3), 1.5 + sway(0.3, 1.1, 0.0));
        let board_y = 3.4 - 0.7 * (time_s - 1.0).clamp(0.0, 3.0);
        let pitch = 6.4 / self.width as f64;
        let modulations = self.modulation_hz.iter().map(|hz| format!("{hz:e}")).collect::<Vec<_>>().join(", ");
        let Self { width, height, phase_steps, dark_sigma, rays, .. } = self;
        let text = format!(
            "(
            scene: (objects: [
                (name: \"room\", shape: Room(min_m: (0, 0, 0), max_m: (9, 5, 3)), albedo: 0.6, texture: Noise(size_m: 0.9, contrast: 0.2, seed: 1)),
                (name: \"person\", shape: Cuboid(center_m: (3.1, {person_y}, 0.9), size_m: (0.3, 0.5, 1.8)), albedo: 0.5),
                (name: \"ball\", shape: Sphere(center_m: (1.8, {ball_y}, {ball_z}), radius_m: 0.18), albedo: 0.7),
                (name: \"board\", shape: Cuboid(center_m: (5.5, {board_y}, 1.3), size_m: (0.05, 1.2, 1.4)), albedo: 0.4),
                (name: \"cabinet\", shape: Cuboid(center_m: (8.6, 1.2, 0.9), size_m: (0.7, 1.2, 1.8)), albedo: 0.7),
                (name: \"pillar\", shape: Cuboid(center_m: (6.6, 3.9, 1.5), size_m: (0.4, 0.4, 3.0)), albedo: 0.3),
            ]),
            camera: (
                geometry: (
                    format: (width: {width}, height: {height}, pixel_pitch_mm: ({pitch}, {pitch})),
                    interior: (principal_point_mm: (0.05, -0.03), principal_distance_mm: 5.2),
                    lens: (k1: -2e-3, k2: 2e-5, p1: 1e-4, p2: -5e-5),
                ),
                modulation_hz: [{modulations}],
                phase_steps: {phase_steps},
            ),
            illumination: (source_power: 5e6, ambient_power: 2e5),
            exposure: (frames_per_station: 1, integration_time_s: 0.002),
            stations: [(name: \"A\", position_m: ({x}, {y}, {z}), attitude: LookAt(target_m: (6, {to_y}, {to_z})))],
            errors: (
                noise: (shot_variance_per_unit: 0.05, dark_sigma: {dark_sigma}),
                mixed_pixels: (rays_per_pixel_side: {rays}),
            ),
        )"
        );
        let mut spec = SimulationSpec::from_ron(&text).unwrap();
        if self.errors {
            let modulations = spec.camera.modulations().unwrap();
            let models = modulations.iter().map(|one| model(one.ambiguity_interval_m()));
            spec.errors.range = Some(models.collect());
            spec.errors.scattering = Some(psf());
        }
        spec
    }

    /// One frame.
    pub fn frame(&self, number: usize) -> SimulatedFrame {
        self.frame_with_noise(number, 1000 + number as u64)
    }

    /// The same with the noise of a seed.
    pub fn frame_with_noise(&self, number: usize, seed: u64) -> SimulatedFrame {
        let spec = self.spec(if self.still { 0.0 } else { (self.first + number) as f64 * INTERVAL_S });
        let simulator = Simulator::new(&spec).unwrap();
        simulator.frame(&simulator.station(0).unwrap(), 0, seed).unwrap()
    }
}

/// The stages of a test: counts from the tree every so many frames.
pub fn stages(refresh_frames: u32) -> Stages {
    let mut stages = Stages::default();
    stages.unwrap.carry.refresh_frames = refresh_frames;
    stages
}
