//! Lengths from files, against the truth and against the same measured in memory.

use cloud_tasks::commands::{Judged, Verdict};
use cloud_tasks::measurement::{FitOptions, fit_plane, fit_sphere, plane_to_plane, point_distance};

use crate::results::{Folder, PLAN};
use crate::scene;

#[test]
fn every_kind_of_length_is_near_the_truth() {
    let folder = Folder::new(3);
    let summary = folder.measure(PLAN).unwrap();
    let truth = [
        ("board off the wall", f64::NAN),
        ("at a place", 0.25),
        ("balls", (0.49_f64 + 0.0025).sqrt()),
        ("ball, wall", 0.3),
        ("ball, pipe", f64::NAN),
        ("corner, mark", f64::NAN),
        ("datum, corner", f64::NAN),
        ("lean", f64::NAN),
        ("pipe's slope", scene::cylinder_axis().z.acos().to_degrees()),
        ("pipe, radius", 0.12),
        ("ball, \"left\"", 0.3),
        ("wall's form", f64::NAN),
        ("behind the board", 0.09),
        ("over zero", 0.09),
    ];
    assert_eq!(summary.lengths.len(), truth.len());
    for (length, (name, truth)) in summary.lengths.iter().zip(truth) {
        assert_eq!(length.name, name);
        let (value, [low, high]) = (length.value.unwrap(), length.interval.unwrap());
        assert!(low <= value + 1e-12 && value <= high, "{name}: {value} in {low} to {high}");
        if let Some(sigma) = length.sigma.filter(|_| truth.is_finite()) {
            assert!((value - truth).abs() < 4.0 * sigma, "{name}: {value} +- {sigma}, {truth}");
        }
        let shares: f64 = length.shares.values().sum();
        assert!(length.kind == "flatness" || (shares - 1.0).abs() < 1e-9, "{name}: {shares}");
    }
    assert_eq!(summary.verdict(), if summary.doubts.is_empty() { Verdict::Done } else { Verdict::Doubtful });
    let without = |length: usize, source: &str| {
        summary.lengths[length].without.iter().find(|rest| rest.source == source).unwrap().sigma
    };
    // What the calibration shares widens the distance of the balls; a radius knows no pose.
    assert!(without(2, "calibration") < summary.lengths[2].sigma.unwrap());
    assert!(summary.regions["wall"].sigma0.is_some() && summary.regions["datum"].points == 0);
    assert!(summary.lengths[0].taken_at_m.is_some() && summary.lengths[11].flatness.is_some());
}

#[test]
fn files_say_the_same_as_memory() {
    let folder = Folder::new(4);
    let summary = folder.measure(PLAN).unwrap();
    let cloud = folder.survey.cloud();
    let options = FitOptions::default();
    let select = |region: cloud_tasks::measurement::Region| region.select(cloud.points).unwrap();
    let wall = fit_plane(&cloud, &select(scene::wall_region()), &options).unwrap();
    let board = fit_plane(&cloud, &select(scene::board_region()), &options).unwrap();
    let planes = plane_to_plane(&cloud, &wall, &board, None).unwrap().distance.estimate(&cloud);
    let balls = [0, 1].map(|which| fit_sphere(&cloud, &select(scene::sphere_region(which)), &options).unwrap().place());
    let balls = point_distance(&balls[0], &balls[1]).estimate(&cloud);
    for (length, direct) in [(&summary.lengths[0], planes), (&summary.lengths[2], balls)] {
        // Coordinates are rounded to 0.1 micrometre, and pixels at the edge of a neighbourhood may fall into the next.
        assert!((length.value.unwrap() - direct.value).abs() < 2e-4, "{}", length.name);
        assert!((length.sigma.unwrap() / direct.sigma - 1.0).abs() < 0.05, "{}", length.name);
    }
}

#[test]
fn the_files_hold_every_length() {
    let folder = Folder::new(5);
    folder.measure(PLAN).unwrap();
    let table = folder.read("lengths.csv");
    assert_eq!(table.lines().count(), 15);
    let header =
        "name,quantity,value,unit,sigma,lower,upper,noise_share,sensor_share,calibration_share,drift_share,poses_share";
    assert_eq!(table.lines().next().unwrap(), header);
    assert!(
        table.contains("\"ball, \"\"left\"\"\",diameter,0.3")
            && table.contains("lean,angle,0.")
            && table.contains(",deg,"),
        "{table}"
    );
    let page = folder.read("report.html");
    assert!(page.contains("Section: board off the wall") && page.contains("Shares of the variance"));
    assert!(folder.read("summary.json").contains("\"behind the board\""));
}

#[test]
fn flagged_points_take_no_part() {
    let folder = Folder::new(6);
    let all = folder.measure(PLAN).unwrap();
    let board = scene::board_region().select(&folder.survey.points).unwrap();
    let flagged: Vec<usize> = board.iter().copied().step_by(2).collect();
    folder.write_cloud(&flagged);
    let half = folder.measure(PLAN).unwrap();
    assert_eq!(half.flagged_points, flagged.len());
    // A hole in the board is named, and its volume is not zero but missing.
    let hole = board.iter().copied().filter(|point| {
        let point = folder.survey.points[*point];
        (point.x + 0.8).hypot(point.y - 0.5) < 0.15
    });
    folder.write_cloud(&hole.collect::<Vec<usize>>());
    let holed = folder.measure(PLAN).unwrap();
    let (volume, missing) = (&holed.lengths[13], holed.lengths[13].missing.as_ref().unwrap());
    assert!((1..=9).contains(&missing.cells) && missing.middles_m.len() == missing.cells);
    let covered = 0.36 - missing.area_m2;
    assert!((volume.value.unwrap() / covered - 0.25).abs() < 0.02);
    assert!(holed.doubts.iter().any(|doubt| doubt.words.contains("cells")), "{:?}", holed.doubts);
    assert!(half.regions["board"].points < all.regions["board"].points / 2 + 2);
}

#[test]
fn without_common_errors_it_is_noise_alone_and_doubted() {
    let folder = Folder::new(7);
    let all = folder.measure(PLAN).unwrap();
    std::fs::remove_file(folder.path("result/common_errors.ron")).unwrap();
    let alone = folder.measure(PLAN).unwrap();
    assert_eq!(alone.verdict(), Verdict::Doubtful);
    assert!(alone.doubts[0].words.contains("noise alone"), "{:?}", alone.doubts);
    assert!(alone.lengths[2].sigma.unwrap() < all.lengths[2].sigma.unwrap());
    assert_eq!(alone.lengths[2].shares["noise"], 1.0);
    assert!(alone.doubts[0].words.contains("run the pipeline again"), "{:?}", alone.doubts);
    // In a fused cloud, it is said where its points came from.
    let summary = r#"{"result": "rooms/north", "fused_points": 12, "voxel_m": 0.02}"#;
    std::fs::write(folder.path("result/summary.json"), summary).unwrap();
    let fused = folder.measure(PLAN).unwrap();
    let words = &fused.doubts[0].words;
    assert!(words.contains("fused from, rooms/north") && !words.contains("pipeline"), "{words}");
}
