//! Point spread functions, images and options that cannot be worked with, and pixels without a value.

use crate::common::{channel, frame, gaussians, no_flags, rough_kernel, scene};
use range_image::{Flags, Raster};
use scattering_deconvolution::{Error, Psf, Refinement, RestorationOptions, Restorer, Scatterer, restore};

/// Half of each pixel's light goes to either side: the alternation of columns is lost.
fn singular() -> Psf {
    Psf::Kernel { width: 3, height: 1, values: vec![0.5, 0.0, 0.5] }
}

fn planes(pixels: usize) -> (Vec<f32>, Vec<f32>) {
    let re: Vec<f32> = (0..pixels).map(|i| ((i * 31) % 17) as f32 + 10.0).collect();
    let im = re.iter().map(|value| value * 0.5).collect();
    (re, im)
}

#[test]
fn a_singular_point_spread_function_is_refused() {
    let error = Restorer::new(&singular(), 62, 40, &RestorationOptions::default()).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::Singular { response, .. } if response < 0.01), "{error}");
    assert!(error.to_string().contains("regularisation"));
}

#[test]
fn regularisation_undoes_what_can_be_undone() {
    let (truth, _) = planes(62 * 40);
    let (mut re, mut im) = planes(62 * 40);
    Scatterer::new(&singular(), 62, 40).unwrap().apply(&mut re, &mut im).unwrap();
    let distance = |re: &[f32]| re.iter().zip(&truth).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt();
    let observed = distance(&re);
    let mut last = f64::INFINITY;
    for regularisation in [1e6, 1.0, 0.01] {
        let options = RestorationOptions { regularisation, ..RestorationOptions::default() };
        let (mut re, mut im) = (re.clone(), im.clone());
        let summary = Restorer::new(&singular(), 62, 40, &options).unwrap().restore_planes(&mut re, &mut im).unwrap();
        assert!(re.iter().chain(&im).all(|value| value.is_finite()));
        assert!(distance(&re) < last, "{regularisation}: {} {summary:?}", distance(&re));
        last = distance(&re);
        // The strongest wish for the observed image gives the observed image.
        assert!(regularisation < 1e6 || (last / observed - 1.0).abs() < 1e-4);
    }
    assert!(last < 0.25 * observed, "{last} of {observed}");
}

#[test]
fn an_iteration_that_does_not_settle_is_refused_and_changes_nothing() {
    let psf = gaussians(&[(0.15, 6.0, 6.0)]);
    let options = RestorationOptions { tolerance: 1e-12, max_iterations: 2, ..RestorationOptions::default() };
    let (mut re, mut im) = planes(40 * 30);
    re[5] = f32::NAN;
    let before: Vec<u32> = re.iter().map(|value| value.to_bits()).collect();
    let error = Restorer::new(&psf, 40, 30, &options).unwrap().restore_planes(&mut re, &mut im).unwrap_err();
    assert!(matches!(error, Error::NotConverged { iterations: 2, .. }), "{error}");
    assert_eq!(before, re.iter().map(|value| value.to_bits()).collect::<Vec<_>>());
    assert_eq!(im, planes(40 * 30).1);
}

#[test]
fn values_too_large_for_single_precision_are_refused() {
    let psf = gaussians(&[(0.1, 6.0, 6.0)]);
    let (mut re, mut im) = (vec![3e38; 1200], vec![3e38; 1200]);
    for refinement in [Refinement::ToTolerance, Refinement::FilterOnly] {
        let options = RestorationOptions { refinement, ..RestorationOptions::default() };
        let mut restorer = Restorer::new(&psf, 40, 30, &options).unwrap();
        assert!(matches!(restorer.restore_planes(&mut re, &mut im), Err(Error::NotConverged { .. })));
    }
    assert!(re.iter().all(|value| value.to_bits() == 3e38_f32.to_bits()));
}

#[test]
fn sizes_and_options_are_checked() {
    let psf = gaussians(&[(0.1, 6.0, 6.0)]);
    let options = RestorationOptions::default();
    for (width, height) in [(0, 0), (7, 0), (usize::MAX, 2)] {
        assert!(matches!(Restorer::new(&psf, width, height, &options), Err(Error::ImageSize { .. })));
        assert!(matches!(Restorer::new(&gaussians(&[]), width, height, &options), Err(Error::ImageSize { .. })));
    }
    for (name, wrong) in [
        ("tolerance", RestorationOptions { tolerance: 0.0, ..options }),
        ("tolerance", RestorationOptions { tolerance: f64::NAN, ..options }),
        ("regularisation", RestorationOptions { regularisation: -1.0, ..options }),
    ] {
        let error = Restorer::new(&psf, 8, 8, &wrong).map(|_| ()).unwrap_err();
        assert!(matches!(error, Error::OutOfDomain { name: found, .. } if found == name), "{error}");
    }
    let mut restorer = Restorer::new(&psf, 8, 8, &options).unwrap();
    let (mut re, mut im) = planes(64);
    assert!(matches!(restorer.restore_planes(&mut re[1..], &mut im), Err(Error::PlaneLength { found: 63, .. })));
    let (re, im) = planes(64);
    let mut turned = channel(16, 4, re, im, 1.0);
    assert!(matches!(restorer.restore(&mut turned), Err(Error::Frame(_))));
    let flags = no_flags(8, 8);
    assert!(matches!(restorer.restore_flagged(&mut turned, &flags), Err(Error::Frame(_))));
    turned.imaginary = Raster::filled(2, 2, 0.0);
    assert!(matches!(restorer.restore(&mut turned), Err(Error::Frame(_))));
}

#[test]
fn pixels_without_a_value_do_not_spread_and_stay() {
    for psf in [gaussians(&[(0.06, 12.0, 12.0)]), rough_kernel(15, 15, 0.06)] {
        let (range, amplitude) = scene(80, 60);
        let mut seen = frame(&range, &amplitude);
        let mut scatterer = Scatterer::new(&psf, 80, 60).unwrap();
        let channel = &mut seen.channels[0];
        scatterer.apply(channel.real.as_mut_slice(), channel.imaginary.as_mut_slice()).unwrap();
        channel.sigma.as_mut_slice().fill(2.0);
        let lost = 60 + 20 * 80;
        let clipped = 10 + 50 * 80;
        channel.real.as_mut_slice()[lost] = f32::INFINITY;
        channel.imaginary.as_mut_slice()[lost] = f32::NAN;
        channel.sigma.as_mut_slice()[lost] = f32::NAN;
        seen.flags.as_mut_slice()[lost] = Flags::NO_DATA;
        seen.flags.as_mut_slice()[clipped] = Flags::SATURATED | Flags::MOTION;
        let mut whole = frame(&range, &amplitude);
        let parts = &mut whole.channels[0];
        scatterer.apply(parts.real.as_mut_slice(), parts.imaginary.as_mut_slice()).unwrap();
        restore(&mut whole, &psf, &RestorationOptions::default()).unwrap();
        let before = seen.clone();
        let summary = restore(&mut seen, &psf, &RestorationOptions::default()).unwrap()[0];
        assert_eq!((summary.kept_pixels, summary.filled_pixels), (2, 1));
        assert_eq!(seen.flags, before.flags);
        let (found, original) = (&seen.channels[0], &before.channels[0]);
        for pixel in [lost, clipped] {
            assert_eq!(found.real.as_slice()[pixel].to_bits(), original.real.as_slice()[pixel].to_bits());
            assert_eq!(found.imaginary.as_slice()[pixel].to_bits(), original.imaginary.as_slice()[pixel].to_bits());
            assert_eq!(found.sigma.as_slice()[pixel].to_bits(), original.sigma.as_slice()[pixel].to_bits());
        }
        for pixel in (0..80 * 60).filter(|&pixel| pixel != lost && pixel != clipped) {
            let change = found.real.as_slice()[pixel] - whole.channels[0].real.as_slice()[pixel];
            // The lost pixel lies on the wall and is filled from it: all that is missing is its texture, 20, of which
            // no other pixel gets more than a thousandth.
            assert!(change.abs() < 0.02, "pixel {pixel}: {change}");
            assert!(found.sigma.as_slice()[pixel].is_finite());
        }
    }
}

#[test]
fn an_image_without_any_value_is_left_alone() {
    let psf = gaussians(&[(0.06, 3.0, 3.0)]);
    let mut nothing = channel(9, 7, vec![f32::NAN; 63], vec![0.0; 63], f32::NAN);
    let mut restorer = Restorer::new(&psf, 9, 7, &RestorationOptions::default()).unwrap();
    let summary = restorer.restore(&mut nothing).unwrap();
    assert_eq!((summary.filled_pixels, summary.residual.to_bits()), (63, 0));
    assert!(nothing.real.as_slice().iter().all(|value| value.is_nan()));
}
