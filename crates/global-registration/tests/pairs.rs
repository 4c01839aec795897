//! Alignment without a guess on simulated frames with truth.

use crate::common::{Pinhole, Scene};
use crate::scenes::{Outcome, align_points, outcome, pair, prepared, random_room};
use global_registration::Error;
use global_registration::{CoarseOptions, align_without_guess};

/// Of `count` pairs with half of the view in common: right and wrong answers.
fn tally(count: u64) -> (u64, u64) {
    let camera = Pinhole::small();
    let (mut right, mut wrong) = (0, 0);
    for k in 0..count {
        let scene = if k % 2 == 0 { Scene::furnished() } else { random_room(k) };
        let pair = pair(&scene, &camera, 0.45..0.6, k);
        let [target, source] = pair.points(&scene, &camera);
        match outcome(&pair.target_from_source(), align_points(&target, &source, &CoarseOptions::default())) {
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
    let (right, wrong) = tally(6);
    assert!(right >= 5 && wrong == 0, "{right} right, {wrong} wrong");
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
fn clouds_of_different_voxels_are_aligned() {
    let (scene, camera) = (Scene::furnished(), Pinhole::small());
    let pair = pair(&scene, &camera, 0.45..0.6, 0);
    let [target, source] = pair.points(&scene, &camera);
    let of = |voxel_m| CoarseOptions { voxel_m: Some(voxel_m), ..CoarseOptions::default() };
    let truth = pair.target_from_source();
    for (of_source, of_target) in [(0.04, 0.07), (0.07, 0.04), (0.05, 0.051)] {
        let (source, target) = (prepared(&source, &of(of_source)), prepared(&target, &of(of_target)));
        let found = align_without_guess(&source, &target, &CoarseOptions::default());
        assert!(matches!(outcome(&truth, found.clone()), Outcome::Right(..)), "{of_source} {of_target}: {found:?}");
        assert!((found.unwrap().voxel_m - f64::max(of_source, of_target)).abs() < 1e-9);
    }
}

#[test]
fn corners_of_an_empty_room_are_refused() {
    let (scene, camera) = (Scene { boxes: Vec::new(), ..Scene::furnished() }, Pinhole::small());
    for k in 0..3 {
        let pair = pair(&scene, &camera, 0.4..0.9, k);
        let [target, source] = pair.points(&scene, &camera);
        // Each corner fits each other, turned by quarters and thirds.
        let found = align_points(&target, &source, &CoarseOptions::default());
        assert!(matches!(found, Err(Error::NoAlignment { .. })), "{k}: {found:?}");
    }
}
