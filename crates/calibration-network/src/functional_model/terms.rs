//! The calibration parameters as lists of named values: one row of a table for each family of terms.

use std::borrow::Cow;

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::{AmplitudeHyperbola, RangeErrorModel, parameter_unit};

/// Names of the interior orientation, which comes before the lens in the camera's block.
pub(crate) const INTERIOR: [&str; 3] = ["xp", "yp", "c"];

/// Names of the sines of Eq. 14, which a spline replaces.
pub const SINES: [&str; 6] = ["d2", "d3", "d4", "d5", "d6", "d7"];

/// Names of the camera's block.
pub fn camera_names() -> Vec<&'static str> {
    INTERIOR.into_iter().chain(LensDistortion::NAMES).collect()
}

/// How many values the camera's block has.
pub(crate) const CAMERA_VALUES: usize = INTERIOR.len() + LensDistortion::NAMES.len();

/// Values of the camera's block.
pub fn camera_values(camera: &Camera) -> Vec<f64> {
    let [xp, yp] = camera.interior.principal_point_mm;
    [xp, yp, camera.interior.principal_distance_mm].into_iter().chain(camera.lens.coefficients()).collect()
}

/// The camera with the values of its block; `None` where their number is wrong.
pub(crate) fn camera_from(camera: &Camera, values: &[f64]) -> Option<Camera> {
    let (&[xp, yp, c], coefficients) = values.split_first_chunk::<3>()?;
    let interior = InteriorOrientation { principal_point_mm: [xp, yp], principal_distance_mm: c };
    let lens = LensDistortion::from_coefficients(coefficients.try_into().ok()?);
    Some(Camera { interior, lens, ..*camera })
}

/// What a range correction is a function of: observed values, the image point in millimetre from the principal point.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Range, metre.
    pub range_m: f64,
    /// Image point from the principal point, millimetre.
    pub x_mm: f64,
    /// The same upwards.
    pub y_mm: f64,
    /// Amplitude, in the unit of the camera's samples; NaN where there is none.
    pub amplitude: f64,
    /// A known drift that the range has in it beside the correction, metre.
    pub drift_m: f64,
}

/// Value of a family of range terms and its derivatives with respect to range and image point.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RangePart {
    pub(crate) value: f64,
    pub(crate) by_range: f64,
    pub(crate) by_x: f64,
    pub(crate) by_y: f64,
}

/// A family of range terms.
pub(crate) struct RangeFamily {
    /// Names in the order of the values; empty where the model has none of them.
    pub(crate) names: fn(&RangeErrorModel) -> Vec<Cow<'static, str>>,
    /// Values in a model.
    pub(crate) read: fn(&RangeErrorModel, &mut Vec<f64>),
    /// Puts values back.
    pub(crate) write: fn(&mut RangeErrorModel, &[f64]),
    /// The correction and its derivatives with respect to the values; fails with a reason where it has no value.
    pub(crate) evaluate: Evaluate,
}

/// A correction as a function of model, observed values, terms; the last argument takes the derivatives.
type Evaluate = fn(&RangeErrorModel, &Seen, &[f64], &mut [f64]) -> Result<RangePart, &'static str>;

/// All families. A further term is a further row.
pub(crate) const RANGE_FAMILIES: [RangeFamily; 2] = [
    // Eq. 14 and the further terms that stand instead of or beside parts of it: all linear.
    RangeFamily {
        names: |model| model.parameter_names().into_iter().map(Cow::Owned).collect(),
        read: |model, out| out.extend(model.parameter_values()),
        write: |model, values| {
            // Values come in the number of the names, and finite: nothing is refused.
            let _ = model.set_parameter_values(values);
        },
        evaluate: |model, seen, values, row| {
            let known = model.design_row_into(seen.range_m, seen.x_mm, seen.y_mm, row);
            known.map_err(|_| "range terms of the wrong number")?;
            let value = row.iter().zip(values).map(|(a, x)| a * x).sum();
            Ok(RangePart { value, ..linear_slopes(model, seen, values, row) })
        },
    },
    // Eq. 15.
    RangeFamily {
        names: |model| {
            let names = model.hyperbola.map_or(&[][..], |_| &AmplitudeHyperbola::NAMES);
            names.iter().copied().map(Cow::Borrowed).collect()
        },
        read: |model, out| out.extend(model.hyperbola.iter().flat_map(|h| [h.h1, h.h2, h.h3])),
        write: |model, values| {
            if let (Some(hyperbola), &[h1, h2, h3]) = (model.hyperbola.as_mut(), values) {
                *hyperbola = AmplitudeHyperbola { h1, h2, h3, ..*hyperbola };
            }
        },
        evaluate: |model, seen, values, row| {
            let (Some(hyperbola), &[h1, h2, h3]) = (model.hyperbola, values) else {
                return Ok(RangePart::default());
            };
            let hyperbola = AmplitudeHyperbola { h1, h2, h3, ..hyperbola };
            let value = hyperbola.correction(seen.amplitude);
            let value = value.ok_or("the amplitude hyperbola has no value at this amplitude")?;
            let jacobian =
                hyperbola.jacobian(seen.amplitude).ok_or("the slope of the amplitude hyperbola is infinite")?;
            row.copy_from_slice(&jacobian.coefficients);
            Ok(RangePart { value, ..RangePart::default() })
        },
    },
];

/// Derivatives of the linear terms with respect to range and image point; `row` has sines and cosines of Eq. 14.
fn linear_slopes(model: &RangeErrorModel, seen: &Seen, values: &[f64], row: &[f64]) -> RangePart {
    if let (true, &[_, d2, d3, d4, d5, d6, d7, by_x, by_y], &[_, s1, c1, s2, c2, s4, c4, ..]) =
        (model.further.is_empty(), values, row)
    {
        let first = d2 * c1 - d3 * s1;
        let further = 2.0 * (d4 * c2 - d5 * s2) + 4.0 * (d6 * c4 - d7 * s4);
        let by_range = std::f64::consts::TAU / model.ambiguity_interval_m * (first + further);
        return RangePart { by_range, by_x, by_y, ..RangePart::default() };
    }
    let mut own = RangeErrorModel { hyperbola: None, ..model.clone() };
    // A number of values that does not fit was refused with the design row.
    let _ = own.set_parameter_values(values);
    let by_range = own.correction(seen.range_m, seen.x_mm, seen.y_mm, f64::NAN).range_derivative;
    let gradient = own.further.surface.as_ref().map(|surface| surface.gradient(seen.x_mm, seen.y_mm));
    let [by_x, by_y] = gradient.unwrap_or([own.terms.e1, own.terms.e2]);
    RangePart { by_range, by_x, by_y, ..RangePart::default() }
}

/// Names of a range set's block.
pub fn range_names(model: &RangeErrorModel) -> Vec<String> {
    RANGE_FAMILIES.iter().flat_map(|family| (family.names)(model)).map(Cow::into_owned).collect()
}

/// Values of a range set's block.
pub(crate) fn range_values(model: &RangeErrorModel) -> Vec<f64> {
    let mut out = Vec::new();
    for family in &RANGE_FAMILIES {
        (family.read)(model, &mut out);
    }
    out
}

/// The model with the values of its block.
pub fn range_model_from(model: &RangeErrorModel, values: &[f64]) -> RangeErrorModel {
    let mut out = model.clone();
    let mut start = 0;
    for family in &RANGE_FAMILIES {
        let end = (start + (family.names)(model).len()).min(values.len());
        (family.write)(&mut out, &values[start..end]);
        start = end;
    }
    out
}

/// Slopes of the correction beyond which an observed range hardly grows with the true one any more.
const STEEPEST: f64 = 0.9;

/// Share of the range below which the step after a step of Newton's method is below rounding.
const SMALL_STEP: f64 = 1e-9;

/// The range that a camera would observe of a distance without noise, the solution of `ρ − Δρ(ρ) = distance`, and its
/// derivatives: with respect to the distance, the image point, and (in `row`) the terms.
///
/// The correction is a function of the observed range. Taken at the *measured* range it would carry its noise, and
/// periodic terms could make the noise smaller by their slope: least squares would take that for a better fit. (With the
/// wave of length U, which hardly anything else holds, d0 then comes out ten deviations wrong.) At the modelled range
/// there is no noise to be made smaller.
pub fn modelled_range(
    model: &RangeErrorModel,
    widths: &[usize],
    measured: &Seen,
    values: &[f64],
    distance: f64,
    row: &mut [f64],
) -> Result<ModelledRange, &'static str> {
    let mut seen = *measured;
    // Newton's method: what a step leaves is its square times half the curvature of the correction, which is a few units
    // per metre at the most, so that after a small one the last digit is right.
    for _ in 0..50 {
        let part = range_correction(model, widths, &seen, values, row)?;
        let slope = part.by_range;
        if slope.is_nan() || slope.abs() > STEEPEST {
            return Err("the range terms are so large that the observed range no longer grows with the true one");
        }
        let growth = 1.0 / (1.0 - slope);
        let step = (distance + seen.drift_m + part.value - seen.range_m) * growth;
        seen.range_m += step;
        if step.abs() <= SMALL_STEP * (1.0 + seen.range_m.abs()) {
            for derivative in row {
                *derivative *= growth;
            }
            let (by_x, by_y) = (part.by_x * growth, part.by_y * growth);
            return Ok(ModelledRange { range_m: seen.range_m, by_distance: growth, by_x, by_y });
        }
    }
    Err("the modelled range does not settle")
}

/// A modelled range with its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct ModelledRange {
    /// Range that would be observed, metre.
    pub range_m: f64,
    /// Its derivative by the distance.
    pub by_distance: f64,
    /// By the image point, metre a millimetre.
    pub by_x: f64,
    /// The same upwards.
    pub by_y: f64,
}

/// Correction of a whole set and its derivatives with respect to its values.
fn range_correction(
    model: &RangeErrorModel,
    widths: &[usize],
    seen: &Seen,
    values: &[f64],
    row: &mut [f64],
) -> Result<RangePart, &'static str> {
    let mut sum = RangePart::default();
    let mut start = 0;
    for (family, width) in RANGE_FAMILIES.iter().zip(widths) {
        let part = start..start + width;
        if part.is_empty() {
            continue;
        }
        if part.end > values.len() || part.end > row.len() {
            return Err("a range set of the wrong length");
        }
        let one = (family.evaluate)(model, seen, &values[part.clone()], &mut row[part.clone()])?;
        sum.value += one.value;
        sum.by_range += one.by_range;
        sum.by_x += one.by_x;
        sum.by_y += one.by_y;
        start = part.end;
    }
    Ok(sum)
}

/// Number of values of each family.
pub fn family_widths(model: &RangeErrorModel) -> Vec<usize> {
    RANGE_FAMILIES.iter().map(|family| (family.names)(model).len()).collect()
}

/// Unit of a parameter by its canonical name.
pub(crate) fn unit(name: &str) -> &'static str {
    match name {
        "xp" | "yp" | "c" => "mm",
        "k1" => "1/mm^2",
        "k2" => "1/mm^4",
        "k3" => "1/mm^6",
        "p1" | "p2" => "1/mm",
        "b1" | "b2" => "1",
        _ => parameter_unit(name).unwrap_or_default(),
    }
}
