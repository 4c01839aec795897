//! Figures of a stream as its frames pass.

use std::collections::BTreeMap;
use std::time::Instant;

use live_frames::{Error, ProcessedFrame};
use range_image::Flags;
use serde::Serialize;

use super::drift::DriftReport;
use super::feed::Feed;
use super::latency::Latencies;
use super::path::Path;
use super::summary::LiveStatus;
use crate::wire::FrameHeader;

/// Combinations of the nine flags.
const COMBINATIONS: usize = 1 << Flags::NAMED.len();

/// Frames refused for one kind of reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RefusedFrames {
    /// The kind of reason.
    pub reason: &'static str,
    /// Frames.
    pub frames: u64,
    /// What was wrong with the first of them.
    pub first: String,
}

pub(super) struct Tally {
    pub(super) processed: u64,
    pub(super) points: u64,
    pub(super) restarts: u64,
    pub(super) drift: DriftReport,
    pub(super) temperatures_c: Option<[f64; 2]>,
    pub(super) latencies: Latencies,
    pub(super) path: Path,
    refused: Vec<RefusedFrames>,
    pixels: Vec<u64>,
    /// First arrival and last result.
    span: Option<[Instant; 2]>,
}

impl Tally {
    pub(super) fn new() -> Self {
        Self {
            processed: 0,
            points: 0,
            restarts: 0,
            drift: DriftReport::default(),
            temperatures_c: None,
            latencies: Latencies::new(),
            path: Path::default(),
            refused: Vec::new(),
            pixels: vec![0; COMBINATIONS],
            span: None,
        }
    }

    /// A frame that came.
    pub(super) fn arrived(&mut self, header: &FrameHeader, arrived: Instant, drift: DriftReport) {
        self.drift = drift;
        if let Some(now_c) = header.temperature_c {
            self.temperatures_c.get_or_insert([now_c, now_c])[1] = now_c;
        }
        self.span.get_or_insert([arrived, arrived]);
    }

    /// A frame whose results are there just now.
    pub(super) fn done(&mut self, frame: &ProcessedFrame, arrived: Instant) {
        let now = Instant::now();
        self.latencies.add(now.saturating_duration_since(arrived).as_secs_f64());
        self.processed += 1;
        if let Some(span) = &mut self.span {
            span[1] = now;
        }
        if let Some(pose) = &frame.pose {
            self.path.add(pose);
        }
        for flags in frame.flags.as_slice() {
            self.pixels[flags.bits() as usize % COMBINATIONS] += 1;
        }
    }

    /// Whether no frame was processed or refused as yet.
    pub(super) fn nothing_yet(&self) -> bool {
        self.processed == 0 && self.refused.is_empty()
    }

    pub(super) fn refuse(&mut self, reason: &'static str, words: String) {
        match self.refused.iter_mut().find(|refused| refused.reason == reason) {
            Some(refused) => refused.frames += 1,
            None => self.refused.push(RefusedFrames { reason, frames: 1, first: words }),
        }
    }

    /// All refused frames by reason, with those that the feed could not read.
    pub(super) fn refused(&self, feed: &Feed) -> Vec<RefusedFrames> {
        let unreadable = feed.unreadable().get();
        let unreadable =
            unreadable.map(|(frames, first)| RefusedFrames { reason: "unreadable", frames, first: first.to_owned() });
        self.refused.iter().cloned().chain(unreadable).collect()
    }

    /// Share of the pixels with each flag, and of those with none.
    pub(super) fn flags(&self) -> BTreeMap<&'static str, f64> {
        let all: u64 = self.pixels.iter().sum();
        let share = |has: &dyn Fn(Flags) -> bool| {
            let of =
                |(bits, count): (usize, &u64)| if has(Flags::from_bits_truncate(bits as u16)) { *count } else { 0 };
            self.pixels.iter().enumerate().map(of).sum::<u64>() as f64 / all.max(1) as f64
        };
        let named = Flags::NAMED.iter().map(|(flag, name)| (*name, share(&|flags| flags.contains(*flag))));
        let named = named.filter(|(_, share)| *share > 0.0);
        named.chain([("none", share(&|flags| flags.is_empty()))]).collect()
    }

    pub(super) fn seconds(&self) -> f64 {
        self.span.map_or(0.0, |[first, last]| last.saturating_duration_since(first).as_secs_f64())
    }

    pub(super) fn status(&self, feed: &Feed) -> LiveStatus {
        LiveStatus {
            frames: self.processed,
            dropped: feed.dropped(),
            refused: self.refused(feed).iter().map(|refused| refused.frames).sum(),
            frames_per_second: per_second(self.processed, self.seconds()),
            latency: self.latencies.summary(),
            temperature_c: self.temperatures_c.map(|[_, last]| last),
            drift: self.drift.clone(),
            path: self.path.status(),
        }
    }
}

/// Frames a second between the first and the last.
pub(super) fn per_second(frames: u64, seconds: f64) -> Option<f64> {
    (frames > 1 && seconds > 0.0).then(|| frames as f64 / seconds)
}

/// The kind of reason for which a frame was refused.
pub(super) fn reason(error: &Error) -> &'static str {
    match error {
        Error::Time { .. } => "time",
        Error::Size { .. } => "another camera",
        Error::Missing { .. } => "samples not finite",
        Error::Exposure { .. } => "integration time",
        Error::Unstated { .. } => "not stated",
        Error::Models(_) => "outside of the models",
        _ => "not processed",
    }
}
