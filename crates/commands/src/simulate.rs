//! A simulated scene as a survey's folder: frames, approximate poses, calibration and truth.

use std::fmt;
use std::path::{Path, PathBuf};

use atomic_output::{Destination, OutputFolder};
use camera_model::step_pose;
use error_models::{ModelSet, RangeErrorModel};
use nalgebra::Isometry3;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Modulation;
use range_io::calibration::{CalibratedDrift, Calibration, Provenance};
use range_io::survey::{
    FrameEntry, InputFrame, Level, ReferencePath, Survey, SurveyCamera, TruthFiles, TruthFrame, write_frame,
    write_truth,
};
use range_io::tables::{Station, write_stations};
use report::Document;
use serde::Serialize;
use simulation::{GrossErrorsSpec, SimulationSpec, Simulator};

use crate::plan::SimulateSource;
use crate::{Error, Inputs, Judged, Progress, Result, produce};

/// What a simulation wrote.
#[derive(Debug, Clone, Serialize)]
pub struct Simulated {
    /// The survey's folder.
    pub folder: PathBuf,
    /// Stations.
    pub stations: usize,
    /// Frames.
    pub frames: usize,
}

impl Judged for Simulated {}

impl fmt::Display for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it, for people.
fn document(found: &Simulated) -> Document {
    let Simulated { folder, stations, frames } = found;
    let lead = format!("{}: {frames} frames of {stations} stations, with truth", folder.display());
    Document::new("rangecam: simulate", lead)
}

/// Simulates a scene's file (relative to `base`) into a survey's folder `out`, which is complete or not there.
///
/// The survey's `stations.csv` holds the first station's true pose, which is the datum, and the others disturbed as
/// `source` says, as a surveyor's sketch would be. Its `calibration.ron` is the true one.
pub fn simulate(source: &SimulateSource, base: &Path, out: &Path, progress: &dyn Progress) -> Result<Simulated> {
    let path = base.join(&source.scene);
    source
        .check()
        .map_err(|(field, reason)| Error::Survey { path: path.clone(), message: format!("`{field}` {reason}") })?;
    let inputs = Inputs::default().path(&path);
    produce(out, &inputs, |destination| simulate_into(destination, source, &path, progress))
}

fn simulate_into(
    destination: &Destination,
    source: &SimulateSource,
    path: &Path,
    progress: &dyn Progress,
) -> Result<Simulated> {
    let text = range_io::read_ron_text(path)?;
    let fail = |error| Error::Scene { path: path.to_owned(), source: error };
    let mut spec = SimulationSpec::from_ron(&text).map_err(fail)?;
    if source.gross_error_share > 0.0 {
        spec.errors.gross_errors = Some(GrossErrorsSpec { share: source.gross_error_share, seed: source.seed });
    }
    let simulator = Simulator::new(&spec).map_err(fail)?;
    let folder = destination.open()?;
    let frames = write_frames(&simulator, source.seed, &folder, path, progress)?;
    write_tables(&spec, source, &folder)?;
    let calibration = true_calibration(&spec, &simulator, &source.scene)?;
    for file in ["calibration.ron", "truth/calibration.ron"] {
        calibration.write(folder.file(file)?)?;
    }
    let survey = survey(&spec, frames);
    survey.write(folder.file(Survey::FILE_NAME)?)?;
    folder.commit()?;
    progress.finish();
    Ok(Simulated { folder: destination.named().to_owned(), stations: spec.stations.len(), frames: survey.frames.len() })
}

/// Renders and writes station by station, so that memory does not grow with their number.
fn write_frames(
    simulator: &Simulator,
    seed: u64,
    folder: &OutputFolder,
    scene: &Path,
    progress: &dyn Progress,
) -> Result<Vec<FrameEntry>> {
    let fail = |error| Error::Scene { path: scene.to_owned(), source: error };
    let spec = simulator.spec();
    let per_station = spec.exposure.frames_at_station();
    progress.begin("simulate", spec.stations.len() * per_station);
    let mut entries = Vec::new();
    for station in 0..spec.stations.len() {
        let image = simulator.station(station).map_err(fail)?;
        for number in 0..per_station {
            let frame = simulator.frame(&image, number, seed).map_err(fail)?;
            let file = PathBuf::from(format!("frames/{station:03}_{number}.npz"));
            write_frame(folder.file(&file)?, &InputFrame::Samples(frame.raw))?;
            let truth = TruthFrame {
                range: frame.truth.range.clone(),
                wraps: frame.truth.wraps.clone(),
                mixed: frame.truth.mixed.clone(),
            };
            write_truth(folder.file(Path::new("truth").join(&file))?, &truth)?;
            entries.push(FrameEntry {
                file,
                station: frame.station,
                timestamp_s: Some(frame.timestamp_s),
                integration_time_s: Some(frame.integration_time_s),
                temperature_c: frame.temperature_c,
            });
            progress.advance(entries.len());
        }
    }
    Ok(entries)
}

fn write_tables(spec: &SimulationSpec, source: &SimulateSource, folder: &OutputFolder) -> Result<()> {
    let row = |name: &str, world_from_camera| Station {
        station: name.to_owned(),
        world_from_camera,
        sigma_position_m: None,
        sigma_attitude_rad: None,
        doubt: None,
    };
    let truth: Vec<Station> = spec.stations.iter().map(|s| row(&s.name, s.world_from_camera())).collect();
    write_stations(folder.file("truth/stations.csv")?, &truth)?;
    // A stream of its own, so that the sketch does not change with the number of frames.
    let mut generator = Pcg64::new(u128::from(source.seed), STATION_STREAM);
    let sketch: Vec<Station> = truth
        .iter()
        .enumerate()
        .map(|(index, known)| match index {
            0 => known.clone(),
            _ => row(&known.station, disturbed(&known.world_from_camera, source, &mut generator)),
        })
        .collect();
    write_stations(folder.file("stations.csv")?, &sketch)?;
    Ok(())
}

/// Number of the generator's stream that disturbs the stations.
const STATION_STREAM: u128 = 0x5741_7469_6f6e;

fn disturbed(pose: &Isometry3<f64>, source: &SimulateSource, generator: &mut Pcg64) -> Isometry3<f64> {
    let mut normal = |sigma: f64| -> f64 {
        let unit: f64 = StandardNormal.sample(generator);
        sigma * unit
    };
    let position = source.approximate_position_sigma_m;
    let attitude = source.approximate_attitude_sigma_deg.to_radians();
    step_pose(
        pose,
        &[normal(position), normal(position), normal(position), normal(attitude), normal(attitude), normal(attitude)],
    )
}

/// The calibration that takes off exactly what the simulation put on.
fn true_calibration(spec: &SimulationSpec, simulator: &Simulator, scene: &str) -> Result<Calibration> {
    let set = spec.errors.range_by_integration_time.clone().map_or_else(|| same_at_all_times(spec), Ok)?;
    let scattering = spec.errors.scattering.as_ref();
    let mut calibration = Calibration::from_models(&spec.camera.geometry, &set, scattering)?;
    let method = "truth of a simulation".to_owned();
    calibration.provenance = Provenance { survey: scene.to_owned(), method, ..Provenance::default() };
    calibration.noise = spec.errors.noise;
    calibration.fixed_pattern = simulator.fixed_pattern().cloned();
    calibration.warm_up = spec.errors.warm_up.as_ref().filter(|drift| !drift.is_empty()).map(|drift| CalibratedDrift {
        model: drift.clone(),
        deviations: vec![0.0; drift.parameter_names().len()],
        correlation: None,
    });
    Ok(calibration)
}

/// The models of a camera whose range errors do not depend on the integration time.
fn same_at_all_times(spec: &SimulationSpec) -> Result<ModelSet> {
    let models = match &spec.errors.range {
        Some(models) => models.clone(),
        None => modulations(spec)?.iter().map(|m| RangeErrorModel::error_free(m.ambiguity_interval_m())).collect(),
    };
    let mut times: Vec<f64> = spec.exposure.integration_times_s().collect();
    times.sort_by(f64::total_cmp);
    Ok(ModelSet { entries: times.into_iter().map(|time| (time, models.clone())).collect() })
}

fn modulations(spec: &SimulationSpec) -> Result<Vec<Modulation>> {
    spec.camera.modulations().map_err(|error| Error::Camera(error.to_string()))
}

fn survey(spec: &SimulationSpec, frames: Vec<FrameEntry>) -> Survey {
    let geometry = spec.camera.geometry;
    let demodulation = spec.demodulation_options();
    let truth_frames = frames.iter().map(|frame| Path::new("truth").join(&frame.file)).collect();
    let camera = SurveyCamera {
        width: geometry.format.width,
        height: geometry.format.height,
        pixel_pitch_mm: geometry.format.pixel_pitch_mm,
        principal_distance_mm: geometry.interior.principal_distance_mm,
        // Nominal, as a data sheet would have it: the calibration brings the true one.
        principal_point_mm: [0.0, 0.0],
        modulation_hz: spec.camera.modulation_hz.clone(),
        phase_steps: Some(spec.camera.phase_steps),
        phase_sense: demodulation.phase_sense,
        phase_offset_rad: demodulation.phase_offset_rad,
        saturation: demodulation.saturation,
        raw_scale: demodulation.raw_scale,
    };
    let truth = TruthFiles {
        stations: Some("truth/stations.csv".into()),
        calibration: Some("truth/calibration.ron".into()),
        frames: truth_frames,
    };
    let reference_path = spec.camera.reference_path.map(|path| ReferencePath {
        columns: path.columns,
        rows: path.rows,
        length_m: path.length_m,
    });
    Survey {
        power_on_s: spec.exposure.power_on_s,
        reference_path,
        truth: Some(truth),
        ..Survey::new(camera, Level::Samples, frames)
    }
}
