//! Noisy phases: filtered, unwrapped and made congruent again.

use std::f32::consts::{PI, TAU};

use phase_unwrap::{
    Error, ExactOptions, NoisyMethod, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, PhaseNoise, PrefilterOptions,
    SpatialOptions, congruent, prefilter, unwrap_noisy, unwrap_spatial,
};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

const CYCLE: f64 = std::f64::consts::TAU;

/// Truth, truth plus noise and its wrapped phase. "Right" is the count of truth plus noise: what a user would get by
/// measuring without wrapping.
struct Scene {
    truth: Raster<f64>,
    phase: Raster<f32>,
    wraps: Raster<i32>,
}

fn scene(size: [usize; 2], seed: u64, surface: impl Fn(f64, f64) -> f64, sigma: impl Fn(usize, usize) -> f64) -> Scene {
    let mut rng = Pcg64::seed_from_u64(seed);
    let truth = Raster::from_fn(size[0], size[1], |col, row| surface(col as f64, row as f64));
    let noisy = Raster::from_fn(size[0], size[1], |col, row| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        truth[(col, row)] + sigma(col, row) * noise
    });
    let phase = noisy.map(|value| (value.rem_euclid(CYCLE) as f32).min(TAU));
    Scene { truth, phase, wraps: noisy.map(|value| value.div_euclid(CYCLE) as i32) }
}

/// A paraboloid and slopes over 640 x 480: eleven cycles, at most 0.3 rad from pixel to pixel.
fn smooth(col: f64, row: f64) -> f64 {
    40.0 + 0.11 * col + 0.05 * row - 0.000_25 * ((col - 330.0).powi(2) + (row - 210.0).powi(2))
}

/// A floor with boxes that stand off by less than half a cycle, so that every method may be right.
fn boxes(col: f64, row: f64) -> f64 {
    let inside = |left: f64, top: f64| (left..left + 23.0).contains(&col) && (top..top + 31.0).contains(&row);
    let off = [(10.0, 12.0, 1.5), (60.0, 9.0, 2.6), (31.0, 60.0, 2.0), (80.0, 55.0, 2.9)];
    20.0 + 0.03 * row - off.iter().filter(|o| inside(o.0, o.1)).map(|o| o.2).sum::<f64>()
}

/// Share of the pixels with the right count, up to the offset of most of them.
fn right(found: &Raster<i32>, truth: &Raster<i32>) -> f64 {
    let offset = |index: usize| found.as_slice()[index] - truth.as_slice()[index];
    let mut counts = std::collections::BTreeMap::new();
    for index in 0..found.len() {
        *counts.entry(offset(index)).or_insert(0_usize) += 1;
    }
    *counts.values().max().unwrap() as f64 / found.len() as f64
}

#[test]
fn noise_of_one_radian_leaves_997_of_1000_pixels_right() {
    let scene = scene([640, 480], 1, smooth, |_, _| 1.0);
    let tree = unwrap_spatial(&scene.phase, None, None, &SpatialOptions::default()).unwrap();
    let sigma = scene.phase.map(|_| 1.0);
    let known = right(&tree.wraps, &scene.wraps);
    // Noise beyond half a cycle, P(|n| > pi) = 0.00168, cannot be told: no method exceeds 0.9983 in expectation.
    let ceiling = 1.0 - 0.00168;
    println!("tree {known:.4}, ceiling {ceiling:.4}");
    for (name, noise) in
        [("uniform", PhaseNoise::Uniform(1.0)), ("sigma", PhaseNoise::Sigma(&sigma)), ("unknown", PhaseNoise::Unknown)]
    {
        let found = unwrap_noisy(&scene.phase, noise, None, &NoisyOptions::default()).unwrap();
        let share = right(&found.unwrapped.wraps, &scene.wraps);
        let sure = found.unwrapped.confidence.as_slice().iter().filter(|c| **c >= 0.6).count();
        println!("{name} {share:.5}, {:.3} of the pixels sure", sure as f64 / share / scene.phase.len() as f64);
        assert!(share >= 0.997, "{name}: {share}");
        assert!(share > known);
    }
    assert!(known < 0.9, "the tree alone does not do: {known}");
}

#[test]
fn other_seeds_and_noises_stay_near_what_noise_allows() {
    for (seed, sigma, outside) in [(2, 0.6, 1.6e-7), (3, 0.8, 8.6e-5), (4, 1.0, 1.68e-3), (5, 1.2, 8.85e-3)] {
        let scene = scene([320, 241], seed, smooth, |_, _| sigma);
        let found = unwrap_noisy(&scene.phase, PhaseNoise::Unknown, None, &NoisyOptions::default()).unwrap();
        let wrong = 1.0 - right(&found.unwrapped.wraps, &scene.wraps);
        println!("sigma {sigma}: wrong {wrong:.5}, unavoidable {outside:.5}");
        // The filtered surface is off by up to 0.16 rad and more at borders: a third more errors, and 3 deviations.
        let chance = 3.0 * (outside / scene.phase.len() as f64).sqrt();
        assert!(wrong <= 1.35 * outside + chance + 1e-4, "sigma {sigma}: {wrong}");
    }
}

#[test]
fn quiet_images_with_jumps_are_left_to_the_tree() {
    let jumps = |col: f64, row: f64| boxes(col, row) - if (40.0..58.0).contains(&col) { 4.4 } else { 0.0 };
    let scene = scene([113, 97], 7, jumps, |_, _| 0.05);
    let tree = unwrap_spatial(&scene.phase, None, None, &SpatialOptions::default()).unwrap();
    for noise in [PhaseNoise::Uniform(0.05), PhaseNoise::Unknown] {
        let found = unwrap_noisy(&scene.phase, noise, None, &NoisyOptions::default()).unwrap();
        assert!(found.filtered.phase == scene.phase && found.unwrapped == tree);
        assert!(found.filtered.radius.as_slice().iter().all(|radius| *radius == 0));
    }
}

#[test]
fn windows_stop_at_jumps() {
    // A fence: bars of three pixels that stand off by 2.2 rad, in noise that asks for windows of five.
    let fence = |col: f64, row: f64| 20.0 + 0.03 * row - if col % 9.0 < 3.0 { 2.2 } else { 0.0 };
    let rigid = PrefilterOptions { least_coherence: 0.0, deviations: 1e3, ..PrefilterOptions::default() };
    for sigma in [0.35_f64, 0.45, 0.55] {
        let scene = scene([127, 101], 8, fence, |_, _| sigma);
        let error = |prefilter: PrefilterOptions| {
            let options = NoisyOptions { prefilter, ..NoisyOptions::default() };
            let found = unwrap_noisy(&scene.phase, PhaseNoise::Uniform(sigma as f32), None, &options).unwrap();
            let off = found.filtered.phase.as_slice().iter().zip(scene.truth.as_slice()).map(|(filtered, truth)| {
                ((f64::from(*filtered) - truth + CYCLE / 2.0).rem_euclid(CYCLE) - CYCLE / 2.0).powi(2)
            });
            ((off.sum::<f64>() / scene.phase.len() as f64).sqrt(), right(&found.unwrapped.wraps, &scene.wraps))
        };
        let (adaptive, rigid) = (error(PrefilterOptions::default()), error(rigid));
        println!("sigma {sigma}: error and share right adaptive {adaptive:.4?}, rigid {rigid:.4?}");
        // Better than the raw noise and than windows that do not look; a third of all pixels lie on a bar.
        assert!(adaptive.0 < 0.9 * sigma && adaptive.0 < 0.93 * rigid.0, "{adaptive:?} {rigid:?}");
        assert!(adaptive.1 > 0.999, "{adaptive:?}");
    }
}

#[test]
fn amplitudes_tell_where_the_noise_is() {
    // A dark half, ten times as noisy as the bright one.
    let amplitude = Raster::from_fn(160, 120, |col, _| if col < 80 { 1000.0_f32 } else { 100.0 });
    let deviation = |col: usize, row: usize| 100.0 / f64::from(amplitude[(col, row)]);
    let scene = scene([160, 120], 9, smooth, deviation);
    let found = unwrap_noisy(&scene.phase, PhaseNoise::Amplitude(&amplitude), None, &NoisyOptions::default()).unwrap();
    let figure = found.filtered.noise_rad.unwrap();
    // Half of the blocks measure 0.1 rad, half 1 rad: either gives noise times amplitude of 100, to a few per cent.
    assert!((figure / 100.0 - 1.0).abs() < 0.1, "{figure}");
    assert!(found.filtered.radius.as_slice().chunks(160).all(|row| row[..78].iter().all(|radius| *radius == 0)));
    assert!(found.filtered.radius[(120, 60)] >= 3);
    let share = right(&found.unwrapped.wraps, &scene.wraps);
    // Half of the pixels have the ceiling 0.9983.
    assert!(share > 0.998, "{share}");
}

#[test]
fn the_stated_sigma_is_the_scatter() {
    for sigma in [0.4, 0.7, 1.0] {
        let scene = scene([200, 150], 10, |col, row| 3.0 + 0.02 * col + 0.01 * row, |_, _| sigma);
        let options = PrefilterOptions { deviations: 6.0, ..PrefilterOptions::default() };
        let filtered = prefilter(&scene.phase, PhaseNoise::Uniform(sigma as f32), None, &options).unwrap();
        let (mut sum, mut count) = (0.0, 0.0);
        for row in 8..142 {
            for col in 8..192 {
                let off = f64::from(filtered.phase[(col, row)]) - scene.truth[(col, row)];
                let off = (off + CYCLE / 2.0).rem_euclid(CYCLE) - CYCLE / 2.0;
                sum += (off / f64::from(filtered.sigma[(col, row)])).powi(2);
                count += 1.0;
            }
        }
        let ratio = (sum / count).sqrt();
        println!("sigma {sigma}: scatter over stated {ratio:.3}");
        // About 500 independent windows: 3 % a standard deviation. The angle of a noisy mean scatters up to 5 % more
        // than its linear approximation says.
        assert!((0.91..1.13).contains(&ratio), "sigma {sigma}: {ratio}");
    }
}

#[test]
fn noise_is_estimated_through_slopes_and_jumps() {
    let steep = |col: f64, row: f64| 1.9 * col - 0.7 * row + boxes(col % 113.0, row % 97.0);
    for sigma in [0.02, 0.1, 0.3, 0.7, 1.0, 1.2] {
        let scene = scene([256, 192], 11, steep, |_, _| sigma);
        let found = prefilter(&scene.phase, PhaseNoise::Unknown, None, &PrefilterOptions::default()).unwrap();
        let ratio = f64::from(found.noise_rad.unwrap()) / sigma;
        println!("sigma {sigma}: estimated over true {ratio:.3}");
        // 384 figures of 240 pairs each, a third with a jump inside.
        assert!((0.9..1.15).contains(&ratio), "sigma {sigma}: {ratio}");
    }
}

#[test]
fn cheapest_cuts_replace_the_tree_or_say_that_they_do_not() {
    let scene = scene([160, 120], 15, smooth, |_, _| 1.0);
    let options = NoisyOptions { method: NoisyMethod::FilteredCuts, ..NoisyOptions::default() };
    let found = unwrap_noisy(&scene.phase, PhaseNoise::Uniform(1.0), None, &options).unwrap();
    assert_eq!(found.method, NoisyMethod::FilteredCuts);
    let share = right(&found.unwrapped.wraps, &scene.wraps);
    // 0.9983 in expectation at best; 0.0006 are two deviations of 19,200 pixels, and borders.
    assert!(share > 0.9965, "{share}");
    // Half of a cycle between neighbours everywhere: residues that no filter removes, and none is allowed.
    let mut rng = Pcg64::seed_from_u64(16);
    let wild = scene.phase.map(|_| rng.random::<f32>() * TAU);
    let options = NoisyOptions { cuts: ExactOptions { maximum_residues: 0, ..ExactOptions::default() }, ..options };
    let refused = unwrap_noisy(&wild, PhaseNoise::Uniform(0.2), None, &options).unwrap();
    assert_eq!(refused.method, NoisyMethod::Filter);
    let tree = unwrap_noisy(&wild, PhaseNoise::Uniform(0.2), None, &NoisyOptions::default()).unwrap();
    assert!(refused == tree);
}

#[test]
fn hard_cases_have_answers() {
    let options = NoisyOptions::default();
    let all = |width, height, value: f32| Raster::filled(width, height, value);
    let run = |phase: &Raster<f32>, noise: PhaseNoise<'_>| unwrap_noisy(phase, noise, None, &options);
    assert!(matches!(run(&all(0, 5, 0.0), PhaseNoise::Unknown), Err(Error::Empty { .. })));
    assert!(matches!(run(&all(7, 3, f32::NAN), PhaseNoise::Unknown), Err(Error::AllMasked { pixels: 21 })));
    assert!(matches!(run(&all(7, 3, 1.0), PhaseNoise::Uniform(f32::NAN)), Err(Error::OutOfDomain { .. })));
    let negative = Raster::from_fn(7, 3, |col, row| if (col, row) == (4, 2) { -0.1 } else { 0.1 });
    let answer = run(&all(7, 3, 1.0), PhaseNoise::Sigma(&negative));
    assert_eq!(answer, Err(Error::NegativeSigma { col: 4, row: 2, value: -0.1 }));
    assert!(matches!(run(&all(7, 3, 1.0), PhaseNoise::Amplitude(&all(3, 7, 1.0))), Err(Error::Raster(_))));
    let mask = Raster::filled(7, 3, false);
    assert!(matches!(
        unwrap_noisy(&all(7, 3, 1.0), PhaseNoise::Unknown, Some(&mask), &options),
        Err(Error::AllMasked { .. })
    ));
    for prefilter in [
        PrefilterOptions { target_sigma_rad: 0.0, ..PrefilterOptions::default() },
        PrefilterOptions { quiet_sigma_rad: f32::NAN, ..PrefilterOptions::default() },
        PrefilterOptions { least_coherence: 1.5, ..PrefilterOptions::default() },
        PrefilterOptions { deviations: -1.0, ..PrefilterOptions::default() },
        PrefilterOptions { largest_radius_px: 16, ..PrefilterOptions::default() },
    ] {
        assert!(NoisyUnwrapper::new(NoisyOptions { prefilter, ..options }).is_err());
    }
    // One pixel, single rows and columns, sizes that no register divides; sigma of zero, NaN and infinity.
    for (width, height) in [(1, 1), (1, 97), (97, 1), (31, 2), (13, 17)] {
        let phase = Raster::from_fn(width, height, |col, row| (0.31 * (col + row) as f32) % TAU);
        let odd = Raster::from_fn(width, height, |col, row| [0.0, f32::NAN, f32::INFINITY, 0.8][(col + 3 * row) % 4]);
        for noise in
            [PhaseNoise::Unknown, PhaseNoise::Uniform(0.9), PhaseNoise::Sigma(&odd), PhaseNoise::Amplitude(&odd)]
        {
            let found = run(&phase, noise).unwrap();
            let steps = found.unwrapped.wraps.as_slice().iter().all(|wraps| (0..=6).contains(wraps));
            assert!(steps, "{width}x{height} {noise:?}: {:?}", found.unwrapped.wraps);
            assert!(found.filtered.phase.as_slice().iter().all(|p| (0.0..=TAU).contains(p)));
        }
    }
    let single = run(&all(1, 1, 2.0), PhaseNoise::Unknown).unwrap();
    assert_eq!((single.filtered.noise_rad, single.unwrapped.wraps[(0, 0)]), (None, 0));
    assert!(single.filtered.sigma[(0, 0)].is_nan());
}

#[test]
fn ties_checkerboards_and_masks_are_taken() {
    // Neighbours half a cycle apart: means of phasors vanish, and nothing may be made of them.
    let board = Raster::from_fn(33, 29, |col, row| if (col + row) % 2 == 0 { 0.5 } else { 0.5 + PI });
    let found = unwrap_noisy(&board, PhaseNoise::Uniform(0.5), None, &NoisyOptions::default()).unwrap();
    assert!(found.unwrapped.wraps.as_slice().iter().all(|wraps| *wraps == 0 || *wraps == 1));
    let scene = scene([64, 48], 12, smooth, |_, _| 1.0);
    let mut phase = scene.phase.clone();
    for row in 0..48 {
        phase[(31, row)] = f32::NAN;
    }
    let mask = Raster::from_fn(64, 48, |col, row| (col / 4 + row / 4) % 5 != 0);
    let found = unwrap_noisy(&phase, PhaseNoise::Uniform(1.0), Some(&mask), &NoisyOptions::default()).unwrap();
    for (col, row) in (0..48).flat_map(|row| (0..64).map(move |col| (col, row))) {
        let used = mask[(col, row)] && col != 31;
        assert_eq!(found.filtered.phase[(col, row)].is_finite(), used);
        assert_eq!(found.unwrapped.island[(col, row)] > 0, used);
        assert!(used || (found.unwrapped.wraps[(col, row)], found.unwrapped.confidence[(col, row)]) == (0, 0.0));
    }
    for island in 1..=found.unwrapped.islands.len() as u32 {
        let counts = found.unwrapped.wraps.as_slice().iter().zip(found.unwrapped.island.as_slice());
        assert_eq!(counts.filter(|c| *c.1 == island).map(|c| *c.0).min(), Some(0));
    }
}

#[test]
fn buffers_and_threads_change_no_bit() {
    let scenes = [scene([131, 67], 13, smooth, |_, _| 1.0), scene([67, 131], 14, boxes, |_, _| 0.6)];
    let mut unwrapper = NoisyUnwrapper::new(NoisyOptions::default()).unwrap();
    let mut out = NoisyUnwrapped::default();
    for scene in scenes.iter().chain(&scenes) {
        unwrapper.unwrap_into(&scene.phase, PhaseNoise::Unknown, None, &mut out).unwrap();
        let fresh = || unwrap_noisy(&scene.phase, PhaseNoise::Unknown, None, &NoisyOptions::default()).unwrap();
        assert!(out == fresh(), "a used buffer changed the result");
        std::thread::scope(|scope| {
            let others: Vec<_> = (0..3).map(|_| scope.spawn(fresh)).collect();
            assert!(others.into_iter().all(|other| other.join().unwrap() == out));
        });
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Made congruent, every phase lies within half a cycle of the filtered surface.
    #[test]
    fn congruent_counts_lie_within_half_a_cycle(
        values in proptest::collection::vec((0.0..TAU, 0.0..TAU, -5..5_i32), 1..60)
    ) {
        let plane = |value: fn(&(f32, f32, i32)) -> f32| {
            Raster::from_vec(values.len(), 1, values.iter().map(value).collect()).unwrap()
        };
        let counts = Raster::from_vec(values.len(), 1, values.iter().map(|v| v.2).collect()).unwrap();
        let (phase, filtered) = (plane(|v| v.0), plane(|v| v.1));
        let wraps = congruent(&phase, &filtered, &counts).unwrap();
        for (index, value) in values.iter().enumerate() {
            let off = phase.as_slice()[index] - filtered.as_slice()[index]
                + TAU * (wraps.as_slice()[index] - value.2) as f32;
            // Half a cycle and three roundings at 4 pi.
            prop_assert!(off.abs() <= PI + 3e-6, "{off}");
        }
    }
}
