//! Coded rings: read rightly or not at all.

use targets::camera_model::Camera;
use targets::nalgebra::{Isometry3, Point3, Vector2, Vector3};
use targets::range_image::Raster;
use targets::{CodedOptions, CodedSighting, Error, NotFound, codes, find_coded};

use crate::support::coded::PrintedCodes;
use crate::support::render::{Optics, Plane, render};
use crate::support::sensor::Sensor;
use crate::support::views::large_camera;

const SPACING: f64 = 0.1;

/// 6 x 4 codes from `first` on, 0.1 m apart, discs of radius 0.012 m.
fn wall(first: usize) -> PrintedCodes {
    let all = codes(CodedOptions::default().bits).unwrap();
    let place = |k: usize| [(k % 6) as f64 * SPACING - 0.25, 0.15 - (k / 6) as f64 * SPACING];
    let targets = (0..24).map(|k| (all[(first + k) % all.len()], place(k))).collect();
    PrintedCodes { targets, radius_m: 0.012, dark: 0.1, bright: 0.9 }
}

fn seen(camera: &Camera, wall: &PrintedCodes, pose: Isometry3<f64>, noise: f64, seed: u64) -> Vec<CodedSighting> {
    let plane = Plane { world_from_plane: pose, pattern: wall };
    let light = render(camera, &Isometry3::identity(), &[plane], &Optics::default());
    find_coded(&Sensor::amplitude(1000.0, noise).expose(&light, seed), &CodedOptions::default()).unwrap()
}

/// A contrast of 20 deviations of the noise, discs of 13 pixels across, tilts up to 50°.
#[test]
fn rings_are_read_rightly() {
    let camera = large_camera();
    let (mut read, mut shown) = (0, 0);
    for view in 0..7_u64 {
        let k = view as f64;
        let tilt = Vector3::new((1.7 * k).cos(), (1.7 * k).sin(), 0.0) * (8.0 * k).to_radians();
        let pose =
            Isometry3::translation(0.0, 0.0, -0.95) * Isometry3::rotation(tilt) * Isometry3::rotation(Vector3::z() * k);
        let wall = wall(24 * view as usize);
        for target in seen(&camera, &wall, pose, 40.0, view) {
            let place = |centre: &[f64; 2]| {
                let pixel = camera.project(&(pose * Point3::new(centre[0], centre[1], 0.0))).unwrap();
                (Vector2::from(pixel) - Vector2::from(target.circle.centre.pixel)).norm()
            };
            let near = wall.targets.iter().find(|(_, centre)| place(centre) < 1.0).expect("a disc");
            assert_eq!(target.code, near.0, "view {view}");
            assert!(!target.is_repeated);
            read += 1;
        }
        let inside = |centre: &[f64; 2]| {
            let pixel = camera.project(&(pose * Point3::new(centre[0], centre[1], 0.0)));
            pixel.is_ok_and(|pixel| pixel[0] > 30.0 && pixel[0] < 610.0 && pixel[1] > 30.0 && pixel[1] < 450.0)
        };
        shown += wall.targets.iter().filter(|(_, centre)| inside(centre)).count();
    }
    println!("{read} of {shown} read");
    assert!(50 * read >= 49 * shown, "{read} of {shown}");
}

#[test]
fn a_wall_in_a_mirror_is_named() {
    let camera = large_camera();
    let wall = wall(3);
    let plane = Plane { world_from_plane: Isometry3::translation(0.0, 0.0, -0.95), pattern: &wall };
    let light = render(&camera, &Isometry3::identity(), &[plane], &Optics::default());
    let image = Sensor::amplitude(1000.0, 20.0).expose(&light, 4);
    let right = find_coded(&image, &CodedOptions::default()).unwrap();
    assert_eq!(right.len(), 24);
    let flipped = Raster::from_fn(image.width(), image.height(), |col, row| image[(image.width() - 1 - col, row)]);
    let told = find_coded(&flipped, &CodedOptions::default());
    assert!(matches!(told, Err(Error::NotFound(NotFound::Mirrored))), "{told:?}");
}

#[test]
fn equal_codes_are_both_named_and_turned_ones_have_their_direction() {
    let camera = large_camera();
    let mut wall = wall(3);
    wall.targets[5].0 = wall.targets[0].0;
    let turn = 0.7;
    let pose = Isometry3::translation(0.0, 0.0, -0.95) * Isometry3::rotation(Vector3::z() * turn);
    let found = seen(&camera, &wall, pose, 5.0, 1);
    let repeated: Vec<_> = found.iter().filter(|target| target.is_repeated).map(|target| target.code).collect();
    assert_eq!(repeated, [wall.targets[0].0; 2]);
    for target in &found {
        // The picture of a board that is turned by +0.7 about z (y up) is turned by −0.7 from columns to rows.
        let off = (target.direction_rad + turn).rem_euclid(std::f64::consts::TAU);
        assert!(off.min(std::f64::consts::TAU - off) < 0.1, "{}", target.direction_rad);
    }
}

#[test]
fn what_has_no_ring_is_not_read_and_nothing_panics() {
    for image in [Raster::filled(0, 0, 1.0), Raster::filled(1, 1, 1.0), Raster::filled(40, 30, f32::NAN)] {
        assert!(find_coded(&image, &CodedOptions::default()).unwrap().is_empty());
    }
    let disc = crate::rendering::ellipse([30.0, 30.0], [6.0, 6.0], 0.0);
    let image = crate::rendering::render(60, 60, 0.5, |col, row| 10.0 + 100.0 * disc(col, row));
    assert!(find_coded(&image, &CodedOptions::default()).unwrap().is_empty());
    assert!(find_coded(&image, &CodedOptions { bits: 0, ..CodedOptions::default() }).is_err());
    assert!(find_coded(&image, &CodedOptions { bits: 99, ..CodedOptions::default() }).is_err());
}
