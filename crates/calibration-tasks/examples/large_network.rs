//! A network of many stations before a wall of 30 by 20 targets, as text for `rangecam simulate-network`:
//!
//! ```text
//! cargo run --release --package calibration-tasks --example large_network -- 1000 > large.ron
//! rangecam simulate-network large.ron --out large
//! rangecam calibrate large --terms xp,yp,c,k1,k2,p1,p2,d0,d4,d5,d6,d7,e1,e2
//! ```
#![allow(clippy::print_stdout)]

/// The golden ratio and the roots of three and seven: their multiples fill an interval evenly and in no order.
const SPREAD: [f64; 3] = [1.618_034, 1.732_051, 2.645_751];

fn main() {
    let count = std::env::args().nth(1).and_then(|count| count.parse::<u32>().ok()).unwrap_or(1000);
    println!(
        r#"#![enable(implicit_some)]
(
    seed: 7,
    camera: (
        width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04),
        principal_distance_mm: 8.0, principal_point_mm: (0.0, 0.0),
        modulation_hz: [20e6],
    ),
    truth: {{
        "xp": 0.06, "yp": -0.04, "c": 8.02,
        "k1": -1.5e-3, "k2": 2e-5, "p1": 1e-4, "p2": -8e-5,
        "d0": 0.024, "d4": 0.003, "d5": 0.005, "d6": -0.009, "d7": 0.004,
        "e1": 1.5e-3, "e2": -1e-3,
    }},
    field: (columns: 30, rows: 20, spacing_m: 0.09, relief_m: 0.25),
    distances: [("T029", "T035", 0.0005), ("T014", "T050", 0.0005), ("T002", "T062", 0.0005)],
    sightings: (sigma_pixel: 0.05, sigma_range_m: 0.01, gross_error_share: 0.002, amplitude_at_1_m: 2000),
    stations: ["#
    );
    for station in 0..count {
        let share = SPREAD.map(|factor| (factor * f64::from(station)).fract());
        println!(
            "        (name: \"S{station:04}\", distance_m: {:.3}, aside_deg: {:.2}, above_deg: {:.2}, roll_deg: {}, \
             integration_time_s: 0.004),",
            1.0 + 2.05 * share[0],
            70.0 * share[1] - 35.0,
            60.0 * share[2] - 30.0,
            90 * (station % 4)
        );
    }
    println!("    ],\n)");
}
