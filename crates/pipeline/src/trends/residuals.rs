//! The residuals of a run: against the truth where the survey was simulated, and else of the planes that frames show.

use std::collections::BTreeMap;
use std::sync::Arc;

use camera_model::Camera;
use primitives::{FittedPixel, PrimitiveKind, PrimitiveOptions, fit_primitive};
use range_calibration::DifferenceOptions;
use range_image::{Flags, RangeFrame};
use range_io::survey::Survey;
use rayon::prelude::*;
use residual_tests::{TrendOptions, TrendSample, test_trends};
use statistics::retain_within;

use crate::survey::open::OpenSurvey;
use crate::survey::truth::range_errors;
use crate::survey::view::{View, ViewData};
use commands::Tape;

use crate::trends::{RemainingErrors, TrendSummary, sentence};

/// Pixels of all frames together that are looked at, about: more would tell smaller trends than anybody minds.
const MOST_PIXELS: usize = 20_000;

/// Errors beyond so many robust standard deviations are gross: wrong intervals, edges without a flag. They say nothing
/// of the terms of a correction.
const GROSS: f64 = 6.0;

/// Largest root mean square of a plane's residuals, in parts of its range. What the chapter's errors leave on a wall,
/// even uncorrected, is below; a corner that passes for a plane is above 5 %.
const FLATNESS: f64 = 0.03;

/// Weight of ranges whose standard deviation nobody states, metre: all the same.
const UNKNOWN_SIGMA_M: f64 = 0.01;

/// Residuals of some pixels of the views so far.
pub(crate) struct Residuals {
    survey: Arc<Survey>,
    camera: Camera,
    /// Every so many columns and rows.
    step: usize,
    views: Vec<OfView>,
}

#[derive(Default)]
struct OfView {
    station: String,
    /// Whether the truth is known, whether it came to ranges, and what they show.
    has_truth: bool,
    has_ranges: bool,
    samples: Vec<TrendSample>,
}

impl Residuals {
    /// For so many views, whose rays a camera gives.
    pub(crate) fn new(survey: &OpenSurvey, camera: &Camera, views: usize) -> Self {
        let pixels = views * camera.format.width * camera.format.height;
        let step = ((pixels as f64 / MOST_PIXELS as f64).sqrt().ceil() as usize).max(1);
        Self { survey: Arc::clone(&survey.survey), camera: *camera, step, views: Vec::new() }
    }

    /// Adds what the last stage leaves of a view.
    pub(crate) fn add(&mut self, view: &View) {
        let has_truth = view.truth.is_some();
        self.views.push(OfView {
            station: view.station.clone(),
            has_truth,
            has_ranges: range_frame(view).is_some(),
            samples: if has_truth { self.against_truth(view) } else { self.planes(view) },
        });
    }

    /// Writes it, or adds another part of the views.
    pub(crate) fn carry(&mut self, tape: &mut Tape) {
        tape.list(&mut self.views, OfView::default, |tape, view| {
            tape.text(&mut view.station);
            for flag in [&mut view.has_truth, &mut view.has_ranges] {
                tape.flag(flag);
            }
            tape.list(&mut view.samples, TrendSample::default, |tape, sample| {
                let TrendSample { residual_m, sigma_m, range_m, amplitude, column, row, time_s, .. } = sample;
                let numbers = [residual_m, sigma_m, range_m, amplitude, column, row, time_s];
                for number in numbers {
                    tape.number(number);
                }
            });
        });
    }

    /// Tests all of it.
    pub(crate) fn remaining(&self) -> RemainingErrors {
        if !self.views.iter().any(|view| view.has_ranges) {
            return none(
                "The frames were not brought to ranges: there are no residuals to test for trends.".to_owned(),
            );
        }
        // What one kind of residuals shows is not mixed with the other.
        let of_truth = self.views.iter().any(|view| view.has_truth);
        let of_kind = |(view, _): &(&OfView, usize)| view.has_truth == of_truth;
        let views = || self.views.iter().zip(shares(&self.views)).filter(of_kind);
        let shared = |(view, frame): (&OfView, usize)| {
            view.samples.iter().map(move |sample| TrendSample { frame, ..*sample }).collect::<Vec<_>>()
        };
        let samples: Vec<TrendSample> = views().flat_map(shared).collect();
        let (shown, all) = (views().filter(|(view, _)| !view.samples.is_empty()).count(), self.views.len());
        if of_truth {
            return tested("truth", "Measured minus true ranges of unflagged pixels.".to_owned(), samples);
        }
        if shown == 0 {
            return none(
                "The truth is not known and no frame, nor a quarter of one, shows a flat surface on most of its pixels: \
                 there are no residuals to test for trends."
                    .to_owned(),
            );
        }
        let words = format!(
            "The truth is not known: residuals of planes, fitted to {shown} of {all} frames or to quarters of them. What a \
             plane takes up (an offset, a tilt, a drift of whole frames) does not show, and unevenness of a wall counts."
        );
        tested("planes", words, samples)
    }

    /// Mean time of the frames of a view; NaN where the survey does not state all.
    fn time_of(&self, view: &View) -> f64 {
        let time = |frame: &usize| self.survey.frames.get(*frame).and_then(|entry| entry.timestamp_s);
        let times: Option<Vec<f64>> = view.frames.iter().map(time).collect();
        times.map_or(f64::NAN, |times| times.iter().sum::<f64>() / times.len() as f64)
    }

    /// Errors are set against the true range: the observed one has their noise in it, and would show a trend by itself.
    fn against_truth(&self, view: &View) -> Vec<TrendSample> {
        let Some(frame) = range_frame(view) else { return Vec::new() };
        let Some(errors) = range_errors(view, &frame.range) else { return Vec::new() };
        let time_s = self.time_of(view);
        let sample = |[col, row]: [usize; 2]| {
            let residual_m = errors[row * frame.width() + col];
            let sigma_m = f64::from(frame.sigma[(col, row)]);
            let known = sigma_m > 0.0 && sigma_m.is_finite();
            let usable = frame.flags[(col, row)].is_empty() && residual_m.is_finite();
            usable.then(|| TrendSample {
                residual_m,
                sigma_m: if known { sigma_m } else { UNKNOWN_SIGMA_M },
                range_m: f64::from(frame.range[(col, row)]) - residual_m,
                amplitude: f64::from(frame.amplitude[(col, row)]),
                column: col as f64,
                row: row as f64,
                time_s,
                frame: 0,
            })
        };
        let columns = || (0..frame.width()).step_by(self.step);
        let positions = (0..frame.height()).step_by(self.step).flat_map(|row| columns().map(move |col| [col, row]));
        positions.filter_map(sample).collect()
    }

    /// Residuals of the plane that a frame shows, or of those that its quarters show.
    fn planes(&self, view: &View) -> Vec<TrendSample> {
        let Some(frame) = range_frame(view) else { return Vec::new() };
        let [right, below] = [frame.width() - 1, frame.height() - 1];
        let plane = |window| plane(frame, &self.camera, window, self.step);
        let pixels = plane([[0, right], [0, below]]).unwrap_or_else(|| {
            let halves = |last: usize| [[0, last / 2], [last / 2 + 1, last]];
            let quarters = halves(below).map(|rows| halves(right).map(|columns| [columns, rows]));
            let quarters: Vec<_> = quarters.into_iter().flatten().collect();
            quarters.into_par_iter().filter_map(plane).flatten().collect()
        });
        let time_s = self.time_of(view);
        let sample = |pixel: FittedPixel| TrendSample {
            residual_m: pixel.observed_m - pixel.modelled_m,
            sigma_m: pixel.sigma_m,
            range_m: pixel.modelled_m,
            amplitude: f64::from(frame.amplitude[(pixel.position[0], pixel.position[1])]),
            column: pixel.position[0] as f64,
            row: pixel.position[1] as f64,
            time_s,
            frame: 0,
        };
        pixels.into_iter().map(sample).collect()
    }
}

/// For each view what it may share errors with: views of its station, which see the same scene, and where there is one
/// station itself alone.
fn shares(views: &[OfView]) -> Vec<usize> {
    let several = views.iter().any(|view| view.station != views[0].station);
    let mut first: BTreeMap<&str, usize> = BTreeMap::new();
    let mut shares = Vec::with_capacity(views.len());
    for (index, view) in views.iter().enumerate() {
        let first = *first.entry(&view.station).or_insert(index);
        shares.push(if several { first } else { index });
    }
    shares
}

fn none(basis_words: String) -> RemainingErrors {
    RemainingErrors { basis: "none", basis_words, ..RemainingErrors::default() }
}

fn tested(basis: &'static str, basis_words: String, mut samples: Vec<TrendSample>) -> RemainingErrors {
    let all = samples.len();
    retain_within(&mut samples, GROSS, |sample| sample.residual_m / sample.sigma_m);
    let (pixels, gross_errors) = (samples.len(), all - samples.len());
    // Too few samples for any bins is the only thing that may be refused of these.
    let report = test_trends(&samples, &TrendOptions::default());
    let variables: Vec<TrendSummary> =
        report.map_or_else(|_| Vec::new(), |report| report.tests.iter().map(TrendSummary::new).collect());
    let untested = || {
        if variables.is_empty() {
            format!("{pixels} residuals are too few to test for trends")
        } else {
            "pixels of a frame share errors, and there are too few frames to tell what they depend on".to_owned()
        }
    };
    let verdict = sentence(&variables).unwrap_or_else(untested);
    RemainingErrors { basis, basis_words, verdict, pixels, gross_errors, variables }
}

fn range_frame(view: &View) -> Option<&RangeFrame> {
    match &view.data {
        ViewData::Range(frame) => Some(frame),
        _ => None,
    }
}

/// The pixels of a window that lie in one plane; `None` where most do not.
fn plane(frame: &RangeFrame, camera: &Camera, window: [[usize; 2]; 2], step: usize) -> Option<Vec<FittedPixel>> {
    let standard = PrimitiveOptions::default();
    let pixels = DifferenceOptions {
        exclude: Flags::all(),
        step,
        window: Some(window),
        unknown_sigma_m: UNKNOWN_SIGMA_M,
        ..standard.pixels
    };
    // What neighbours share is what is looked for, and not a reason to refuse the wall.
    let options = PrimitiveOptions { pixels, largest_systematic_sigmas: f64::MAX, ..standard };
    let fit = fit_primitive(frame, camera, PrimitiveKind::Plane, &options).ok()?;
    let used: Vec<FittedPixel> = fit.pixels.into_iter().filter(|pixel| pixel.used).collect();
    let mean_square = |of: fn(&FittedPixel) -> f64| used.iter().map(|pixel| of(pixel).powi(2)).sum::<f64>();
    let rms = (mean_square(|pixel| pixel.observed_m - pixel.modelled_m) / mean_square(|pixel| pixel.modelled_m)).sqrt();
    (rms < FLATNESS).then_some(used)
}
