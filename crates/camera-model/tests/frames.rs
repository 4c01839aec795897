//! Ray table, back-projection of frames, depth and range.

use crate::common::{cameras, plain_camera};
use camera_model::{Camera, Error, ImageFormat, LensDistortion, OrganisedCloud, RayTable};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;
use range_image::{Flags, RangeFrame, Raster};

fn frame(width: usize, height: usize) -> RangeFrame {
    RangeFrame {
        range: Raster::from_fn(width, height, |col, row| 1.0 + 0.01 * (col as f32) + 0.003 * (row as f32)),
        sigma: Raster::from_fn(width, height, |col, _| 0.001 * (1 + col) as f32),
        amplitude: Raster::from_fn(width, height, |_, row| 100.0 + row as f32),
        flags: Raster::filled(width, height, Flags::empty()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn table_holds_the_rays(camera in cameras()) {
        let table = RayTable::new(&camera).unwrap();
        let ImageFormat { width, height, .. } = camera.format;
        for (col, row) in [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1), (width / 2, height / 3)] {
            prop_assert_eq!(table.direction(col, row), camera.ray([col as f64, row as f64]));
        }
        prop_assert!(table.direction(width, 0).x.is_nan() && table.direction(0, height).x.is_nan());
        prop_assert!(table.directions().iter().all(|ray| ray[2] < 0.0));
    }

    #[test]
    fn depth_and_range(camera in cameras()) {
        let table = RayTable::new(&camera).unwrap();
        let depth = Raster::from_fn(camera.format.width, camera.format.height, |col, row| {
            if (col + row) % 7 == 0 { f32::NAN } else { 1.0 + col as f32 * 0.01 }
        });
        let range = table.depth_to_range(&depth).unwrap();
        let again = table.range_to_depth(&range).unwrap();
        for ((d, r), a) in depth.as_slice().iter().zip(range.as_slice()).zip(again.as_slice()) {
            // Two roundings to f32.
            prop_assert!((d.is_nan() && r.is_nan() && a.is_nan()) || (r >= d && (a - d).abs() <= 2.0 * f32::EPSILON * d));
        }
    }
}

#[test]
fn pixels_have_the_points_of_whole_frames() {
    let camera = plain_camera();
    let table = RayTable::new(&camera).unwrap();
    let mut frame = frame(camera.format.width, camera.format.height);
    (frame.range.as_mut_slice()[3], frame.range.as_mut_slice()[5]) = (f32::NAN, -1.0);
    frame.flags.as_mut_slice()[5] = Flags::MOTION;
    let cloud = table.back_project(&frame).unwrap();
    let (first, count) = (1, 2 * camera.format.width + 5);
    let mut points = vec![[0.0; 3]; count];
    let mut flags = frame.flags.as_slice()[first..first + count].to_vec();
    let ranges = &frame.range.as_slice()[first..first + count];
    table.back_project_pixels(first, ranges, &mut points, &mut flags).unwrap();
    // Half a unit in the last place of the ray, and of the product.
    let near = |a: f32, b: f64| (f64::from(a) - b).abs() <= 1.2e-7 * b.abs().max(1.0) * 8.0 || a.is_nan() && b.is_nan();
    assert!(points.iter().zip(&cloud.points[first..]).all(|(a, b)| (0..3).all(|axis| near(a[axis], b[axis]))));
    assert_eq!(flags, cloud.flags[first..first + count]);
    let beyond = frame.range.len() - 1;
    assert!(table.back_project_pixels(beyond, ranges, &mut points, &mut flags).is_err());
    assert!(table.back_project_pixels(first, &ranges[1..], &mut points, &mut flags).is_err());
}

#[test]
fn points_lie_on_their_rays() {
    let camera = plain_camera();
    let table = RayTable::new(&camera).unwrap();
    let mut input = frame(176, 144);
    input.range[(5, 7)] = f32::NAN;
    input.range[(6, 7)] = 0.0;
    input.range[(7, 7)] = -1.0;
    input.range[(8, 7)] = f32::INFINITY;
    input.flags[(9, 7)] = Flags::MOTION;
    let cloud = table.back_project(&input).unwrap();
    assert_eq!((cloud.width, cloud.height), (176, 144));
    assert_eq!(cloud.valid_count(), 176 * 144 - 4);
    for col in 5..9 {
        let i = 7 * 176 + col;
        assert!(cloud.points[i].iter().all(|x| x.is_nan()));
        assert_eq!(cloud.flags[i], Flags::NO_DATA);
    }
    assert_eq!(cloud.flags[7 * 176 + 9], Flags::MOTION);
    assert_eq!(cloud.sigma, input.sigma.as_slice());
    assert_eq!(cloud.amplitude, input.amplitude.as_slice());
    for (col, row) in [(0, 0), (175, 143), (80, 60)] {
        let expected =
            camera.point([f64::from(col), f64::from(row)], f64::from(input.range[(col as usize, row as usize)]));
        let found = Point3::from(cloud.points[row as usize * 176 + col as usize]);
        assert!((expected - found).norm() < 1e-15);
    }
    let pose = Isometry3::translation(1.0, 0.0, 0.0);
    let mut world = Vec::new();
    cloud.points_into(&pose, &mut world);
    assert!((Vector3::from(world[0]) - Vector3::from(cloud.points[0]) - Vector3::x()).norm() < 1e-15);
    assert!(world[7 * 176 + 5][0].is_nan());
}

#[test]
fn memory_is_used_again() {
    let camera = plain_camera();
    let table = RayTable::new(&camera).unwrap();
    let mut cloud = OrganisedCloud::default();
    table.back_project_into(&frame(176, 144), &mut cloud).unwrap();
    let first = cloud.clone();
    let places = (cloud.points.as_ptr(), cloud.sigma.as_ptr(), cloud.amplitude.as_ptr(), cloud.flags.as_ptr());
    // What an earlier frame left behind, flags above all, must not show through.
    cloud.flags.fill(Flags::all());
    cloud.points.fill([9.0; 3]);
    table.back_project_into(&frame(176, 144), &mut cloud).unwrap();
    assert_eq!(cloud, first);
    assert_eq!(places, (cloud.points.as_ptr(), cloud.sigma.as_ptr(), cloud.amplitude.as_ptr(), cloud.flags.as_ptr()));
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let mut camera = plain_camera();
    camera.format = ImageFormat::new(320, 240, [0.02, 0.02]).unwrap();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| RayTable::new(&camera).unwrap().back_project(&frame(320, 240)).unwrap())
    };
    let one = run(1);
    for threads in [2, 3, 8] {
        assert_eq!(one, run(threads));
    }
}

#[test]
fn sizes_that_differ_are_refused() {
    let table = RayTable::new(&plain_camera()).unwrap();
    let mut cloud = OrganisedCloud::default();
    assert!(matches!(table.back_project_into(&frame(144, 176), &mut cloud), Err(Error::Image(_))));
    let mut uneven = frame(176, 144);
    uneven.sigma = Raster::filled(1, 1, 0.0);
    assert!(table.back_project_into(&uneven, &mut cloud).is_err());
    assert_eq!(cloud, OrganisedCloud::default());
    assert!(table.depth_to_range(&Raster::filled(3, 3, 1.0)).is_err());
    assert!(table.range_to_depth(&Raster::filled(0, 0, 1.0)).is_err());
}

#[test]
fn smallest_images() {
    for (width, height) in [(1, 1), (1, 5), (5, 1)] {
        let camera = Camera { format: ImageFormat::new(width, height, [0.04, 0.04]).unwrap(), ..plain_camera() };
        let cloud = RayTable::new(&camera).unwrap().back_project(&frame(width, height)).unwrap();
        assert_eq!(cloud.valid_count(), width * height);
    }
}

#[test]
fn a_fold_inside_the_image_is_refused() {
    // Fold at r = 1 / sqrt(3 k1); the image's half diagonal is 4.5 mm.
    let with_fold_at = |radius: f64| {
        let lens = LensDistortion { k1: 1.0 / (3.0 * radius * radius), ..LensDistortion::default() };
        RayTable::new(&Camera { lens, ..plain_camera() })
    };
    assert!(with_fold_at(5.0).is_ok());
    assert!(matches!(with_fold_at(4.0), Err(Error::FoldInsideImage { .. })));
    // A model that turns back and forth again: positive definite at the corner, but not on the way there.
    let lens = LensDistortion { k1: 0.2, k3: -1e-3, ..LensDistortion::default() };
    assert!(matches!(RayTable::new(&Camera { lens, ..plain_camera() }), Err(Error::FoldInsideImage { .. })));
}

#[test]
fn impossible_sizes_are_refused() {
    for (width, height) in [(usize::MAX, 2), (usize::MAX, 1), (1 << 40, 1 << 20)] {
        let format = ImageFormat { width, height, pixel_pitch_mm: [1e-18, 1e-18] };
        let answer = RayTable::new(&Camera { format, lens: LensDistortion::default(), ..plain_camera() });
        assert!(matches!(answer, Err(Error::OutOfDomain { .. })), "{answer:?}");
    }
}
