//! Bright objects beyond the image border.

use crate::common::{channel, gaussians, no_flags};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use range_image::{ComplexChannel, Flags, Raster};
use scattering_deconvolution::{
    DarkPixels, Error, OutsideLightDetector, OutsideLightOptions, OutsideLightVerdict, Psf, RestorationOptions,
    Restorer, Scatterer, Side,
};

const SIZE: [usize; 2] = [96, 72];
/// What a canvas has around the image.
const MARGIN: usize = 40;

fn psf() -> Psf {
    gaussians(&[(0.02, 6.0, 6.0), (0.04, 20.0, 20.0)])
}

/// Columns and rows of a rectangle on the image; it may leave it.
type Place = [[isize; 2]; 2];

/// What the camera delivers of bright rectangles before nothing, restored. Patches of 8 x 8 pixels return a little light of
/// random amplitude and phase; each pixel has noise of 1.
fn restored(bright: &[Place], patches: f32, seed: u64, assumed: &Psf) -> ComplexChannel {
    let mut generator = Pcg64Mcg::seed_from_u64(seed);
    let mut normal = |_: usize| -> f32 { StandardNormal.sample(&mut generator) };
    let [width, height] = SIZE.map(|count| count + 2 * MARGIN);
    let dim: Vec<[f32; 2]> = (0..width * height).map(|i| [patches * normal(i), patches * normal(i)]).collect();
    let light = |pixel: usize, part: usize| {
        let (col, row) = (pixel % width, pixel / width);
        let [c, r] = [col, row].map(|at| at as isize - MARGIN as isize);
        let inside = |[cols, rows]: &Place| (cols[0]..cols[1]).contains(&c) && (rows[0]..rows[1]).contains(&r);
        if bright.iter().any(inside) { [1200.0, 900.0][part] } else { dim[col / 8 + row / 8 * width][part] }
    };
    let mut planes = [0, 1].map(|part| (0..width * height).map(|pixel| light(pixel, part)).collect::<Vec<f32>>());
    let [re, im] = &mut planes;
    Scatterer::new(&psf(), width, height).unwrap().apply(re, im).unwrap();
    let planes = planes.map(|plane| {
        let rows = plane.chunks(width).skip(MARGIN).take(SIZE[1]);
        let cropped = rows.flat_map(|row| row[MARGIN..MARGIN + SIZE[0]].to_vec());
        cropped.enumerate().map(|(i, value)| value + normal(i)).collect::<Vec<f32>>()
    });
    let [re, im] = planes;
    let mut image = channel(SIZE[0], SIZE[1], re, im, 1.0);
    let mut restorer = Restorer::new(assumed, SIZE[0], SIZE[1], &RestorationOptions::default()).unwrap();
    restorer.restore(&mut image).unwrap();
    image
}

fn test(image: &ComplexChannel, flags: &mut Raster<Flags>) -> OutsideLightVerdict {
    let options = OutsideLightOptions { dark: DarkPixels::Below(100.0), ..OutsideLightOptions::default() };
    OutsideLightDetector::new(&psf(), SIZE[0], SIZE[1], &options).unwrap().detect(image, flags).unwrap()
}

/// Objects just beyond the middle of each side, and one that the lower border cuts.
const OUTSIDE: [(Side, Place); 5] = [
    (Side::Left, [[-24, -4], [26, 44]]),
    (Side::Right, [[100, 120], [20, 40]]),
    (Side::Top, [[30, 50], [-24, -3]]),
    (Side::Bottom, [[40, 60], [76, 98]]),
    (Side::Bottom, [[50, 72], [58, 96]]),
];

#[test]
fn objects_beyond_each_side_are_found() {
    for (side, place) in OUTSIDE {
        for seed in 0..5 {
            for patches in [0.0, 1.0] {
                let image = restored(&[place, [[20, 30], [10, 20]]], patches, seed, &psf());
                let mut flags = no_flags(SIZE[0], SIZE[1]);
                let OutsideLightVerdict::Suspected(found) = test(&image, &mut flags) else {
                    panic!("{side:?} {place:?}, seed {seed}, patches of {patches}: {:?}", test(&image, &mut flags))
                };
                assert_eq!(found.suspected_side, side, "{found:?}");
                // The phase is that of the object; its amount goes by how far out the strip is thought to be.
                let turn = found.phasor[1].atan2(found.phasor[0]) - 900.0_f64.atan2(1200.0);
                assert!(turn.abs() < 0.25, "{found:?}");
                assert!(found.strength > 3.0 && found.strength < 60.0 && found.p_value < 1e-3, "{found:?}");
                let flagged = flags.as_slice().iter().filter(|flags| flags.contains(Flags::MULTIPATH)).count();
                assert!(flagged == found.flagged_pixels && flagged > 100, "{found:?}");
            }
        }
    }
}

#[test]
fn objects_inside_raise_few_alarms() {
    let inside: [&[Place]; 3] = [&[], &[[[0, 20], [30, 60]]], &[[[30, 50], [20, 40]], [[80, 96], [0, 10]]]];
    for (patches, allowed) in [(0.0, 1), (3.0, 3)] {
        let mut alarms = 0;
        for seed in 0..30 {
            for bright in inside {
                let image = restored(bright, patches, 1000 + seed, &psf());
                let verdict = test(&image, &mut no_flags(SIZE[0], SIZE[1]));
                alarms += usize::from(matches!(verdict, OutsideLightVerdict::Suspected(_)));
            }
        }
        // Asked for: one in a thousand of 90 tests by noise. Patches that return light are no noise: their neighbours are
        // alike, which is allowed for, but not exactly.
        assert!(alarms <= allowed, "{alarms} alarms of 90, patches of {patches}");
    }
}

#[test]
fn a_wrong_weight_of_the_point_spread_function_is_no_light_from_outside() {
    let weaker = gaussians(&[(0.016, 6.0, 6.0), (0.032, 20.0, 20.0)]);
    let bright: Place = [[35, 55], [25, 45]];
    let alarm = |seed| {
        let image = restored(&[bright], 0.0, seed, &weaker);
        matches!(test(&image, &mut no_flags(SIZE[0], SIZE[1])), OutsideLightVerdict::Suspected(_))
    };
    let alarms = (0..20).filter(|&seed| alarm(seed)).count();
    // A fifth of the scattered light stays; as it is the light of the image, it is explained. The blocks do so to some
    // percent, which noise of 1 hides.
    assert!(alarms <= 2, "{alarms} of 20");
}

#[test]
fn images_without_dark_pixels_are_not_tested() {
    let image = channel(96, 72, vec![500.0; 96 * 72], vec![100.0; 96 * 72], 1.0);
    let mut flags = no_flags(96, 72);
    assert!(matches!(test(&image, &mut flags), OutsideLightVerdict::NotTestable { .. }));
    let nothing = channel(96, 72, vec![f32::NAN; 96 * 72], vec![f32::NAN; 96 * 72], 1.0);
    assert!(matches!(test(&nothing, &mut flags), OutsideLightVerdict::NotTestable { .. }));
    let zeros = channel(96, 72, vec![0.0; 96 * 72], vec![0.0; 96 * 72], 1.0);
    assert!(matches!(test(&zeros, &mut flags), OutsideLightVerdict::NotTestable { .. }));
    assert!(flags.as_slice().iter().all(Flags::is_empty));
    for (width, height) in [(1, 1), (1, 40), (3, 5)] {
        let count = width * height;
        let detector = OutsideLightDetector::new(&psf(), width, height, &OutsideLightOptions::default()).unwrap();
        let image = channel(width, height, vec![1.0; count], vec![2.0; count], 1.0);
        let mut flags = Raster::filled(width, height, Flags::LOW_AMPLITUDE);
        assert!(matches!(detector.detect(&image, &mut flags), Ok(OutsideLightVerdict::NotTestable { .. })));
    }
}

#[test]
fn what_is_wrong_is_named() {
    let options = OutsideLightOptions::default();
    let refused = |psf: &Psf, options: &OutsideLightOptions| match OutsideLightDetector::new(psf, 9, 9, options) {
        Err(Error::OutOfDomain { name, .. }) => name,
        _ => panic!(),
    };
    assert_eq!(refused(&gaussians(&[]), &options), "weight");
    assert_eq!(refused(&psf(), &OutsideLightOptions { false_alarm: 0.0, ..options }), "false_alarm");
    assert_eq!(refused(&psf(), &OutsideLightOptions { flagged_share: f64::NAN, ..options }), "flagged_share");
    assert_eq!(refused(&psf(), &OutsideLightOptions { dark: DarkPixels::Below(-1.0), ..options }), "dark");
    assert!(matches!(OutsideLightDetector::new(&psf(), 0, 9, &options), Err(Error::ImageSize { .. })));
    let detector = OutsideLightDetector::new(&psf(), 9, 8, &options).unwrap();
    let image = channel(8, 9, vec![0.0; 72], vec![0.0; 72], 1.0);
    assert!(detector.detect(&image, &mut no_flags(8, 9)).is_err());
    assert!(matches!(detector.detect(&image, &mut no_flags(9, 8)), Err(Error::Frame(_))));
}
