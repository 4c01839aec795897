//! Ranges of the points of a board, from simulated samples.

use std::path::Path;

use pipeline::{Silent, SimulateSource, simulate};
use range_io::tables::{read_observations, read_stations};
use target_tasks::{TargetKind, TargetsRequest, find_targets};
use targets::nalgebra::Point3;

/// A board of discs before a wall, seen from three places by an ideal camera with noise.
pub(crate) const SCENE: &str = r#"(
    scene: (objects: [(
        name: "board", shape: Rectangle(corner_m: (-1.4, -1.0, 0.0), edge_u_m: (2.8, 0.0, 0.0), edge_v_m: (0.0, 2.0, 0.0)),
        albedo: 0.85, texture: Discs(spacing_m: 0.4, radius_m: 0.1, factor: 0.35, first_m: (0.2, 0.2)),
    ), (
        name: "wall", shape: Rectangle(corner_m: (-6.0, -5.0, -0.02), edge_u_m: (12.0, 0.0, 0.0), edge_v_m: (0.0, 10.0, 0.0)),
        albedo: 0.3,
    )]),
    camera: (
        geometry: (
            format: (width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04)),
            interior: (principal_point_mm: (0.06, -0.04), principal_distance_mm: 4.6),
            lens: (k1: -2.3e-3, k2: 1.5e-5, k3: 0.0, p1: 4.0e-5, p2: -3.0e-5),
        ),
        modulation_hz: [20.0e6], phase_steps: 4,
    ),
    illumination: (source_power: 8.0e6, modulation_contrast: 0.5, ambient_power: 5.0e4, vignetting_exponent: 1.0),
    exposure: (frames_per_station: 2, integration_time_s: 0.002, frame_interval_s: 0.1),
    stations: [
        (name: "A", position_m: (0.1, 0.1, 2.4), attitude: LookAt(target_m: (0.0, 0.0, 0.0))),
        (name: "B", position_m: (-1.9, 0.2, 2.4), attitude: LookAt(target_m: (0.0, 0.0, 0.0), roll_deg: 20.0)),
        (name: "C", position_m: (0.2, 1.6, 3.4), attitude: LookAt(target_m: (0.0, 0.0, 0.0))),
    ],
    errors: (noise: (shot_variance_per_unit: 0.025, dark_sigma: 2.0), mixed_pixels: (rays_per_pixel_side: 4)),
)"#;

#[test]
fn ranges_are_those_of_the_points_within_what_is_stated() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.ron"), SCENE).unwrap();
    let source = SimulateSource {
        scene: "scene.ron".to_owned(),
        seed: 3,
        approximate_position_sigma_m: 0.0,
        approximate_attitude_sigma_deg: 0.0,
        gross_error_share: 0.0,
    };
    let survey = folder.path().join("survey");
    simulate(&source, folder.path(), &survey, &Silent).unwrap();
    let request = TargetsRequest {
        survey: survey.clone(),
        calibration: None,
        kind: TargetKind::parse(&["circles", "7x5", "0.4"]).unwrap(),
        principal_distance_px: None,
        board_sigma_m: Some(0.001),
        out: folder.path().join("out"),
    };
    let summary = find_targets(&request, &Silent).unwrap();
    assert_eq!((summary.points, summary.ranges), (105, 105), "{summary}");
    assert!(summary.stations.iter().all(|board| board.ambiguity == 2), "a grid without a mark may be turned by half");
    let poses = read_stations(Path::new(&survey).join("truth/stations.csv")).unwrap();
    let rows = read_observations(folder.path().join("out/observations.csv")).unwrap();
    let mut squares = 0.0;
    for row in &rows {
        let pose = poses.iter().find(|pose| pose.station == row.station).unwrap().world_from_camera;
        let node: [f64; 2] = [row.target[1..3].parse().unwrap(), row.target[4..6].parse().unwrap()];
        // Node (0, 0) of the board as printed, and as it is turned by half.
        let places =
            [1.0, -1.0].map(|turn| Point3::new(turn * (-1.2 + 0.4 * node[0]), turn * (0.8 - 0.4 * node[1]), 0.0));
        let ranges = places.map(|place| (place.coords - pose.translation.vector).norm());
        let (observed, sigma) = (row.range_m.unwrap(), row.sigma_range_m.unwrap());
        let errors = ranges.map(|range| ((observed - range) / sigma).powi(2));
        assert!(sigma < 0.003, "{row:?}");
        squares += errors[0].min(errors[1]);
    }
    let mean = squares / rows.len() as f64;
    // Each of two turns would be taken for the other by chance: no less than a third, no more than twice as stated.
    assert!((0.3..2.0).contains(&mean), "{mean}");
}
