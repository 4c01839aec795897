//! Depth images of structured-light cameras with poses, read where they lie.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, missing_docs)]

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use projective_registration::Projection;

pub struct DepthFrame {
    pub points: Vec<[f64; 3]>,
    pub world_from_camera: Isometry3<f64>,
}

pub struct Sequence {
    pub projection: Arc<Projection>,
    pub frames: Vec<DepthFrame>,
}

fn folder(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real")).join(name);
    folder.exists().then_some(folder)
}

pub const FOCAL: [f64; 2] = [585.0, 525.0];
pub const CENTRES: [[f64; 2]; 2] = [[320.0, 240.0], [319.5, 239.5]];

/// The first `count` frames of a Kinect's way through a kitchen; poses good to about 8 mm.
pub fn kitchen(count: usize) -> Option<Sequence> {
    let folder = folder("sevenscenes_redkitchen")?;
    let mut names: Vec<PathBuf> = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    names.retain(|n| n.to_string_lossy().ends_with(".depth.png"));
    names.sort();
    let frames = names
        .iter()
        .take(count)
        .map(|name| {
            let text = std::fs::read_to_string(name.to_string_lossy().replace("depth.png", "pose.txt")).unwrap();
            DepthFrame { points: points(name, FOCAL[0], CENTRES[0]), world_from_camera: pose(&numbers(&text)) }
        })
        .collect();
    Some(Sequence { projection: pinhole(FOCAL[0], CENTRES[0]), frames })
}

/// Frames of the same way by their numbers.
pub fn dense_kitchen(numbers_of_frames: impl Iterator<Item = usize>) -> Option<Sequence> {
    let folder = folder("sevenscenes_redkitchen_dense")?;
    let frame = |number: usize| {
        let text = std::fs::read_to_string(folder.join(format!("frame-{number:06}.pose.txt"))).unwrap();
        let image = folder.join(format!("frame-{number:06}.depth.png"));
        DepthFrame { points: points(&image, FOCAL[0], CENTRES[0]), world_from_camera: pose(&numbers(&text)) }
    };
    Some(Sequence { projection: pinhole(FOCAL[0], CENTRES[0]), frames: numbers_of_frames.map(frame).collect() })
}

/// Five frames of a living room, with their trajectory.
pub fn living_room() -> Option<Sequence> {
    let folder = folder("redwood_rgbd5")?;
    let log = std::fs::read_to_string(folder.join("trajectory.log")).unwrap();
    let poses: Vec<Isometry3<f64>> = numbers(&log).chunks_exact(19).map(|block| pose(&block[3..])).collect();
    let mut names: Vec<PathBuf> = std::fs::read_dir(folder.join("depth")).unwrap().map(|e| e.unwrap().path()).collect();
    names.sort();
    let frames = names
        .iter()
        .zip(poses)
        .map(|(name, world_from_camera)| DepthFrame { points: points(name, FOCAL[1], CENTRES[1]), world_from_camera })
        .collect();
    Some(Sequence { projection: pinhole(FOCAL[1], CENTRES[1]), frames })
}

fn pinhole(focal: f64, centre: [f64; 2]) -> Arc<Projection> {
    Arc::new(Projection::pinhole(640, 480, [focal; 2], centre).unwrap())
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().filter_map(|w| w.parse().ok()).collect()
}

/// Rows of a matrix between frames with y down and z forwards, as a pose between frames with y up and z backwards.
fn pose(v: &[f64]) -> Isometry3<f64> {
    let turned = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    let matrix = turned * Matrix3::new(v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]) * turned;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Isometry3::from_parts(Translation3::from(turned * Vector3::new(v[3], v[7], v[11])), rotation)
}

/// Points of a 16-bit depth image in millimetre; 0 and 65535 mean no depth.
fn points(name: &Path, focal: f64, centre: [f64; 2]) -> Vec<[f64; 3]> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(name).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]]));
    pixels
        .enumerate()
        .map(|(k, value)| {
            if value == 0 || value == u16::MAX {
                return [f64::NAN; 3];
            }
            let depth = f64::from(value) * 1e-3;
            let (col, row) = ((k % 640) as f64, (k / 640) as f64);
            [(col - centre[0]) / focal * depth, (centre[1] - row) / focal * depth, -depth]
        })
        .collect()
}
