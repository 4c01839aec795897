//! Ranges or depths, in simulated rooms.

use rand_distr::{Distribution, StandardNormal, Uniform};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use range_image::Raster;
use stored_values::camera_model::{
    Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable, pose_from_euler,
};
use stored_values::{Error, Kind, KindJudgement, bendings, judge_kind};

/// Half a room's width, depth and height in metre.
const ROOM: [f64; 3] = [2.6, 3.4, 1.3];

struct Errors {
    noise_m: f64,
    /// Amplitude of an error with a wavelength of 2.5 m.
    periodic_m: f64,
    /// What the stated principal distance is of the true one.
    principal_distance: f64,
    k1: f64,
}

const NONE: Errors = Errors { noise_m: 0.005, periodic_m: 0.0, principal_distance: 1.0, k1: 0.0 };

fn camera(principal_distance_mm: f64, k1: f64) -> Camera {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm };
    Camera::new(format, interior, LensDistortion { k1, ..LensDistortion::default() }).unwrap()
}

/// What is stored of a room by a camera that looks anywhere, and the camera's stated rays.
fn frame(random: &mut Pcg64, kind: Kind, principal_distance_mm: f64, errors: &Errors) -> (Raster<f32>, RayTable) {
    let mut uniform = |half: f64| Uniform::new(-half, half).unwrap().sample(random);
    let place = [0, 1, 2].map(|axis| uniform(0.7 * ROOM[axis]));
    let turned = pose_from_euler(place, [1.57 + uniform(0.5), uniform(3.1), uniform(0.3)]);
    let ball = [0, 1, 2].map(|axis| uniform(0.8 * ROOM[axis]));
    let rays = RayTable::new(&camera(principal_distance_mm, errors.k1)).unwrap();
    let values = Raster::from_fn(176, 144, |col, row| {
        let direction = rays.direction(col, row);
        let world = turned.rotation * direction;
        let to_wall = |axis: usize| (ROOM[axis].copysign(world[axis]) - place[axis]) / world[axis];
        let mut range = (0..3).map(to_wall).fold(f64::INFINITY, f64::min);
        let to_ball: f64 = (0..3).map(|axis| world[axis] * (ball[axis] - place[axis])).sum();
        let square: f64 = (0..3).map(|axis| (ball[axis] - place[axis]).powi(2)).sum();
        let root = to_ball * to_ball - square + 0.09;
        if root > 0.0 && to_ball > root.sqrt() {
            range = range.min(to_ball - root.sqrt());
        }
        let noise: f64 = StandardNormal.sample(random);
        range += errors.periodic_m * (range * std::f64::consts::TAU / 2.5).sin() + errors.noise_m * noise;
        let value = if kind == Kind::Depth { -range * direction.z } else { range };
        value as f32
    });
    let stated = camera(principal_distance_mm * errors.principal_distance, 0.0);
    (values, RayTable::new(&stated).unwrap())
}

/// Right, wrong and not told of so many cameras with `frames` frames each, half of them with depths.
fn count(cameras: u64, frames: usize, principal_distance_mm: f64, errors: &Errors) -> [usize; 3] {
    let mut counts = [0; 3];
    for seed in 0..cameras {
        let mut random = Pcg64::seed_from_u64(seed);
        let kind = if seed % 2 == 0 { Kind::Range } else { Kind::Depth };
        let mut surfaces = Vec::new();
        for _ in 0..frames {
            let (values, rays) = frame(&mut random, kind, principal_distance_mm, errors);
            surfaces.extend(bendings(&values, &rays).unwrap());
        }
        let place = judge_kind(&surfaces).told().map_or(2, |told| usize::from(told != kind));
        counts[place] += 1;
    }
    counts
}

#[test]
fn rooms_tell_ranges_from_depths() {
    let [right, wrong, open] = count(60, 1, 5.0, &NONE);
    println!("right {right}, wrong {wrong}, not told {open}");
    assert_eq!(wrong, 0);
    assert!(right >= 45, "{right}");
}

#[test]
fn they_do_with_a_lens_and_ranges_that_are_not_calibrated() {
    let errors = Errors { noise_m: 0.01, periodic_m: 0.01, principal_distance: 1.05, k1: -2e-3 };
    let [right, wrong, open] = count(40, 4, 5.0, &errors);
    println!("right {right}, wrong {wrong}, not told {open}");
    assert_eq!(wrong, 0);
    assert!(right >= 32, "{right}");
}

#[test]
fn a_narrow_field_of_view_tells_nothing_and_says_so() {
    let [_, wrong, open] = count(20, 1, 80.0, &Errors { noise_m: 0.02, ..NONE });
    assert_eq!([wrong, open], [0, 20]);
}

#[test]
fn no_values_tell_nothing() {
    let rays = RayTable::new(&camera(5.0, 0.0)).unwrap();
    for value in [f32::NAN, 0.0, -1.0, f32::INFINITY, f32::MAX, f32::MIN_POSITIVE] {
        let surfaces = bendings(&Raster::filled(176, 144, value), &rays).unwrap();
        let judgement = judge_kind(&surfaces);
        assert!(judgement.range.is_finite() && judgement.depth.is_finite(), "{value}: {judgement:?}");
        if !(value > 0.0 && value.is_finite()) {
            assert_eq!((judgement.surfaces, judgement.told()), (0, None), "{value}");
        }
    }
    let error = bendings(&Raster::filled(10, 10, 1.0), &rays).unwrap_err();
    assert_eq!(error, Error::Size { values: [10, 10], rays: [176, 144] });
}

#[test]
fn surfaces_bent_by_another_amount_are_neither() {
    let surfaces = (0..40).map(|number| stored_values::Bending {
        bending: 0.5 + 0.05 * f64::from(number % 5 - 2),
        sigma: 0.05,
        window: [0; 4],
    });
    let judgement: KindJudgement = judge_kind(&surfaces.collect::<Vec<_>>());
    assert_eq!(judgement.told(), None);
    assert!(judgement.neither > 0.1 && (judgement.bending - 0.5).abs() < 0.05, "{judgement:?}");
}

#[test]
fn deviations_of_bendings_are_those_of_their_scatter() {
    // One wall, all pixels with noise of their own: 200 frames.
    let rays = RayTable::new(&camera(5.0, 0.0)).unwrap();
    let mut random = Pcg64::seed_from_u64(7);
    let mut squares = Vec::new();
    for _ in 0..200 {
        let values = Raster::from_fn(176, 144, |col, row| {
            let direction = rays.direction(col, row);
            let noise: f64 = StandardNormal.sample(&mut random);
            (-3.0 / (direction.z + 0.2 * direction.x) + 0.01 * noise) as f32
        });
        let [surface] = bendings(&values, &rays).unwrap()[..] else { panic!("one wall") };
        squares.push((surface.bending / surface.sigma).powi(2));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    println!("normalised square {mean:.2}");
    assert!((0.7..1.35).contains(&mean), "{mean}");
}
