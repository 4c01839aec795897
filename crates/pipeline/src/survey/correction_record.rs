//! What the correction of the ranges worked on, kept so that each pixel's change can be taken apart afterwards.

use std::sync::Arc;

use error_models::{FixedPattern, InterpolatedModel, LedgerEntry, OutsideModel, RangeTerm};
use range_image::{ImageFormat, RangeFrame, Raster};
use range_io::calibration::ValidSpan;

use crate::survey::drift::ViewDrift;
use crate::survey::span::reasons;

/// The ranges of a view as [`crate::Stage::CorrectRange`] found them, with the models that it applied.
#[derive(Debug, Clone)]
pub struct CorrectionRecord {
    channels: Vec<CorrectedChannel>,
    format: ImageFormat,
    principal_point_mm: [f64; 2],
    pattern: Option<Arc<FixedPattern>>,
    drift: Option<ViewDrift>,
    span: ValidSpan,
}

/// One frequency.
#[derive(Debug, Clone)]
struct CorrectedChannel {
    model: InterpolatedModel,
    observed: Raster<f32>,
    amplitude: Raster<f32>,
    /// Standard deviations that weigh the frequencies, before and after.
    sigma: [Raster<f32>; 2],
}

/// The change of one pixel, part by part.
#[derive(Debug, Clone, Default)]
pub struct PixelLedger {
    /// Changes of the combined range by term.
    pub entries: Vec<LedgerEntry>,
    /// What came from other weights of the frequencies, metre; zero for one frequency.
    pub weights_m: f64,
    /// What the models do not cover.
    pub outside: Vec<OutsideModel>,
    /// How it lies outside of what the calibration rests on, in words.
    pub outside_span: Vec<String>,
}

impl CorrectionRecord {
    pub(crate) fn new(
        format: ImageFormat,
        principal_point_mm: [f64; 2],
        pattern: Option<Arc<FixedPattern>>,
        drift: Option<ViewDrift>,
        span: ValidSpan,
    ) -> Self {
        Self { channels: Vec::new(), format, principal_point_mm, pattern, drift, span }
    }

    /// The drift of the warming camera that was taken off, if one was.
    pub fn drift(&self) -> Option<&ViewDrift> {
        self.drift.as_ref()
    }

    /// Adds a frequency: its frame before and after the correction.
    pub(crate) fn add(
        &mut self,
        model: &InterpolatedModel,
        observed: Raster<f32>,
        sigma: Raster<f32>,
        after: &RangeFrame,
    ) {
        self.channels.push(CorrectedChannel {
            model: model.clone(),
            observed,
            amplitude: after.amplitude.clone(),
            sigma: [sigma, after.sigma.clone()],
        });
    }

    /// The parts of the change of a pixel inside the image.
    pub fn pixel(&self, [col, row]: [usize; 2]) -> PixelLedger {
        let [x, y] = self.format.image_from_pixel([col as f64, row as f64]);
        let (x, y) = (x - self.principal_point_mm[0], y - self.principal_point_mm[1]);
        let index = row * self.format.width + col;
        let pattern = self.pattern.as_ref().and_then(|pattern| pattern.offset_m.get(index)).map(|m| f64::from(*m));
        let [before, after] = [0, 1].map(|when| self.weights(index, when));
        let mut ledger = PixelLedger::default();
        for (channel, (before, after)) in self.channels.iter().zip(before.into_iter().zip(after)) {
            let observed = f64::from(channel.observed.as_slice()[index]);
            let amplitude = f64::from(channel.amplitude.as_slice()[index]);
            if observed.is_finite() {
                ledger.weights_m += (after - before) * observed;
            }
            for entry in channel.model.ledger(observed, x, y, amplitude, pattern) {
                let weighted = LedgerEntry { change_m: after * entry.change_m, ..entry };
                match ledger.entries.iter_mut().find(|known| known.term == entry.term) {
                    Some(known) => known.change_m += weighted.change_m,
                    None => ledger.entries.push(weighted),
                }
            }
            if observed.is_finite() {
                ledger.outside.extend(channel.model.outside(observed, x, y, amplitude));
                ledger.outside_span.extend(reasons(&self.span, observed, amplitude));
            }
        }
        ledger.entries.sort_by_key(|entry| entry.term);
        ledger
    }

    /// Weights of the frequencies at a pixel before (0) or after (1): inverse variances, or equal where none is known.
    fn weights(&self, index: usize, when: usize) -> Vec<f64> {
        let raw = |channel: &CorrectedChannel| {
            let sigma = f64::from(channel.sigma[when].as_slice()[index]);
            let finite = channel.observed.as_slice()[index].is_finite();
            if finite && sigma > 0.0 && sigma.is_finite() { sigma.powi(-2) } else { 0.0 }
        };
        let mut weights: Vec<f64> = self.channels.iter().map(raw).collect();
        let mut sum: f64 = weights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            let finite = self.channels.iter().map(|channel| channel.observed.as_slice()[index].is_finite());
            weights = finite.map(|finite| f64::from(u8::from(finite))).collect();
            sum = weights.iter().sum::<f64>().max(1.0);
        }
        weights.iter().map(|weight| weight / sum).collect()
    }

    /// The change of the first frequency by term over the image, metre.
    pub(crate) fn maps(&self) -> Result<Vec<(RangeTerm, Raster<f32>)>, error_models::Error> {
        let Some(channel) = self.channels.first() else { return Ok(Vec::new()) };
        let (model, format) = (&channel.model, &self.format);
        model.ledger_maps(
            &channel.observed,
            &channel.amplitude,
            format,
            self.principal_point_mm,
            self.pattern.as_deref(),
        )
    }

    /// Number of frequencies.
    pub fn frequencies(&self) -> usize {
        self.channels.len()
    }
}
