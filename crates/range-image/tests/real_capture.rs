//! A real four-phase capture at 60 MHz against the distances that the camera computed itself.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::common::angle_between;
use range_image::{
    ConsistencyOptions, DemodulationOptions, Flags, InterferenceOptions, Modulation, PhaseSense, Raster, RawFrame,
    RulesVerdict, Samples, check_samples, demodulate, tell_interference,
};

/// The f32 values of one array of an .npz file (little-endian, version 1 header).
fn array(file: &Path, name: &str) -> Vec<f32> {
    let mut archive = zip::ZipArchive::new(File::open(file).unwrap()).unwrap();
    let mut bytes = Vec::new();
    archive.by_name(&format!("{name}.npy")).unwrap().read_to_end(&mut bytes).unwrap();
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    bytes[start..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// The capture's folder and its frame; `None`, with a word, where it is not there.
fn capture() -> Option<(&'static Path, RawFrame)> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/mlx75027_scene"));
    if !folder.is_dir() {
        eprintln!("skipped: no capture at {}", folder.display());
        return None;
    }
    let samples = Samples::F32(array(&folder.join("000_0.npz"), "samples"));
    Some((folder, RawFrame::new(640, 385, 4, vec![Modulation::new(60e6).unwrap()], samples).unwrap()))
}

#[test]
fn samples_of_a_camera_at_rest_agree_to_one_percent() {
    let Some((_, raw)) = capture() else { return };
    let flagged = |tolerance: f64| {
        let mut flags = Raster::filled(640, 385, Flags::empty());
        let check = ConsistencyOptions { tolerance, ..ConsistencyOptions::default() };
        let summary = check_samples(&raw, &DemodulationOptions::default(), &check, &mut flags).unwrap();
        assert!(matches!(summary.rules, RulesVerdict::Checked { degrees_of_freedom: 1, .. }));
        let moved = flags.as_slice().iter().filter(|flags| flags.contains(Flags::MOTION)).count();
        moved as f64 / flags.len() as f64
    };
    // Nothing moved; the taps are unequal by one percent of the amplitude, and not by a tenth of that.
    assert!(flagged(0.012) < 0.002 && flagged(0.001) > 0.1, "{} {}", flagged(0.012), flagged(0.001));
}

#[test]
fn a_camera_alone_at_rest_shows_neither_motion_nor_another_camera() {
    let Some((_, raw)) = capture() else { return };
    let mut frame = demodulate(&raw, &DemodulationOptions::default()).unwrap();
    let check = ConsistencyOptions { tolerance: 0.012, ..ConsistencyOptions::default() };
    check_samples(&raw, &DemodulationOptions::default(), &check, &mut frame.flags).unwrap();
    let share = tell_interference(&mut frame, &InterferenceOptions::default()).unwrap();
    // No noise is known of this mean of many frames: the tolerance alone is exceeded by two pixels in a thousand.
    assert!(share < 0.004, "{share}");
    assert!(!frame.flags.as_slice().iter().any(|flags| flags.contains(Flags::INTERFERENCE)));
}

#[test]
fn distances_of_a_real_camera_come_back() {
    let Some((folder, raw)) = capture() else { return };
    let modulation = raw.modulations()[0];
    // Opposite sense and 2.780 rad: known of this camera.
    let options = DemodulationOptions {
        phase_sense: PhaseSense::Negative,
        phase_offset_rad: 2.780,
        ..DemodulationOptions::default()
    };
    let channel = demodulate(&raw, &options).unwrap().channels.remove(0);
    let (phase, amplitude) = (channel.phase(), channel.amplitude());
    let output = folder.join("camera_output.npz");
    let (distances, amplitudes) = (array(&output, "range_mm"), array(&output, "amplitude"));

    let count = distances.len() as f64;
    let differences = phase.as_slice().iter().zip(&distances).map(|(phase, millimetres)| {
        let truth = modulation.phase_from_range(f64::from(*millimetres) / 1000.0);
        modulation.range_from_phase(angle_between(f64::from(*phase), truth))
    });
    let mean = differences.clone().sum::<f64>() / count;
    let deviation = (differences.map(|d| (d - mean).powi(2)).sum::<f64>() / count).sqrt();
    // The camera applies corrections of its own, which leave a structure of 11 mm.
    assert!(mean.abs() < 0.003 && deviation < 0.012, "mean {mean} m, standard deviation {deviation} m");
    let ratios = amplitude.as_slice().iter().zip(&amplitudes).map(|(own, theirs)| f64::from(own / theirs));
    let mean_ratio = ratios.clone().sum::<f64>() / count;
    let scatter = (ratios.map(|r| (r - mean_ratio).powi(2)).sum::<f64>() / count).sqrt() / mean_ratio;
    // The camera may average amplitudes where these samples are averages: half a percent between dim and bright.
    assert!(scatter < 0.01, "amplitudes are not in proportion: {mean_ratio}, scatter {scatter}");
}
