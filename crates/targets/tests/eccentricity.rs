//! The image of a circle's centre: against geometry and against rendered discs.

use targets::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use targets::nalgebra::{Isometry3, Point3, Vector2, Vector3};
use targets::{CircleGrid, CircleOptions, Ellipse, Polarity, centre_of_circle, find_circles, poses_of_circle};

use crate::support::dots::PrintedDots;
use crate::support::render::{Optics, Plane, render};

fn camera(k1: f64) -> Camera {
    Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(),
        InteriorOrientation { principal_point_mm: [0.1, -0.05], principal_distance_mm: 8.0 },
        LensDistortion { k1, ..LensDistortion::default() },
    )
    .unwrap()
}

/// One disc of radius 0.05 m, 40 pixels across, at a tilt, without noise: the board's only dot that is not hidden.
fn seen(camera: &Camera, tilt_deg: f64, offset: [f64; 2]) -> (Ellipse, Isometry3<f64>) {
    let grid = CircleGrid::symmetric(3, 3, 0.3).unwrap();
    let dots = PrintedDots { hidden: &|node| node != [1, 1], ..PrintedDots::new(grid, 0.05) };
    let middle = grid.node_m([1, 1]);
    let tilt = Vector3::new(0.8, 0.6, 0.0) * tilt_deg.to_radians();
    let pose = Isometry3::translation(offset[0], offset[1], -0.5) * Isometry3::rotation(tilt);
    let board = pose * Isometry3::translation(-middle.x, -middle.y, 0.0);
    let plane = Plane { world_from_plane: board, pattern: &dots };
    let image = render(camera, &Isometry3::identity(), &[plane], &Optics { blur_px: 0.6, ..Optics::default() });
    let options = CircleOptions { polarity: Polarity::Dark, ..CircleOptions::default() };
    let mut found = find_circles(&image, &options).unwrap();
    found.retain(|disc| disc.ellipse.semi_axes_px[0] > 10.0);
    assert_eq!(found.len(), 1);
    (found[0].ellipse, pose)
}

#[test]
fn the_centre_of_a_rendered_disc() {
    for (k1, offset) in [(0.0, [0.02, -0.03]), (-3e-3, [0.1, 0.05])] {
        let camera = camera(k1);
        for tilt in [0.0, 30.0, 60.0] {
            let (ellipse, pose) = seen(&camera, tilt, offset);
            let truth = Vector2::from(camera.project(&pose.translation.vector.into()).unwrap());
            let normal = pose * Vector3::z();
            let centre = Vector2::from(centre_of_circle(&camera, &ellipse, &normal).unwrap().pixel);
            let before = (Vector2::from(ellipse.centre) - truth).norm();
            println!("{k1} {tilt}°: {before:.4} px before, {:.4} px after", (centre - truth).norm());
            assert!((centre - truth).norm() < 0.01, "{k1} {tilt}°: {}", (centre - truth).norm());
            let poses = poses_of_circle(&camera, &ellipse, 0.05).unwrap();
            let near =
                poses.iter().map(|p| (p.centre.coords - pose.translation.vector).norm()).fold(f64::INFINITY, f64::min);
            assert!(near < 1e-3, "{k1} {tilt}°: {near}");
        }
    }
}

/// The ellipse of a circle in a camera without lens, by 4000 points of its edge, which leave 1e-5 pixel: the centre and both poses.
#[test]
fn the_formula_is_exact() {
    let camera = camera(0.0);
    for (tilt, middle) in [(0.3, [0.0, 0.0]), (1.2, [0.1, -0.2]), (0.9, [-0.15, 0.05])] {
        let pose =
            Isometry3::translation(middle[0], middle[1], -0.7) * Isometry3::rotation(Vector3::new(tilt, 0.2, 0.0));
        let radius = 0.08;
        let edge = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 4000.0;
            Vector2::from(
                camera.project(&(pose * Point3::new(radius * angle.cos(), radius * angle.sin(), 0.0))).unwrap(),
            )
        };
        let ellipse = through(&(0..4000).map(edge).collect::<Vec<_>>());
        let truth = Vector2::from(camera.project(&pose.translation.vector.into()).unwrap());
        let normal = pose * Vector3::z();
        let found = centre_of_circle(&camera, &ellipse, &normal).unwrap();
        let off = (Vector2::from(found.pixel) - truth).norm();
        assert!(off < 3e-5, "{off:e}");
        let poses = poses_of_circle(&camera, &ellipse, radius).unwrap();
        let good = poses.iter().any(|found| {
            (found.centre.coords - pose.translation.vector).norm() < 1e-5 && (found.normal - normal).norm() < 1e-4
        });
        assert!(good, "{poses:?}");
        // Moving the ellipse moves the centre along, nearly by the same.
        assert!((found.by_ellipse[(0, 0)] - 1.0).abs() < 0.1 && found.by_ellipse[(0, 1)].abs() < 0.1);
    }
}

/// The ellipse through points that lie on one, by its moments: those of the polygon.
fn through(points: &[Vector2<f64>]) -> Ellipse {
    let next = |k: usize| points[(k + 1) % points.len()];
    let crosses: Vec<f64> = (0..points.len()).map(|k| points[k].perp(&next(k))).collect();
    let area: f64 = crosses.iter().sum::<f64>() * 0.5;
    let centre = (0..points.len()).map(|k| (points[k] + next(k)) * crosses[k]).sum::<Vector2<f64>>() / (6.0 * area);
    let second = |f: &dyn Fn(Vector2<f64>, Vector2<f64>) -> f64| {
        (0..points.len())
            .map(|k| f(points[k] - centre, next(k) - centre) * (points[k] - centre).perp(&(next(k) - centre)))
            .sum::<f64>()
            / area
    };
    let xx = second(&|p, q| (p.x * p.x + p.x * q.x + q.x * q.x) / 12.0);
    let yy = second(&|p, q| (p.y * p.y + p.y * q.y + q.y * q.y) / 12.0);
    let xy = second(&|p, q| (p.x * q.y + 2.0 * p.x * p.y + 2.0 * q.x * q.y + q.x * p.y) / 24.0);
    let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    // The polygon's area is smaller than the ellipse's by 2π²/3n².
    let grown = 1.0 + std::f64::consts::PI.powi(2) / (3.0 * (points.len() * points.len()) as f64);
    Ellipse {
        centre: centre.into(),
        semi_axes_px: [mean + half, mean - half].map(|square| 2.0 * square.sqrt() * grown),
        direction_rad: 0.5 * f64::atan2(2.0 * xy, xx - yy),
    }
}

#[test]
fn what_is_no_circle_is_refused() {
    let camera = camera(0.0);
    let ellipse = Ellipse { centre: [80.0, 70.0], semi_axes_px: [9.0, 6.0], direction_rad: 0.3 };
    assert!(centre_of_circle(&camera, &ellipse, &Vector3::zeros()).is_err());
    assert!(centre_of_circle(&camera, &ellipse, &Vector3::repeat(f64::NAN)).is_err());
    for wrong in [[0.0, 0.0], [f64::NAN, 3.0], [f64::INFINITY, 1.0]] {
        let ellipse = Ellipse { semi_axes_px: wrong, ..ellipse };
        assert!(centre_of_circle(&camera, &ellipse, &Vector3::z()).is_err());
        assert!(poses_of_circle(&camera, &ellipse, 0.1).is_err());
    }
    assert!(poses_of_circle(&camera, &ellipse, f64::NAN).is_err() && poses_of_circle(&camera, &ellipse, 0.0).is_err());
}
