//! Dense differences to a wall with the chapter's magnitudes, where light falls off towards the corners.

use error_models::{AmplitudeHyperbola, FurtherShape, RangeErrorModel, RangeTerms, SurfaceShape};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_calibration::RangeDifference;

pub const INTERVAL_M: f64 = 5.0;
pub const SIGMA_M: f64 = 0.006;

/// Columns and rows of a frame.
pub const SIZE: [u32; 2] = [14, 12];

/// What the wall looks like.
#[derive(Clone, Copy, PartialEq)]
pub enum Wall {
    /// Patches from black to white everywhere.
    Patches,
    /// One albedo: dark pixels are those of the corners and of far walls.
    Plain,
    /// One albedo at one distance.
    PlainAndStill,
}

/// A wall straight in front of the camera at 16 distances; amplitudes fall with the fourth power of the cosine.
pub fn differences(truth: &RangeErrorModel, wall: Wall, seed: u64) -> Vec<RangeDifference> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut differences = Vec::new();
    let [width, height] = SIZE;
    for step in 0..16_u32 {
        let distance = if wall == Wall::PlainAndStill { 2.0 } else { 0.6 + 0.3 * f64::from(step) };
        for index in 0..width * height {
            let (x_mm, y_mm) = ((f64::from(index % width) - 6.5) * 0.5, (f64::from(index / width) - 5.5) * 0.5);
            let slant = (x_mm * x_mm + y_mm * y_mm + 64.0_f64).sqrt() / 8.0;
            let reference_range_m = distance * slant;
            let albedo = if wall == Wall::Patches { 20.0_f64.powf(random.random::<f64>() - 1.0) } else { 0.5 };
            let amplitude = 4000.0 * albedo / (reference_range_m.powi(2) * slant.powi(4));
            let noise: f64 = StandardNormal.sample(&mut random);
            let shown = truth.observed_range(reference_range_m, x_mm, y_mm, amplitude).unwrap();
            let (observed_range_m, sigma_m) = (shown + SIGMA_M * noise, SIGMA_M);
            differences.push(RangeDifference { observed_range_m, reference_range_m, x_mm, y_mm, amplitude, sigma_m });
        }
    }
    differences
}

/// An offset, waves of a centimetre, a tilt.
pub fn terms() -> RangeTerms {
    RangeTerms { d0: 0.02, periodic: [0.004, -0.003, 0.002, 0.003, 0.008, -0.005], e1: 1e-3, e2: -8e-4 }
}

/// The surface over the image of [`differences`].
pub fn surface() -> SurfaceShape {
    SurfaceShape { order: 4, x_span_mm: [-3.25, 3.25], y_span_mm: [-2.75, 2.75] }
}

/// Errors of the size that \[20\] of the chapter reports: 40 cm at the lowest amplitudes, 25 cm in the corners.
pub fn truth(by_amplitude: bool, by_position: bool) -> RangeErrorModel {
    let mut model = RangeErrorModel { terms: terms(), ..RangeErrorModel::error_free(INTERVAL_M) };
    if by_position {
        let shape = FurtherShape { surface: Some(surface()), ..FurtherShape::default() };
        model = model.with_further(&shape).unwrap();
        let names = model.parameter_names();
        let mut values = model.parameter_values();
        let corners = [("g10", 0.003), ("g01", -0.002), ("g20", 0.05), ("g02", 0.04), ("g40", 0.03), ("g22", 0.09)];
        for (name, value) in corners.into_iter().chain([("g04", 0.04)]) {
            values[names.iter().position(|known| known == name).unwrap()] = value;
        }
        model.set_parameter_values(&values).unwrap();
    }
    // Half a metre without light, some 40 cm at the darkest pixels, a centimetre in bright light.
    let hyperbola = AmplitudeHyperbola { h1: -2e-4, h2: 0.05, h3: 4.0, amplitude_span: [0.0, 1e5] };
    model.hyperbola = by_amplitude.then_some(hyperbola);
    model
}
