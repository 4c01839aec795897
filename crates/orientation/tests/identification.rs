//! Targets named by their arrangement: rightly or not at all.

use nalgebra::{Isometry3, Point3};
use orientation::{Error, IdentificationOptions, UnnamedTarget, identify_targets};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::common::{camera, looking_at, normals};

/// Targets about the origin, without any order.
fn field(count: usize, seed: u64) -> Vec<Point3<f64>> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut draw = |half: f64| half * (2.0 * random.random::<f64>() - 1.0);
    (0..count).map(|_| Point3::new(draw(1.2), draw(0.9), draw(0.4))).collect()
}

/// Rows and columns 0.3 m apart.
fn grid(columns: usize, rows: usize) -> Vec<Point3<f64>> {
    let place = |k: usize| [(k % columns) as f64 * 0.3 - 0.9, (k / columns) as f64 * 0.3 - 0.6, 0.0];
    (0..columns * rows).map(|k| Point3::from(place(k))).collect()
}

/// What a station sees, in an order of its own, and which target each point is.
fn seen(
    known: &[Point3<f64>],
    pose: &Isometry3<f64>,
    with_ranges: bool,
    seed: u64,
) -> (Vec<UnnamedTarget>, Vec<usize>) {
    let mut normal = normals(seed);
    let order: Vec<usize> = (0..known.len()).map(|k| (k * 11 + seed as usize) % known.len()).collect();
    let inside = order.into_iter().filter_map(|k| {
        let observed = camera().observe(pose, &known[k]).ok()?;
        let pixel = camera().format.pixel_from_image(observed.image_mm);
        let pixel = pixel.map(|value| value + 0.1 * normal());
        // Ranges that are not corrected are some centimetres off.
        let range_m = with_ranges.then(|| observed.range_m + 0.03 + 0.01 * normal());
        camera().contains(pixel).then_some((UnnamedTarget { pixel, range_m }, k))
    });
    inside.unzip()
}

#[test]
fn names_are_right_through_a_lens_with_false_points_and_hidden_targets() {
    // The lens is not known to what names them.
    let nominal = camera_model::Camera { lens: camera_model::LensDistortion::default(), ..camera() };
    for with_ranges in [false, true] {
        let (mut named, mut shown) = (0, 0);
        for seed in 0..5_u64 {
            let known = field(18, seed);
            let angle = seed as f64;
            let pose = looking_at([2.0 * angle.sin(), 1.2 * angle.cos(), 3.8], angle);
            let (mut points, truth) = seen(&known, &pose, with_ranges, seed);
            let (points_kept, truth) = (points.split_off(3), &truth[3..]);
            let mut random = Pcg64::seed_from_u64(seed);
            let mut points: Vec<UnnamedTarget> = points_kept;
            for _ in 0..3 {
                let pixel = [175.0, 143.0].map(|size| size * random.random::<f64>());
                points.push(UnnamedTarget { pixel, range_m: with_ranges.then_some(3.0) });
            }
            let found = identify_targets(&nominal, &known, &points, &IdentificationOptions::default());
            let found = found.unwrap_or_else(|error| panic!("{with_ranges} {seed}: {error}"));
            for [point, target] in &found.pairs {
                assert_eq!(truth.get(*point), Some(target), "{with_ranges} {seed}");
            }
            named += found.pairs.len();
            shown += truth.len();
        }
        assert!(named as f64 >= 0.9 * shown as f64, "{named} of {shown}");
    }
}

#[test]
fn four_spheres_with_ranges_are_enough_and_four_points_without_are_not() {
    let known = field(4, 5);
    let pose = looking_at([0.3, 0.4, 4.2], 0.3);
    let (points, truth) = seen(&known, &pose, true, 1);
    let found = identify_targets(&camera(), &known, &points, &IdentificationOptions::default()).unwrap();
    assert!(found.pairs.iter().all(|[point, target]| truth[*point] == *target) && found.pairs.len() == 4);
    let (points, _) = seen(&field(5, 5), &pose, false, 1);
    let refused = identify_targets(&camera(), &field(9, 6), &points, &IdentificationOptions::default());
    assert!(matches!(refused, Err(Error::Unidentified { .. })), "{refused:?}");
}

#[test]
fn a_regular_grid_is_ambiguous_and_an_approximate_pose_decides() {
    let known = grid(7, 5);
    let pose = looking_at([0.3, 0.4, 3.2], 0.2);
    let (points, truth) = seen(&known, &pose, true, 3);
    let refused = identify_targets(&camera(), &known, &points, &IdentificationOptions::default());
    assert!(matches!(refused, Err(Error::AmbiguousArrangement { ways }) if ways > 1), "{refused:?}");
    let near = Isometry3::translation(0.05, -0.04, 0.03) * pose;
    let options = IdentificationOptions { approximate: Some(near), ..IdentificationOptions::default() };
    let found = identify_targets(&camera(), &known, &points, &options).unwrap();
    assert_eq!(found.pairs.len(), points.len());
    assert!(found.pairs.iter().all(|[point, target]| truth[*point] == *target));
}

#[test]
fn chance_names_nothing_and_numbers_that_are_none_are_refused() {
    let mut random = Pcg64::seed_from_u64(4);
    for seed in 0..4 {
        let known = field(14, seed);
        let points: Vec<UnnamedTarget> = (0..14)
            .map(|_| UnnamedTarget { pixel: [175.0, 143.0].map(|size| size * random.random::<f64>()), range_m: None })
            .collect();
        let refused = identify_targets(&camera(), &known, &points, &IdentificationOptions::default());
        assert!(matches!(refused, Err(Error::Unidentified { .. })), "{seed}: {refused:?}");
    }
    let options = IdentificationOptions::default();
    for count in 0..3 {
        assert!(identify_targets(&camera(), &field(count, 1), &[], &options).is_err());
    }
    let none = [UnnamedTarget { pixel: [f64::NAN, 1.0], range_m: None }];
    assert!(matches!(identify_targets(&camera(), &field(5, 1), &none, &options), Err(Error::InvalidTarget { .. })));
    let same = [Point3::origin(); 5];
    let points = [UnnamedTarget { pixel: [30.0, 40.0], range_m: Some(2.0) }; 6];
    assert!(identify_targets(&camera(), &same, &points, &options).is_err());
}
