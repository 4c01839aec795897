//! Cyclic axes, sequences, streams of frames and edge weights by noise.

use std::f32::consts::{PI, TAU};

use phase_unwrap::{
    Boundary, EdgeWeight, Error, KnownWraps, PhaseInput, Seed, SpatialOptions, StreamUnwrapper, Unwrapped, Unwrapper,
    unwrap_sequence, unwrap_spatial,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

fn wrap(surface: &Raster<f32>) -> Raster<f32> {
    surface.map(|value| value.rem_euclid(TAU).min(TAU))
}

/// Count of whole cycles of a surface; what rounding puts on the other side of a cycle is the phase's word.
fn truth(surface: &Raster<f32>, phase: &Raster<f32>) -> Raster<i32> {
    Raster::from_fn(phase.width(), phase.height(), |col, row| {
        ((surface[(col, row)] - phase[(col, row)]) / TAU).round() as i32
    })
}

#[test]
fn a_panorama_closes_across_its_seam() {
    let (width, height) = (120, 20);
    // Steep enough to wrap several times, the same at both ends.
    let surface = Raster::from_fn(width, height, |col, row| {
        30.0 + 14.0 * (TAU * col as f32 / width as f32).cos() + 0.1 * row as f32
    });
    let phase = wrap(&surface);
    // A blind sector in the middle: left and right hang together only across the seam.
    let mask = Raster::from_fn(width, height, |col, _| !(55..65).contains(&col));
    let options = SpatialOptions { boundaries: [Boundary::Cyclic, Boundary::Open], ..SpatialOptions::default() };
    let found = unwrap_spatial(&phase, None, Some(&mask), &options).unwrap();
    let open = unwrap_spatial(&phase, None, Some(&mask), &SpatialOptions::default()).unwrap();
    assert_eq!((found.islands.len(), open.islands.len()), (1, 2));
    let truth = truth(&surface, &phase);
    let lowest = (0..truth.len()).filter(|&i| mask.as_slice()[i]).map(|i| truth.as_slice()[i]).min().unwrap();
    for row in 0..height {
        for col in (0..width).filter(|&col| mask[(col, row)]) {
            assert_eq!(found.wraps[(col, row)], truth[(col, row)] - lowest, "{col} {row}");
        }
    }
}

#[test]
fn a_segment_cut_by_the_seam_is_one_island_with_amplitudes_too() {
    let surface = Raster::from_fn(64, 24, |col, _| 7.5 + 0.3 * (TAU * col as f32 / 64.0).cos());
    let phase = wrap(&surface);
    let amplitude = surface.map(|s| 100.0 / (s * s));
    let mask = Raster::from_fn(64, 24, |col, _| !(30..34).contains(&col));
    let options = SpatialOptions { boundaries: [Boundary::Cyclic, Boundary::Open], ..SpatialOptions::default() };
    let found = unwrap_spatial(&phase, Some(&amplitude), Some(&mask), &options).unwrap();
    assert_eq!(found.islands.len(), 1);
    assert_eq!(found.wraps[(2, 5)], found.wraps[(60, 5)]);
}

/// A hill that wanders, on a slope that drifts: motion below half a cycle a frame.
fn moving(frames: usize) -> Vec<Raster<f32>> {
    let frame = |t: usize| {
        Raster::from_fn(48, 32, |col, row| {
            let (x, y) = (col as f32 - 10.0 - 2.0 * t as f32, row as f32 - 16.0);
            20.0 + 1.1 * t as f32 + 0.4 * row as f32 + 9.0 * (-(x * x + y * y) / 120.0).exp()
        })
    };
    (0..frames).map(frame).collect()
}

#[test]
fn a_sequence_is_unwrapped_as_one_block() {
    let surfaces = moving(6);
    let mut phases: Vec<Raster<f32>> = surfaces.iter().map(wrap).collect();
    // A bar splits frames 1 to 5; both halves are joined through frame 0 alone.
    for phase in &mut phases[1..] {
        (0..32).for_each(|row| phase[(24, row)] = f32::NAN);
    }
    let found = unwrap_sequence(&phases, None, &SpatialOptions::default()).unwrap();
    let truths: Vec<Raster<i32>> = surfaces.iter().map(|surface| truth(surface, &wrap(surface))).collect();
    let offset = found[0].wraps[(0, 0)] - truths[0][(0, 0)];
    for (frame, (found, truth)) in found.iter().zip(&truths).enumerate() {
        assert_eq!(found.islands.len(), 1);
        for row in 0..32 {
            for col in (0..48).filter(|&col| frame == 0 || col != 24) {
                assert_eq!(found.wraps[(col, row)] - truth[(col, row)], offset, "frame {frame}, {col} {row}");
            }
        }
        assert_eq!(found.islands[0].pixels, if frame == 0 { 48 * 32 } else { 47 * 32 });
    }
    let lowest = found.iter().flat_map(|frame| {
        frame.wraps.as_slice().iter().zip(frame.island.as_slice()).filter(|(_, island)| **island > 0)
    });
    assert_eq!(lowest.map(|(wraps, _)| *wraps).min(), Some(0));
}

#[test]
fn a_sequence_of_one_frame_is_a_frame() {
    let phase = wrap(&moving(1)[0]);
    let found = unwrap_sequence(std::slice::from_ref(&phase), None, &SpatialOptions::default()).unwrap();
    assert_eq!(found, [unwrap_spatial(&phase, None, None, &SpatialOptions::default()).unwrap()]);
}

#[test]
fn bad_sequences_get_a_typed_answer() {
    let options = SpatialOptions::default();
    assert_eq!(unwrap_sequence(&[], None, &options).unwrap_err(), Error::NoFrames);
    let (small, large) = (Raster::filled(3, 2, 1.0), Raster::filled(4, 2, 1.0));
    assert!(matches!(unwrap_sequence(&[small.clone(), large], None, &options), Err(Error::Raster(_))));
    let empty = Raster::filled(0, 0, 1.0);
    assert!(matches!(unwrap_sequence(&[empty], None, &options), Err(Error::Empty { .. })));
    let masked = Raster::filled(3, 2, false);
    assert!(matches!(unwrap_sequence(&[small], Some(&masked), &options), Err(Error::AllMasked { .. })));
}

#[test]
fn a_stream_follows_motion_over_many_cycles() {
    let surfaces = moving(30);
    let mut stream = StreamUnwrapper::new(SpatialOptions::default()).unwrap();
    for (t, surface) in surfaces.iter().enumerate() {
        let phase = wrap(surface);
        let truth = truth(surface, &phase);
        // The first frame is fixed by one seed, all others by the frame before.
        let seeds = [Seed { col: 1, row: 1, wraps: truth[(1, 1)] }];
        let known = if t == 0 { KnownWraps::Seeds(&seeds) } else { KnownWraps::Nothing };
        let found = stream.unwrap_next(&PhaseInput { known, ..PhaseInput::new(&phase) }).unwrap();
        assert_eq!(found.wraps, truth, "frame {t}");
        assert!(found.islands[0].offset_known);
    }
    // After a restart nothing is known any more, and later frames do not pretend that it is.
    stream.restart();
    for surface in &surfaces[..2] {
        assert!(!stream.unwrap_next(&PhaseInput::new(&wrap(surface))).unwrap().islands[0].offset_known);
    }
}

/// A card that comes from 5.6 m to 4.4 m and goes sideways, before a wall at 7 m with a floor; interval 5 m.
fn card(t: usize) -> (Raster<f32>, Raster<f32>, Raster<i32>) {
    let range = Raster::from_fn(80, 60, |col, row| {
        let card = (10 + 2 * t..34 + 2 * t).contains(&col) && (12..40).contains(&row);
        let wall = if row < 45 { 7.0 } else { 7.0 - 0.25 * (row as f32 - 44.0) };
        if card { 5.6 - 0.1 * t as f32 } else { wall }
    });
    let phase = range.map(|r| (r / 5.0 * TAU).rem_euclid(TAU).min(TAU));
    let amplitude = range.map(|r| 100.0 / (r * r));
    let wraps = range.map(|r| (r / 5.0).floor() as i32);
    (phase, amplitude, wraps)
}

#[test]
fn a_stream_carries_a_card_across_the_interval() {
    let mut stream = StreamUnwrapper::new(SpatialOptions::default()).unwrap();
    for t in 0..13 {
        let (phase, amplitude, truth) = card(t);
        let input = PhaseInput { amplitude: Some(&amplitude), ..PhaseInput::new(&phase) };
        let found = stream.unwrap_next(&input).unwrap();
        let (mut sure, mut wrong) = (0, 0);
        for (index, &confidence) in found.confidence.as_slice().iter().enumerate() {
            // The card passes 5 m exactly: there either count is right.
            let at_zero = !(0.01..TAU - 0.01).contains(&phase.as_slice()[index]);
            sure += usize::from(confidence >= 0.6);
            wrong +=
                usize::from(confidence >= 0.6 && !at_zero && found.wraps.as_slice()[index] != truth.as_slice()[index]);
        }
        assert!(wrong == 0 && sure * 10 > 9 * phase.len(), "frame {t}: {wrong} wrong, {sure} sure");
    }
}

#[test]
fn a_previous_frame_gives_way_where_the_image_is_clear() {
    let (phase, amplitude, truth) = card(0);
    let unwrap = |known| {
        let mut unwrapper = Unwrapper::new(SpatialOptions { maximum_wraps: 1, ..SpatialOptions::default() }).unwrap();
        unwrapper.unwrap(&phase, Some(&amplitude), None, known).unwrap()
    };
    let right = |found: &Unwrapped| {
        found.wraps.as_slice().iter().zip(truth.as_slice()).filter(|(a, b)| a == b).count() as f64 / phase.len() as f64
    };
    let free = unwrap(KnownWraps::Nothing);
    assert!(right(&free) > 0.99);
    // A frame before with the floor's near end pushed a cycle away, sure of itself.
    let mut wrong = free.clone();
    wrong.wraps = truth.map(|&count| 1 - count);
    wrong.confidence = wrong.confidence.map(|_| 1.0);
    let known = KnownWraps::Previous { phase: &phase, unwrapped: &wrong, minimum_confidence: 0.5 };
    let found = unwrap(known);
    let sure_wrong = (0..phase.len())
        .filter(|&i| found.confidence.as_slice()[i] >= 0.9 && found.wraps.as_slice()[i] != truth.as_slice()[i])
        .count();
    println!("{:.3} right against a wrong frame before, {sure_wrong} sure and wrong", right(&found));
    assert!((sure_wrong as f64) < 0.05 * phase.len() as f64);
}

/// Images with noise of their own.
const RUNS: usize = 12;

#[test]
fn sigma_leads_the_tree_around_what_is_noisy() {
    let mut rng = Pcg64::seed_from_u64(3);
    // A ramp with stripes of strong noise and quiet bridges between them.
    let noisy = |col: usize, row: usize| col % 16 >= 11 && row % 20 >= 3;
    let sigma = Raster::from_fn(96, 80, |col, row| if noisy(col, row) { 1.6_f32 } else { 0.25 });
    let surface = Raster::from_fn(96, 80, |col, row| 20.0 + 0.5 * col as f32 + 0.2 * row as f32);
    let mut right = [0.0; 3];
    for _ in 0..RUNS {
        let measured = Raster::from_fn(96, 80, |col, row| {
            let noise: f32 = StandardNormal.sample(&mut rng);
            surface[(col, row)] + sigma[(col, row)] * noise
        });
        let phase = wrap(&measured);
        let truth =
            Raster::from_fn(96, 80, |col, row| ((surface[(col, row)] - phase[(col, row)]) / TAU).round() as i32);
        let seeds = [Seed { col: 3, row: 3, wraps: truth[(3, 3)] }];
        let quiet: Vec<usize> = (0..phase.len()).filter(|&i| sigma.as_slice()[i] < 1.0).collect();
        let cases = [
            (None, EdgeWeight::SecondDifferences),
            (Some(&sigma), EdgeWeight::SecondDifferences),
            (Some(&sigma), EdgeWeight::Noise),
        ];
        for (right, (sigma, edge_weight)) in right.iter_mut().zip(cases) {
            let mut unwrapper = Unwrapper::new(SpatialOptions { edge_weight, ..SpatialOptions::default() }).unwrap();
            let input = PhaseInput { sigma, known: KnownWraps::Seeds(&seeds), ..PhaseInput::new(&phase) };
            let mut found = Unwrapped::default();
            unwrapper.unwrap_input_into(&input, &mut found).unwrap();
            let equal = quiet.iter().filter(|&&i| found.wraps.as_slice()[i] == truth.as_slice()[i]).count();
            *right += equal as f64 / quiet.len() as f64 / RUNS as f64;
        }
    }
    println!("quiet pixels right: {:.4} without sigma, {:.4} with, {:.4} by noise alone", right[0], right[1], right[2]);
    assert!(right[1] > 0.999 && right[2] > 0.999 && right[1] >= right[0]);
}

#[test]
fn weights_by_noise_need_a_noise() {
    let phase = Raster::filled(5, 4, 1.0);
    let options = SpatialOptions { edge_weight: EdgeWeight::Noise, ..SpatialOptions::default() };
    assert_eq!(unwrap_spatial(&phase, None, None, &options).unwrap_err(), Error::NoiseUnknown);
    assert_eq!(unwrap_sequence(std::slice::from_ref(&phase), None, &options).unwrap_err(), Error::NoiseUnknown);
    let mut unwrapper = Unwrapper::new(options).unwrap();
    // What no sigma can be stands for a phase that says nothing.
    let mut sigma = Raster::filled(5, 4, 0.1);
    (sigma[(1, 1)], sigma[(2, 1)], sigma[(3, 1)]) = (f32::NAN, -1.0, f32::INFINITY);
    let mut found = Unwrapped::default();
    unwrapper.unwrap_input_into(&PhaseInput { sigma: Some(&sigma), ..PhaseInput::new(&phase) }, &mut found).unwrap();
    assert!(found.confidence[(1, 1)] < 0.1 && found.confidence[(2, 1)] < 0.1 && found.confidence[(0, 0)] > 0.9);
    let small = Raster::filled(3, 3, 0.1);
    let input = PhaseInput { sigma: Some(&small), ..PhaseInput::new(&phase) };
    assert!(matches!(unwrapper.unwrap_input_into(&input, &mut found), Err(Error::Raster(_))));
}

#[test]
fn ties_at_pi_keep_no_side_across_a_seam() {
    let phase = Raster::from_fn(8, 6, |col, _| if col % 2 == 0 { 0.0 } else { PI });
    let options = SpatialOptions { boundaries: [Boundary::Cyclic; 2], ..SpatialOptions::default() };
    assert!(unwrap_spatial(&phase, None, None, &options).unwrap().wraps.as_slice().iter().all(|&wraps| wraps == 0));
}

#[test]
fn one_and_many_threads_give_the_same_bits() {
    let mut rng = Pcg64::seed_from_u64(8);
    let mut random = |scale: f32| {
        Raster::from_fn(131, 97, |col, _| {
            let noise: f32 = StandardNormal.sample(&mut rng);
            (scale * noise + 0.2 * col as f32).rem_euclid(TAU).min(TAU)
        })
    };
    let (phase, amplitude) = (random(0.8), random(0.3).map(|a| 1.0 + a));
    let unwrap = || unwrap_spatial(&phase, Some(&amplitude), None, &SpatialOptions::default()).unwrap();
    let alone = unwrap();
    let together: Vec<Unwrapped> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(unwrap)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(together.iter().all(|found| *found == alone));
}
