//! Steep fringes in noise: the filter that follows them, and the choice between tree, filter and cuts.

use std::f32::consts::TAU;

use phase_unwrap::{
    Error, ExactOptions, FilterVerdict, NoisyMethod, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper, PhaseNoise,
    PrefilterOptions, prefilter, unwrap_noisy,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use range_image::Raster;

use crate::fringes::{Fringes, Which, hill, ramp, scenes};

const METHODS: [NoisyMethod; 5] =
    [NoisyMethod::Tree, NoisyMethod::Cuts, NoisyMethod::Filter, NoisyMethod::FilteredCuts, NoisyMethod::Auto];

fn unwrap(phase: &Raster<f32>, method: NoisyMethod) -> NoisyUnwrapped {
    unwrap_noisy(phase, PhaseNoise::Unknown, None, &NoisyOptions { method, ..NoisyOptions::default() }).unwrap()
}

/// Share of the counts that noise within half a cycle leaves to be right.
fn can_be_right(sigma: f64) -> f64 {
    // Both tails beyond pi / sigma.
    match sigma {
        0.5 => 1.0,
        1.0 => 1.0 - 1.68e-3,
        1.3 => 1.0 - 1.567e-2,
        _ => f64::NAN,
    }
}

#[test]
fn the_filter_follows_ramps_in_all_directions() {
    for (slope, direction_deg, sigma) in [
        (2.0, 0.0, 1.0),
        (2.0, 90.0, 1.0),
        (2.0, 180.0, 1.0),
        (2.0, 217.0, 1.0),
        (1.2, 75.0, 1.0),
        (2.7, 10.0, 1.0),
        (2.3, 305.0, 1.3),
        (2.7, 190.0, 0.5),
        // Both components count: 2.9 rad a column and 2.4 a row.
        (3.76, 39.6, 0.5),
    ] {
        let fringes = Fringes::new([200, 150], &ramp(slope, direction_deg), sigma, 41);
        // From 1.2 rad on some windows stay noisy: the cuts over them are chosen then.
        let methods = [NoisyMethod::Auto, NoisyMethod::Filter];
        for method in methods.into_iter().take(if sigma > 1.2 { 1 } else { 2 }) {
            let found = unwrap(&fringes.phase, method);
            let share = fringes.right(&found.unwrapped.wraps);
            println!("{slope} rad at {direction_deg} deg, noise {sigma}, {method:?}: {share:.4}");
            assert_eq!(found.filtered.verdict, FilterVerdict::Followed);
            // Three deviations of 30,000 pixels, and the filtered surface's own noise.
            let chance = 3.0 * ((1.0 - can_be_right(sigma)) / 3e4).sqrt() + 0.25 * (1.0 - can_be_right(sigma));
            assert!(share >= can_be_right(sigma) - chance, "{slope} {direction_deg} {sigma} {method:?}: {share}");
        }
    }
}

#[test]
fn the_choice_is_as_good_as_the_best_of_the_three() {
    for (sigma, seed) in [(0.1, 51), (0.6, 52), (1.0, 53), (1.25, 54)] {
        for (name, surface) in scenes(Which::HeldOut) {
            let fringes = Fringes::new([320, 240], &surface, sigma, seed);
            let right = |method| fringes.right(&unwrap(&fringes.phase, method).unwrapped.wraps);
            let best =
                [NoisyMethod::Tree, NoisyMethod::Filter, NoisyMethod::Cuts].map(right).into_iter().fold(0.0, f64::max);
            let auto = right(NoisyMethod::Auto);
            assert!(auto >= best - 0.003, "{name} at {sigma}: {auto} against {best}");
            assert!(auto > 0.95, "{name} at {sigma}: {auto}");
        }
    }
}

#[test]
fn the_filter_says_what_it_cannot_follow() {
    let verdict = |phase: &Raster<f32>| {
        prefilter(phase, PhaseNoise::Uniform(1.0), None, &PrefilterOptions::default()).unwrap().verdict
    };
    let share = |verdict: FilterVerdict| if let FilterVerdict::NotFollowed { share } = verdict { share } else { 0.0 };
    let ramp_of = |slope: f64| Fringes::new([96, 80], &ramp(slope, 0.0), 1.0, 61).phase;
    assert_eq!(verdict(&ramp_of(2.5)), FilterVerdict::Followed);
    // Half a cycle a pixel has no side.
    assert!(share(verdict(&ramp_of(3.1))) > 0.9);
    // No phase at all.
    let mut rng = Pcg64::seed_from_u64(62);
    assert!(share(verdict(&Raster::from_fn(96, 80, |_, _| rng.random::<f32>() * TAU))) > 0.99);
    // A bend of 0.5 rad a pixel from pixel to pixel: the slope runs through two cycles a tile.
    assert!(share(verdict(&Fringes::new([96, 80], &hill(8.0, [48.0, 40.0], 16.0), 1.0, 63).phase)) > 0.5);
    let quiet = Fringes::new([96, 80], &ramp(1.0, 0.0), 0.05, 64).phase;
    let found = unwrap(&quiet, NoisyMethod::Auto);
    assert_eq!((found.filtered.verdict, found.method), (FilterVerdict::NotNeeded, NoisyMethod::Tree));
    assert!(found.filtered.phase == quiet);
}

#[test]
fn every_method_takes_the_hard_cases() {
    for method in METHODS {
        let options = NoisyOptions { method, ..NoisyOptions::default() };
        let run = |phase: &Raster<f32>| unwrap_noisy(phase, PhaseNoise::Unknown, None, &options);
        assert!(matches!(run(&Raster::filled(9, 7, f32::NAN)), Err(Error::AllMasked { pixels: 63 })));
        assert!(matches!(run(&Raster::filled(0, 7, 7.0)), Err(Error::Empty { .. })));
        for (width, height) in [(1, 1), (1, 40), (40, 1), (2, 2), (33, 47)] {
            let constant = run(&Raster::filled(width, height, 2.0)).unwrap();
            assert!(constant.unwrapped.wraps.as_slice().iter().all(|wraps| *wraps == 0));
            let steep = Raster::from_fn(width, height, |col, row| (1.9 * (col + row) as f32).rem_euclid(TAU));
            let found = run(&steep).unwrap();
            let value = |at| steep[at] + TAU * found.unwrapped.wraps[at] as f32;
            for (col, row) in (0..height).flat_map(|row| (0..width).map(move |col| (col, row))) {
                let rise = value((col, row)) - value((0, 0)) - 1.9 * (col + row) as f32;
                assert!(rise.abs() < 1e-3, "{method:?}, {width}x{height}: {rise} at ({col}, {row})");
            }
        }
        // A line of holes parts the image; each part starts at 0.
        let mut parted = Fringes::new([48, 40], &ramp(1.5, 20.0), 0.8, 71).phase;
        for row in 0..40 {
            parted[(20, row)] = f32::NAN;
        }
        let found = run(&parted).unwrap().unwrapped;
        assert_eq!(found.islands.len(), 2);
        for island in 1..=2 {
            let counts = found.wraps.as_slice().iter().zip(found.island.as_slice());
            assert_eq!(counts.filter(|(_, of)| **of == island).map(|(wraps, _)| *wraps).min(), Some(0));
        }
    }
}

#[test]
fn the_choice_names_what_it_took_and_keeps_no_trace_of_the_image_before() {
    let all: Vec<Fringes> = scenes(Which::Tuned)
        .into_iter()
        .map(|(name, surface)| Fringes::new([90, 110], &surface, if name.starts_with("waves") { 1.2 } else { 0.6 }, 81))
        .collect();
    let mut unwrapper =
        NoisyUnwrapper::new(NoisyOptions { method: NoisyMethod::Auto, ..NoisyOptions::default() }).unwrap();
    let mut out = NoisyUnwrapped::default();
    for fringes in all.iter().chain(all.iter().rev()) {
        unwrapper.unwrap_into(&fringes.phase, PhaseNoise::Unknown, None, &mut out).unwrap();
        let fresh = unwrap(&fringes.phase, NoisyMethod::Auto);
        assert!(out.unwrapped == fresh.unwrapped && out.method == fresh.method);
        assert_eq!((&out.filtered.radius, out.filtered.verdict), (&fresh.filtered.radius, fresh.filtered.verdict));
        // The counts are those of the method that is named.
        assert_eq!(out.unwrapped.wraps, unwrap(&fringes.phase, out.method).unwrapped.wraps);
    }
    assert_eq!(unwrap(&all.last().unwrap().phase, NoisyMethod::Auto).method, NoisyMethod::Cuts);
    // More residues than are allowed leave the tree.
    let cuts = ExactOptions { maximum_residues: 0, ..ExactOptions::default() };
    let options = NoisyOptions { method: NoisyMethod::Cuts, cuts, ..NoisyOptions::default() };
    let refused = unwrap_noisy(&all[0].phase, PhaseNoise::Unknown, None, &options).unwrap();
    assert_eq!(refused.method, NoisyMethod::Tree);
}
