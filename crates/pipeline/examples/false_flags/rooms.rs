//! Surveys of both rooms at a level of light, with what is true of each pixel.

use std::path::{Path, PathBuf};

use error_models::ModelSet;
use pipeline::Plan;
use range_image::{NoiseModel, Raster, RawFrame, Samples, demodulate};
use range_io::calibration::Calibration;
use range_io::survey::{
    FrameEntry, InputFrame, Level, Survey, SurveyCamera, TruthFiles, TruthFrame, read_frame, write_frame, write_truth,
};
use simulation::{SimulationSpec, Simulator};

use super::Failure;
use super::caster::{Camera, Image, MIXED_M, Paint, Room, Shape, Station};

/// Columns and rows.
pub const SIZE: [usize; 2] = [88, 72];

/// Amplitude below which the plan flags a pixel of a single frame.
pub const LOW_AMPLITUDE: f64 = 20.0;

/// Stages between samples and flags, but for what the rooms differ in.
const LAST_STAGES: &str = "Multipath(), PointCloud(), Flag()";

/// What is true of a station's pixels, without noise.
pub struct Truth {
    pub range: Vec<f32>,
    /// Rays of one pixel leave the surface that its centre sees.
    pub mixed: Vec<bool>,
    /// Least amplitude of all frequencies, scattered light included.
    pub amplitude: Vec<f64>,
    /// The expected highest sample lies within three standard deviations of the camera's last value, or beyond.
    pub cut_off: Vec<bool>,
    /// The light of the surface itself lies outside the amplitudes that the calibration holds for.
    pub outside_span: Vec<bool>,
}

/// A survey on disk and how it is processed.
pub struct Capture {
    pub folder: PathBuf,
    pub truth: Vec<Truth>,
    /// Noise of one frame.
    noise: NoiseModel,
    /// Stages after `Demodulate`.
    stages: String,
    frames: Vec<FrameEntry>,
    camera: SurveyCamera,
    integration_time_s: f64,
}

impl Capture {
    /// The first `count` frames of each station; the survey's file.
    pub fn survey(&self, count: usize) -> Result<PathBuf, Failure> {
        let number = |entry: &&FrameEntry| entry.timestamp_s.is_some_and(|time| time < count as f64 - 0.5);
        self.write(&format!("survey_{count}.ron"), self.frames.iter().filter(number).cloned().collect())
    }

    /// One frame of each station whose samples are the means of those of the first `count`: a single frame with the noise
    /// of so many; the survey's file.
    pub fn survey_of_sums(&self, count: usize) -> Result<PathBuf, Failure> {
        let survey = Survey::read(self.survey(count)?)?;
        let (mut means, mut sum) = (Vec::new(), Vec::new());
        for (index, entry) in survey.frames.iter().enumerate() {
            let InputFrame::Samples(raw) = read_frame(&survey, &self.folder, index)? else { continue };
            let Samples::U16(samples) = raw.samples() else { continue };
            sum.resize(samples.len(), 0.0);
            sum.iter_mut().zip(samples).for_each(|(sum, sample)| *sum += f64::from(*sample));
            if entry.timestamp_s.is_some_and(|time| time < count as f64 - 1.5) {
                continue;
            }
            let mean = Samples::F32(sum.drain(..).map(|sum| (sum / count as f64) as f32).collect());
            let file = PathBuf::from(format!("frames/{}_mean_of_{count}.npz", entry.station));
            let modulations = raw.modulations().to_vec();
            let raw = RawFrame::new(raw.width(), raw.height(), raw.phase_steps(), modulations, mean)?;
            write_frame(self.folder.join(&file), &InputFrame::Samples(raw))?;
            means.push(FrameEntry { file, timestamp_s: Some(0.0), ..entry.clone() });
        }
        self.write(&format!("survey_of_sums_{count}.ron"), means)
    }

    /// The plan for frames of the noise that single frames have, or sums of so many.
    pub fn plan(&self, summed: usize) -> Result<Plan, Failure> {
        let fewer = 1.0 / (summed as f64).sqrt();
        let NoiseModel { shot_variance_per_unit, dark_sigma } = self.noise;
        let (low, shot, dark) = (LOW_AMPLITUDE * fewer, shot_variance_per_unit * fewer * fewer, dark_sigma * fewer);
        let demodulate =
            format!("Demodulate(low_amplitude: {low}, noise: (shot_variance_per_unit: {shot}, dark_sigma: {dark}))");
        let text = format!("(name: \"flags\", stages: [{demodulate}, {}])", self.stages);
        Ok(Plan::from_ron(&text, "flags.ron".as_ref())?)
    }

    fn write(&self, name: &str, frames: Vec<FrameEntry>) -> Result<PathBuf, Failure> {
        let truth = frames.iter().map(|entry| Path::new("truth").join(format!("{}.npz", entry.station))).collect();
        let mut survey = Survey::new(self.camera.clone(), Level::Samples, frames);
        survey.truth = Some(TruthFiles { frames: truth, ..TruthFiles::default() });
        let file = self.folder.join(name);
        survey.write(&file)?;
        Ok(file)
    }

    fn add(&mut self, station: &str, number: usize, raw: RawFrame) -> Result<(), Failure> {
        let file = PathBuf::from(format!("frames/{station}_{number}.npz"));
        write_frame(self.folder.join(&file), &InputFrame::Samples(raw))?;
        let station = station.to_owned();
        let timestamp_s = Some(number as f64);
        self.frames.push(FrameEntry {
            file,
            station,
            timestamp_s,
            integration_time_s: Some(self.integration_time_s),
            temperature_c: None,
        });
        Ok(())
    }

    fn add_truth(&mut self, station: &str, truth: Truth) -> Result<(), Failure> {
        let [width, height] = SIZE;
        let wraps = vec![Raster::filled(width, height, 0); self.camera.modulation_hz.len()];
        let range = Raster::from_vec(width, height, truth.range.clone())?;
        let mixed = Raster::from_vec(width, height, truth.mixed.clone())?;
        let file = self.folder.join("truth").join(format!("{station}.npz"));
        write_truth(file, &TruthFrame { range, wraps, mixed })?;
        self.truth.push(truth);
        Ok(())
    }
}

fn folders(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder.join("frames"))?;
    std::fs::create_dir_all(folder.join("truth"))?;
    Ok(())
}

/// How much there is to take.
#[derive(Clone, Copy)]
pub struct Amount {
    pub stations: usize,
    pub frames: usize,
    pub seed: u64,
    /// Median amplitude of the first station.
    pub amplitude: f64,
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The small room of the fixtures with its scattering and range errors, as the simulator makes it; samples have a noise of
/// 4 units and more. Stations from `first` on.
pub fn simulated(folder: &Path, first: usize, amount: Amount) -> Result<Capture, Failure> {
    folders(folder)?;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes/room_small.ron");
    let text = std::fs::read_to_string(file)?
        .replace(
            "(width: 132, height: 108, pixel_pitch_mm: (0.05333333333333334, 0.05333333333333334))",
            "(width: 88, height: 72, pixel_pitch_mm: (0.08, 0.08))",
        )
        .replace("sigma_px: (3.0, 3.0)", "sigma_px: (2.0, 2.0)")
        .replace("sigma_px: (27.0, 27.0)", "sigma_px: (18.0, 18.0)")
        .replace("(shot_variance_per_unit: 0.025, dark_sigma: 2.0)", "(shot_variance_per_unit: 0.1, dark_sigma: 4.0)");
    let mut spec = SimulationSpec::from_ron(&text)?;
    if let Some(mixed) = &mut spec.errors.mixed_pixels {
        mixed.threshold_m = MIXED_M;
    }
    spec.stations = spec.stations.split_off(first);
    spec.stations.truncate(amount.stations);
    spec.exposure.frames_per_station = amount.frames;
    let image = Simulator::new(&spec)?;
    let amplitude = |simulator: &Simulator| -> Result<f64, Failure> {
        let truth = simulator.frame(&simulator.station(0)?, 0, 0)?.truth;
        Ok(median(truth.amplitude[0].as_slice().iter().map(|value| f64::from(*value))))
    };
    let brighter = amount.amplitude / amplitude(&image)?;
    spec.illumination.source_power *= brighter;
    spec.illumination.ambient_power *= brighter;
    let mut still = spec.clone();
    still.errors.noise = None;
    let (simulator, still) = (Simulator::new(&spec)?, Simulator::new(&still)?);
    let calibration = true_calibration(&spec)?;
    calibration.write(folder.join("calibration.ron"))?;
    let noise = calibration.noise.ok_or("the scene has no noise")?;
    let (geometry, demodulation) = (spec.camera.geometry, spec.demodulation_options());
    let camera = SurveyCamera {
        width: SIZE[0],
        height: SIZE[1],
        pixel_pitch_mm: geometry.format.pixel_pitch_mm,
        principal_distance_mm: geometry.interior.principal_distance_mm,
        principal_point_mm: geometry.interior.principal_point_mm,
        modulation_hz: spec.camera.modulation_hz.clone(),
        phase_steps: Some(4),
        phase_sense: spec.camera.phase_sense,
        phase_offset_rad: spec.camera.phase_offset_rad,
        saturation: demodulation.saturation,
        raw_scale: demodulation.raw_scale,
    };
    let stages = format!(
        "Average(), Deconvolve(), Unwrap(maximum_range_m: 12), CorrectRange(), CorrectImagePoint(), {LAST_STAGES}"
    );
    let (truth, frames) = (Vec::new(), Vec::new());
    let mut capture = Capture {
        folder: folder.to_owned(),
        truth,
        noise,
        stages,
        frames,
        camera,
        integration_time_s: spec.exposure.integration_time_s,
    };
    for (index, station) in spec.stations.iter().enumerate() {
        let image = simulator.station(index)?;
        for number in 0..amount.frames {
            capture.add(&station.name, number, simulator.frame(&image, number, amount.seed)?.raw)?;
        }
        let frame = still.frame(&still.station(index)?, 0, 0)?;
        let span =
            still.spec().errors.range.as_ref().and_then(|models| Some(models.first()?.hyperbola?.amplitude_span));
        let is_outside = |amplitude: f64| span.is_some_and(|[low, high]| !(low..=high).contains(&amplitude));
        let complex = demodulate(&frame.raw, &still.spec().demodulation_options())?;
        let channel = &complex.channels[0];
        let amplitude: Vec<f64> = channel.amplitude().as_slice().iter().map(|value| f64::from(*value)).collect();
        let truth = Truth {
            range: frame.truth.range.as_slice().to_vec(),
            mixed: frame.truth.mixed.as_slice().to_vec(),
            cut_off: vec![false; amplitude.len()],
            outside_span: frame.truth.amplitude[0].as_slice().iter().map(|own| is_outside(f64::from(*own))).collect(),
            amplitude,
        };
        capture.add_truth(&station.name, truth)?;
    }
    Ok(capture)
}

/// The calibration that takes off exactly what the simulation puts on.
fn true_calibration(spec: &SimulationSpec) -> Result<Calibration, Failure> {
    let models = spec.errors.range.clone().unwrap_or_default();
    let set = ModelSet { entries: vec![(spec.exposure.integration_time_s, models)] };
    let mut calibration = Calibration::from_models(&spec.camera.geometry, &set, spec.errors.scattering.as_ref())?;
    // Rounding adds a twelfth of the square of a step.
    calibration.noise = spec.errors.noise.map(|noise| {
        let step = spec.errors.digitisation.map_or(0.0, |digitisation| digitisation.raw_scale);
        NoiseModel { dark_sigma: (noise.dark_sigma.powi(2) + step * step / 12.0).sqrt(), ..noise }
    });
    Ok(calibration)
}

/// An attic: slanted ceilings, columns, a stair, bricks and boards.
fn attic(scale: f64) -> Room {
    use Paint::{Bricks, Grain, Plain, Stripes};
    use Shape::{Block, Column, Plane, Sphere};
    let slope = |x: f64| [x / 2.0_f64.sqrt(), 0.0, -(0.5_f64.sqrt())];
    let mut shapes = vec![
        (Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), Stripes([0.5, 0.42], 0.11, [1.0, 0.0, 0.0])),
        (Plane([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]), Bricks(0.55)),
        (Plane([0.0, 9.0, 0.0], [0.0, -1.0, 0.0]), Bricks(0.6)),
        (Plane([0.0, 0.0, 1.1], slope(1.0)), Stripes([0.66, 0.6], 0.14, [0.0, 1.0, 0.0])),
        (Plane([6.0, 0.0, 1.1], slope(-1.0)), Stripes([0.66, 0.6], 0.14, [0.0, 1.0, 0.0])),
        (Plane([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]), Plain(0.7)),
        (Plane([6.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Grain([0.5, 0.8], 0.07)),
        (Plane([0.0, 0.0, 3.2], [0.0, 0.0, -1.0]), Plain(0.75)),
        (Column([1.9, 4.1, 0.0], 0.14, 3.2), Grain([0.4, 0.6], 0.03)),
        (Column([4.3, 6.3, 0.0], 0.2, 3.2), Plain(0.5)),
        (Column([3.2, 2.5, 0.0], 0.3, 0.8), Stripes([0.7, 0.35], 0.1, [0.0, 0.0, 1.0])),
        (Sphere([3.1, 5.6, 2.1], 0.28), Plain(0.85)),
        (Sphere([1.2, 7.4, 0.35], 0.35), Stripes([0.8, 0.3], 0.15, [1.0, 1.0, 0.0])),
        (Block([3.0, 4.5, 2.9], [3.0, 0.1, 0.12], 0.0), Grain([0.35, 0.5], 0.05)),
        (Block([5.2, 3.2, 0.45], [0.5, 0.7, 0.45], 12.0), Grain([0.3, 0.7], 0.12)),
        (Block([2.6, 7.8, 0.4], [0.9, 0.35, 0.4], -20.0), Plain(0.55)),
        (Block([0.8, 2.2, 0.3], [0.45, 0.6, 0.3], 30.0), Stripes([0.75, 0.5], 0.2, [0.0, 1.0, 0.0])),
        (Block([4.4, 8.93, 1.2], [0.6, 0.05, 0.45], 0.0), Grain([0.2, 0.9], 0.15)),
        (Block([1.5, 0.05, 1.3], [0.5, 0.05, 0.6], 0.0), Plain(0.15)),
    ];
    let step = |n: i32| {
        let n = f64::from(n);
        (Block([5.2, 5.2 + 0.28 * n, 0.09 * (n + 1.0)], [0.8, 0.14, 0.09 * (n + 1.0)], 0.0), Plain(0.6 - 0.02 * n))
    };
    shapes.extend((0..9).map(step));
    Room { shapes, scale }
}

const STATIONS: [Station; 6] = [
    Station { name: "A", position: [1.2, 0.9, 1.5], target: [3.6, 6.0, 1.1] },
    Station { name: "B", position: [4.9, 1.0, 1.6], target: [2.2, 6.0, 1.0] },
    Station { name: "C", position: [3.0, 8.2, 1.4], target: [3.2, 2.0, 1.2] },
    Station { name: "D", position: [1.0, 8.0, 1.7], target: [4.5, 3.0, 0.9] },
    Station { name: "E", position: [3.4, 1.4, 1.2], target: [3.0, 7.5, 1.6] },
    Station { name: "F", position: [1.1, 5.3, 1.3], target: [5.2, 4.6, 1.0] },
];

/// The attic through a pinhole, with shot noise of whole photoelectrons and 14 bits; stations from `first` on.
pub fn cast(folder: &Path, first: usize, modulation_hz: &[f64], amount: Amount) -> Result<Capture, Failure> {
    folders(folder)?;
    let [width, height] = SIZE;
    let mut light = Camera {
        width,
        height,
        principal_distance_px: 62.0,
        modulation_hz: modulation_hz.to_vec(),
        power: 1.0,
        contrast: 0.55,
        sun: 0.08,
        gain: 0.1,
        dark_sigma: 4.0,
        saturation: 16383.0,
    };
    // Two frequencies are unique up to 7.5 m, which the attic has to end before.
    let room = attic(if modulation_hz.len() > 1 { 0.75 } else { 1.0 });
    let stations = &STATIONS[first..(first + amount.stations).min(STATIONS.len())];
    let amplitudes = |image: &Image, pixel: usize| {
        image.light.iter().map(|plane| plane[pixel][0].hypot(plane[pixel][1])).fold(f64::INFINITY, f64::min)
    };
    let first_image = room.render(&light, &stations[0]);
    light.power = amount.amplitude / median((0..width * height).map(|pixel| amplitudes(&first_image, pixel)));
    let camera = SurveyCamera {
        width,
        height,
        pixel_pitch_mm: [0.05, 0.05],
        principal_distance_mm: 0.05 * light.principal_distance_px,
        principal_point_mm: [0.0, 0.0],
        modulation_hz: modulation_hz.to_vec(),
        phase_steps: Some(4),
        phase_sense: range_image::PhaseSense::Positive,
        phase_offset_rad: 0.0,
        saturation: Some(light.saturation),
        raw_scale: 1.0,
    };
    // Rounding adds the variance of a twelfth.
    let dark_sigma = (light.dark_sigma * light.dark_sigma + 1.0 / 12.0).sqrt();
    let unwrap = if modulation_hz.len() > 1 { "Unwrap()" } else { "Unwrap(maximum_range_m: 12)" };
    let noise = NoiseModel { shot_variance_per_unit: light.gain, dark_sigma };
    let stages = format!("Average(), {unwrap}, {LAST_STAGES}");
    let (truth, frames) = (Vec::new(), Vec::new());
    let mut capture =
        Capture { folder: folder.to_owned(), truth, noise, stages, frames, camera, integration_time_s: 1e-3 };
    for station in stations {
        let image = room.render(&light, station);
        let modulations = capture.camera.modulations()?;
        for number in 0..amount.frames {
            let samples = Samples::U16(image.samples(&light, amount.seed + station.position[0].to_bits(), number));
            capture.add(station.name, number, RawFrame::new(width, height, 4, modulations.clone(), samples)?)?;
        }
        let pixels = 0..width * height;
        let amplitude: Vec<f64> = pixels.clone().map(|pixel| amplitudes(&image, pixel)).collect();
        let cut_off = pixels.map(|pixel| {
            let largest = |[re, im]: [f64; 2]| re.abs().max(im.abs());
            let highest =
                image.offset[pixel] + image.light.iter().map(|plane| largest(plane[pixel])).fold(0.0, f64::max);
            highest + 3.0 * light.gain.mul_add(highest, dark_sigma * dark_sigma).sqrt() > light.saturation
        });
        let cut_off = cut_off.collect();
        let outside_span = vec![false; width * height];
        let truth = Truth { range: image.range, mixed: image.mixed, amplitude, cut_off, outside_span };
        capture.add_truth(station.name, truth)?;
    }
    Ok(capture)
}
