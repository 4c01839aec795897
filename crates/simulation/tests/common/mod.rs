//! What the tests share: a plain room without errors, and how to look at a frame.
#![allow(clippy::unwrap_used, dead_code)]

use range_image::{ComplexFrame, Raster, demodulate};
use simulation::{SimulatedFrame, SimulationSpec, simulate_frame};

/// Ambiguity interval at 30 MHz, metre.
pub const INTERVAL_M: f64 = 299_792_458.0 / 60.0e6;

/// A room with a ball and a box, one station, nothing that goes wrong.
pub fn plain() -> SimulationSpec {
    SimulationSpec::from_ron(
        r#"(
        scene: (objects: [
            (name: "room", shape: Room(min_m: (0, 0, 0), max_m: (7, 5, 3)), albedo: 0.6),
            (name: "ball", shape: Sphere(center_m: (3, 2.5, 1.2), radius_m: 0.4), albedo: 0.8),
            (name: "box", shape: Cuboid(center_m: (4, 1.2, 0.5), size_m: (0.8, 0.8, 1.0), rotation_deg: (0, 0, 30)), albedo: 0.4),
        ]),
        camera: (
            geometry: (
                format: (width: 48, height: 36, pixel_pitch_mm: (0.15, 0.15)),
                interior: (principal_point_mm: (0.05, -0.03), principal_distance_mm: 5.0),
                lens: (k1: -2.0e-3, p1: 3.0e-5),
            ),
            modulation_hz: [30.0e6],
        ),
        illumination: (source_power: 4.0e6),
        exposure: (frames_per_station: 2, integration_time_s: 0.002),
        stations: [(name: "A", position_m: (0.8, 2.0, 1.4), attitude: LookAt(target_m: (5, 2.4, 1.1), roll_deg: 3))],
    )"#,
    )
    .unwrap()
}

/// A scene of the fixtures.
pub fn fixture(name: &str) -> SimulationSpec {
    let path = format!("{}/../../fixtures/scenes/{name}.ron", env!("CARGO_MANIFEST_DIR"));
    SimulationSpec::from_ron(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The first frame of the first station, with its complex image.
pub fn first(spec: &SimulationSpec) -> (SimulatedFrame, ComplexFrame) {
    let frame = simulate_frame(spec, 1, 0, 0).unwrap();
    let complex = demodulate(&frame.raw, &spec.demodulation_options()).unwrap();
    (frame, complex)
}

/// Range shown minus a reference, modulo the ambiguity interval, in -U/2..U/2; NaN where the reference is.
pub fn range_error(complex: &ComplexFrame, channel: usize, reference: &Raster<f32>) -> Vec<f64> {
    let channel = &complex.channels[channel];
    let interval = channel.modulation.ambiguity_interval_m();
    let shown =
        channel.phase().into_vec().into_iter().map(|phase| channel.modulation.range_from_phase(f64::from(phase)));
    shown.zip(reference.as_slice()).map(|(shown, truth)| wrapped(shown - f64::from(*truth), interval)).collect()
}

/// A difference modulo an interval, centred on zero.
pub fn wrapped(difference: f64, interval: f64) -> f64 {
    difference - (difference / interval).round() * interval
}

/// Largest absolute value; NaN counts as no value.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// A quantile of the absolute values that are not NaN.
pub fn quantile(values: &[f64], fraction: f64) -> f64 {
    let mut sorted: Vec<f64> = values.iter().map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * fraction).round() as usize]
}
