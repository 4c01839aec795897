//! Every reader of a file, by the name of its target.

use std::path::Path;

use calibration_tasks::NetworkScene;
use pipeline::Plan;
use range_io::calibration::Calibration;
use range_io::survey::{Survey, read_frame, read_truth};
use range_io::{azure, e57, mkv, npz, pcd, ply, png16, tables, trajectory, vtk, xyz};
use recordings::{Payload, Recording};
use simulation::SimulationSpec;

/// A reader and the name of the file that it is given.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    pub name: &'static str,
    pub file: &'static str,
    /// Whether the file is of lines and words.
    pub text: bool,
    /// Reads the file; whether it was accepted.
    pub read: fn(&Path) -> bool,
}

const fn text(name: &'static str, file: &'static str, read: fn(&Path) -> bool) -> Target {
    Target { name, file, text: true, read }
}

const fn binary(name: &'static str, file: &'static str, read: fn(&Path) -> bool) -> Target {
    Target { name, file, text: false, read }
}

/// The survey that arrays and images are read as frames of: 4 x 3 pixels.
pub const SURVEY: &str = "(
    camera: (width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0,
             principal_point_mm: (0.0, 0.0), modulation_hz: [20e6], phase_steps: 4),
    level: LEVEL, DEPTH
    frames: [(file: \"FILE\", station: \"S00\", timestamp_s: 0.0, integration_time_s: 0.002)],
    truth: (frames: [\"FILE\"]),
)";

/// Reads a file as the frame of a survey at each level.
fn frame(path: &Path) -> bool {
    let (Some(folder), Some(file)) = (path.parent(), path.file_name()) else { return false };
    let mut accepted = false;
    for level in ["samples", "phase", "range", "depth"] {
        let depth = if level == "depth" { "depth: (scale_m: 0.001, invalid: 0)," } else { "" };
        let text = SURVEY.replace("LEVEL", level).replace("DEPTH", depth).replace("FILE", &file.to_string_lossy());
        if let Ok(survey) = Survey::parse(path, &text) {
            accepted |= read_frame(&survey, folder, 0).is_ok();
            accepted |= matches!(read_truth(&survey, folder, 0), Ok(Some(_)));
        }
    }
    accepted
}

fn recording(path: &Path) -> bool {
    let Ok(mut recording) = mkv::Recording::open(path) else { return false };
    recording.attachment("calibration.json");
    recording.depth_frame(0).is_ok() | recording.depth_frame(1).is_ok()
}

/// Reads every message of a recording of any format.
fn messages(path: &Path) -> bool {
    let Ok(mut recording) = Recording::open(path) else { return false };
    let mut accepted = false;
    while let Ok(Some(message)) = recording.next_message() {
        accepted = true;
        if let Payload::Image(image) = &message.payload {
            accepted |= image.depths_m().is_some() | image.values_f32().is_some();
        }
    }
    accepted
}

pub const TARGETS: &[Target] = &[
    text("survey", "survey.ron", |path| Survey::read(path).is_ok()),
    text("calibration", "calibration.ron", |path| Calibration::read(path).is_ok()),
    text("pipeline", "pipeline.ron", |path| Plan::read(path).is_ok()),
    text("network", "network.ron", |path| NetworkScene::read(path).is_ok()),
    text("scene", "scene.ron", |path| {
        range_io::read_ron_text(path).is_ok_and(|text| SimulationSpec::from_ron(&text).is_ok())
    }),
    text("azure", "calibration.json", |path| azure::read(path, azure::DepthMode::NarrowBinned).is_ok()),
    text("observations", "observations.csv", |path| tables::read_observations(path).is_ok()),
    text("stations", "stations.csv", |path| tables::read_stations(path).is_ok()),
    text("targets", "targets.csv", |path| tables::read_targets(path).is_ok()),
    text("distances", "distances.csv", |path| tables::read_distances(path).is_ok()),
    text("planes", "planes.csv", |path| tables::read_planes(path).is_ok()),
    text("imu", "imu.csv", |path| tables::read_imu(path).is_ok()),
    text("residuals", "residuals.csv", |path| tables::read_residuals(path).is_ok()),
    text("trajectory", "trajectory.txt", |path| trajectory::read_any_trajectory(path).is_ok()),
    text("sequence", "depth.txt", |path| Survey::read(path.parent().unwrap_or(path)).is_ok()),
    text("xyz", "cloud.xyz", |path| xyz::read_xyz(path).is_ok()),
    binary("cloud", "cloud.txt", |path| range_io::clouds::read_any_cloud(path).is_ok()),
    binary("ply", "cloud.ply", |path| ply::read_cloud(path).is_ok()),
    binary("pcd", "cloud.pcd", |path| pcd::read_pcd(path).is_ok()),
    binary("vtk", "cloud.vtk", |path| vtk::read_vtk(path).is_ok()),
    binary("e57", "cloud.e57", |path| e57::read_e57(path).is_ok()),
    binary("npz", "frame.npz", frame),
    binary("npy", "frame.npy", |path| npz::read_npy(path, "depth", |_| Ok(())).is_ok() | frame(path)),
    binary("png", "depth.png", |path| png16::read(path).is_ok() | frame(path)),
    binary("mkv", "depth.mkv", |path| recording(path) | frame(path)),
    binary("recording_mcap", "recording.mcap", messages),
    binary("recording_bag", "recording.bag", messages),
    binary("recording_kinect", "recording.mkv", messages),
    binary("recording_adi", "recording.bin", messages),
];
