//! What is counted of each stream.

use recordings::{CameraInfo, Kind, Message, Payload, Stream};

use super::timing::Timing;
use super::{CameraReport, StreamReport, TemperatureReport};

/// Messages of one stream.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pub messages: u64,
    unreadable: u64,
    content: Option<String>,
    /// Earliest and latest.
    pub times_ns: Option<[i64; 2]>,
    timing: Timing,
}

impl Tally {
    pub fn add(&mut self, message: &Message) {
        self.messages += 1;
        let time = message.time_ns();
        self.times_ns = Some(self.times_ns.map_or([time; 2], |[first, last]| [first.min(time), last.max(time)]));
        self.timing.add(time);
        match &message.payload {
            Payload::Unreadable(_) => self.unreadable += 1,
            Payload::Image(image) if self.content.is_none() => {
                self.content = Some(format!("{} x {} {}", image.width(), image.height(), image.encoding().name()));
            }
            Payload::Compressed(image) if self.content.is_none() => self.content = Some(image.format.clone()),
            _ => {}
        }
    }

    pub fn report(mut self, stream: &Stream, seconds: impl Fn(i64) -> f64) -> StreamReport {
        let interval_s = self.timing.finish().map(|interval| interval as f64 * 1e-9);
        let [first, last] = self.times_ns.map_or([0.0; 2], |times| times.map(&seconds));
        // Messages of other kinds come when something happens.
        if stream.kind == Kind::Other {
            self.timing.forget_gaps();
        }
        StreamReport {
            name: stream.name.clone(),
            kind: stream.kind.name(),
            type_name: stream.type_name.clone(),
            content: self.content,
            messages: self.messages,
            stated: stream.count,
            unreadable: self.unreadable,
            first_s: first,
            last_s: last,
            interval_s,
            rate_hz: interval_s.map(f64::recip),
            gaps: self.timing.gaps,
            missing: self.timing.missing,
            longest_gap: self.timing.longest_gap(&seconds),
            not_ascending: self.timing.not_ascending,
        }
    }
}

pub(super) fn camera(stream: String, info: &CameraInfo) -> CameraReport {
    let [fx, _, cx, _, fy, cy, ..] = info.matrix;
    CameraReport {
        stream,
        size_px: [info.width, info.height],
        focal_px: [fx, fy],
        principal_point_px: [cx, cy],
        distortion_model: info.distortion_model.clone(),
        distortion: info.distortion.clone(),
    }
}

pub(super) fn temperature(reports: &mut Vec<TemperatureReport>, stream: impl Fn() -> String, celsius: f64) {
    if !celsius.is_finite() {
        return;
    }
    let name = stream();
    match reports.iter_mut().find(|report| report.stream == name) {
        Some(report) => {
            report.last_c = celsius;
            report.lowest_c = report.lowest_c.min(celsius);
            report.highest_c = report.highest_c.max(celsius);
        }
        None => reports.push(TemperatureReport {
            stream: name,
            first_c: celsius,
            last_c: celsius,
            lowest_c: celsius,
            highest_c: celsius,
        }),
    }
}
