//! Alignment without a guess on simulated frames with truth.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs)]

mod coarse_scenes;
mod common;

use coarse_scenes::{Outcome, align_points, outcome, pair, random_room};
use common::{Pinhole, Scene};
use icp_registration::{Cloud, CoarseOptions, Error, Estimator, FeatureCloud, Viewpoint, align_without_guess};
use nalgebra::Point3;

/// Of `count` pairs with half of the view in common: right and wrong answers.
fn tally(count: u64, options: &CoarseOptions) -> (u64, u64) {
    let camera = Pinhole::small();
    let (mut right, mut wrong) = (0, 0);
    for k in 0..count {
        let scene = if k % 2 == 0 { Scene::furnished() } else { random_room(k) };
        let pair = pair(&scene, &camera, 0.45..0.6, k);
        let [target, source] = pair.points(&scene, &camera);
        match outcome(&pair.target_from_source(), align_points(&target, &source, options)) {
            Outcome::Right(..) => right += 1,
            Outcome::Wrong(..) => wrong += 1,
            Outcome::None(_) => {}
        }
    }
    (right, wrong)
}

#[test]
fn most_pairs_are_found_and_no_answer_is_wrong() {
    // The long statistics are those of the example `coarse_pairs`; one pair in six may have too little structure.
    let (right, wrong) = tally(6, &CoarseOptions::default());
    assert!(right >= 5 && wrong == 0, "{right} right, {wrong} wrong");
}

#[test]
fn random_samples_find_most_pairs_too() {
    let estimator = Estimator::Ransac { samples: 50_000 };
    let (right, wrong) = tally(4, &CoarseOptions { estimator, ..CoarseOptions::default() });
    assert!(right >= 2 && wrong == 0, "{right} right, {wrong} wrong");
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let (scene, camera) = (Scene::furnished(), Pinhole::small());
    let pair = pair(&scene, &camera, 0.45..0.6, 0);
    let [target, source] = pair.points(&scene, &camera);
    let found = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| align_points(&target, &source, &CoarseOptions::default()).unwrap())
    });
    assert_eq!(found[0], found[1]);
}

#[test]
fn clouds_without_overlap_are_refused() {
    let camera = Pinhole::small();
    for k in 0..3 {
        let scene = random_room(100 + k);
        let pair = pair(&scene, &camera, 0.0..0.02, k);
        let [target, source] = pair.points(&scene, &camera);
        let found = align_points(&target, &source, &CoarseOptions::default());
        assert!(matches!(found, Err(Error::NoAlignment { .. })), "{k}: {found:?}");
    }
}

#[test]
fn one_wall_is_refused() {
    let wall: Vec<[f64; 3]> =
        (0..10_000).map(|k| [f64::from(k % 100) * 0.02 - 1.0, f64::from(k / 100) * 0.02 - 1.0, -2.0]).collect();
    let found = align_points(&wall, &wall, &CoarseOptions::default());
    assert!(matches!(found, Err(Error::NoAlignment { .. })), "{found:?}");
}

#[test]
fn bad_input_is_named() {
    let options = CoarseOptions::default();
    let made = |points: Vec<Point3<f64>>, options: &CoarseOptions| FeatureCloud::new(&Cloud::new(points), options);
    assert!(matches!(made(vec![], &options), Err(Error::Empty { .. })));
    assert!(matches!(made(vec![Point3::new(f64::NAN, 0.0, 0.0)], &options), Err(Error::NonFinite { .. })));
    assert!(matches!(made(vec![Point3::origin(); 50], &options), Err(Error::TooFewPoints { .. })));
    let far = vec![Point3::new(0.0, 0.0, 0.0), Point3::new(1e99, 0.0, 0.0), Point3::new(0.0, -1e99, 1.0)];
    assert!(matches!(made(far, &options), Err(Error::TooFewPoints { .. })));
    let line: Vec<Point3<f64>> = (0..500).map(|k| Point3::new(f64::from(k) * 0.01, 0.0, 0.0)).collect();
    let line = made(line, &options).unwrap();
    assert!(matches!(align_without_guess(&line, &line, &options), Err(Error::NoAlignment { .. })));
    for bad in [
        CoarseOptions { voxel_m: Some(0.0), ..options.clone() },
        CoarseOptions { voxel_m: Some(f64::NAN), ..options.clone() },
        CoarseOptions { tolerance_voxels: -1.0, ..options.clone() },
        CoarseOptions { max_features: 0, ..options.clone() },
        CoarseOptions { estimator: Estimator::Ransac { samples: 0 }, ..options.clone() },
        CoarseOptions { min_overlap: f64::INFINITY, ..options.clone() },
    ] {
        assert!(matches!(made(vec![Point3::origin()], &bad), Err(Error::InvalidOption { .. })), "{bad:?}");
    }
    let unseen = CoarseOptions { viewpoint: Viewpoint::At(Point3::new(0.0, f64::NAN, 0.0)), ..options };
    assert!(matches!(made(vec![Point3::origin()], &unseen), Err(Error::NonFinite { .. })));
}
