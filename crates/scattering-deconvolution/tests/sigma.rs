//! Predicted noise of the restored image against the sampled one.

use crate::common::{channel, gaussians, rough_kernel};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use scattering_deconvolution::{
    CompositePsf, FieldPolynomial, FieldTerm, GaussianTerm, Ghost, GhostDelay, GhostPlace, GridSpacing, Psf,
    RestorationOptions, Restorer,
};

const SIZE: [usize; 2] = [40, 30];
const TRIALS: usize = 1500;

/// Bright noise in a corner, hardly any elsewhere.
fn observed_sigma(pixel: usize, dim: f32) -> f32 {
    let (col, row) = (pixel % SIZE[0], pixel / SIZE[0]);
    if col < 12 && row < 10 { 20.0 } else { dim }
}

/// Sampled over predicted standard deviation: smallest and largest of block means over 5 x 5 pixels.
fn ratios(psf: &Psf, options: &RestorationOptions, dim: f32) -> (f64, f64) {
    let pixels = SIZE[0] * SIZE[1];
    let mut restorer = Restorer::new(psf, SIZE[0], SIZE[1], options).unwrap();
    let mut generator = Pcg64Mcg::seed_from_u64(5);
    let mut squares = vec![0.0_f64; pixels];
    let mut predicted = Vec::new();
    for _ in 0..TRIALS {
        let noise = |generator: &mut Pcg64Mcg| -> Vec<f32> {
            let normal = |pixel: usize, value: f32| value * observed_sigma(pixel, dim);
            (0..pixels).map(|pixel| normal(pixel, StandardNormal.sample(generator))).collect()
        };
        let (re, im) = (noise(&mut generator), noise(&mut generator));
        let mut image = channel(SIZE[0], SIZE[1], re, im, 0.0);
        for (pixel, sigma) in image.sigma.as_mut_slice().iter_mut().enumerate() {
            *sigma = observed_sigma(pixel, dim);
        }
        restorer.restore(&mut image).unwrap();
        for (pixel, square) in squares.iter_mut().enumerate() {
            *square += f64::from(image.real.as_slice()[pixel]).powi(2);
            *square += f64::from(image.imaginary.as_slice()[pixel]).powi(2);
        }
        predicted = image.sigma.into_vec();
    }
    let ratio = |pixel: usize| squares[pixel] / (2.0 * TRIALS as f64) / f64::from(predicted[pixel]).powi(2);
    let block = |col: usize, row: usize| {
        let inside = (0..25).map(|i| (col + i % 5) + (row + i / 5) * SIZE[0]);
        (inside.map(ratio).sum::<f64>() / 25.0).sqrt()
    };
    let blocks = (0..SIZE[1] / 5).flat_map(|row| (0..SIZE[0] / 5).map(move |col| (5 * col, 5 * row)));
    let ratios = blocks.map(|(col, row)| block(col, row));
    ratios.fold((f64::INFINITY, 0.0), |(least, most), ratio| (least.min(ratio), most.max(ratio)))
}

#[test]
fn sigma_of_the_restored_image_is_the_sampled_one() {
    let every_pixel = RestorationOptions { grid_spacing: GridSpacing::EveryPixel, ..RestorationOptions::default() };
    let cases = [
        // A kernel of 9 pixels mixes noise by itself; its inverse changes sigma by several percent.
        (rough_kernel(3, 3, 0.3), every_pixel, 2.0),
        // Noise of the bright corner that reaches the dim rest.
        (rough_kernel(5, 5, 0.15), every_pixel, 0.05),
        (gaussians(&[(0.15, 4.0, 2.0)]), every_pixel, 0.05),
        (gaussians(&[(0.15, 5.0, 4.0)]), RestorationOptions::default(), 0.02),
        (rough_kernel(3, 3, 0.3), RestorationOptions { regularisation: 0.1, ..every_pixel }, 2.0),
    ];
    for (psf, options, dim) in cases {
        let (least, most) = ratios(&psf, &options, dim);
        // 3000 values a pixel: 1.3 %. Pixels of a block that got their noise from one bright corner share it, so a
        // block's mean is hardly better: 48 blocks within three times that.
        assert!(least > 0.96 && most < 1.04, "sampled / predicted from {least} to {most}: {psf:?}");
    }
}

/// Noise that reaches other pixels over a field that changes from side to side, and by a mirror image.
fn changing(weight: f64, sigma: f64) -> Psf {
    let gaussian = GaussianTerm { weight, sigma_px: [sigma, 1.2 * sigma] };
    let slope = |linear| FieldPolynomial { constant: 1.0, linear, quadratic: [0.0; 3] };
    let delay = GhostDelay::Phase(1.0);
    let place = GhostPlace::Mirrored([24.0, 17.0]);
    Psf::Composite(CompositePsf {
        stationary: vec![GaussianTerm { weight: 0.3 * weight, ..gaussian }],
        field_terms: vec![
            FieldTerm { gaussian, received: slope([0.4, -0.2]), sent: slope([0.0, 0.5]) },
            FieldTerm { gaussian, received: slope([-0.4, 0.3]), sent: slope([-0.3, 0.0]) },
        ],
        ghosts: vec![Ghost { weight: 0.4 * weight, place, sigma_px: [sigma, sigma], delay }],
    })
}

#[test]
fn sigma_holds_where_scattering_changes_over_the_field() {
    let every_pixel = RestorationOptions { grid_spacing: GridSpacing::EveryPixel, ..RestorationOptions::default() };
    let cases = [
        // Narrow Gaussians change the own noise of each pixel by several percent.
        (changing(0.1, 0.8), every_pixel, 2.0),
        // Noise of the bright corner in the dim rest; its mirror image is the opposite corner.
        (changing(0.06, 3.0), every_pixel, 0.05),
        (changing(0.06, 5.0), RestorationOptions::default(), 0.02),
    ];
    for (psf, options, dim) in cases {
        let (least, most) = ratios(&psf, &options, dim);
        // As above; what the mean field neglects, half of the scattered share of what is scattered, lies within.
        assert!(least > 0.95 && most < 1.05, "sampled / predicted from {least} to {most}: {psf:?}");
    }
}

#[test]
fn the_gain_of_uniform_noise_is_reported() {
    let psf = rough_kernel(3, 3, 0.3);
    let mut restorer = Restorer::new(&psf, 60, 60, &RestorationOptions::default()).unwrap();
    let mut image = channel(60, 60, vec![1.0; 3600], vec![1.0; 3600], 3.0);
    let summary = restorer.restore(&mut image).unwrap();
    let middle = f64::from(image.sigma[(30, 30)]) / 3.0;
    assert!((summary.noise_gain - middle).abs() < 1e-5, "{} {middle}", summary.noise_gain);
    assert!((middle - 1.0).abs() > 0.005);
}
