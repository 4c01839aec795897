//! The small room, from raw samples to one registered cloud, against its truth.

use std::path::Path;

use pipeline::{NetworkCalibration, Silent, Source, Stage, StartPoses, Summary};

use crate::common::{request, run};

#[test]
fn the_small_room_reaches_its_bars() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("room_small");
    let summary = run("room_small", &out).unwrap();
    let truth = summary.truth.as_ref().unwrap();
    println!("{summary}");

    // Scattering and range terms together put the raw ranges off by 50 to 100 mm, which is what the stages take off.
    let raw = summary.stages[0].truth.as_ref().unwrap();
    assert!((0.050..0.100).contains(&raw.range_error_median_m), "raw: {}", raw.range_error_median_m);
    // Half the pixels and half the frames: sigma is about 1.4 times that of the full room, whose bars are 4 and 15 mm,
    // and edges are denser.
    assert!(truth.ranges.range_error_median_m < 0.006, "median {}", truth.ranges.range_error_median_m);
    assert!(truth.ranges.range_error_p95_m < 0.025, "95 % {}", truth.ranges.range_error_p95_m);
    assert!(truth.ranges.wrap_count_right_fraction > 0.995, "wraps {}", truth.ranges.wrap_count_right_fraction);
    assert!(truth.ranges.flagged_fraction < 0.25, "flagged {}", truth.ranges.flagged_fraction);
    require_poses(&summary);

    check_files(&out, summary.points);
}

/// The full room's bar of 2 mm and 0.05 degrees, which half the points of 1.4 times the sigma reach as well.
fn require_poses(summary: &Summary) {
    let truth = summary.truth.as_ref().unwrap();
    assert!(truth.position_error_max_m.unwrap() < 0.002, "position {:?}", truth.position_error_max_m);
    assert!(truth.attitude_error_max_deg.unwrap() < 0.05, "attitude {:?}", truth.attitude_error_max_deg);
}

#[test]
fn the_order_of_the_stations_is_enough_with_gross_errors() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut request = request("room_small", &out);
    let Some(Source::Simulate(source)) = &mut request.plan.source else { panic!("the small room is simulated") };
    source.gross_error_share = 0.01;
    for stage in &mut request.plan.stages {
        if let Stage::Register(options) = stage {
            options.start = StartPoses::Order;
        }
    }
    let summary = calibration_tasks::run(&request, &Silent).unwrap();
    println!("{summary}");
    require_poses(&summary);
}

/// The bars of the full room, for it and for its variants with an estimated calibration and with gross errors.
pub(crate) fn require_the_bars_of_the_room(summary: &Summary, name: &str) {
    let truth = summary.truth.as_ref().unwrap();
    assert!(truth.ranges.range_error_median_m < 0.004, "{name}: median {}", truth.ranges.range_error_median_m);
    assert!(truth.ranges.range_error_p95_m < 0.015, "{name}: 95 % {}", truth.ranges.range_error_p95_m);
    assert!(truth.position_error_max_m.unwrap() < 0.005, "{name}: position {:?}", truth.position_error_max_m);
    assert!(truth.attitude_error_max_deg.unwrap() < 0.1, "{name}: attitude {:?}", truth.attitude_error_max_deg);
}

fn check_files(out: &Path, points: usize) {
    let cloud = range_io::ply::read_cloud(out.join("cloud.ply")).unwrap();
    let unflagged = cloud.flags.unwrap().iter().filter(|flags| **flags == 0).count();
    assert_eq!(unflagged, points);
    let stations = range_io::tables::read_stations(out.join("stations.csv")).unwrap();
    let trajectory = range_io::trajectory::read_tum(out.join("trajectory.txt")).unwrap();
    assert_eq!((stations.len(), trajectory.len()), (8, 8));
    for (station, stamped) in stations.iter().zip(&trajectory) {
        let apart = station.world_from_camera.translation.vector - stamped.world_from_camera.translation.vector;
        // Both files keep at least a tenth of a micrometre.
        assert!(apart.norm() < 1e-6);
    }
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    for name in ["range_error_median_m", "range_error_p95_m", "wrap_count_right_fraction", "flagged_fraction"] {
        assert!(summary["truth"][name].is_f64(), "{name}");
        assert!(summary["truth"]["stations"]["S3"][name].is_f64(), "{name} of a station");
    }
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("<svg") && report.contains("From above") && report.contains("Range error after"));
    assert!(!report.contains("src=\"http") && !report.contains("href=\"http"), "the page needs no network");
}

#[test]
fn a_calibration_estimated_from_targets_serves_as_well_as_the_true_one() {
    let folder = tempfile::tempdir().unwrap();
    let terms = "xp yp c k1 k2 p1 p2 d0 d2 d3 d4 d5 d6 d7 e1 e2 h1 h2 h3";
    let estimated = NetworkCalibration {
        network: "../networks/room_small.ron".to_owned(),
        terms: terms.split(' ').map(str::to_owned).collect(),
    };
    let median = |calibrate: Option<NetworkCalibration>, name: &str| {
        let mut request = request("room_small", &folder.path().join(name));
        // Ranges are final before the stations are aligned.
        request.plan.stages.retain(|stage| !matches!(stage, Stage::Register(_) | Stage::Adjust(_)));
        request.plan.calibrate = calibrate;
        let summary = calibration_tasks::run(&request, &Silent).unwrap();
        summary.truth.unwrap().ranges.range_error_median_m
    };
    let (with_truth, with_estimate) = (median(None, "true"), median(Some(estimated), "estimated"));
    println!("median {with_truth} m with the true calibration, {with_estimate} m with the estimated one");
    assert!(with_estimate < with_truth + 0.002);
}
