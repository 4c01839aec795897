//! The risk of a real scene: boxes in front of a wall, seen by an SR4000.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod common;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use common::median;
use multipath::{RiskOptions, assess_risk};
use range_image::{Flags, RangeFrame, Raster};

const WIDTH: usize = 176;
const HEIGHT: usize = 144;

/// The f32 values of one array of an .npz file (little-endian, version 1 header).
fn array(file: &Path, name: &str) -> Vec<f32> {
    let mut archive = zip::ZipArchive::new(File::open(file).unwrap()).unwrap();
    let mut bytes = Vec::new();
    archive.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut bytes).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    bytes[start..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[test]
fn the_risk_of_a_real_scene_is_of_centimetres() {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/sr4000_steps/Y1_0.npz"));
    if !file.is_file() {
        eprintln!("skipped: no capture at {}", file.display());
        return;
    }
    let raster = |values: Vec<f32>| Raster::from_vec(WIDTH, HEIGHT, values).unwrap();
    let range = raster(array(file, "range"));
    // The camera's own points give the viewing directions.
    let directions: Vec<[f64; 3]> = array(file, "xyz")
        .chunks_exact(3)
        .map(|p| {
            let point = [f64::from(p[0]), f64::from(p[1]), f64::from(p[2])];
            let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
            point.map(|x| x / length)
        })
        .collect();
    let amplitude = raster(array(file, "amplitude"));
    let sigma = amplitude.map(|amplitude| 2.0 / amplitude);
    // Where the light is weak the range wraps.
    let flags = amplitude.map(|a| if *a < 100.0 { Flags::NO_DATA } else { Flags::empty() });
    let mut frame = RangeFrame { range, sigma, amplitude, flags };
    let bright = frame.flags.as_slice().iter().filter(|flags| flags.is_empty()).count();
    let options = RiskOptions { modulation_hz: Some(30e6), ..RiskOptions::default() };
    let risk = assess_risk(&mut frame, &directions, &options).unwrap();
    let errors: Vec<f64> = risk.risk_m.as_slice().iter().filter(|e| e.is_finite()).map(|e| f64::from(*e)).collect();
    let ratios: Vec<f64> = risk.ratio.as_slice().iter().filter(|e| e.is_finite()).map(|e| f64::from(*e)).collect();
    let mut sorted = errors.clone();
    sorted.sort_by(f64::total_cmp);
    eprintln!(
        "bright {bright} assessed {} patches {} flagged {} error med {} p1 {} p99 {} max {} min {} ratio med {} max {}",
        risk.assessed,
        risk.patches,
        risk.flagged,
        median(errors.clone()),
        sorted[sorted.len() / 100],
        sorted[sorted.len() * 99 / 100],
        sorted[sorted.len() - 1],
        sorted[0],
        median(ratios.clone()),
        ratios.iter().copied().fold(0.0, f64::max)
    );
}
