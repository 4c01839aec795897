//! Saturated and missing pixels, and pixels that depend on them.

use crate::common::{channel, frame, gaussians, scene};
use range_image::Flags;
use scattering_deconvolution::{Error, GridSpacing, RestorationOptions, Restorer, SaturatedLight, Scatterer, restore};

const SIZE: [usize; 2] = [88, 72];

/// The scene scattered, the brightest pixels clipped to a share of their light and flagged.
fn clipped(share: f32) -> (range_image::ComplexFrame, range_image::ComplexFrame) {
    let (range, amplitude) = scene(SIZE[0], SIZE[1]);
    let truth = frame(&range, &amplitude);
    let mut seen = truth.clone();
    let part = &mut seen.channels[0];
    let mut scatterer = Scatterer::new(&gaussians(&[(0.06, 12.0, 12.0)]), SIZE[0], SIZE[1]).unwrap();
    scatterer.apply(part.real.as_mut_slice(), part.imaginary.as_mut_slice()).unwrap();
    for pixel in (0..SIZE[0] * SIZE[1]).filter(|pixel| amplitude.as_slice()[*pixel] > 2300.0) {
        part.real.as_mut_slice()[pixel] *= share;
        part.imaginary.as_mut_slice()[pixel] *= share;
        seen.flags.as_mut_slice()[pixel] |= Flags::SATURATED;
    }
    (seen, truth)
}

fn options(saturated_light: SaturatedLight, grid_spacing: GridSpacing) -> RestorationOptions {
    RestorationOptions { saturated_light, grid_spacing, ..RestorationOptions::default() }
}

#[test]
fn pixels_near_clipped_light_are_flagged_and_others_are_right() {
    let psf = gaussians(&[(0.06, 12.0, 12.0)]);
    for grid_spacing in [GridSpacing::Automatic, GridSpacing::EveryPixel] {
        let (mut seen, truth) = clipped(0.5);
        let before = seen.clone();
        let summary = restore(&mut seen, &psf, &options(SaturatedLight::Clipped, grid_spacing)).unwrap()[0];
        assert!(summary.kept_pixels > 300 && summary.filled_pixels == 0 && summary.dependent_pixels > 100);
        let mut flagged = 0;
        for pixel in 0..SIZE[0] * SIZE[1] {
            let parts = |frame: &range_image::ComplexFrame| {
                [frame.channels[0].real.as_slice()[pixel], frame.channels[0].imaginary.as_slice()[pixel]]
            };
            let flags = seen.flags.as_slice()[pixel];
            if flags.contains(Flags::SATURATED) {
                assert_eq!(parts(&seen).map(f32::to_bits), parts(&before).map(f32::to_bits));
                assert!(!flags.contains(Flags::MULTIPATH));
                continue;
            }
            flagged += usize::from(flags.contains(Flags::MULTIPATH));
            let ([a, b], [c, d]) = (parts(&seen), parts(&truth));
            let wrong = (a - c).hypot(b - d) / c.hypot(d);
            // Half of the light is not known; a tenth of what is left was allowed from the other half. What is left is
            // itself wrong by that tenth.
            assert!(flags.contains(Flags::MULTIPATH) || wrong < 0.12, "pixel {pixel}: {wrong}");
        }
        assert_eq!(flagged, summary.dependent_pixels);
    }
}

#[test]
fn saturated_light_can_be_taken_from_its_neighbours() {
    let psf = gaussians(&[(0.06, 12.0, 12.0)]);
    let error = |saturated_light| {
        let (mut seen, truth) = clipped(0.0);
        let summary = restore(&mut seen, &psf, &options(saturated_light, GridSpacing::Automatic)).unwrap()[0];
        let parts = seen.channels[0].real.as_slice().iter().zip(truth.channels[0].real.as_slice());
        let free = parts.zip(seen.flags.as_slice()).filter(|(_, flags)| !flags.contains(Flags::SATURATED));
        (free.map(|((a, b), _)| f64::from((a - b).abs())).sum::<f64>(), summary)
    };
    let ((clipped, _), (filled, summary)) = (error(SaturatedLight::Clipped), error(SaturatedLight::Filled));
    assert_eq!(summary.filled_pixels, summary.kept_pixels);
    // The object is textured: its other pixels are 30 % dimmer, but that is more than nothing.
    assert!(filled < 0.5 * clipped, "{filled} {clipped}");
}

#[test]
fn an_infinite_limit_asks_for_no_flags() {
    let psf = gaussians(&[(0.06, 12.0, 12.0)]);
    let (mut seen, _) = clipped(0.5);
    let flags = seen.flags.clone();
    let options = RestorationOptions { dependence_limit: f64::INFINITY, ..RestorationOptions::default() };
    assert_eq!(restore(&mut seen, &psf, &options).unwrap()[0].dependent_pixels, 0);
    assert_eq!(seen.flags, flags);
    let options = RestorationOptions { dependence_limit: 0.0, ..options };
    let error = Restorer::new(&psf, 4, 4, &options).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::OutOfDomain { name: "dependence_limit", .. }), "{error}");
}

#[test]
fn frames_of_nothing_but_gaps_stay_as_they_are() {
    let psf = gaussians(&[(0.1, 3.0, 3.0)]);
    for (width, height) in [(1, 1), (1, 17), (13, 1), (31, 7)] {
        let pixels = width * height;
        for (value, flag) in [(f32::NAN, Flags::NO_DATA), (700.0, Flags::SATURATED), (700.0, Flags::NO_DATA)] {
            for light in [SaturatedLight::Clipped, SaturatedLight::Filled] {
                let mut image = channel(width, height, vec![value; pixels], vec![value; pixels], 2.0);
                let flags = range_image::Raster::filled(width, height, flag);
                let mut restorer = Restorer::new(&psf, width, height, &options(light, GridSpacing::Automatic)).unwrap();
                let summary = restorer.restore_flagged(&mut image, &flags).unwrap();
                assert_eq!((summary.kept_pixels, summary.dependent_pixels), (pixels, 0));
                assert!(image.real.as_slice().iter().all(|found| found.to_bits() == value.to_bits()));
                assert!(image.sigma.as_slice().iter().all(|sigma| sigma.to_bits() == 2.0_f32.to_bits()));
            }
        }
    }
}
