//! The explanation for people.

use std::fmt;

use report::{Column, Document};

use crate::explain::{Explanation, FlagReason, StageLine, StagePart, WHOLE_INTERVALS};

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it.
fn document(found: &Explanation) -> Document {
    let [col, row] = found.pixel;
    let Explanation { file, frame, station, calibration, .. } = found;
    let lead = format!("{file} (frame {frame}, station {station}), pixel {col},{row}. Calibration: {calibration}.");
    let mut document = Document::new("rangecam: explain", lead);
    document.paragraph(moved(found));
    document.section("What each stage did");
    let range_and_sigma = |range_m, sigma_m| [metres(range_m), report::millimetres(sigma_m)];
    let line = |name: &str, change: String, [range, sigma]: [String; 2]| vec![name.to_owned(), change, range, sigma];
    let mut rows = vec![line("raw", String::new(), [metres(found.raw_range_m), String::new()])];
    for StageLine { stage, change_m, parts, range_m, sigma_m } in &found.stages {
        let change = change_m.map_or("-".to_owned(), signed_millimetres);
        rows.push(line(stage, change, range_and_sigma(*range_m, *sigma_m)));
        let part = |part: &StagePart| vec![format!("  {}", part.what), signed_millimetres(part.change_m)];
        rows.extend(parts.iter().map(part));
    }
    rows.push(line("final", String::new(), range_and_sigma(found.range_m, found.sigma_m)));
    let [change, range, sigma] = ["change", "range", "sigma"].map(Column::number);
    document.table([Column::words("stage"), change, range, sigma], rows);
    if let Some(amplitude) = found.amplitude {
        document.paragraph(format!("amplitude: {amplitude:.1}"));
    }
    if let Some([x, y, z]) = found.point_m {
        document.paragraph(format!("point in the camera's frame: {x:.4} {y:.4} {z:.4} m"));
    }
    if found.flags.is_empty() {
        document.paragraph("flags: none");
    } else {
        document.section("Flags");
        document.list(&found.flags.iter().map(flag).collect::<Vec<String>>());
    }
    document
}

fn flag(FlagReason { flag, stage, reason, threshold_sigmas }: &FlagReason) -> String {
    let by = stage.map_or_else(|| "with the frame".to_owned(), |stage| format!("by {stage}"));
    let threshold = threshold_sigmas.map_or_else(String::new, |sigmas| format!(" [threshold: {sigmas:.1} sigma]"));
    format!("{} ({by}): {reason}{threshold}", flag.replace('_', " "))
}

/// `moved -13.2 mm: offset -9.0, periodic -3.0, scattering -1.2`.
fn moved(found: &Explanation) -> String {
    let mut groups: Vec<(&str, f64)> = Vec::new();
    for part in found.stages.iter().flat_map(|line| &line.parts) {
        match groups.iter_mut().find(|(name, _)| *name == part.group) {
            Some((_, sum)) => *sum += part.change_m,
            None => groups.push((part.group, part.change_m)),
        }
    }
    groups.retain(|(name, _)| *name != WHOLE_INTERVALS);
    groups.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let parts: Vec<String> = groups.iter().map(|(name, sum)| format!("{name} {:+.1}", 1e3 * sum)).collect();
    let parts = if parts.is_empty() { "no stage changed it".to_owned() } else { parts.join(", ") };
    let whole = if found.whole_intervals_m == 0.0 {
        String::new()
    } else {
        format!("; besides {:+.4} m of whole ambiguity intervals", found.whole_intervals_m)
    };
    format!("moved {:+.1} mm: {parts}{whole}", 1e3 * found.moved_m)
}

fn metres(range_m: Option<f64>) -> String {
    range_m.map_or("-".to_owned(), |range| format!("{range:.4} m"))
}

fn signed_millimetres(change_m: f64) -> String {
    if change_m == 0.0 { "0".to_owned() } else { format!("{:+.2} mm", 1e3 * change_m) }
}
