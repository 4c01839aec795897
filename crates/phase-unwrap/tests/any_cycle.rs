//! Phases in `(-pi, pi]`, or of any other cycle, are unwrapped to the same surface as those in `[0, 2 pi)`.

use std::f32::consts::{PI, TAU};

use phase_unwrap::range_image::{Modulation, Raster};
use phase_unwrap::{
    CutPrice, ExactOptions, KnownWraps, MultiFrequencyOptions, NoisyMethod, NoisyOptions, PhaseInput, PhaseNoise, Seed,
    SpatialOptions, StreamUnwrapper, hypotheses, unwrap_least_cuts, unwrap_multi_frequency, unwrap_noisy,
    unwrap_noisy_absolute, unwrap_sequence, unwrap_spatial,
};

/// A floor over two cycles, and the phases of it in three cycles.
fn floor(speed: f32) -> (Raster<f32>, [Raster<f32>; 3]) {
    let surface = Raster::from_fn(40, 60, |col, row| 1.5 + speed * (0.2 * row as f32 + 0.01 * col as f32));
    let inside = surface.map(|value| value.rem_euclid(TAU));
    let signed = inside.map(|&value| if value > PI { value - TAU } else { value });
    let far = Raster::from_fn(40, 60, |col, row| inside[(col, row)] + TAU * (3.0 * (col % 3) as f32 - 4.0));
    (surface, [inside, signed, far])
}

/// Largest distance between `phase + 2 pi wraps` and the surface, less what is common.
fn distance(surface: &Raster<f32>, phase: &Raster<f32>, wraps: &Raster<i32>) -> f32 {
    let off = |index: usize| phase.as_slice()[index] + TAU * wraps.as_slice()[index] as f32 - surface.as_slice()[index];
    (0..surface.len()).map(|index| (off(index) - off(0)).abs()).fold(0.0, f32::max)
}

#[test]
fn counts_belong_to_the_phases_given() {
    let (surface, phases) = floor(1.0);
    let amplitude = surface.map(|value| 900.0 / (value * value));
    let options = SpatialOptions { maximum_wraps: 3, ..SpatialOptions::default() };
    let cuts = ExactOptions { price: CutPrice::Uniform, ..ExactOptions::default() };
    let noisy = NoisyOptions { method: NoisyMethod::Filter, spatial: options, ..NoisyOptions::default() };
    for phase in &phases {
        let relative = unwrap_spatial(phase, None, None, &options).unwrap().wraps;
        let exact = unwrap_least_cuts(phase, None, None, &cuts).unwrap().wraps;
        let filtered = unwrap_noisy(phase, PhaseNoise::Uniform(0.9), None, &noisy).unwrap().unwrapped.wraps;
        let absolute = unwrap_spatial(phase, Some(&amplitude), None, &options).unwrap().wraps;
        let blocks = unwrap_noisy_absolute(phase, &amplitude, PhaseNoise::Uniform(0.9), None, &noisy).unwrap();
        for wraps in [&relative, &exact, &filtered, &absolute, &blocks.unwrapped.wraps] {
            assert!(distance(&surface, phase, wraps) < 1e-4);
        }
        assert!((phase[(0, 0)] + TAU * absolute[(0, 0)] as f32 - surface[(0, 0)]).abs() < 1e-4);
    }
}

#[test]
fn known_counts_belong_to_the_phases_given() {
    let (surface, phases) = floor(1.0);
    for phase in &phases {
        let wraps = ((surface[(20, 30)] - phase[(20, 30)]) / TAU).round() as i32 + 1;
        let seeds = [Seed { col: 20, row: 30, wraps }];
        let counts = Raster::from_fn(40, 60, |col, row| ((col, row) == (20, 30)).then_some(wraps));
        for known in [KnownWraps::Seeds(&seeds), KnownWraps::Raster(&counts)] {
            let mut unwrapper = phase_unwrap::Unwrapper::new(SpatialOptions::default()).unwrap();
            let found = unwrapper.unwrap(phase, None, None, known).unwrap();
            assert_eq!(found.wraps[(20, 30)], wraps);
            assert!(distance(&surface, phase, &found.wraps) < 1e-4);
        }
    }
}

#[test]
fn sequences_and_streams_take_any_cycle() {
    let frames: Vec<_> = (0..3).map(|frame| floor(1.0 + 0.02 * frame as f32)).collect();
    for cycle in 0..3 {
        let phases: Vec<Raster<f32>> = frames.iter().map(|(_, phases)| phases[cycle].clone()).collect();
        let block = unwrap_sequence(&phases, None, &SpatialOptions::default()).unwrap();
        let mut stream = StreamUnwrapper::new(SpatialOptions::default()).unwrap();
        for ((surface, _), (phase, found)) in frames.iter().zip(phases.iter().zip(&block)) {
            assert!(distance(surface, phase, &found.wraps) < 1e-4);
            let next = stream.unwrap_next(&PhaseInput::new(phase)).unwrap();
            assert!(distance(surface, phase, &next.wraps) < 1e-4);
        }
    }
}

#[test]
fn several_frequencies_take_any_cycle() {
    let modulations = [Modulation::new(80e6).unwrap(), Modulation::new(60e6).unwrap()];
    let options = MultiFrequencyOptions::default();
    let range = Raster::from_fn(9, 7, |col, row| 0.5 + 0.07 * (col + 9 * row) as f32);
    let inside = modulations.map(|modulation| {
        range.map(|&range| {
            (f64::from(range) / modulation.range_from_phase(1.0)).rem_euclid(2.0 * std::f64::consts::PI) as f32
        })
    });
    let signed = [0, 1].map(|frequency| inside[frequency].map(|&value| if value > PI { value - TAU } else { value }));
    let (one, other) = (
        unwrap_multi_frequency(&inside, &modulations, None, None, &options).unwrap(),
        unwrap_multi_frequency(&signed, &modulations, None, None, &options).unwrap(),
    );
    let near =
        |a: &Raster<f32>, b: &Raster<f32>| a.as_slice().iter().zip(b.as_slice()).all(|(a, b)| (a - b).abs() < 1e-5);
    assert!(near(&one.range, &range) && near(&other.range, &range));
    for (frequency, modulation) in modulations.iter().enumerate() {
        let metres = modulation.range_from_phase(1.0) as f32;
        let shown = Raster::from_fn(9, 7, |col, row| {
            let at = (col, row);
            metres * (signed[frequency][at] + TAU * other.wraps[frequency][at] as f32)
        });
        assert!(near(&shown, &range));
    }
    let ranks = |phases: &[Raster<f32>]| hypotheses(phases, &modulations, None, None, 2, &options).unwrap().ranks;
    assert!(near(&ranks(&signed)[0].range, &ranks(&inside)[0].range));
}

#[test]
fn what_is_not_finite_stays_masked() {
    let (_, [_, mut signed, _]) = floor(1.0);
    signed[(3, 4)] = f32::NAN;
    signed[(4, 4)] = f32::NEG_INFINITY;
    signed[(5, 4)] = f32::MAX;
    let mask = Raster::from_fn(40, 60, |col, row| (col, row) != (6, 59));
    let found = unwrap_spatial(&signed, None, Some(&mask), &SpatialOptions::default()).unwrap();
    assert_eq!([(3, 4), (4, 4), (6, 59)].map(|at| (found.island[at], found.wraps[at])), [(0, 0); 3]);
    assert!(found.island[(5, 4)] > 0);
}
