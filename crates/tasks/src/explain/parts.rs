//! A stage's change of one pixel, taken apart.

use error_models::{LedgerEntry, RangeTerm};

use crate::explain::{StagePart, WHOLE_INTERVALS};
use commands::plan::Stage;
use pipeline::survey::wrap;
use pipeline::{View, ViewDrift};

/// The parts of a change, which add up to it; none where nothing changed.
pub(super) fn parts(stage: &Stage, before: &View, after: &View, pixel: [usize; 2], change_m: f64) -> Vec<StagePart> {
    let one = |what: String, group: &'static str| with_wraps(StagePart { what, group, change_m }, before);
    let all = match stage {
        Stage::Average(_) => one(format!("mean of {} frames", after.frames.len()), "averaging"),
        Stage::Deconvolve(_) => one("scattered light taken off".to_owned(), "scattering"),
        Stage::Unwrap(_) => unwrapped(before, after, pixel, change_m),
        Stage::RepairWraps(_) => {
            let what = "whole ambiguity intervals added".to_owned();
            vec![StagePart { what, group: WHOLE_INTERVALS, change_m }]
        }
        Stage::CorrectRange(_) => return corrected(after, pixel),
        Stage::Multipath(_) => one("range of the direct path".to_owned(), "multipath"),
        Stage::FuseExposures(_) => one("weighted mean of the exposures that agree".to_owned(), "fusion"),
        Stage::PointCloud(_) => one("width of the pixel on its surface".to_owned(), "pixel width"),
        Stage::Demodulate(_) | Stage::CorrectImagePoint(_) | Stage::Flag(_) | Stage::Register(_) | Stage::Adjust(_) => {
            one("changed".to_owned(), "others")
        }
    };
    all.into_iter().filter(|part| part.change_m != 0.0).collect()
}

/// As long as ranges are wrapped, a change over the end of the interval is a small one and a whole interval.
fn with_wraps(part: StagePart, before: &View) -> Vec<StagePart> {
    let Some(modulation) = before.wrapped_to() else { return vec![part] };
    let change_m = wrap(part.change_m, modulation);
    let what = "over the end of the ambiguity interval".to_owned();
    let whole = StagePart { what, group: WHOLE_INTERVALS, change_m: part.change_m - change_m };
    vec![StagePart { change_m, ..part }, whole]
}

/// Whole intervals of the first frequency, and what the others add to the mean.
fn unwrapped(before: &View, after: &View, [col, row]: [usize; 2], change_m: f64) -> Vec<StagePart> {
    let Some(interval_m) = before.wrapped_to().map(|modulation| modulation.ambiguity_interval_m()) else {
        return Vec::new();
    };
    let first = after.channels.first().map(|channel| f64::from(channel.range[(col, row)]));
    let wrapped = before.snapshot().map_or(f64::NAN, |snapshot| f64::from(snapshot.range[(col, row)]));
    let intervals = ((first.map_or(change_m, |range| range - wrapped)) / interval_m).round();
    let whole = intervals * interval_m;
    let count = format!(
        "{intervals} whole {} of {interval_m:.3} m",
        if (intervals - 1.0).abs() < 0.5 { "interval" } else { "intervals" }
    );
    let mut parts = vec![StagePart { what: count, group: WHOLE_INTERVALS, change_m: whole }];
    if after.channels.is_empty() {
        // What is left is the rounding of the sum in single precision.
        parts[0].change_m = if intervals == 0.0 { 0.0 } else { change_m };
    } else {
        let what = format!("weighted mean of {} frequencies", after.channels.len());
        parts.push(StagePart { what, group: "frequencies", change_m: change_m - whole });
    }
    parts
}

/// How well a drift is known, and what of its correction follows the frame rate.
fn drift_words(drift: &ViewDrift) -> String {
    let sigma = format!("sigma {:.2} mm", 1e3 * drift.sigma_m);
    match drift.frame_rate {
        None => sigma,
        Some(part) => {
            format!("{sigma}; {:+.2} mm of it by the frame rate of {:.2} Hz", -1e3 * part.part_m, part.rate_hz)
        }
    }
}

/// Range terms one by one.
fn corrected(after: &View, pixel: [usize; 2]) -> Vec<StagePart> {
    let Some(record) = &after.correction else { return Vec::new() };
    let ledger = record.pixel(pixel);
    let entry = |entry: &LedgerEntry| StagePart {
        what: match record.drift().filter(|_| entry.term == RangeTerm::WarmUp) {
            Some(drift) => format!("{} ({})", entry.term.words(), drift_words(drift)),
            None => entry.term.words().to_owned(),
        },
        group: entry.term.group(),
        change_m: entry.change_m,
    };
    let mut parts: Vec<StagePart> = ledger.entries.iter().map(entry).collect();
    if record.frequencies() > 1 {
        let what = "other weights of the frequencies".to_owned();
        parts.push(StagePart { what, group: "frequencies", change_m: ledger.weights_m });
    }
    parts
}
