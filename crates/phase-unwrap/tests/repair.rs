//! Repair of wrapped ranges and depths: rooms, hallways, ceilings, a real capture; nothing that is right is harmed.

use std::io::Read;
use std::path::Path;

use crate::common::{FOCAL_PX, HEIGHT, INTERVAL_M, Scene, WIDTH};
use phase_unwrap::{
    AmplitudeKind, Error, Fold, ImageGeometry, RepairOptions, RepairVerdict, RepairedRanges, repair_depths,
    repair_ranges,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

/// What a camera gives, and what it should have given.
struct Capture {
    folded: Raster<f32>,
    truth: Raster<f32>,
    amplitude: Raster<f32>,
    /// Cosine of the angle between ray and axis.
    cosine: Raster<f32>,
    interval_m: f64,
}

impl Capture {
    /// `trace` gives range and cosine of incidence for a direction `(x, y)` at depth 1; noise of `sigma_m` at one
    /// interval, growing with the square of the range.
    fn new(interval_m: f64, fold_m: f64, sigma_m: f64, trace: impl Fn(f64, f64) -> (f64, f64)) -> Self {
        let mut rng = Pcg64::seed_from_u64(1);
        let direction = |col: usize, row: usize| ((col as f64 - 87.5) / FOCAL_PX, (71.5 - row as f64) / FOCAL_PX);
        let view = Raster::from_fn(WIDTH, HEIGHT, |col, row| {
            let (x, y) = direction(col, row);
            trace(x, y)
        });
        let truth = view.map(|&(range, _)| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            (range + sigma_m * (range / interval_m).powi(2) * noise) as f32
        });
        let fold = |range: &f32| (fold_m + (f64::from(*range) - fold_m).rem_euclid(interval_m)) as f32;
        let cosine = Raster::from_fn(WIDTH, HEIGHT, |col, row| {
            let (x, y) = direction(col, row);
            (1.0 + x * x + y * y).sqrt().recip() as f32
        });
        Self {
            folded: truth.map(fold),
            truth,
            amplitude: view.map(|&(range, incidence)| (900.0 * incidence / (range * range)) as f32),
            cosine,
            interval_m,
        }
    }

    /// A hallway 2 m wide and 2.4 m high that ends at 8.5 m, with a card at 1 m: U is 5 m.
    fn hallway(fold_m: f64) -> Self {
        Self::new(5.0, fold_m, 0.02, |x, y| {
            let norm = (1.0 + x * x + y * y).sqrt();
            if (0.1..0.2).contains(&x) && y.abs() < 0.1 {
                return (norm, 1.0 / norm);
            }
            let (end, side, height) = (8.5, 1.0 / x.abs(), 1.2 / y.abs());
            let depth = f64::min(end, f64::min(side, height));
            let incidence = if depth == end {
                1.0
            } else if depth == side {
                x.abs()
            } else {
                y.abs()
            };
            (depth * norm, incidence / norm)
        })
    }

    /// The corner of a room, seen from 3.4 m: nothing wraps.
    fn corner() -> Self {
        Self::new(5.0, 0.0, 0.01, |x, y| {
            let norm = (1.0 + x * x + y * y).sqrt();
            let depth = f64::min(3.4 / (1.0 + x.abs()), if y < 0.0 { -1.2 / y } else { f64::INFINITY });
            (depth * norm, 0.7 / norm)
        })
    }

    fn options() -> RepairOptions {
        let mut options = RepairOptions::default();
        let principal_point_px = [(WIDTH as f32 - 1.0) / 2.0, (HEIGHT as f32 - 1.0) / 2.0];
        options.spatial.geometry = Some(ImageGeometry { principal_distance_px: FOCAL_PX as f32, principal_point_px });
        options
    }

    fn repair(&self, options: &RepairOptions) -> RepairedRanges {
        repair_ranges(&self.folded, Some(&self.amplitude), None, self.interval_m, options).unwrap()
    }

    /// Share of sure pixels, share of the sure that are right, share of the folded that are repaired.
    fn score(&self, found: &RepairedRanges) -> [f64; 3] {
        let half = 0.5 * self.interval_m as f32;
        let (mut sure, mut right, mut folded, mut repaired) = (0.0, 0.0, 0.0, 0.0);
        for index in 0..self.truth.len() {
            let truth = self.truth.as_slice()[index];
            let is_right = (found.range.as_slice()[index] - truth).abs() < half;
            if (self.folded.as_slice()[index] - truth).abs() > half {
                folded += 1.0;
                repaired += f64::from(u8::from(is_right));
            }
            if found.unsure.as_slice()[index] {
                // What is not sure is as it was.
                assert_eq!(found.range.as_slice()[index], self.folded.as_slice()[index]);
                assert_eq!(found.wraps.as_slice()[index], 0);
            } else {
                sure += 1.0;
                right += f64::from(u8::from(is_right));
            }
        }
        [sure / self.truth.len() as f64, right / f64::max(sure, 1.0), repaired / f64::max(folded, 1.0)]
    }
}

#[test]
fn a_hallway_beyond_the_interval_is_continued() {
    for fold_m in [0.0, -0.15, 0.08] {
        let capture = Capture::hallway(fold_m);
        let found = capture.repair(&Capture::options());
        let [sure, right, repaired] = capture.score(&found);
        println!(
            "hallway, fold at {fold_m}: sure {sure:.3}, right {right:.4}, repaired {repaired:.3}, {:?}",
            found.verdict
        );
        assert!(sure > 0.8 && right > 0.995 && repaired > 0.8);
        let RepairVerdict::Absolute { fold_m: detected } = found.verdict else { panic!("{:?}", found.verdict) };
        // The hallway runs through the fold: both ends of the interval are occupied to within a few pixels' steps.
        assert!((detected - fold_m).abs() < 0.02, "{detected} {fold_m}");
        let stated = RepairOptions { fold: Fold::At(fold_m), ..Capture::options() };
        assert!(capture.score(&capture.repair(&stated))[1] > 0.995);
        assert!(found.islands[0].is_decided() && found.islands[0].repaired > 1000);
    }
}

#[test]
fn rooms_are_repaired_where_sure() {
    let (mut sure_sum, mut right_sum, mut repaired_sum, poses) = (0.0, 0.0, 0.0, 8);
    for pose in 0..poses {
        let view = Scene::random(pose).view(1000 + pose, 0.015);
        let to_m = INTERVAL_M as f32 / std::f32::consts::TAU;
        let capture = Capture {
            folded: view.phase.map(|&phase| phase * to_m),
            truth: Raster::from_fn(WIDTH, HEIGHT, |col, row| {
                view.phase[(col, row)] * to_m + view.wraps[(col, row)] as f32 * INTERVAL_M as f32
            }),
            amplitude: view.amplitude,
            cosine: Raster::filled(1, 1, 1.0),
            interval_m: INTERVAL_M,
        };
        let [sure, right, repaired] = capture.score(&capture.repair(&Capture::options()));
        println!("room {pose}: sure {sure:.3}, right {right:.4}, of the folded repaired {repaired:.3}");
        sure_sum += sure / poses as f64;
        right_sum += right / poses as f64;
        repaired_sum += repaired / poses as f64;
    }
    println!("rooms: sure {sure_sum:.3}, right {right_sum:.4}, repaired {repaired_sum:.3}");
    assert!(sure_sum > 0.85 && right_sum > 0.99 && repaired_sum > 0.8);
}

#[test]
fn a_room_inside_the_interval_is_left_alone() {
    let capture = Capture::corner();
    let found = capture.repair(&Capture::options());
    assert_eq!(found.range, capture.folded);
    assert!(found.wraps.as_slice().iter().all(|&wraps| wraps == 0));
    println!("corner: {:?} {:?}", capture.score(&found), found.islands);
}

#[test]
fn ranges_that_a_camera_has_unwrapped_itself_are_left_alone() {
    let capture = Capture::hallway(0.0);
    let found = repair_ranges(&capture.truth, Some(&capture.amplitude), None, 5.0, &Capture::options()).unwrap();
    assert_eq!((found.verdict, &found.range), (RepairVerdict::AlreadyUnwrapped, &capture.truth));
    assert!(found.confidence.as_slice().iter().all(|confidence| confidence.is_nan()) && found.islands.is_empty());
    let stated = RepairOptions { fold: Fold::At(0.0), ..Capture::options() };
    let found = repair_ranges(&capture.truth, None, None, 5.0, &stated).unwrap();
    assert_eq!(found.verdict, RepairVerdict::AlreadyUnwrapped);
    // One stray value beyond the interval does not stop the repair, and is left as it is.
    let mut stray = Capture::hallway(0.0);
    stray.folded[(3, 3)] = 7.0;
    let found = stray.repair(&Capture::options());
    assert!(matches!(found.verdict, RepairVerdict::Absolute { .. }));
    assert!(found.range[(3, 3)] == 7.0 && found.unsure[(3, 3)]);
}

#[test]
fn depths_wrap_along_their_rays() {
    let capture = Capture::hallway(0.0);
    let times =
        |plane: &Raster<f32>| Raster::from_fn(WIDTH, HEIGHT, |col, row| plane[(col, row)] * capture.cosine[(col, row)]);
    let (depth, truth) = (times(&capture.folded), times(&capture.truth));
    let amplitude = Some(&capture.amplitude);
    let found = repair_depths(&depth, &capture.cosine, amplitude, None, 5.0, &Capture::options()).unwrap();
    let [sure, right, repaired] = capture.score(&capture.repair(&Capture::options()));
    let mut close = 0.0;
    for index in 0..depth.len() {
        let error = (found.depth.as_slice()[index] - truth.as_slice()[index]).abs();
        close += f64::from(u8::from(error < 1e-4 && !found.ranges.unsure.as_slice()[index])) / depth.len() as f64;
    }
    println!("depths: close {close:.3}; ranges: sure {sure:.3}, right {right:.4}, repaired {repaired:.3}");
    assert!(close > 0.99 * sure * right);
    let mut wrong = capture.cosine.clone();
    wrong[(4, 5)] = -0.5;
    let error = repair_depths(&depth, &wrong, amplitude, None, 5.0, &Capture::options()).unwrap_err();
    assert_eq!(error, Error::OutOfDomain { name: "cosine", value: -0.5, expected: "above 0 and at most 1" });
    // Rays that are not known have no range.
    wrong[(4, 5)] = f32::NAN;
    let found = repair_depths(&depth, &wrong, amplitude, None, 5.0, &Capture::options()).unwrap();
    assert!(found.depth[(4, 5)] == depth[(4, 5)] && found.ranges.unsure[(4, 5)]);
}

#[test]
fn a_ceiling_just_beyond_the_interval_comes_up_from_the_camera() {
    // A flat ceiling at 2 m and U = 1.94 m: it reads 6 cm in the middle, a cone at the origin. All of it is folded, so
    // brightness compares with nothing; that a plane seen from a point is flat decides.
    let capture = Capture::new(1.94, 0.0, 0.002, |x, y| {
        let norm = (1.0 + x * x + y * y).sqrt();
        (2.0 * norm, 1.0 / norm)
    });
    assert!(capture.folded[(88, 72)] < 0.07);
    let found = capture.repair(&Capture::options());
    let [sure, right, repaired] = capture.score(&found);
    println!("ceiling: sure {sure:.3}, right {right:.4}, repaired {repaired:.3}");
    assert!(right > 0.995 && repaired > 0.9);
    // Without ray geometry nothing tells 6 cm from 2 m: unsure, and as it was.
    let blind = capture.repair(&RepairOptions::default());
    println!("ceiling without rays: {:?}", capture.score(&blind));
    assert!(blind.islands.iter().all(|island| island.repaired == 0) || capture.score(&blind)[1] > 0.995);
}

#[test]
fn without_amplitudes_only_surfaces_through_the_fold_are_continued() {
    // A floor from 1.2 m to 8 m before a wall at 8 m, and a box at 1.9 m that touches nothing: what the tree of smaller
    // steps would get wrong.
    let mut capture = Capture::new(5.0, 0.0, 0.004, |x, y| {
        let norm = (1.0 + x * x + y * y).sqrt();
        if x.abs() < 0.1 && (0.1..0.3).contains(&y) {
            return (1.9 * norm, 0.9);
        }
        (f64::min(8.0, if y < 0.0 { -1.2 / y } else { 8.0 }) * norm, 0.5)
    });
    capture.amplitude = Raster::filled(WIDTH, HEIGHT, f32::NAN);
    let absent = repair_ranges(&capture.folded, None, None, 5.0, &Capture::options()).unwrap();
    assert!(matches!(absent.verdict, RepairVerdict::Relative { .. }));
    let [sure, right, repaired] = capture.score(&absent);
    println!("floor without amplitude: sure {sure:.3}, right {right:.4}, repaired {repaired:.3}");
    assert!(sure > 0.6 && right > 0.999 && repaired > 0.9);
    assert!(absent.unsure[(88, 30)] && absent.range[(88, 30)] == capture.folded[(88, 30)]);
    // An amplitude that is nowhere known is none.
    assert_eq!(capture.repair(&Capture::options()).wraps, absent.wraps);
    // A room inside the interval has no fold to run through.
    let corner = Capture::corner();
    let found = repair_ranges(&corner.folded, None, None, 5.0, &Capture::options()).unwrap();
    assert!(found.range == corner.folded && found.unsure.as_slice().iter().all(|unsure| *unsure));
}

#[test]
fn compensated_amplitudes_are_taken_back() {
    let mut capture = Capture::hallway(0.0);
    let plain = capture.repair(&Capture::options());
    let ranges = capture.folded.clone();
    for (amplitude, range) in capture.amplitude.as_mut_slice().iter_mut().zip(ranges.as_slice()) {
        *amplitude *= range * range;
    }
    let options = RepairOptions { amplitude_kind: AmplitudeKind::RangeCompensated, ..Capture::options() };
    let found = capture.repair(&options);
    let differ = found.wraps.as_slice().iter().zip(plain.wraps.as_slice()).filter(|(a, b)| a != b).count();
    // The fold is detected to a few millimetres, by which the compensation is off.
    assert!(differ < 50, "{differ}");
}

#[test]
fn bad_input_gets_a_typed_answer() {
    let plane = Raster::filled(4, 3, 1.0_f32);
    let options = RepairOptions::default();
    for interval in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = repair_ranges(&plane, None, None, interval, &options).unwrap_err();
        assert!(matches!(error, Error::OutOfDomain { name: "interval_m", .. }));
    }
    let unknown = RepairOptions { fold: Fold::At(f64::NAN), ..options };
    assert!(matches!(repair_ranges(&plane, None, None, 5.0, &unknown), Err(Error::OutOfDomain { name: "fold", .. })));
    let nothing = Raster::filled(4, 3, f32::NAN);
    assert_eq!(repair_ranges(&nothing, None, None, 5.0, &options), Err(Error::AllMasked { pixels: 12 }));
    assert!(matches!(
        repair_ranges(&Raster::filled(0, 0, 0.0), None, None, 5.0, &options),
        Err(Error::AllMasked { .. })
    ));
    let small = Raster::filled(3, 3, 1.0_f32);
    assert!(matches!(repair_ranges(&plane, Some(&small), None, 5.0, &options), Err(Error::Raster(_))));
    assert!(matches!(
        repair_ranges(&plane, None, Some(&Raster::filled(1, 1, true)), 5.0, &options),
        Err(Error::Raster(_))
    ));
    assert!(matches!(repair_depths(&plane, &small, None, None, 5.0, &options), Err(Error::Raster(_))));
    for (width, height) in [(1, 9), (9, 1), (1, 1)] {
        let line = Raster::filled(width, height, 1.0_f32);
        let found = repair_ranges(&line, Some(&line), None, 5.0, &options).unwrap();
        assert_eq!(found.range, line);
    }
}

/// One array of a file of the real capture: little-endian, row by row, after its header.
fn array(path: &Path, name: &str) -> Raster<f32> {
    let mut archive = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut bytes = Vec::new();
    archive.by_name(name).unwrap().read_to_end(&mut bytes).unwrap();
    let body = &bytes[bytes.len() - 4 * WIDTH * HEIGHT..];
    let values = body.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
    Raster::from_vec(WIDTH, HEIGHT, values).unwrap()
}

const CAPTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/sr4000_steps");
const CAPTURE_INTERVAL_M: f64 = 4.9965;

/// Ranges and amplitudes of an SR4000, 30 MHz; `None` where the captures are missing.
fn sr4000(name: &str) -> Option<(Raster<f32>, Raster<f32>)> {
    let path = Path::new(CAPTURES).join(format!("{name}.npz"));
    if !path.exists() {
        println!("skipped: no capture at {}", path.display());
        return None;
    }
    Some((array(&path, "range.npy"), array(&path, "amplitude.npy")))
}

/// The camera's own points tell a principal distance of 217 pixels.
fn sr4000_options(amplitude_kind: AmplitudeKind) -> RepairOptions {
    let mut options = RepairOptions { amplitude_kind, ..Capture::options() };
    if let Some(geometry) = &mut options.spatial.geometry {
        geometry.principal_distance_px = 217.0;
    }
    options
}

#[test]
fn a_real_capture_keeps_its_foreground() {
    for name in ["Y1_0", "Y1_3", "Y2_0", "Y2_3"] {
        let Some((range, amplitude)) = sr4000(name) else { return };
        for kind in [AmplitudeKind::RangeCompensated, AmplitudeKind::Received] {
            let options = sr4000_options(kind);
            let found = repair_ranges(&range, Some(&amplitude), None, CAPTURE_INTERVAL_M, &options).unwrap();
            let count = |test: &dyn Fn(usize) -> bool| (0..range.len()).filter(|&index| test(index)).count();
            let sure = count(&|i| !found.unsure.as_slice()[i]);
            let repaired = |index: usize| found.wraps.as_slice()[index] != 0;
            let at_the_fold = |index: usize| repaired(index) && range.as_slice()[index] < 1.0;
            // Boxes, floor and wall in the lower two fifths, at 1.3 to 2.5 m.
            let foreground = count(&|i| i >= WIDTH * 90 && repaired(i));
            let (all, fold) = (count(&repaired), count(&at_the_fold));
            println!("{name} {kind:?}: sure {sure}, repaired {all}, of them at the fold {fold}, in front {foreground}");
            assert!(matches!(found.verdict, RepairVerdict::Absolute { .. }));
            // What this camera calls amplitude is compensated: a white board at 4.8 m is not darker than the floor at
            // 1.3 m. Taken as received, nothing in front is pushed away all the same.
            assert!(sure > range.len() / 2 && foreground == 0);
            if kind == AmplitudeKind::RangeCompensated {
                assert!(all < range.len() / 200 && 5 * fold >= 4 * all, "{name}: {all} {fold}");
            }
        }
    }
}

#[test]
fn a_real_capture_folded_again_comes_back() {
    for name in ["Y1_0", "Y1_3", "Y2_0", "Y2_3"] {
        let Some((truth, compensated)) = sr4000(name) else { return };
        // As at 60 MHz: ranges beyond 2.5 m fold. Below amplitude 100 the capture itself is noise or folded.
        let interval_m = CAPTURE_INTERVAL_M / 2.0;
        let mask = compensated.map(|&amplitude| amplitude >= 100.0);
        let received = Raster::from_fn(WIDTH, HEIGHT, |col, row| compensated[(col, row)] / truth[(col, row)].powi(2));
        let capture = Capture {
            folded: truth.map(|&range| range.rem_euclid(interval_m as f32)),
            truth,
            amplitude: received,
            cosine: Raster::filled(1, 1, 1.0),
            interval_m,
        };
        let options = sr4000_options(AmplitudeKind::Received);
        let found =
            repair_ranges(&capture.folded, Some(&capture.amplitude), Some(&mask), interval_m, &options).unwrap();
        let [sure, right, repaired] = capture.score(&found);
        let used = mask.as_slice().iter().filter(|used| **used).count() as f64 / mask.len() as f64;
        println!("{name} folded again: used {used:.3}, sure {sure:.3}, right {right:.4}, repaired {repaired:.3}");
        assert!(sure > 0.6 * used && right > 0.97, "{name}: {sure} {right}");
    }
}
