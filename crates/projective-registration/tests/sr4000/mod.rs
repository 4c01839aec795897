//! Two stations of an SR4000 on a line towards a stack of boxes, read where they lie.
#![allow(dead_code, clippy::unwrap_used, clippy::expect_used, missing_docs)]

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use projective_registration::{OrganisedFrame, Projection};

pub const SIZE: [usize; 2] = [176, 144];
/// Dimmer pixels are wrapped or lost.
const LEAST_AMPLITUDE: f32 = 100.0;
/// Lens: pixel, principal distance and point in millimetre, k1, k2, p1, p2.
const PIXEL_MM: f64 = 0.04;
const DISTANCE_MM: f64 = 10.00258;
const POINT_MM: [f64; 2] = [-0.000_431_167_7, -0.001_867_597];
const RADIAL: [f64; 2] = [-0.006_912_051, -0.000_395_264];
const TANGENTIAL: [f64; 2] = [1.304_567e-5, 0.000_404_58];

/// The mean of four frames of each station, prepared.
pub fn stations() -> Option<[OrganisedFrame; 2]> {
    let directions: Vec<[f64; 3]> = (0..SIZE[0] * SIZE[1]).map(direction).collect();
    let projection = Arc::new(Projection::from_directions(SIZE[0], SIZE[1], &directions).unwrap());
    let points = points(&[0, 1, 2, 3])?;
    Some(points.map(|points| OrganisedFrame::new(&projection, &points, None).unwrap()))
}

/// Points of both stations by the mean of some of their four frames, row by row; NaN where one of these is dim.
pub fn points(frames: &[usize]) -> Option<[Vec<[f64; 3]>; 2]> {
    let folder = folder()?;
    Some(["Y1", "Y2"].map(|station| {
        let ranges = ranges(&folder, station, frames);
        ranges.iter().enumerate().map(|(pixel, range)| direction(pixel).map(|v| v * range)).collect()
    }))
}

/// Amplitudes of a frame of both stations.
pub fn amplitudes(frame: usize) -> Option<[Vec<f32>; 2]> {
    let folder = folder()?;
    Some(["Y1", "Y2"].map(|station| numbers(&mut archive(&folder, station, frame), "amplitude.npy")))
}

fn folder() -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/sr4000_steps"));
    folder.exists().then_some(folder)
}

fn archive(folder: &Path, station: &str, frame: usize) -> zip::ZipArchive<File> {
    zip::ZipArchive::new(File::open(folder.join(format!("{station}_{frame}.npz"))).unwrap()).unwrap()
}

/// Unit direction of a pixel's ray in the camera frame.
pub fn direction(pixel: usize) -> [f64; 3] {
    let x = ((pixel % SIZE[0]) as f64 - (SIZE[0] as f64 - 1.0) / 2.0) * PIXEL_MM - POINT_MM[0];
    let y = ((SIZE[1] as f64 - 1.0) / 2.0 - (pixel / SIZE[0]) as f64) * PIXEL_MM - POINT_MM[1];
    let square = x * x + y * y;
    let radial = RADIAL[0] * square + RADIAL[1] * square * square;
    let dx = x * radial + TANGENTIAL[0] * (square + 2.0 * x * x) + 2.0 * TANGENTIAL[1] * x * y;
    let dy = y * radial + TANGENTIAL[1] * (square + 2.0 * y * y) + 2.0 * TANGENTIAL[0] * x * y;
    let ray = [x - dx, y - dy, -DISTANCE_MM];
    let length = ray.iter().map(|v| v * v).sum::<f64>().sqrt();
    ray.map(|v| v / length)
}

/// Mean ranges of a station's frames, metre; NaN where one of them is dim.
fn ranges(folder: &Path, station: &str, frames: &[usize]) -> Vec<f64> {
    let mut mean = vec![0.0; SIZE[0] * SIZE[1]];
    for frame in frames {
        let mut archive = archive(folder, station, *frame);
        let (range, amplitude) = (numbers(&mut archive, "range.npy"), numbers(&mut archive, "amplitude.npy"));
        for ((mean, range), amplitude) in mean.iter_mut().zip(range).zip(amplitude) {
            *mean += if amplitude >= LEAST_AMPLITUDE { f64::from(range) / frames.len() as f64 } else { f64::NAN };
        }
    }
    mean
}

/// Numbers of a plane, whose header has 128 bytes.
fn numbers(archive: &mut zip::ZipArchive<File>, name: &str) -> Vec<f32> {
    let mut bytes = Vec::new();
    archive.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
    bytes[128..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}
