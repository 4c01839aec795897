//! Range terms as curves, part by part, beside those of the calibration that was given.

use camera_model::{Camera, ImageFormat};
use error_models::{RangeCorrection, RangeErrorModel};
use nalgebra::DMatrix;
use range_io::calibration::Calibration;
use report::{Axes, CATEGORIES, CHART_SIZE, Canvas, Figure, span};
use self_calibration::CalibrationOutcome;
use statistics::quantile;

use crate::calibrate::point_uncertainty::{MovedCalibration, PointUncertainty};

const STEPS: usize = 160;
/// Half width of a 95 % interval in standard deviations.
const NORMAL_95: f64 = 1.959_963_984_540_054;
/// Part of the observed ranges and amplitudes beyond either end of a curve.
const BEYOND: f64 = 0.01;
/// Colours of the survey's own curve and of the one beside it.
const OWN: [u8; 3] = CATEGORIES[0];
const BESIDE: [u8; 3] = CATEGORIES[1];

/// One calibration's curves.
struct Side {
    model: RangeErrorModel,
    moved: MovedCalibration,
}

/// A place at which a correction is asked for.
#[derive(Clone, Copy)]
struct Place {
    range_m: f64,
    x_mm: f64,
    y_mm: f64,
    amplitude: f64,
}

/// A part of the range correction over one quantity.
struct Part {
    title: &'static str,
    x: &'static str,
    words: &'static str,
    /// What of a correction it is, metre.
    of: fn(&RangeCorrection) -> f64,
    /// Abscissae with their places.
    places: Vec<(f64, Place)>,
}

/// Curves of all parts that a calibration has; where another one is `beside`, its curves too, and the differences.
pub(crate) fn figures(outcome: &CalibrationOutcome, beside: Option<&Calibration>) -> Vec<(Figure, String)> {
    let Some((_, model)) = outcome.range_models.first() else { return Vec::new() };
    let own = Side::new(&outcome.camera, model, &outcome.estimated, &outcome.first_order_covariance);
    let beside = beside.and_then(Side::of_file);
    let figures = parts(outcome)
        .into_iter()
        .filter(|part| part.is_in(&own) || beside.as_ref().is_some_and(|side| part.is_in(side)));
    figures.flat_map(|part| part.figures(&own, beside.as_ref())).collect()
}

impl Side {
    fn new(camera: &Camera, model: &RangeErrorModel, names: &[String], covariance: &DMatrix<f64>) -> Self {
        let everywhere = RangeErrorModel { range_span_m: None, ..model.clone() };
        let range_models = [(None, model.clone())];
        let moved = PointUncertainty { camera, range_models: &range_models }.moved(names, covariance);
        Self { model: everywhere, moved }
    }

    /// The first range model of a file; `None` where it has none.
    fn of_file(file: &Calibration) -> Option<Self> {
        let [written] = file.range_models.as_slice() else { return None };
        let known = written.parameters.iter().filter(|parameter| parameter.sigma > 0.0);
        let names: Vec<&str> = known.map(|parameter| parameter.name.as_str()).collect();
        let (camera, model, covariance) =
            (file.camera().ok()?, written.to_model().ok()?, file.covariance(&names).ok()?);
        let names: Vec<String> = names.into_iter().map(str::to_owned).collect();
        Some(Self::new(&camera, &model, &names, &covariance))
    }

    /// A part's values and half the width of its band, millimetre; NaN where the model says nothing.
    fn curve(&self, part: &Part) -> Vec<[f64; 3]> {
        let at = |(x, place): &(f64, Place)| {
            let value = |model: &RangeErrorModel| {
                let found = model.correction(place.range_m, place.x_mm, place.y_mm, place.amplitude);
                if found.outside_span { f64::NAN } else { 1e3 * (part.of)(&found) }
            };
            [*x, value(&self.model), NORMAL_95 * self.moved.sigma_of(value)]
        };
        part.places.iter().map(at).collect()
    }
}

/// The parts over what was observed.
fn parts(outcome: &CalibrationOutcome) -> Vec<Part> {
    let observed = |of: fn(&self_calibration::ObservationQuality) -> f64| {
        let values: Vec<f64> =
            outcome.residuals.iter().map(of).filter(|value| value.is_finite() && *value > 0.0).collect();
        [BEYOND, 0.5, 1.0 - BEYOND].map(|share| quantile(&mut values.clone(), share))
    };
    let [ranges, amplitudes] = [observed(|quality| quality.range_m), observed(|quality| quality.amplitude)];
    let middle = Place { range_m: ranges[1], x_mm: 0.0, y_mm: 0.0, amplitude: amplitudes[1] };
    let along = |[low, high]: [f64; 2], place: &dyn Fn(f64) -> Place| {
        let at = |step: usize| low + (high - low) * step as f64 / STEPS as f64;
        (0..=STEPS).map(|step| (at(step), place(at(step)))).collect()
    };
    let ImageFormat { width, height, pixel_pitch_mm, .. } = outcome.camera.format;
    let half = [width as f64 * pixel_pitch_mm[0], height as f64 * pixel_pitch_mm[1]].map(|side| 0.5 * side);
    vec![
        Part {
            title: "Periodic terms",
            x: "observed range, m",
            words: "What of the correction goes with the range",
            of: |found| found.periodic_m + found.polynomial_m,
            places: along([ranges[0], ranges[2]], &|range_m| Place { range_m, ..middle }),
        },
        Part {
            title: "Offset and amplitude",
            x: "logarithm (base 10) of the amplitude",
            words: "The offset with what goes with the amplitude: what is received in bright light does not tell the two apart",
            of: |found| found.offset_m + found.amplitude_m,
            places: along([amplitudes[0].log10(), amplitudes[2].log10()], &|power| Place {
                amplitude: 10.0_f64.powf(power),
                ..middle
            }),
        },
        Part {
            title: "Delay along rows",
            x: "x in the image, mm",
            words: "What goes with the place in the image, through the principal point along a row",
            of: |found| found.delay_m,
            places: along([-half[0], half[0]], &|x_mm| Place { x_mm, ..middle }),
        },
        Part {
            title: "Delay along columns",
            x: "y in the image, mm",
            words: "The same along a column",
            of: |found| found.delay_m,
            places: along([-half[1], half[1]], &|y_mm| Place { y_mm, ..middle }),
        },
    ]
}

impl Part {
    /// Whether the calibration has it: its curve is not zero all along.
    fn is_in(&self, side: &Side) -> bool {
        side.curve(self).iter().any(|[_, value, band]| value.abs() > 0.0 || *band > 0.0)
    }

    fn figures(&self, own: &Side, beside: Option<&Side>) -> Vec<(Figure, String)> {
        let own = own.curve(self);
        let beside = beside.map(|side| side.curve(self));
        let mut figures = vec![self.curves(&own, beside.as_deref())];
        figures.extend(beside.map(|beside| self.differences(&own, &beside)));
        figures
    }

    fn curves(&self, own: &[[f64; 3]], beside: Option<&[[f64; 3]]>) -> (Figure, String) {
        let axes = Axes { title: self.title, x: self.x, y: "correction, mm" };
        let mut canvas = self.canvas(&axes, own.iter().chain(beside.into_iter().flatten()));
        if let Some(beside) = beside {
            draw(&mut canvas, beside, BESIDE, "6 4");
            canvas.name(BESIDE, "as given");
        }
        draw(&mut canvas, own, OWN, "");
        canvas.name(OWN, "from surfaces");
        let widest = own.iter().map(|[_, _, band]| *band).filter(|band| band.is_finite()).fold(0.0, f64::max);
        let words = self.words;
        (canvas.finish(), format!("{words}, with bands of 95 %; the widest is ± {widest:.2} mm."))
    }

    fn differences(&self, own: &[[f64; 3]], beside: &[[f64; 3]]) -> (Figure, String) {
        let difference: Vec<[f64; 3]> =
            own.iter().zip(beside).map(|([x, value, band], [_, given, _])| [*x, value - given, *band]).collect();
        let given: Vec<[f64; 3]> = beside.iter().map(|[x, value, band]| [*x, 0.0 * value, *band]).collect();
        let title = format!("{}: difference", self.title);
        let axes = Axes { title: &title, x: self.x, y: "less the given, mm" };
        let mut canvas = self.canvas(&axes, difference.iter().chain(&given));
        draw(&mut canvas, &given, BESIDE, "6 4");
        canvas.name(BESIDE, "as given");
        draw(&mut canvas, &difference, OWN, "");
        canvas.name(OWN, "from surfaces");
        let known = difference.iter().filter(|[_, value, _]| value.is_finite());
        let largest = known.map(|[_, value, _]| value.abs()).fold(0.0, f64::max);
        (
            canvas.finish(),
            format!(
                "The same less the curve that was given: at most {largest:.2} mm. Each band is that of its own calibration."
            ),
        )
    }

    fn canvas<'a>(&self, axes: &Axes<'_>, curves: impl Iterator<Item = &'a [f64; 3]> + Clone) -> Canvas {
        let ends = self.places.iter().map(|(x, _)| *x);
        let values = curves.flat_map(|[_, value, band]| [value - band, value + band]);
        Canvas::new(axes, CHART_SIZE, span(ends), span(values))
    }
}

fn draw(canvas: &mut Canvas, curve: &[[f64; 3]], colour: [u8; 3], dashes: &str) {
    let band: Vec<_> = curve.iter().map(|[x, value, half]| (*x, value - half, value + half)).collect();
    canvas.band(&band, colour, 0.25);
    canvas.line(&curve.iter().map(|[x, value, _]| (*x, *value)).collect::<Vec<_>>(), colour, dashes);
}
