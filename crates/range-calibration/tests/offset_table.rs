//! Offsets by pixel and by block of pixels: recovered, with their deviations, and told from noise.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_calibration::{Error, OffsetSample, OffsetTableOptions, estimate_offset_table};
use range_image::ImageFormat;

const SIZE: [usize; 2] = [24, 18];
const SIGMA_M: f64 = 0.006;

fn format() -> ImageFormat {
    ImageFormat::new(SIZE[0], SIZE[1], [0.1, 0.1]).unwrap()
}

/// Twelve captures with an error of each frame, a common offset, noise, and a pattern by pixel.
fn samples(pattern_m: impl Fn([usize; 2]) -> f64, seed: u64) -> Vec<OffsetSample> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut samples = Vec::new();
    for _ in 0..12 {
        let of_frame: f64 = StandardNormal.sample(&mut random);
        for index in 0..SIZE[0] * SIZE[1] {
            let pixel = [index % SIZE[0], index / SIZE[0]];
            let noise: f64 = StandardNormal.sample(&mut random);
            let residual_m = 0.01 + 1e-3 * of_frame + SIGMA_M * noise + pattern_m(pixel);
            samples.push(OffsetSample { residual_m, sigma_m: SIGMA_M, pixel });
        }
    }
    samples
}

/// A pattern of mean zero of some millimetres.
fn planted([col, row]: [usize; 2]) -> f64 {
    0.005 * if (col * 7 + row * 3) % 2 == 0 { 1.0 } else { -1.0 }
}

#[test]
fn the_offset_of_each_pixel_is_found_within_its_deviation() {
    let mut sum = 0.0;
    for seed in 0..10 {
        let found = estimate_offset_table(&samples(planted, seed), &format(), &OffsetTableOptions::default()).unwrap();
        assert!(found.significant && found.p_value < 1e-6 && found.known_blocks == 432, "{}", found.p_value);
        let mean: f64 = found.pattern.offset_m.iter().map(|offset| f64::from(*offset)).sum::<f64>() / 432.0;
        // Single precision of offsets of 5 mm.
        assert!(mean.abs() < 1e-8, "d0 keeps its meaning: {mean}");
        for (index, (offset, sigma)) in found.pattern.offset_m.iter().zip(&found.pattern.sigma_m).enumerate() {
            let truth = planted([index % SIZE[0], index / SIZE[0]]);
            sum += ((f64::from(*offset) - truth) / f64::from(*sigma)).powi(2);
        }
        // 5 mm of 432 pixels, each known to 6 mm / sqrt(12): the rms is known to 0.1 mm.
        assert!((found.rms_m - 0.005).abs() < 4e-4, "{}", found.rms_m);
    }
    let mean = sum / 4320.0;
    // χ² of 4320 numbers over their count scatters by sqrt(2 / 4320) = 0.022; four of them.
    assert!((mean - 1.0).abs() < 0.09, "{mean}");
}

#[test]
fn noise_makes_no_pattern_but_at_the_stated_level() {
    let options = OffsetTableOptions { level: 0.05, ..OffsetTableOptions::default() };
    let alarms = (0..100)
        .filter(|seed| estimate_offset_table(&samples(|_| 0.0, 50 + seed), &format(), &options).unwrap().significant);
    let alarms = alarms.count();
    println!("{alarms} alarms of 100 at 5 %");
    // 5 with a deviation of 2.2; the errors of whole frames, which all blocks share, make it sleep a little deeper.
    assert!(alarms <= 12, "{alarms}");
}

#[test]
fn blocks_share_an_offset_and_those_not_seen_have_none() {
    let of_block = |[col, row]: [usize; 2]| if col / 5 % 2 == row / 5 % 2 { 0.002 } else { -0.002 };
    let mut samples = samples(of_block, 3);
    // 24 x 18 pixels in blocks of 5: the last column of blocks has 4 pixels, the last row 3. The first block is not seen.
    samples.retain(|sample| sample.pixel[0] >= 5 || sample.pixel[1] >= 5);
    let options = OffsetTableOptions { block: 5, ..OffsetTableOptions::default() };
    let found = estimate_offset_table(&samples, &format(), &options).unwrap();
    assert_eq!((found.known_blocks, found.unknown_blocks), (19, 1));
    assert!(found.significant);
    assert!(found.pattern.offset_m[0] == 0.0 && found.pattern.sigma_m[0].is_nan());
    let at = |col: usize, row: usize| f64::from(found.pattern.offset_m[row * SIZE[0] + col]);
    assert!((at(7, 0) - at(9, 4)).abs() == 0.0, "one block, one offset");
    // Each block has 25 x 12 samples of 6 mm: 0.35 mm.
    assert!((at(7, 0) - at(12, 0) + 0.004).abs() < 2e-3, "{} {}", at(7, 0), at(12, 0));
    found.pattern.validate().unwrap();
}

#[test]
fn bad_input_is_refused_by_name() {
    let good = samples(|_| 0.0, 1);
    let ask = |s: &[OffsetSample], o: &OffsetTableOptions| estimate_offset_table(s, &format(), o).unwrap_err();
    let options = OffsetTableOptions::default();
    assert!(matches!(ask(&good[..3], &options), Error::TooFewDifferences { differences: 3, .. }));
    assert!(matches!(
        ask(&good, &OffsetTableOptions { block: 0, ..options }),
        Error::OutOfDomain { name: "block", .. }
    ));
    let outside = OffsetSample { pixel: [24, 0], ..good[0] };
    assert!(matches!(ask(&[outside], &options), Error::OutOfDomain { name: "column or row", .. }));
    let unknown = OffsetSample { sigma_m: f64::NAN, ..good[0] };
    assert!(matches!(ask(&[unknown], &options), Error::OutOfDomain { name: "sigma_m", .. }));
}
