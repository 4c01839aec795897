//! The comparison in words.

use std::fmt;

use report::{Column, Document};

use crate::diff::{CalibrationDifference, CorrectionLine, DriftLine, DriftPlace, ImageLine, PatternLine, PlaceLine};

impl fmt::Display for CalibrationDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

fn document(difference: &CalibrationDifference) -> Document {
    let verdict = if difference.significant { "differ significantly" } else { "show no significant difference" };
    let lead =
        format!("{} and {} {verdict} (level {} %).", difference.first, difference.second, 100.0 * difference.level);
    let mut document = Document::new("rangecam: difference of two calibrations", lead);
    let corrections = difference.corrections.iter().map(correction);
    let others = [
        difference.drift.as_ref().map(drift),
        difference.pattern.as_ref().map(pattern),
        difference.image.as_ref().map(image),
    ];
    let lines = corrections.chain(others.into_iter().flatten()).chain([joint(difference)]);
    document.list(&lines.collect::<Vec<_>>());
    parameters(&mut document, difference);
    for (names, which) in [(&difference.only_first, "first"), (&difference.only_second, "second")] {
        if !names.is_empty() {
            document.paragraph(format!("in the {which} alone: {}", names.join(", ")));
        }
    }
    if !difference.not_tested.is_empty() {
        let names = difference.not_tested.join(", ");
        document.paragraph(format!("without a known standard deviation, not tested: {names}"));
    }
    for note in &difference.notes {
        document.paragraph(format!("note: {note}"));
    }
    let holm = "probabilities of single parameters mind that there are several (Holm); <- marks what is significant";
    document.paragraph(holm);
    document
}

fn joint(difference: &CalibrationDifference) -> String {
    match &difference.joint {
        Some(joint) => format!(
            "all common parameters: chi squared {:.1} with {} degrees of freedom, probability {}{}",
            joint.chi_squared,
            joint.degrees,
            probability(joint.p_value),
            mark(joint.significant)
        ),
        None => "all common parameters are held in both files: values are compared as they stand".to_owned(),
    }
}

fn parameters(document: &mut Document, difference: &CalibrationDifference) {
    document.section("Parameters");
    let rows = difference.parameters.iter().map(|line| {
        vec![
            line.name.clone(),
            format!("{:.6e}", line.first),
            format!("{:.6e}", line.second),
            format!("{:.3e}", line.difference),
            format!("{:.2e}", line.sigma),
            line.p_value.map_or("-".to_owned(), probability),
            line.unit.clone(),
            if line.status == "estimated" { String::new() } else { line.status.to_string() },
            mark(line.significant).trim().to_owned(),
        ]
    });
    let numbers = ["first", "second", "difference", "sigma", "probability"].map(Column::number);
    let columns = std::iter::once(Column::words("parameter")).chain(numbers);
    document.table(columns.chain(["unit", "", ""].map(Column::words)), rows.collect());
}

fn mark(significant: bool) -> &'static str {
    if significant { "  <-" } else { "" }
}

fn probability(p: f64) -> String {
    if p < 1e-4 { format!("{p:.0e}") } else { format!("{p:.4}") }
}

fn correction(line: &CorrectionLine) -> String {
    let [low, high] = line.range_span_m;
    let amplitudes =
        line.amplitude_span.map_or_else(String::new, |[low, high]| format!(", amplitudes {low:.0} to {high:.0}"));
    let (largest, clearest) = (place(&line.largest), place(&line.clearest));
    let clearest = if clearest == largest { String::new() } else { format!("; clearest {clearest}") };
    format!(
        "range correction at {} ({low:.2} m to {high:.2} m{amplitudes}): differs by up to {largest}{clearest}; rms {:.2} mm{}",
        line.model,
        1e3 * line.rms_m,
        mark(line.significant)
    )
}

fn place(at: &PlaceLine) -> String {
    let amplitude = at.amplitude.map_or_else(String::new, |amplitude| format!(", amplitude {amplitude:.0}"));
    let [col, row] = at.pixel;
    format!(
        "{:+.2} mm (band {:.2} mm) at {:.2} m{amplitude}, pixel {col:.0},{row:.0}",
        1e3 * at.difference_m,
        1e3 * at.band_m,
        at.range_m
    )
}

fn drift(line: &DriftLine) -> String {
    let place = |at: &DriftPlace| {
        let time = at.time_s.map_or_else(String::new, |time| format!(" {time:.0} s after power-on"));
        let temperature = at.temperature_c.map_or_else(String::new, |celsius| format!(" at {celsius:.1} °C"));
        let rate = at.rate_hz.map_or_else(String::new, |hertz| format!(" at {hertz:.2} Hz"));
        format!("{:+.2} mm (band {:.2} mm){time}{temperature}{rate}", 1e3 * at.difference_m, 1e3 * at.band_m)
    };
    let (largest, clearest) = (place(&line.largest), place(&line.clearest));
    let clearest = if clearest == largest { String::new() } else { format!("; clearest {clearest}") };
    let rms = 1e3 * line.rms_m;
    format!("drift: differs by up to {largest}{clearest}; rms {rms:.2} mm{}", mark(line.significant))
}

fn pattern(line: &PatternLine) -> String {
    let ([col, row], mm) = (line.pixel, |metres: f64| 1e3 * metres);
    format!(
        "offsets of {} pixels: differ by up to {:+.2} mm (sigma {:.2} mm) at pixel {col},{row}; rms {:.2} mm, {:.2} mm by \
         chance, probability {}{}",
        line.pixels,
        mm(line.largest_m),
        mm(line.largest_sigma_m),
        mm(line.rms_m),
        mm(line.expected_rms_m),
        probability(line.p_value),
        mark(line.significant)
    )
}

fn image(line: &ImageLine) -> String {
    let [col, row] = line.pixel;
    format!(
        "image: directions shift by up to {:.3} px (band {:.3} px) at pixel {col:.0},{row:.0}; rms {:.3} px{}",
        line.largest_px,
        line.band_px,
        line.rms_px,
        mark(line.significant)
    )
}
