//! What a recording holds, for people.

use report::{Column, Document};

use super::{CameraReport, RecordingInspection, StreamReport};

/// Properties that are shown in words; a program has all of them.
const MOST_PROPERTIES: usize = 20;

pub(super) fn of(found: &RecordingInspection) -> Document {
    let mut document = Document::new("rangecam: inspect", "");
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let mut rows = vec![
        row("recording", found.recording.clone()),
        row("format", found.format.to_owned()),
        row("size", format!("{} bytes", found.bytes)),
        row("duration", format!("{:.3} s", found.duration_s)),
    ];
    if let Some(begins) = found.begins_ns {
        rows.push(row("begins", format!("at {begins} ns on its clock")));
    }
    rows.push(row("ended", found.ended.clone()));
    for file in &found.attachments {
        rows.push(row("attachment", format!("{} ({} bytes)", file.name, file.bytes)));
    }
    for property in found.properties.iter().take(MOST_PROPERTIES) {
        rows.push(row("property", format!("{}: {}", property.name, property.value)));
    }
    document.table([Column::words("what"), Column::words("found")], rows);
    document.section("Streams");
    let columns = [
        Column::words("stream"),
        Column::words("kind"),
        Column::words("content"),
        Column::number("messages"),
        Column::number("from").unit("s"),
        Column::number("to").unit("s"),
        Column::number("rate").unit("Hz"),
        Column::number("gaps"),
        Column::number("missing"),
        Column::number("longest gap").unit("s"),
    ];
    document.table(columns, found.streams.iter().map(stream).collect());
    if !found.cameras.is_empty() {
        document.section("Cameras");
        let columns = [
            Column::words("stream"),
            Column::words("size"),
            Column::words("focal lengths"),
            Column::words("principal point"),
            Column::words("distortion"),
        ];
        document.table(columns, found.cameras.iter().map(camera).collect());
    }
    if !found.temperatures.is_empty() {
        document.section("Temperatures");
        let columns = ["first", "last", "lowest", "highest"].map(|name| Column::number(name).unit("°C"));
        let rows = found.temperatures.iter().map(|report| {
            let values = [report.first_c, report.last_c, report.lowest_c, report.highest_c];
            std::iter::once(report.stream.clone()).chain(values.map(|value| format!("{value:.1}"))).collect()
        });
        document.table(std::iter::once(Column::words("stream")).chain(columns), rows.collect());
    }
    document.warnings(&found.doubts);
    document
}

fn stream(stream: &StreamReport) -> Vec<String> {
    let is_there = stream.messages > 0;
    let number =
        |value: Option<f64>, decimals: usize| value.map_or_else(String::new, |value| format!("{value:.decimals$}"));
    vec![
        stream.name.clone(),
        stream.kind.to_owned(),
        stream.content.clone().unwrap_or_default(),
        stream.messages.to_string(),
        number(is_there.then_some(stream.first_s), 3),
        number(is_there.then_some(stream.last_s), 3),
        number(stream.rate_hz, 2),
        stream.gaps.to_string(),
        stream.missing.to_string(),
        number(stream.longest_gap.map(|gap| gap.length_s), 3),
    ]
}

fn camera(camera: &CameraReport) -> Vec<String> {
    let pair = |[first, second]: [f64; 2]| format!("{first:.3}, {second:.3} px");
    let coefficients: Vec<_> = camera.distortion.iter().map(|value| format!("{value:.5}")).collect();
    vec![
        camera.stream.clone(),
        format!("{} x {}", camera.size_px[0], camera.size_px[1]),
        pair(camera.focal_px),
        pair(camera.principal_point_px),
        format!("{} ({})", camera.distortion_model, coefficients.join(", ")),
    ]
}
