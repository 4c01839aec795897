//! The forward model against its definition.

use crate::common::{gaussians, rough_kernel, scattered_directly};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use scattering_deconvolution::{Error, Psf, Scatterer};

fn plane(pixels: usize, seed: usize) -> Vec<f32> {
    (0..pixels).map(|i| ((i * 7919 + seed * 104_729) % 1009) as f32 - 300.0).collect()
}

fn largest_difference(psf: &Psf, width: usize, height: usize) -> f64 {
    let (mut re, mut im) = (plane(width * height, 1), plane(width * height, 2));
    let expected = [scattered_directly(psf, width, height, &re), scattered_directly(psf, width, height, &im)];
    Scatterer::new(psf, width, height).unwrap().apply(&mut re, &mut im).unwrap();
    let differences = re.iter().chain(&im).zip(expected.iter().flatten()).map(|(a, b)| (f64::from(*a) - b).abs());
    differences.fold(0.0, f64::max)
}

#[test]
fn light_scatters_as_defined() {
    let psfs = [
        gaussians(&[(0.05, 3.0, 3.0)]),
        gaussians(&[(0.03, 1.0, 6.0), (0.1, 20.0, 9.0)]),
        rough_kernel(5, 3, 0.12),
        // Larger than the images: only its middle can matter.
        rough_kernel(61, 43, 0.3),
    ];
    for (width, height) in [(1, 1), (1, 17), (23, 1), (31, 37), (16, 20)] {
        for (index, psf) in psfs.iter().enumerate() {
            // Values of 700 in single precision: 4e-5 a rounding, several of them in the sums of the transform.
            let difference = largest_difference(psf, width, height);
            assert!(difference < 5e-4, "psf {index}, {width} x {height}: {difference}");
        }
    }
}

#[test]
fn an_empty_point_spread_function_changes_nothing() {
    for psf in [gaussians(&[]), gaussians(&[(0.0, 2.0, 2.0)]), rough_kernel(3, 3, 0.0)] {
        let (mut re, mut im) = (plane(35, 1), plane(35, 2));
        Scatterer::new(&psf, 7, 5).unwrap().apply(&mut re, &mut im).unwrap();
        assert_eq!((re, im), (plane(35, 1), plane(35, 2)));
    }
}

#[test]
fn pixels_without_value_scatter_nothing() {
    let psf = gaussians(&[(0.1, 3.0, 3.0)]);
    let mut scatterer = Scatterer::new(&psf, 9, 9).unwrap();
    let (mut re, mut im) = (plane(81, 1), plane(81, 2));
    (re[40], im[40]) = (0.0, 0.0);
    let (mut re_gap, mut im_gap) = (re.clone(), im.clone());
    (re_gap[40], im_gap[40]) = (f32::NAN, 7.0);
    scatterer.apply(&mut re, &mut im).unwrap();
    scatterer.apply(&mut re_gap, &mut im_gap).unwrap();
    assert!(re_gap[40].is_nan());
    assert_eq!(im_gap[40].to_bits(), 7.0_f32.to_bits());
    for pixel in (0..81).filter(|&pixel| pixel != 40) {
        assert_eq!((re[pixel].to_bits(), im[pixel].to_bits()), (re_gap[pixel].to_bits(), im_gap[pixel].to_bits()));
    }
}

#[test]
fn what_is_wrong_is_named() {
    let named = |psf: &Psf| match Scatterer::new(psf, 8, 8).map(|_| ()).unwrap_err() {
        Error::OutOfDomain { name, .. } => name,
        other => panic!("{other}"),
    };
    assert_eq!(named(&gaussians(&[(-0.1, 1.0, 1.0)])), "weight");
    assert_eq!(named(&gaussians(&[(f64::NAN, 1.0, 1.0)])), "weight");
    assert_eq!(named(&gaussians(&[(0.1, 0.0, 1.0)])), "sigma_px");
    assert_eq!(named(&gaussians(&[(0.1, 1.0, f64::INFINITY)])), "sigma_px");
    assert_eq!(named(&rough_kernel(4, 3, 0.1)), "kernel width");
    assert_eq!(named(&rough_kernel(3, 2, 0.1)), "kernel height");
    assert_eq!(named(&Psf::Kernel { width: 1, height: 1, values: vec![f64::NAN] }), "kernel value");
    let short = Psf::Kernel { width: 3, height: 3, values: vec![0.1; 8] };
    assert!(matches!(Scatterer::new(&short, 8, 8), Err(Error::KernelLength { found: 8, .. })));
    let psf = gaussians(&[(0.1, 1e9, 1e-9)]);
    for (width, height) in [(0, 0), (0, 4), (usize::MAX, 1), (usize::MAX, usize::MAX), (1 << 20, 1 << 20)] {
        assert!(matches!(Scatterer::new(&psf, width, height), Err(Error::ImageSize { .. })));
    }
    let mut scatterer = Scatterer::new(&psf, 4, 4).unwrap();
    let mut whole = vec![0.0; 16];
    assert!(matches!(scatterer.apply(&mut whole, &mut [0.0; 15]), Err(Error::PlaneLength { found: 15, .. })));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(24) })]

    #[test]
    fn scattering_follows_its_definition_for_any_size(
        width in 1_usize..40, height in 1_usize..40, weight in 0.0..0.3_f64, across in 0.1..30.0_f64, down in 0.1..30.0_f64
    ) {
        prop_assert!(largest_difference(&gaussians(&[(weight, across, down)]), width, height) < 5e-4);
    }
}
