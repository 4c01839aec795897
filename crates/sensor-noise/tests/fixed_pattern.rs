//! The offset of each pixel from walls, against the truth.

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use nalgebra::{Isometry3, Point3, Vector3};
use primitives::Plane;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Flags, ImageFormat, RangeFrame, Raster};
use sensor_noise::Error;
use sensor_noise::{
    PatternEstimate, PatternEstimator, PatternOptions, PatternSplit, PatternVerdict, WallCapture,
    estimate_fixed_pattern,
};

const SIGMA_M: f64 = 0.006;
const SIZE: [usize; 2] = [48, 36];

fn camera() -> Camera {
    let format = ImageFormat::new(SIZE[0], SIZE[1], [0.1, 0.1]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    Camera::new(format, interior, LensDistortion::default()).unwrap()
}

fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut random = Pcg64::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

fn true_pattern(sigma_m: f64) -> Vec<f64> {
    let mut unit = normal(77);
    (0..SIZE[0] * SIZE[1]).map(|_| sigma_m * unit()).collect()
}

/// Frames of walls at growing distances, each tilted in its own way, a shelf before the second.
fn captures(stations: usize, frames: usize, pattern: &[f64], seed: u64) -> Vec<(String, RangeFrame)> {
    let camera = camera();
    let mut unit = normal(seed);
    let mut out = Vec::new();
    for station in 0..stations {
        let tilt = Vector3::new(0.05 * station as f64 - 0.1, 0.03 * (station % 3) as f64, 1.0);
        let plane = Plane::new(&tilt, &Point3::new(0.0, 0.0, -1.2 - 0.3 * station as f64)).unwrap();
        for _ in 0..frames {
            let range = Raster::from_fn(SIZE[0], SIZE[1], |col, row| {
                let (range, _) =
                    plane.reference_range(&camera, &Isometry3::identity(), [col as f64, row as f64]).unwrap();
                let shelf = if station == 1 && col < 8 { -0.4 } else { 0.0 };
                (range + shelf + pattern[row * SIZE[0] + col] + SIGMA_M * unit()) as f32
            });
            let frame = RangeFrame {
                range,
                sigma: Raster::filled(SIZE[0], SIZE[1], SIGMA_M as f32),
                amplitude: Raster::filled(SIZE[0], SIZE[1], 100.0),
                flags: Raster::filled(SIZE[0], SIZE[1], Flags::empty()),
            };
            out.push((format!("W{station}"), frame));
        }
    }
    out
}

fn estimate(frames: &[(String, RangeFrame)]) -> Result<PatternEstimate, Error> {
    let walls: Vec<WallCapture<'_>> =
        frames.iter().map(|(station, frame)| WallCapture { station: station.clone(), frame }).collect();
    estimate_fixed_pattern(&walls, &camera(), &PatternOptions::default())
}

#[test]
fn the_pattern_is_found_with_true_deviations() {
    let truth = true_pattern(0.005);
    let estimate = estimate(&captures(5, 4, &truth, 1)).unwrap();
    let standardised = |(index, truth): (usize, &f64)| {
        let error = f64::from(estimate.pattern.offset_m[index]) - truth;
        (error / f64::from(estimate.pattern.sigma_m[index])).powi(2)
    };
    let square = truth.iter().enumerate().map(standardised).sum::<f64>() / truth.len() as f64;
    // 1728 pixels know a variance to 3 %; the deviation grows by the scatter of five walls where that is larger, which makes
    // it a tenth too large on average, and Huber's mean is a twentieth less precise.
    assert!((0.75..1.15).contains(&square), "{square}");
    assert!((estimate.offset_rms_m / 0.005 - 1.0).abs() < 0.1, "{}", estimate.offset_rms_m);
    assert_eq!(estimate.pixels, SIZE[0] * SIZE[1]);
    let test = estimate.test;
    assert_eq!((test.split, test.verdict), (PatternSplit::Stations, PatternVerdict::RaisesPrecision), "{test:?}");
    // Means of four frames: √(5² + 3²) without, √(3² + 3² / 4) with the pattern of four others.
    assert!((test.rms_m[0] - 0.00583).abs() < 4e-4 && (test.rms_m[1] - 0.00335).abs() < 3e-4, "{test:?}");
}

#[test]
fn a_camera_without_a_pattern_gains_nothing() {
    let none = true_pattern(0.0);
    for seed in 0..20 {
        let test = estimate(&captures(3, 2, &none, 10 + seed)).unwrap().test;
        assert_eq!(test.verdict, PatternVerdict::NoGain, "{test:?}");
        assert!(test.rms_m[1] > test.rms_m[0], "a pattern of noise makes it worse: {test:?}");
    }
}

#[test]
fn a_pattern_far_below_the_noise_is_not_worth_it() {
    // 0.5 mm of pattern under 6 mm of noise: two others' means of two frames are known to 3 mm.
    let test = estimate(&captures(3, 2, &true_pattern(0.0005), 5)).unwrap().test;
    assert_ne!(test.verdict, PatternVerdict::RaisesPrecision, "{test:?}");
}

#[test]
fn one_station_is_split_by_frames_and_one_frame_is_refused() {
    let frames = captures(1, 6, &true_pattern(0.005), 3);
    let test = estimate(&frames).unwrap().test;
    assert_eq!((test.split, test.verdict), (PatternSplit::Frames, PatternVerdict::RaisesPrecision), "{test:?}");
    let answer = estimate(&frames[..1]);
    assert!(matches!(answer, Err(Error::TooFewFrames { frames: 1, needed: 2, .. })), "{answer:?}");
    let mut unlike = frames;
    unlike[1].1.range = Raster::filled(4, 4, 1.0);
    let answer = estimate(&unlike);
    assert!(matches!(answer, Err(Error::Primitive(primitives::Error::Image(_)))), "{answer:?}");
}

#[test]
fn what_is_kept_of_walls_is_bounded_and_tells_as_much() {
    let frames = captures(1, 300, &true_pattern(0.005), 3);
    let bytes = |stations: usize| {
        let named = vec!["S".to_owned(); stations];
        PatternEstimator::new(named, &camera(), &PatternOptions::default()).unwrap().bytes()
    };
    // Beside what is said of each frame.
    assert_eq!(bytes(100_000) - 300 * 100_000, bytes(256) - 300 * 256);
    let estimate = estimate(&frames).unwrap();
    assert_eq!((estimate.test.parts, estimate.test.verdict), (20, PatternVerdict::RaisesPrecision));
    assert_eq!(estimate.frames.len(), 300);
    // 6 mm of noise over 300 frames, beside what the planes take up.
    assert!(estimate.deviation_rms_m < 0.0005, "{}", estimate.deviation_rms_m);
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let frames = captures(3, 2, &true_pattern(0.005), 9);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| estimate(&frames).unwrap())
    };
    let bits = |estimate: PatternEstimate| -> Vec<u32> {
        estimate.pattern.offset_m.iter().chain(&estimate.pattern.sigma_m).map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(with(1)), bits(with(4)));
}
