//! The risk of a real scene: boxes in front of a wall, seen by an SR4000.

use std::fs::File;
use std::io::Read;
use std::path::Path;

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
    // The median scatter of this station's four frames.
    let sigma = amplitude.map(|amplitude| 19.0 / amplitude);
    // Where the light is weak the range wraps.
    let flags = amplitude.map(|a| if *a < 100.0 { Flags::NO_DATA } else { Flags::empty() });
    let mut frame = RangeFrame { range, sigma, amplitude, flags };
    let bright = frame.flags.as_slice().iter().filter(|flags| flags.is_empty()).count();
    let options = RiskOptions { modulation_hz: Some(30e6), sigmas: 0.0, ..RiskOptions::default() };
    let risk = assess_risk(&mut frame, &directions, &options).unwrap();
    let finite = |plane: &Raster<f32>| {
        let mut values: Vec<f64> = plane.as_slice().iter().filter(|v| v.is_finite()).map(|v| f64::from(*v)).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let (errors, ratios) = (finite(&risk.risk_m), finite(&risk.ratio));
    let quantile = |share: f64| errors[(share * (errors.len() - 1) as f64) as usize];
    eprintln!(
        "{} of {bright} pixels in {} patches, {} flagged; error at 1, 50, 99 %: {:.4} {:.4} {:.4} m; ratio up to {:.2}",
        risk.assessed,
        risk.patches,
        risk.flagged,
        quantile(0.01),
        quantile(0.5),
        quantile(0.99),
        ratios[ratios.len() - 1]
    );
    assert!(risk.assessed * 4 > bright * 3, "{} of {bright}", risk.assessed);
    // Boxes in front of a wall, 1 to 4 m away: millimetres in the median, a decimetre in the worst corners, nothing too
    // short. Found: 5.6 mm and 11.5 cm.
    assert!(quantile(0.5) > 0.0 && quantile(0.5) < 0.01 && quantile(0.01) > -0.005);
    assert!(quantile(0.99) > 0.01 && quantile(0.99) < 0.2);
    assert!(ratios[0] >= 0.0 && ratios[ratios.len() - 1] < 1.0);
    assert!(risk.flagged > 0 && risk.flagged < risk.assessed);
}
