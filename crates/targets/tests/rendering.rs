//! Images of a plane scene: sampled finely, blurred, averaged over pixels, with noise. It shares nothing with the models.
#![allow(dead_code)]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use targets::range_image::Raster;

/// Samples along each side of a pixel.
const FINE: usize = 5;

/// The scene `value(col, row)`, blurred by a Gaussian of `blur_px` and averaged over pixels.
pub fn render(width: usize, height: usize, blur_px: f64, value: impl Fn(f64, f64) -> f64) -> Raster<f32> {
    let margin = (4.0 * blur_px * FINE as f64).ceil() as usize;
    let (wide, high) = (width * FINE + 2 * margin, height * FINE + 2 * margin);
    let place = |index: usize| (index as f64 - margin as f64 + 0.5) / FINE as f64 - 0.5;
    let fine: Vec<f64> = (0..high)
        .flat_map(|row| (0..wide).map(move |col| (col, row)))
        .map(|(col, row)| value(place(col), place(row)))
        .collect();
    let sigma = blur_px * FINE as f64;
    let gauss = |offset: i64| {
        if sigma > 0.0 { (-0.5 * (offset as f64 / sigma).powi(2)).exp() } else { f64::from(u8::from(offset == 0)) }
    };
    // The weights of a pixel: the Gaussian, moved over its fine samples and summed.
    let reach = margin as i64;
    let weights: Vec<f64> =
        (-reach..reach + FINE as i64).map(|at| (0..FINE as i64).map(|own| gauss(at - own)).sum()).collect();
    let total: f64 = weights.iter().sum();
    let along: Vec<f64> = (0..high)
        .flat_map(|row| (0..width).map(move |col| (col, row)))
        .map(|(col, row)| {
            weights.iter().enumerate().map(|(k, weight)| weight * fine[row * wide + col * FINE + k]).sum::<f64>()
                / total
        })
        .collect();
    Raster::from_fn(width, height, |col, row| {
        (weights.iter().enumerate().map(|(k, weight)| weight * along[(row * FINE + k) * width + col]).sum::<f64>()
            / total) as f32
    })
}

/// The image with normal noise.
pub fn noisy(image: &Raster<f32>, sigma: f64, seed: u64) -> Raster<f32> {
    let mut random = Pcg64::seed_from_u64(seed);
    image.map(|value| {
        let noise: f64 = StandardNormal.sample(&mut random);
        (f64::from(*value) + sigma * noise) as f32
    })
}

/// 1 inside an ellipse of semi-axes `[a, b]`, turned by `direction` from the columns towards the rows, 0 outside; within half a
/// fine sample of the edge the share that is inside.
pub fn ellipse(centre: [f64; 2], axes: [f64; 2], direction: f64) -> impl Fn(f64, f64) -> f64 {
    let (sine, cosine) = direction.sin_cos();
    move |col, row| {
        let (dx, dy) = (col - centre[0], row - centre[1]);
        let (x, y) = ((cosine * dx + sine * dy) / axes[0], (cosine * dy - sine * dx) / axes[1]);
        let parts = x.hypot(y);
        let slope = (x / axes[0]).hypot(y / axes[1]) / parts.max(1e-9);
        (0.5 - (parts - 1.0) / slope.max(1e-9) * FINE as f64).clamp(0.0, 1.0)
    }
}
