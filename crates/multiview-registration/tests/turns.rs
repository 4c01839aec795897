//! Turns that an inertial unit measured, where surfaces leave attitudes open.

use multiview_registration::nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use multiview_registration::point_cloud::Cloud;
use multiview_registration::{Datum, Error, MeasuredTurn, Start, StationRegistrationOptions, register_stations};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use rigid_pose::InputError;

/// Standard deviation of a turn about each axis, radian: a phone's gyroscope over a second, its bias known from a rest.
const TURN_RAD: f64 = 3e-4;
/// The same of the attitudes at the start.
const START_RAD: f64 = 0.03;

struct Walls {
    clouds: Vec<Cloud>,
    truth: Vec<Isometry3<f64>>,
    rough: Vec<Isometry3<f64>>,
    turns: Vec<MeasuredTurn>,
}

/// Radius of a bump on the wall, metre: it holds the positions, and leaves the turn about it open.
const BUMP_M: f64 = 0.25;

/// Stations past a bare wall with one bump, two metres away, with points to 3 mm.
fn bare_wall(seed: u64) -> Walls {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut normal = |sigma: f64| {
        let one: f64 = StandardNormal.sample(&mut random);
        sigma * one
    };
    let mut three = |sigma: f64| Vector3::from_fn(|_, _| normal(sigma));
    let truth: Vec<Isometry3<f64>> = (0..5)
        .map(|k| {
            let k = f64::from(k);
            Isometry3::new(Vector3::new(0.3 * k, 0.05 * k, 2.0), Vector3::new(0.02 * k, -0.05, 0.15 * k))
        })
        .collect();
    let cloud = |pose: &Isometry3<f64>, noise: &mut dyn FnMut() -> f64| {
        let middle = pose.translation.vector;
        let point = |index: i32| {
            let [a, b] = [index % 50, index / 50].map(|place| 0.03 * (f64::from(place) - 24.5));
            let (x, y) = (middle.x + a, middle.y + b);
            let beside = (x - 0.6).hypot(y - 0.1);
            let on_wall = Point3::new(x, y, (BUMP_M * BUMP_M - beside * beside).max(0.0).sqrt());
            let seen = pose.inverse() * on_wall;
            seen + seen.coords.normalize() * noise()
        };
        Cloud::new((0..2500).map(point).collect())
    };
    let clouds = truth.iter().map(|pose| cloud(pose, &mut || three(0.003).x)).collect();
    let rough = truth
        .iter()
        .enumerate()
        .map(|(k, pose)| {
            let off = if k == 0 { Isometry3::identity() } else { Isometry3::new(three(0.01), three(START_RAD)) };
            pose * off
        })
        .collect();
    let turn = |k: usize| MeasuredTurn {
        first: k,
        second: k + 1,
        first_from_second: truth[k].rotation.inverse()
            * truth[k + 1].rotation
            * UnitQuaternion::from_scaled_axis(three(TURN_RAD)),
        covariance: Matrix3::identity() * TURN_RAD.powi(2),
    };
    let turns = (0..4).map(turn).collect();
    Walls { clouds, truth, rough, turns }
}

impl Walls {
    /// Root mean square of the errors of the attitudes, radian.
    fn error(&self, turns: &[MeasuredTurn]) -> f64 {
        let options = StationRegistrationOptions { turns, ..StationRegistrationOptions::default() };
        let start = Start::Poses(&self.rough);
        let found = register_stations(&self.clouds, start, Datum::Station(0), &options, &|_, _| {}).unwrap();
        let pairs = found.world_from_station.iter().zip(&self.truth).skip(1);
        let squares: f64 = pairs.map(|(found, truth)| found.rotation.angle_to(&truth.rotation).powi(2)).sum();
        (squares / 4.0).sqrt()
    }
}

#[test]
fn turns_hold_the_attitudes_past_a_bare_wall() {
    let mut squares = [0.0_f64; 2];
    for seed in 0..4 {
        let walls = bare_wall(seed);
        squares[0] += walls.error(&[]).powi(2) / 4.0;
        squares[1] += walls.error(&walls.turns).powi(2) / 4.0;
    }
    let [without, with] = squares.map(|square| square.sqrt().to_degrees());
    println!("attitudes off by {without:.3} degrees without turns, {with:.3} with them");
    assert!(3.0 * with < without, "{without} {with}");
    // Errors of up to four turns add up.
    assert!(with < 0.1, "{with}");
}

#[test]
fn turns_of_stations_that_are_not_there_are_refused() {
    let walls = bare_wall(1);
    let with = |change: fn(&mut MeasuredTurn)| {
        let mut turns = walls.turns.clone();
        change(&mut turns[0]);
        let options = StationRegistrationOptions { turns: &turns, ..StationRegistrationOptions::default() };
        let start = Start::Poses(&walls.rough);
        register_stations(&walls.clouds, start, Datum::Station(0), &options, &|_, _| {}).unwrap_err()
    };
    assert!(matches!(with(|turn| turn.second = 9), Error::NoSuchStation { station: 9, count: 5 }));
    for change in [
        (|turn| turn.covariance = Matrix3::zeros()) as fn(&mut MeasuredTurn),
        |turn| turn.covariance[(0, 0)] = f64::NAN,
        |turn| turn.second = turn.first,
    ] {
        assert!(matches!(with(change), Error::Input(InputError::NonFinite { .. })));
    }
}
