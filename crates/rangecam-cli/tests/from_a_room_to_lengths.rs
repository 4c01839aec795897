//! A survey of a room without a target: calibrated by its own surfaces, corrected, checked, and measured in.

use std::path::Path;

use range_io::calibration::Calibration;

use crate::desk::Desk;

const STAGES: &str = "(name: \"room\", stages: [Demodulate(low_amplitude: 20), Average(), Deconvolve(), Unwrap(maximum_range_m: 12), \
                      CorrectRange(), CorrectImagePoint(), PointCloud(), Flag(), Register(normal_half_width_px: 2), Adjust()])";

/// Walls, a table's top and two balls of the room, with the lengths between them.
const LENGTHS: &str = r#"#![enable(implicit_some)]
(
    regions: {
        "east": plane(box(from_m: (7.40, 2.0, 2.2), to_m: (7.60, 4.0, 2.5))),
        "west": plane(box(from_m: (-0.1, 3.2, 2.3), to_m: (0.1, 4.0, 2.6))),
        "north": plane(box(from_m: (2.8, 5.9, 2.1), to_m: (5.0, 6.1, 2.6))),
        "south": plane(box(from_m: (4.0, -0.1, 1.0), to_m: (5.4, 0.1, 2.6))),
        "floor": plane(box(from_m: (2.6, 1.6, -0.1), to_m: (5.0, 2.4, 0.1))),
        "table": plane(box(from_m: (3.2, 2.7, 0.68), to_m: (4.3, 3.3, 0.80))),
        "globe": sphere(sphere(centre_m: (3.9, 3.1, 0.945), radius_m: 0.26)),
        "lamp": sphere(sphere(centre_m: (4.9, 3.2, 2.45), radius_m: 0.28)),
    },
    lengths: [
        (name: "length", quantity: distance(from: "east", to: "west")),
        (name: "width", quantity: distance(from: "north", to: "south")),
        (name: "table", quantity: distance(from: "floor", to: "table")),
        (name: "globe", quantity: radius(of: "globe")),
        (name: "globe to lamp", quantity: distance(from: "globe", to: "lamp")),
        (name: "corner", quantity: angle(from: "east", to: "north")),
    ],
)
"#;
const TRUTH: [(&str, f64); 6] =
    [("length", 7.5), ("width", 6.0), ("table", 0.745), ("globe", 0.2), ("globe to lamp", 1.809_73), ("corner", 90.0)];

#[test]
fn a_room_without_a_target_is_calibrated_corrected_checked_and_measured() {
    let desk = Desk::new();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenes/room_small.ron");
    for (seed, survey) in [(1, "room"), (2, "later")] {
        desk.rangecam(&format!("simulate {} --seed {seed} --out @{survey}", scene.display()));
    }
    std::fs::write(desk.path("room.ron"), STAGES).unwrap();
    std::fs::write(desk.path("lengths.ron"), LENGTHS).unwrap();
    // The lens and what it scatters are known; of the ranges' errors nothing is.
    let truth = Calibration::read(desk.path("room/truth/calibration.ron")).unwrap();
    let mut lens = truth.clone();
    lens.range_models.clear();
    lens.write(desk.path("lens.ron")).unwrap();

    desk.rangecam("calibrate @room --method surfaces --calibration @lens.ron --out @own");
    let median = |calibration: &str, out: &str| {
        let line = format!("run --pipeline @room.ron @later --calibration @{calibration} --out @{out}");
        desk.rangecam(&line)["truth"]["range_error_median_m"].as_f64().unwrap()
    };
    let (own, best) = (median("own", "corrected"), median("later/truth/calibration.ron", "best"));
    println!("median range error {own:.5} m, with the true calibration {best:.5} m");
    assert!(own < 1.1 * best, "{own} {best}");

    let check = |calibration: &str| desk.rangecam(&format!("check @later --calibration @{calibration}"));
    let still = check("own");
    println!("own: moved {}, {} m", still["moved"], still["change_rms_m"]);
    assert_eq!(still["matters"], false);
    let mut moved = Calibration::read(desk.path("own")).unwrap();
    let offset = moved.range_models[0].parameters.iter_mut().find(|parameter| parameter.name == "d0").unwrap();
    offset.value += 0.005;
    moved.write(desk.path("moved.ron")).unwrap();
    let found = check("moved.ron");
    assert_eq!((&found["moved"], &found["matters"]), (&true.into(), &true.into()));
    let change = found["change_rms_m"].as_f64().unwrap();
    assert!((change - 0.005).abs() < 0.001, "{change}");

    let measured = desk.rangecam("measure @corrected --lengths @lengths.ron --out @lengths");
    for (name, length) in TRUTH {
        let all = measured["lengths"].as_array().unwrap();
        let found = all.iter().find(|found| found["name"] == name).unwrap();
        let [value, sigma] = ["value", "sigma"].map(|field| found[field].as_f64().unwrap());
        println!("{name}: {value:.5} +- {sigma:.5}, truth {length}");
        // Six lengths beyond 3.5 deviations by chance: one run in three hundred.
        assert!((value - length).abs() < 3.5 * sigma, "{name}");
        // One in a thousand of the length, or of the angle.
        assert!(sigma < 1.5e-3 * length, "{name}");
    }
}
