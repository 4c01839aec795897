//! The comparison in words.

use std::fmt;

use super::{CalibrationDifference, CorrectionLine, DriftLine, DriftPlace, ImageLine, PatternLine, PlaceLine};

impl fmt::Display for CalibrationDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.significant { "differ significantly" } else { "show no significant difference" };
        writeln!(f, "{} and {} {verdict} (level {} %)", self.first, self.second, 100.0 * self.level)?;
        for line in &self.corrections {
            writeln!(f, "{}", correction(line))?;
        }
        if let Some(line) = &self.drift {
            writeln!(f, "{}", drift(line))?;
        }
        if let Some(line) = &self.pattern {
            writeln!(f, "{}", pattern(line))?;
        }
        if let Some(line) = &self.image {
            writeln!(f, "{}", image(line))?;
        }
        match &self.joint {
            Some(joint) => writeln!(
                f,
                "all common parameters: chi squared {:.1} with {} degrees of freedom, probability {}{}",
                joint.chi_squared,
                joint.degrees,
                probability(joint.p_value),
                mark(joint.significant)
            )?,
            None => writeln!(f, "all common parameters are held in both files: values are compared as they stand")?,
        }
        writeln!(
            f,
            "{:<10} {:>13} {:>13} {:>13} {:>11} {:>11}  unit",
            "parameter", "first", "second", "difference", "sigma", "probability"
        )?;
        for line in &self.parameters {
            let status = if line.status == "estimated" { String::new() } else { format!(", {}", line.status) };
            writeln!(
                f,
                "{:<10} {:>13.6e} {:>13.6e} {:>13.3e} {:>11.2e} {:>11}  {}{status}{}",
                line.name,
                line.first,
                line.second,
                line.difference,
                line.sigma,
                line.p_value.map_or("-".to_owned(), probability),
                line.unit,
                mark(line.significant)
            )?;
        }
        for (names, which) in [(&self.only_first, "first"), (&self.only_second, "second")] {
            if !names.is_empty() {
                writeln!(f, "in the {which} alone: {}", names.join(", "))?;
            }
        }
        if !self.not_tested.is_empty() {
            writeln!(f, "without a known standard deviation, not tested: {}", self.not_tested.join(", "))?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        write!(f, "probabilities of single parameters mind that there are several (Holm); <- marks what is significant")
    }
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
