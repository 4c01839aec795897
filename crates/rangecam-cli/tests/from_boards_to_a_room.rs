//! From frames of a board to the corrected ranges of a room, command by command, beside the true calibration.

use std::path::Path;

use range_io::calibration::Calibration;

use crate::desk::Desk;

const STAGES: &str = "(name: \"room\", stages: [Demodulate(low_amplitude: 20), Average(), Deconvolve(), Unwrap(maximum_range_m: 12), \
                      CorrectRange(), CorrectImagePoint(), PointCloud(), Flag()])";

/// The median range error of the room, metre.
fn room_error(desk: &Desk, calibration: &str) -> f64 {
    let line =
        format!("run --pipeline @room.ron @room --calibration @{calibration} --out @corrected-{}", calibration.len());
    desk.rangecam(&line)["truth"]["range_error_median_m"].as_f64().unwrap()
}

#[test]
fn boards_alone_calibrate_the_ranges_of_a_room() {
    let desk = Desk::new();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes");
    for (scene, seed, survey) in [("dots.ron", 1, "boards"), ("room.ron", 2, "room")] {
        desk.rangecam(&format!("simulate {} --seed {seed} --out @{survey}", scenes.join(scene).display()));
    }
    std::fs::write(desk.path("room.ron"), STAGES).unwrap();
    // What is known before: what the lens scatters, and the camera as its maker states it.
    let mut truth = Calibration::read(desk.path("room/truth/calibration.ron")).unwrap();
    let mut start = truth.clone();
    start.range_models.clear();
    for parameter in start.parameters.iter_mut().filter(|parameter| parameter.name != "c") {
        parameter.value = 0.0;
    }
    start.write(desk.path("start.ron")).unwrap();
    // The discs lie on the board to 0.2 mm.
    desk.rangecam(
        "targets @boards --kind circles 7x5 0.4 --board-sigma 0.0002 --calibration @start.ron --out @targets",
    );
    desk.rangecam("calibrate @targets --out @calibrated");
    let found = Calibration::read(desk.path("calibrated/calibration.ron")).unwrap();
    // Beyond the ranges and amplitudes of the boards pixels are flagged: both are judged on the others.
    (truth.span, truth.range_models[0].range_span_m) = (found.span, found.range_models[0].range_span_m);
    truth.range_models[0].amplitude_span = found.range_models[0].amplitude_span;
    truth.write(desk.path("true.ron")).unwrap();
    let [true_m, found_m] =
        ["true.ron", "calibrated/calibration.ron"].map(|calibration| room_error(&desk, calibration));
    println!(
        "median range error: {:.2} mm with the true calibration, {:.2} mm from boards",
        1e3 * true_m,
        1e3 * found_m
    );
    assert!(found_m < 1.5 * true_m, "{found_m} {true_m}");
}
