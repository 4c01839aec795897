//! Normals of frames and clouds.

use crate::common::{Cuboid, Pinhole, Scene, frame, look_at};
use nalgebra::{Point3, Vector3};
use point_cloud::{Error, OrganisedNormalOptions, UnorganisedNormalOptions, organised_normals, unorganised_normals};
use rigid_pose::InputError;

fn corner() -> Scene {
    Scene { room: Cuboid::new([-3.0, -3.0, 0.0], [3.0, 3.0, 3.0]), boxes: vec![] }
}

#[test]
fn frame_normals_are_those_of_the_walls_and_look_at_the_camera() {
    let camera = Pinhole::small();
    let pose = look_at([-1.0, -0.5, 1.2], [3.0, 0.3, 0.4]);
    let (points, _) = frame(&corner(), &camera, &pose, 0.0, 1);
    let normals = organised_normals(&points, 176, 144, &OrganisedNormalOptions::default()).unwrap();
    let mut on_a_wall = 0;
    for (normal, p) in normals.iter().zip(&points).filter(|(n, _)| n.x.is_finite()) {
        assert!((normal.norm() - 1.0).abs() < 1e-12);
        assert!(normal.dot(&Vector3::from(*p)) < 0.0);
        let largest = (pose.rotation * normal).amax();
        on_a_wall += usize::from(largest > 1.0 - 1e-9);
    }
    // All but the border of two pixels and the windows across the edges.
    assert!(on_a_wall > 20_000, "{on_a_wall}");
}

#[test]
fn windows_do_not_reach_over_a_jump_or_a_hole() {
    let (width, height) = (40, 30);
    let wall = |col: usize, row: usize| if col < 20 { 1.0 } else { 1.0 + 0.2 + 0.0 * row as f64 };
    let mut points = Vec::new();
    for row in 0..height {
        for col in 0..width {
            let z = wall(col, row);
            points.push([(col as f64 - 20.0) * 0.01 * z, (row as f64 - 15.0) * 0.01 * z, -z]);
        }
    }
    points[15 * width + 10] = [f64::NAN; 3];
    let all = OrganisedNormalOptions { min_fill: 0.3, ..OrganisedNormalOptions::default() };
    let normals = organised_normals(&points, width, height, &all).unwrap();
    for (i, normal) in normals.iter().enumerate() {
        if i == 15 * width + 10 {
            assert!(normal.x.is_nan());
        } else {
            // Exact planes: a window that mixed both would lean.
            assert!((normal - Vector3::z()).norm() < 1e-9, "{i} {normal}");
        }
    }
    let strict = organised_normals(&points, width, height, &OrganisedNormalOptions::default()).unwrap();
    assert!(strict[5 * width + 19].x.is_nan() && strict[5 * width + 20].x.is_nan(), "edge of the jump");
    assert!(strict[0].x.is_nan(), "corner of the frame");
    assert!(strict[15 * width + 11].x.is_finite(), "one hole among 25");
}

#[test]
fn noise_of_normals_is_that_of_the_plane_fit() {
    let (width, height) = (60, 60);
    let (sigma, spacing) = (1e-3, 0.01);
    let mut random = <rand_pcg::Pcg64 as rand::SeedableRng>::seed_from_u64(3);
    let mut points = Vec::new();
    for row in 0..height {
        for col in 0..width {
            let e: f64 = rand_distr::Distribution::sample(&rand_distr::StandardNormal, &mut random);
            points.push([(f64::from(col) - 30.0) * spacing, (f64::from(row) - 30.0) * spacing, -2.0 + sigma * e]);
        }
    }
    let normals = organised_normals(&points, 60, 60, &OrganisedNormalOptions::default()).unwrap();
    let slopes: Vec<f64> = normals.iter().filter(|n| n.x.is_finite()).map(|n| n.x).collect();
    let found = (slopes.iter().map(|s| s * s).sum::<f64>() / slopes.len() as f64).sqrt();
    // Slope of a plane over 5 x 5 points: sigma / (spacing sqrt(50)).
    let expected = sigma / (spacing * 50.0_f64.sqrt());
    // About 3000 / 25 independent windows: 6 %.
    assert!((found / expected - 1.0).abs() < 0.2, "{found} {expected}");
}

#[test]
fn windows_widen_where_noise_hides_the_surface_and_nowhere_else() {
    let (width, height, sigma, spacing) = (80, 60, 0.012, 0.01);
    let mut random = <rand_pcg::Pcg64 as rand::SeedableRng>::seed_from_u64(5);
    let mut points = Vec::new();
    for row in 0..height {
        for col in 0..width {
            let e: f64 = rand_distr::Distribution::sample(&rand_distr::StandardNormal, &mut random);
            // The right half is twelve times as quiet.
            let noise = if col < width / 2 { sigma } else { sigma / 12.0 };
            points.push([f64::from(col) * spacing, f64::from(row) * spacing, -2.0 + noise * e]);
        }
    }
    let narrow = OrganisedNormalOptions::default();
    let wide = OrganisedNormalOptions { widest_half_width_px: Some(8), ..narrow };
    let [before, after] = [narrow, wide].map(|options| organised_normals(&points, 80, 60, &options).unwrap());
    let noisy =
        |normals: &[Vector3<f64>]| (0..normals.len()).filter(|i| i % 80 < 30 && normals[*i].x.is_finite()).count();
    assert!(noisy(&before) < 600 && noisy(&after) > 1000, "{} {}", noisy(&before), noisy(&after));
    for (i, (before, after)) in before.iter().zip(&after).enumerate().filter(|(_, (before, _))| before.x.is_finite()) {
        assert_eq!(before, after, "pixel {i} had a normal");
    }
    let odd = OrganisedNormalOptions { widest_half_width_px: Some(1), ..narrow };
    assert!(matches!(organised_normals(&points, 80, 60, &odd), Err(Error::Input(InputError::InvalidOption { .. }))));
}

#[test]
fn cloud_normals_follow_a_sphere() {
    // Spiral points on a sphere of 1 m.
    let n = 4000;
    let points: Vec<Point3<f64>> = (0..n)
        .map(|i| {
            let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
            let angle = f64::from(i) * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        })
        .collect();
    let options = UnorganisedNormalOptions { viewpoint: Some(Point3::origin()), ..UnorganisedNormalOptions::default() };
    let normals = unorganised_normals(&points, &options).unwrap();
    for (normal, p) in normals.iter().zip(&points) {
        // Towards the centre, tilted by the uneven neighbourhood: 20 points reach 0.14 m.
        assert!(normal.dot(&-p.coords) > 0.999, "{p}");
    }
}

#[test]
fn lines_and_blobs_have_no_normal() {
    let line: Vec<_> = (0..50).map(|i| Point3::new(f64::from(i), 2.0 * f64::from(i), 0.5)).collect();
    let normals = unorganised_normals(&line, &UnorganisedNormalOptions::default()).unwrap();
    assert!(normals.iter().all(|n| n.x.is_nan()));
    let one = unorganised_normals(&line[..1], &UnorganisedNormalOptions::default()).unwrap();
    assert!(one[0].x.is_nan());
    let equal = unorganised_normals(&vec![Point3::origin(); 30], &UnorganisedNormalOptions::default()).unwrap();
    assert!(equal.iter().all(|n| n.x.is_nan()));
}

#[test]
fn odd_frames_are_answered() {
    let options = OrganisedNormalOptions::default();
    assert!(organised_normals(&[], 0, 0, &options).unwrap().is_empty());
    assert!(organised_normals(&[], 0, 7, &options).unwrap().is_empty());
    assert!(organised_normals(&[[0.0, 0.0, -1.0]], 1, 1, &options).unwrap()[0].x.is_nan());
    let row: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i), 0.0, -5.0]).collect();
    assert!(organised_normals(&row, 9, 1, &options).unwrap().iter().all(|n| n.x.is_nan()));
    assert!(organised_normals(&row, 1, 9, &options).unwrap().iter().all(|n| n.x.is_nan()));
    let nothing = vec![[f64::NAN; 3]; 12];
    assert!(organised_normals(&nothing, 4, 3, &options).unwrap().iter().all(|n| n.x.is_nan()));
    let infinite = vec![[f64::INFINITY, 1.0, 1.0]; 12];
    assert!(organised_normals(&infinite, 4, 3, &options).unwrap().iter().all(|n| n.x.is_nan()));
    assert!(matches!(organised_normals(&row, 3, 4, &options), Err(Error::Input(InputError::LengthMismatch { .. }))));
    for bad in [
        OrganisedNormalOptions { half_width_px: 0, ..options },
        OrganisedNormalOptions { max_relative_jump: f64::NAN, ..options },
        OrganisedNormalOptions { min_fill: 2.0, ..options },
    ] {
        assert!(matches!(organised_normals(&row, 9, 1, &bad), Err(Error::Input(InputError::InvalidOption { .. }))));
    }
    let few = UnorganisedNormalOptions { neighbours: 2, ..UnorganisedNormalOptions::default() };
    assert!(matches!(
        unorganised_normals(&[Point3::origin()], &few),
        Err(Error::Input(InputError::InvalidOption { .. }))
    ));
    assert!(matches!(
        unorganised_normals(&[], &UnorganisedNormalOptions::default()),
        Err(Error::Input(InputError::Empty { .. }))
    ));
}
