//! Restoration of one complex image at 6 % scatter.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use scattering_deconvolution::{GaussianTerm, GridSpacing, Psf, RestorationOptions, Restorer, Scatterer};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];

/// A narrow and a wide Gaussian, the wide one a fifth of the image.
fn psf(width: usize) -> Psf {
    let term = |weight, sigma: f64| GaussianTerm { weight, sigma_px: [sigma, sigma] };
    Psf::Gaussians(vec![term(0.02, 12.0), term(0.04, width as f64 / 5.0)])
}

/// A dim wall and a bright object, scattered.
fn image(width: usize, height: usize) -> (Vec<f32>, Vec<f32>) {
    let lit = |i: usize| if i % width < width / 3 && i / width > height / 2 { 2000.0 } else { 60.0 };
    let mut re: Vec<f32> = (0..width * height).map(lit).collect();
    let mut im: Vec<f32> = re.iter().map(|value| 2.0 * value.sqrt()).collect();
    Scatterer::new(&psf(width), width, height).unwrap().apply(&mut re, &mut im).unwrap();
    (re, im)
}

fn restoration(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Deconvolve");
    for (width, height) in SIZES {
        group.throughput(Throughput::Elements((width * height) as u64));
        let (re, im) = image(width, height);
        for (name, grid_spacing) in [("automatic", GridSpacing::Automatic), ("every_pixel", GridSpacing::EveryPixel)] {
            let options = RestorationOptions { grid_spacing, ..RestorationOptions::default() };
            let mut restorer = Restorer::new(&psf(width), width, height, &options).unwrap();
            let (mut re_work, mut im_work) = (re.clone(), im.clone());
            group.bench_function(format!("{name}/{width}x{height}"), |bencher| {
                bencher.iter(|| {
                    re_work.copy_from_slice(&re);
                    im_work.copy_from_slice(&im);
                    restorer.restore_planes(black_box(&mut re_work), black_box(&mut im_work)).unwrap()
                });
            });
        }
    }
}

criterion_group!(benches, restoration);
criterion_main!(benches);
