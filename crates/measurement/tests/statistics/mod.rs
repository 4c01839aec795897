//! Errors of measured quantities against their intervals, over many surveys.

#![allow(dead_code)]

use std::collections::BTreeMap;

use measurement::nalgebra::{Point3, Unit, Vector3};
use measurement::point_uncertainty::Source;
use measurement::{
    Base, Cloud, Direction, Estimate, FitOptions, Place, Quantity, Region, VolumeOptions, angle, axis_distance,
    fit_cylinder, fit_plane, fit_sphere, flatness, plane_distance, plane_to_plane, point_distance, volume,
};

use crate::scene::{self, Setting, Survey};

/// One quantity over all surveys.
#[derive(Default)]
pub struct Tally {
    surveys: f64,
    inside: [f64; 2],
    nse: [f64; 2],
    squares: [f64; 2],
}

impl Tally {
    fn add(&mut self, truth: f64, all: &Estimate, without: &Estimate) {
        self.surveys += 1.0;
        let error = all.value - truth;
        self.squares[0] += error * error;
        self.squares[1] += all.sigma * all.sigma;
        for (at, estimate) in [all, without].into_iter().enumerate() {
            let [low, high] = estimate.interval;
            self.inside[at] += f64::from(u8::from((low..=high).contains(&truth)));
            self.nse[at] += (error / estimate.sigma).powi(2);
        }
    }

    pub fn inside(&self) -> f64 {
        self.inside[0] / self.surveys
    }

    pub fn inside_without(&self) -> f64 {
        self.inside[1] / self.surveys
    }

    pub fn nse(&self) -> f64 {
        self.nse[0] / self.surveys
    }

    pub fn nse_without(&self) -> f64 {
        self.nse[1] / self.surveys
    }

    pub fn error(&self) -> f64 {
        (self.squares[0] / self.surveys).sqrt()
    }

    pub fn sigma(&self) -> f64 {
        (self.squares[1] / self.surveys).sqrt()
    }
}

/// Measures all kinds of quantities in so many surveys.
pub fn run(surveys: u64, first_seed: u64) -> BTreeMap<&'static str, Tally> {
    let mut tallies: BTreeMap<&'static str, Tally> = BTreeMap::new();
    for seed in first_seed..first_seed + surveys {
        let survey = scene::survey(&Setting::default(), seed);
        let cloud = survey.cloud();
        for (name, quantity, truth) in measured(&survey) {
            let all = quantity.estimate(&cloud);
            let without = quantity.estimate_without(&cloud, Source::Calibration);
            tallies.entry(name).or_default().add(truth, &all, &without);
        }
        for (name, waves_m) in [("flatness, plane", 0.0), ("flatness, waves of 4 mm", 0.004)] {
            let (estimate, truth) = of_flatness(seed, waves_m);
            tallies.entry(name).or_default().add(truth, &estimate, &estimate);
        }
    }
    tallies
}

/// All quantities of a survey with their true values.
pub fn measured(survey: &Survey) -> Vec<(&'static str, Quantity, f64)> {
    let cloud = survey.cloud();
    let options = FitOptions::default();
    let select = |region: Region| region.select(cloud.points).unwrap();
    let wall = fit_plane(&cloud, &select(scene::wall_region()), &options).unwrap();
    let board = fit_plane(&cloud, &select(scene::board_region()), &options).unwrap();
    let spheres = [0, 1].map(|which| fit_sphere(&cloud, &select(scene::sphere_region(which)), &options).unwrap());
    let cylinder = fit_cylinder(&cloud, &select(scene::cylinder_region()), &options).unwrap();
    let [one, two] = [0, 1].map(|which| spheres[which].place());
    let centres = scene::SPHERES.map(|(centre, _)| Vector3::from(centre));
    let planes = plane_to_plane(&cloud, &wall, &board, Some(Point3::new(-0.3, 0.3, 0.12))).unwrap();
    let upward = if wall.normal.z < 0.0 { -1.0 } else { 1.0 };
    let picked = [nearest(survey, [-0.8, 0.5, 0.25]), nearest(survey, [0.4, 0.1, 0.0])];
    let [a, b] = picked.map(|index| Place::of_point(&cloud, index).unwrap());
    let [true_a, true_b] = picked.map(|index| survey.truth[index]);
    let (axis_point, axis) = (Vector3::from(scene::CYLINDER.0), scene::cylinder_axis());
    let from_axis = |place: Vector3<f64>| axis.cross(&(place - axis_point)).norm();
    let (volume, true_volume) = of_volume(&cloud, &wall);
    let horizontal = Direction::fixed(Unit::new_normalize(Vector3::x()));
    vec![
        ("plane to plane", planes.distance, true_distance(planes.at)),
        ("angle of planes", planes.angle, scene::BOARD_TILT_RAD),
        ("sphere to sphere", point_distance(&one, &two), (centres[0] - centres[1]).norm()),
        ("sphere to plane", signed(plane_distance(&one, &wall), upward), centres[0].z - scene::WALL_Z),
        ("sphere to axis", axis_distance(&one, &cylinder), from_axis(centres[0])),
        ("point to point", point_distance(&a, &b), (true_a - true_b).norm()),
        ("point to plane", signed(plane_distance(&a, &wall), upward), true_a.z - scene::WALL_Z),
        ("point to axis", axis_distance(&b, &cylinder), from_axis(true_b.coords)),
        ("radius of sphere", spheres[0].radius(), scene::SPHERES[0].1),
        ("radius of cylinder", cylinder.radius(), scene::CYLINDER.2),
        ("angle of axis, normal", angle(&cylinder.direction(), &wall.direction()), axis.z.abs().acos()),
        ("angle of axis, fixed", angle(&cylinder.direction(), &horizontal), axis.x.acos()),
        ("volume", volume, true_volume),
    ]
}

fn signed(quantity: Quantity, sign: f64) -> Quantity {
    let gradient = quantity.gradient.iter().map(|(point, by)| (*point, by * sign)).collect();
    Quantity { value: quantity.value * sign, gradient, ..quantity }
}

/// Of the true planes, along their mean normal.
fn true_distance(at: Point3<f64>) -> f64 {
    let mean = (Vector3::z() + scene::board_normal()).normalize();
    let to_wall = (scene::WALL_Z - at.z) / mean.z;
    let board = Vector3::from(scene::BOARD_CENTRE);
    let to_board = scene::board_normal().dot(&(board - at.coords)) / scene::board_normal().dot(&mean);
    to_board - to_wall
}

fn of_volume(cloud: &Cloud<'_>, wall: &measurement::FittedPlane) -> (Quantity, f64) {
    let [x, y, z] = scene::BOARD_CENTRE;
    let half = 0.3;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let corners_m = corners.map(|[dx, dy]| [x + dx, y + dy, z]).to_vec();
    let region = Region::Prism { corners_m, reach_m: [0.1, 0.1] };
    let found = volume(cloud, &region, &Base::Fitted(wall), &VolumeOptions { cell_m: 0.1 }).unwrap();
    assert!(found.missing.is_empty());
    (found.volume, 4.0 * half * half * z)
}

fn nearest(survey: &Survey, to: [f64; 3]) -> usize {
    let to = Point3::from(to);
    let squares = survey.points.iter().map(|point| (point - to).norm_squared());
    squares.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
}

/// Form of a wall with waves; the truth is the root mean square of the waves at the kept points about their plane.
fn of_flatness(seed: u64, waves_m: f64) -> (Estimate, f64) {
    let survey = scene::survey(&Setting { waves_m, ..Setting::default() }, seed);
    let cloud = survey.cloud();
    let wall = fit_plane(&cloud, &scene::wall_region().select(cloud.points).unwrap(), &FitOptions::default()).unwrap();
    let found = flatness(&wall);
    let true_points: Vec<Point3<f64>> = wall.support.kept.iter().map(|index| survey.truth[*index]).collect();
    let truth = true_form(&true_points, &wall.support.sigmas_m);
    let estimate = Estimate {
        value: found.form_m,
        unit: measurement::Unit::Metre,
        sigma: found.sigma_m,
        interval: found.interval_m,
        level: 0.05,
        shares: measurement::point_uncertainty::Shares::default(),
    };
    (estimate, truth)
}

/// Weighted root mean square about the weighted plane `z = a + b x + c y`.
fn true_form(points: &[Point3<f64>], sigmas: &[f64]) -> f64 {
    use measurement::nalgebra::Matrix3;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (point, sigma) in points.iter().zip(sigmas) {
        let row = Vector3::new(1.0, point.x, point.y);
        normal += row * row.transpose() / (sigma * sigma);
        right += row * (point.z / (sigma * sigma));
    }
    let plane = normal.try_inverse().unwrap() * right;
    let (mut sum, mut weights) = (0.0, 0.0);
    for (point, sigma) in points.iter().zip(sigmas) {
        sum += (point.z - plane.dot(&Vector3::new(1.0, point.x, point.y))).powi(2) / (sigma * sigma);
        weights += (sigma * sigma).recip();
    }
    (sum / weights).sqrt()
}
