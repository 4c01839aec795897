//! An estimation of a drift for people.

use std::fmt;

use error_models::WarmUp;
use report::{Axes, CATEGORIES, Canvas, Column, Document, Figure, millimetres, span};
use warm_up::{DriftEstimate, DriftSample};

use crate::warm_up::{Series, WarmUpParameter, WarmUpSummary};

const WIDE: [f64; 2] = [1200.0, 380.0];
const LOW: [f64; 2] = [1200.0, 240.0];
/// Dots of a figure; more would not show.
const MOST_DOTS: usize = 3000;
/// Points of a curve.
const CURVE: usize = 400;
/// Width of the moving average, as in Fig. 5 of the chapter, second.
const WINDOW_S: f64 = 60.0;
const FRAME: [u8; 3] = [196, 203, 212];
const AVERAGE: [u8; 3] = CATEGORIES[0];
const MODEL: [u8; 3] = CATEGORIES[1];
const STABLE: [u8; 3] = CATEGORIES[2];
const PHASE: [u8; 3] = CATEGORIES[3];

impl fmt::Display for WarmUpSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, None).fmt(f)
    }
}

/// All of it, with the figure of the drift.
pub(crate) fn document(summary: &WarmUpSummary, drift: Option<Figure>) -> Document {
    let [first, last] = summary.time_span_s;
    let lead = format!(
        "Drift of {} frames over {:.1} min of {}, {} pixels of them used. Power-on: {}. Change of: {}.",
        summary.frames,
        minutes(last - first),
        summary.survey,
        summary.pixels,
        summary.power_on,
        summary.change_of
    );
    let mut document = Document::new("rangecam: warm-up", lead);
    merits(&mut document, summary);
    document.list(&summary.notes);
    document.warnings(&summary.doubts);
    document.section("Change of range");
    document.figures(drift);
    let caption = "Block means less the model. A trend here is a drift that the model does not have.";
    document.figures([residual_figure(summary).caption(caption)]);
    parameter_section(&mut document, summary);
    test_section(&mut document, summary);
    rate_section(&mut document, summary);
    let calibration = summary.calibration.as_ref().map_or("", |_| "calibration.ron, ");
    document.closing(format!(
        "took {:.1} s; written to {}: {calibration}summary.json, report.html",
        summary.seconds,
        summary.out.display()
    ));
    document
}

fn merits(document: &mut Document, summary: &WarmUpSummary) {
    let after = format!("{:.1} min", minutes(summary.stable_after_s));
    document.merits([(summary.verdict.as_str(), "verdict")]);
    document.merits(if summary.stable {
        [(after, "until it is stable"), (format!("±{}", millimetres(summary.within_m)), "now, three deviations")]
    } else {
        [(after, "until it is expected to be stable"), (millimetres(summary.remaining_m), "drift at the end")]
    });
    document.merits([
        (millimetres(Some(summary.tolerance_m)), "tolerance"),
        (format!("{:.2}", summary.sigma0), "sigma0"),
        (summary.redundancy.to_string(), "redundancy"),
        (format!("{:.2}", summary.autocorrelation), "correlation of neighbouring blocks"),
        (format!("{:.1} %", 100.0 * summary.moved_share), "of the pixels wander"),
    ]);
}

fn minutes(time_s: f64) -> f64 {
    time_s / 60.0
}

/// Frames, their means and the model over time.
pub(crate) fn drift_figure(summary: &WarmUpSummary, series: &Series, estimate: &DriftEstimate) -> Figure {
    let millimetres = |sample: &DriftSample| 1e3 * (sample.mean_change_m - estimate.warm_change_m);
    let average = moving_average(&series.samples, WINDOW_S);
    let average: Vec<(f64, f64)> =
        average.iter().map(|(time_s, mean_m)| (minutes(*time_s), 1e3 * (mean_m - estimate.warm_change_m))).collect();
    let model = model_curve(estimate);
    let half = 1e3 * summary.within_m.unwrap_or(summary.tolerance_m);
    // Single frames may scatter far more than the camera drifts: they do not rule the axis.
    let values = average.iter().map(|point| point.1).chain(model.iter().flat_map(|point| [point.1, point.2]));
    let y = span(values.chain([1.6 * half, -1.6 * half]));
    let x = span(summary.time_span_s.into_iter().map(minutes));
    let axes = Axes { title: "Drift", x: "time since power-on, min", y: "change of range, mm" };
    let mut canvas = Canvas::new(&axes, WIDE, x, y);
    for phase in summary.phases.iter().skip(1) {
        let at = minutes(phase.since_s);
        canvas.line(&[(at, y[0]), (at, y[1])], PHASE, "");
    }
    if summary.stable {
        let from = minutes(summary.stable_after_s);
        canvas.band(&[(from, -half, half), (minutes(summary.time_span_s[1]), -half, half)], STABLE, 0.16);
        canvas.line(&[(from, y[0]), (from, y[1])], STABLE, "6 4");
    }
    let step = series.samples.len().div_ceil(MOST_DOTS).max(1);
    let dots: Vec<(f64, f64)> =
        series.samples.iter().step_by(step).map(|sample| (minutes(sample.time_s), millimetres(sample))).collect();
    canvas.points(&dots, FRAME, 0.8);
    canvas.line(&average, AVERAGE, "");
    canvas.band(&model, MODEL, 0.25);
    let middle: Vec<(f64, f64)> = model.iter().map(|(x, low, high)| (*x, f64::midpoint(*low, *high))).collect();
    canvas.line(&middle, MODEL, "");
    canvas.name(FRAME, if step > 1 { "some of the frames" } else { "frames" });
    canvas.name(AVERAGE, "moving average over 60 s");
    canvas.name(MODEL, "model");
    if summary.stable {
        canvas.name(STABLE, &format!("stable after {:.1} min", minutes(summary.stable_after_s)));
    }
    if summary.phases.len() > 1 {
        let rates: Vec<String> = summary.phases.iter().map(|phase| format!("{:.2}", phase.rate_hz)).collect();
        canvas.name(PHASE, &format!("frame rate {} Hz", rates.join(", ")));
    }
    let [width, height] = series.size;
    let bars = if summary.phases.len() > 1 { " Bars: changes of the frame rate." } else { "" };
    canvas.finish().caption(format!(
        "Against the warm camera. Grey: single frames of {width} x {height} pixels (what lies beyond the axis is not shown); the \
         model with three of its deviations; green: from the time of stability on, what the ranges stay within.{bars}"
    ))
}

/// Time in minutes, and the model less and plus three deviations, millimetre. Where it follows the temperature, it is
/// drawn at the blocks.
fn model_curve(estimate: &DriftEstimate) -> Vec<(f64, f64, f64)> {
    let at = |time_s: f64, temperature_c: Option<f64>| {
        let (time_s, model) = (Some(time_s), &estimate.model);
        let rates = Some(&estimate.rates);
        let value = model.value_at_rates(time_s, temperature_c, rates).unwrap_or(f64::NAN);
        // The warm camera's mean, which the figure refers to, is part of what is known.
        let row = model.jacobian_at_rates(time_s, temperature_c, rates);
        let sigma = row.and_then(|row| WarmUp::sigma_of(row, &estimate.covariance)).unwrap_or(f64::NAN);
        let reach = 3.0 * sigma;
        (minutes(time_s.unwrap_or(f64::NAN)), 1e3 * (value - reach), 1e3 * (value + reach))
    };
    if estimate.model.temperature.is_some() {
        return estimate.blocks.iter().map(|block| at(block.time_s, block.temperature_c)).collect();
    }
    let [first, last] = estimate.model.time_span_s.unwrap_or([0.0; 2]);
    let share = |step: usize| step as f64 / CURVE as f64;
    // Transients are steep at the begin, and so is what follows a change of the frame rate: denser steps there.
    let changes = estimate.rates.phases().iter().map(|phase| phase.since_s);
    let inside = changes.filter(|since_s| estimate.model.frame_rate.is_some() && *since_s > first && *since_s < last);
    let begins: Vec<f64> = std::iter::once(first).chain(inside).collect();
    let ends = begins[1..].iter().copied().chain([last]);
    let dense = |(from, to): (f64, f64)| (0..=CURVE).map(move |step| from + (to - from) * share(step).powi(2));
    begins.iter().copied().zip(ends).flat_map(dense).map(|time_s| at(time_s, None)).collect()
}

fn residual_figure(summary: &WarmUpSummary) -> Figure {
    let residuals: Vec<(f64, f64)> =
        summary.blocks.iter().map(|block| (minutes(block.time_s), 1e3 * block.residual_m)).collect();
    let x = span(summary.time_span_s.into_iter().map(minutes));
    let y = span(residuals.iter().map(|point| point.1).chain([0.0]));
    let axes = Axes { title: "Residuals", x: "time since power-on, min", y: "residual, mm" };
    let mut canvas = Canvas::new(&axes, LOW, x, y);
    canvas.line(&[(x[0], 0.0), (x[1], 0.0)], MODEL, "");
    canvas.points(&residuals, AVERAGE, 1.0);
    canvas.name(AVERAGE, "block means");
    canvas.finish()
}

/// Means of the samples within half a window of a time, at up to a thousand times; (second, metre).
fn moving_average(samples: &[DriftSample], window_s: f64) -> Vec<(f64, f64)> {
    let step = samples.len().div_ceil(1000).max(1);
    let (mut low, mut high, mut sum) = (0, 0, 0.0);
    let mut means = Vec::new();
    // Values near zero, so that a running sum keeps its digits.
    let first_m = samples.first().map_or(0.0, |first| first.mean_change_m);
    for sample in samples.iter().step_by(step) {
        while high < samples.len() && samples[high].time_s <= sample.time_s + 0.5 * window_s {
            sum += samples[high].mean_change_m - first_m;
            high += 1;
        }
        while samples[low].time_s < sample.time_s - 0.5 * window_s {
            sum -= samples[low].mean_change_m - first_m;
            low += 1;
        }
        means.push((sample.time_s, first_m + sum / (high - low) as f64));
    }
    means
}

/// Value and deviation in the unit of a table for people.
fn readable(parameter: &WarmUpParameter) -> [String; 3] {
    let (factor, unit) = match parameter.unit {
        "m" => (1e3, "mm"),
        "m/K" => (1e3, "mm/K"),
        "m/Hz" => (1e3, "mm/Hz"),
        unit => (1.0, unit),
    };
    let decimals = if parameter.unit == "s" { 1 } else { 4 };
    let number = |value: f64| format!("{:.decimals$}", factor * value);
    [number(parameter.value), number(parameter.sigma), unit.to_owned()]
}

fn parameter_section(document: &mut Document, summary: &WarmUpSummary) {
    if summary.parameters.is_empty() {
        return;
    }
    document.section("The model");
    document.explanation(
        "Sum of A exp(-t / tau), t the time since power-on, of cT (T - T0), and of cF (f - f0), which the camera follows \
         with the time constant tauF; it is subtracted from every range. \
         Deviations allow for the correlation of neighbouring blocks and are scaled by sigma0.",
    );
    let mut columns =
        vec![Column::words("parameter"), Column::number("value"), Column::number("sigma"), Column::words("unit")];
    columns.extend(summary.parameters.iter().map(|parameter| Column::number(&parameter.name)));
    let row = |(parameter, correlations): (&WarmUpParameter, &Vec<f64>)| {
        let cells = std::iter::once(parameter.name.clone()).chain(readable(parameter));
        cells.chain(correlations.iter().map(|value| format!("{value:.2}"))).collect()
    };
    document.table(columns, summary.parameters.iter().zip(&summary.correlation).map(row).collect());
    document.paragraph("The columns behind the unit are correlations.");
    if let Some(reference_c) = summary.reference_temperature_c {
        document.paragraph(format!("T0 = {reference_c:.2} °C, the mean of the last tenth of the capture."));
    }
    if let Some(reference_hz) = summary.reference_rate_hz {
        document.paragraph(format!(
            "f0 = {reference_hz:.3} Hz, the frame rate of the first phase, which counts from power-on on."
        ));
    }
}

/// A time in seconds; a dash where there is none.
fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or_else(|| "-".to_owned(), |time_s| format!("{time_s:.0}"))
}

fn test_section(document: &mut Document, summary: &WarmUpSummary) {
    document.section("How many exponentials");
    document.explanation(
        "Probability that noise alone makes an exponential as good as the best one found, whatever its time constant. \
         Small: it is there.",
    );
    let rows = summary.tests.iter().map(|test| {
        vec![
            test.beside.to_string(),
            seconds(test.time_constant_s),
            format!("{:.2e}", test.p_value),
            if test.taken { "yes" } else { "no" }.to_owned(),
        ]
    });
    let columns = [
        Column::number("one more than"),
        Column::number("best time constant").unit("s"),
        Column::number("p"),
        Column::words("taken"),
    ];
    document.table(columns, rows.collect());
}

fn rate_section(document: &mut Document, summary: &WarmUpSummary) {
    let Some(test) = &summary.rate_test else { return };
    document.section("Whether it follows the frame rate");
    let rows = summary.phases.iter().map(|phase| {
        vec![format!("{:.1}", minutes(phase.since_s)), format!("{:.3}", phase.rate_hz), phase.frames.to_string()]
    });
    let columns =
        [Column::number("from").unit("min"), Column::number("frame rate").unit("Hz"), Column::number("frames")];
    document.table(columns, rows.collect());
    let follows = if test.taken { "follows" } else { "does not follow" };
    document.paragraph(format!(
        "As tested, the drift {follows} the frame rate: p = {:.2e}, the probability that noise makes a response to these rates \
         as good as the best one found (time constant {} s), beside any transients.",
        test.p_value,
        seconds(test.time_constant_s)
    ));
}
