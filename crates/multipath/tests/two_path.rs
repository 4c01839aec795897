//! The direct range beside a second path.

use crate::common;
use crate::common::{CONTRAST, NO_SYSTEMATICS, Path, THREE, frame, matched_range, median, spread};
use multipath::{
    Error, FrequencyResponse, PixelPaths, SearchSpan, TwoPathImage, TwoPathOptions, TwoPathSolver, Verdict,
    solve_two_paths,
};
use proptest::prelude::*;
use range_image::{ComplexFrame, Flags};

const SIZE: [usize; 2] = [60, 50];
const SIGMA: f64 = 1.0;

fn options() -> TwoPathOptions {
    TwoPathOptions { systematics: NO_SYSTEMATICS, diffuse_share: 0.0, ..TwoPathOptions::default() }
}

/// Direct light of 150 to 450 standard deviations at 1 to 5.5 m; the second path brings 0.15 to 0.6 of it, 0.5 to 2.5 m later.
fn paths(index: usize) -> Vec<Path> {
    let (amplitude, range) = (150.0 + 300.0 * spread(index, 1), 1.0 + 4.5 * spread(index, 2));
    let (ratio, detour) = (0.15 + 0.45 * spread(index, 3), 0.5 + 2.0 * spread(index, 4));
    vec![(amplitude, range), (ratio * amplitude, range + detour)]
}

fn solve(frame: &ComplexFrame, contrast: &[f64]) -> TwoPathImage {
    solve_two_paths(frame, &FrequencyResponse { contrast: contrast.to_vec() }, &options()).unwrap()
}

fn resolved(image: &TwoPathImage) -> impl Iterator<Item = (usize, &PixelPaths)> {
    image.paths.as_slice().iter().enumerate().filter(|(_, paths)| paths.verdict == Verdict::Two)
}

/// Root mean square of error over sigma of the direct range, and the share of errors beyond three sigma.
fn normalised_error(image: &TwoPathImage, paths: impl Fn(usize) -> Vec<Path>) -> (f64, f64) {
    let squares: Vec<f64> = resolved(image)
        .map(|(index, found)| {
            ((f64::from(found.direct_m) - paths(index)[0].1) / f64::from(found.sigma_direct_m)).powi(2)
        })
        .collect();
    let far = squares.iter().filter(|square| **square > 9.0).count();
    let count = squares.len() as f64;
    ((squares.iter().sum::<f64>() / count).sqrt(), far as f64 / count)
}

#[test]
fn the_bias_of_the_direct_range_falls_twentyfold() {
    let frame = frame(SIZE, &THREE, &CONTRAST, SIGMA, 21, paths);
    let image = solve(&frame, &CONTRAST);
    // Three refusals in 3000 are expected of a false alarm of one in a thousand; some detours are too short.
    assert!(image.count(Verdict::Two) > 2900, "{}", image.count(Verdict::Two));
    let matched = matched_range(&frame, &CONTRAST, 9.0);
    let error = |index: usize, range: f32| (f64::from(range) - paths(index)[0].1).abs();
    let before = median(resolved(&image).map(|(index, _)| error(index, matched.as_slice()[index])).collect());
    let after = median(resolved(&image).map(|(index, found)| error(index, found.direct_m)).collect());
    // Found: 27 mm and 1.1 mm, the latter of it noise.
    assert!(before > 0.02 && after < before / 20.0, "{before} {after}");
    let mean: f64 = resolved(&image).map(|(i, found)| f64::from(found.direct_m) - paths(i)[0].1).sum::<f64>() / 3000.0;
    assert!(mean.abs() < 3e-4, "mean error left {mean}");
}

#[test]
fn sigmas_are_those_of_sampling() {
    // At ten times the noise some pixels are not resolved; what is resolved must still be honest.
    for (sigma, least) in [(1.0, 2900), (4.0, 2200), (10.0, 900)] {
        let frame = frame(SIZE, &THREE, &CONTRAST, sigma, 22, paths);
        let image = solve(&frame, &CONTRAST);
        let count = image.count(Verdict::Two);
        let (rms, far) = normalised_error(&image, paths);
        assert!(count >= least, "sigma {sigma}: {count} resolved");
        // Sampling knows the rms to 1.4 %; beyond three sigma are 0.27 % of a normal variable, 8 of 3000.
        assert!((rms - 1.0).abs() < 0.06, "sigma {sigma}: normalised error {rms}");
        assert!(far < 0.007, "sigma {sigma}: {far} beyond three sigma");
    }
}

#[test]
fn ratio_and_indirect_range_have_honest_sigmas_as_well() {
    let image = solve(&frame(SIZE, &THREE, &CONTRAST, SIGMA, 23, paths), &CONTRAST);
    let rms = |value: &dyn Fn(usize, &PixelPaths) -> f64| {
        let squares: Vec<f64> = resolved(&image).map(|(index, found)| value(index, found).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let ratio = rms(&|i, p| (f64::from(p.ratio) - paths(i)[1].0 / paths(i)[0].0) / f64::from(p.sigma_ratio));
    let indirect = rms(&|i, p| (f64::from(p.indirect_m) - paths(i)[1].1) / f64::from(p.sigma_indirect_m));
    // 3000 samples know an rms to 1.3 %; the linearised covariance adds a little.
    assert!((ratio - 1.0).abs() < 0.08 && (indirect - 1.0).abs() < 0.08, "{ratio} {indirect}");
}

#[test]
fn one_path_stays_one() {
    let single = |index: usize| vec![paths(index)[0]];
    let image = solve(&frame(SIZE, &THREE, &CONTRAST, SIGMA, 24, single), &CONTRAST);
    let count = image.count(Verdict::Single);
    // A false alarm of one in a thousand: 3 of 3000 expected, ten have a probability below 1e-3.
    assert!(count > 2990, "{count}");
    let squares = image.paths.as_slice().iter().enumerate().filter(|(_, p)| p.verdict == Verdict::Single);
    let squares: Vec<f64> =
        squares.map(|(i, p)| ((f64::from(p.direct_m) - paths(i)[0].1) / f64::from(p.sigma_direct_m)).powi(2)).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // 3000 samples know an rms to 1.3 %; four of that.
    assert!((rms - 1.0).abs() < 0.052, "{rms}");
}

#[test]
fn two_frequencies_give_hypotheses_and_never_a_number() {
    let image = solve(&frame(SIZE, &THREE[1..], &CONTRAST[1..], SIGMA, 25, paths), &CONTRAST[1..]);
    assert_eq!(image.count(Verdict::Two), 0);
    assert!(image.paths.as_slice().iter().all(|p| p.verdict == Verdict::Single || p.direct_m.is_nan()));
    let (mut with_truth, mut several) = (0, 0);
    for pixel in &image.hypotheses {
        let truth = paths(pixel.row * SIZE[0] + pixel.col);
        let hit = |h: &multipath::Hypothesis| (h.direct_m - truth[0].1).abs() < 5.0 * h.sigma_direct_m;
        with_truth += usize::from(pixel.solutions.iter().any(hit));
        several += usize::from(pixel.solutions.len() > 1);
    }
    assert_eq!(image.hypotheses.len(), image.count(Verdict::Ambiguous));
    assert!(with_truth > 2980, "the truth is among the hypotheses of {with_truth}");
    assert!(several > 2900, "{several} pixels with several hypotheses");
}

fn with_detour(detour: f64) -> impl Fn(usize) -> Vec<Path> {
    move |index| {
        let [(a, range), (b, _)] = paths(index)[..] else { unreachable!() };
        vec![(a, range), (b, range + detour)]
    }
}

#[test]
fn paths_close_together_are_never_resolved_wrongly() {
    // Detours from a fortieth to a quarter of the shortest interval: the squares have a long, bent valley.
    let mut resolved_share = Vec::new();
    for detour in [0.05, 0.2, 0.3, 0.4, 0.5] {
        let close = with_detour(detour);
        let image = solve(&frame(SIZE, &THREE, &CONTRAST, SIGMA, 26, &close), &CONTRAST);
        let wrong = resolved(&image)
            .filter(|(i, p)| (f64::from(p.direct_m) - close(*i)[0].1).abs() > 4.5 * f64::from(p.sigma_direct_m));
        // Normal errors give 0.02 of 3000.
        assert!(wrong.count() <= 2, "detour {detour} m");
        resolved_share.push(image.count(Verdict::Two) as f64 / 3000.0);
        if detour < 0.1 {
            // One path at a range between the two explains it: no sensor of these frequencies can tell.
            assert!(image.count(Verdict::Single) > 2980);
        } else {
            let told = [Verdict::Single, Verdict::Two, Verdict::Ambiguous, Verdict::Unresolved].map(|v| image.count(v));
            assert!(told[1] + told[3] > 2500, "detour {detour} m: {told:?}");
            assert!(image.count(Verdict::Inconsistent) < 30, "detour {detour} m: {told:?}");
        }
    }
    assert!(resolved_share[0] == 0.0 && resolved_share[1] < 0.01 && resolved_share[4] > 0.8, "{resolved_share:?}");
}

#[test]
fn three_strong_paths_are_inconsistent() {
    let three = |index: usize| {
        let [first, second] = paths(index)[..] else { unreachable!() };
        vec![first, second, (second.0, second.1 + 1.1)]
    };
    let image = solve(&frame(SIZE, &THREE, &CONTRAST, SIGMA, 27, three), &CONTRAST);
    assert!(image.count(Verdict::Inconsistent) > 2950, "{}", image.count(Verdict::Inconsistent));
    assert!(image.paths.as_slice().iter().all(|p| p.verdict != Verdict::Inconsistent || p.direct_m.is_nan()));
}

#[test]
fn a_span_beyond_the_common_interval_is_ambiguous() {
    // 20, 50 and 80 MHz repeat together after 15 m.
    let span = SearchSpan { farthest_m: 22.0, ..SearchSpan::default() };
    let options = TwoPathOptions { span, ..options() };
    let frame = frame([20, 5], &THREE, &CONTRAST, SIGMA, 28, |index| paths(index)[..1].to_vec());
    let image = solve_two_paths(&frame, &FrequencyResponse { contrast: CONTRAST.to_vec() }, &options).unwrap();
    for pixel in &image.hypotheses {
        assert_eq!(pixel.solutions.len(), 2);
        let difference = (pixel.solutions[0].direct_m - pixel.solutions[1].direct_m).abs();
        // c / (2 * 10 MHz), to the millimetre that chi-squared may be shared out by.
        assert!((difference - 14.9896).abs() < 1e-3, "{difference}");
        assert!(pixel.solutions.iter().all(|h| h.indirect_m.is_nan() && h.ratio.abs() < f64::EPSILON));
    }
    assert!(image.count(Verdict::Ambiguous) > 95);
}

#[test]
fn hopeless_pixels_get_no_number() {
    let mut frame = frame([6, 1], &THREE, &CONTRAST, SIGMA, 29, |_| vec![(200.0, 2.0)]);
    frame.channels[0].real.as_mut_slice()[0] = f32::NAN;
    frame.channels[1].sigma.as_mut_slice()[0] = f32::INFINITY;
    frame.flags.as_mut_slice()[1] = Flags::SATURATED;
    frame.flags.as_mut_slice()[2] = Flags::NO_DATA;
    for channel in &mut frame.channels {
        channel.real.as_mut_slice()[3] = 0.0;
        channel.imaginary.as_mut_slice()[3] = 0.0;
        channel.sigma.as_mut_slice()[4] = f32::NAN;
    }
    let image = solve(&frame, &CONTRAST);
    for paths in &image.paths.as_slice()[..5] {
        assert_eq!(paths.verdict, Verdict::NoData);
        assert!(paths.direct_m.is_nan() && paths.sigma_direct_m.is_nan());
    }
    assert_eq!(image.paths.as_slice()[5].verdict, Verdict::Single);
}

#[test]
fn bad_options_are_refused_by_name() {
    let modulations = common::modulations(&THREE);
    let response = FrequencyResponse::flat(3);
    let refuse = |options: TwoPathOptions| TwoPathSolver::new(&modulations, &response, &options).unwrap_err();
    let span = |nearest_m, farthest_m, longest_detour_m| TwoPathOptions {
        span: SearchSpan { nearest_m, farthest_m, longest_detour_m },
        ..TwoPathOptions::default()
    };
    assert!(matches!(refuse(span(2.0, 1.0, 1.0)), Error::OutOfDomain { name: "farthest_m - nearest_m", .. }));
    assert!(matches!(refuse(span(-1.0, 1.0, 1.0)), Error::OutOfDomain { name: "nearest_m", .. }));
    assert!(matches!(refuse(span(0.0, 1.0, f64::NAN)), Error::OutOfDomain { name: "longest_detour_m", .. }));
    assert!(matches!(refuse(span(0.0, 1e4, 1e3)), Error::SearchTooLarge { .. }));
    assert!(matches!(refuse(span(0.0, 1e300, 1e300)), Error::SearchTooLarge { .. }));
    let bad = TwoPathOptions { largest_sigma_m: 0.0, ..TwoPathOptions::default() };
    assert!(matches!(refuse(bad), Error::OutOfDomain { name: "largest_sigma_m", .. }));
    let one = TwoPathSolver::new(&modulations[..1], &FrequencyResponse::flat(1), &TwoPathOptions::default());
    assert!(matches!(one, Err(Error::FrequencyCount { found: 1, least: 2, .. })));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let frame = frame([40, 30], &THREE, &CONTRAST, 4.0, 30, paths);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&frame, &CONTRAST))
    };
    let (one, three) = (with(1), with(3));
    let bits = |image: &TwoPathImage| image.paths.map(|p| [p.direct_m, p.indirect_m, p.chi_squared].map(f32::to_bits));
    assert_eq!(bits(&one), bits(&three));
    assert_eq!(one.hypotheses.len(), three.hypotheses.len());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn without_noise_both_paths_are_found(
        range in 0.5..6.5_f64, detour in 0.5..2.9_f64, ratio in 0.1..0.9_f64, amplitude in 10.0..1e4_f64,
    ) {
        let exact = frame([1, 1], &THREE, &CONTRAST, 0.0, 1, |_| vec![(amplitude, range), (ratio * amplitude, range + detour)]);
        // The values are single precision: 6e-8 of each, for which the sigma stands.
        let mut stated = exact;
        for channel in &mut stated.channels {
            channel.sigma.as_mut_slice()[0] = (amplitude * 1e-6) as f32;
        }
        let found = solve(&stated, &CONTRAST).paths.as_slice()[0];
        // One pair in some four hundred: rounding to single precision, against so small a sigma, bends the squares, and
        // there is no number rather than one with a sigma that lies.
        prop_assume!(found.verdict != Verdict::Unresolved);
        prop_assert_eq!(found.verdict, Verdict::Two);
        // Rounding, some thirty times enlarged by the geometry of the worst cases.
        prop_assert!((f64::from(found.direct_m) - range).abs() < 2e-5, "{:?}", found);
        prop_assert!((f64::from(found.ratio) - ratio).abs() < 2e-5, "{:?}", found);
    }
}
