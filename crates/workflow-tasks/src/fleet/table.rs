//! `fleet.csv`: a row for each recording.

use range_image::Flags;

use super::RecordingRow;
use super::read::has_result;

/// The table with its header.
pub(crate) fn csv(rows: &[RecordingRow]) -> String {
    let mut header: Vec<String> =
        ["camera", "day", "recording", "code", "frames", "stations", "points", "sigma_range_median_m"]
            .map(str::to_owned)
            .to_vec();
    header.push("flagged".to_owned());
    header.extend(Flags::NAMED.map(|(_, name)| name.to_owned()));
    let last = ["calibration_matters", "calibration_change_rms_m", "doubts", "version", "digest", "reason"];
    header.extend(last.map(str::to_owned));
    let mut text = line(&header);
    for row in rows {
        text += &line(&fields(row));
    }
    text
}

fn fields(row: &RecordingRow) -> Vec<String> {
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
    let count = |value: Option<u64>| value.map_or_else(String::new, |value| value.to_string());
    let share = |name: &str| {
        // What a result does not name, no pixel has; without a result nothing is known.
        let zero = (has_result(row.code) && !row.flags_fraction.is_empty()).then_some(0.0);
        number(row.flags_fraction.get(name).copied().or(zero))
    };
    let mut fields = row.place.to_vec();
    fields.extend([row.code.to_string(), count(row.frames), count(row.stations), count(row.points)]);
    fields.extend([number(row.sigma_range_median_m), share("any")]);
    fields.extend(Flags::NAMED.map(|(_, name)| share(name)));
    fields.push(row.calibration_matters.map_or_else(String::new, |matters| matters.to_string()));
    fields.push(number(row.calibration_change_m));
    fields.push(row.doubt_kinds.join(" "));
    fields.extend(row.made.iter().map(|text| text.clone().unwrap_or_default()));
    fields.push(row.reason.clone().unwrap_or_default());
    fields
}

/// A line of a CSV file, with quotes where a field needs them.
fn line(fields: &[String]) -> String {
    let quoted = |field: &String| {
        let needs = field.contains([',', '"', '\n', '\r']);
        if needs { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.clone() }
    };
    let quoted: Vec<String> = fields.iter().map(quoted).collect();
    format!("{}\n", quoted.join(","))
}
