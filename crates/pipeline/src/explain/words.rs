//! The explanation as a short table.

use std::fmt;

use crate::explain::{Explanation, StageLine, WHOLE_INTERVALS};

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [col, row] = self.pixel;
        writeln!(f, "{} (frame {}, station {}), pixel {col},{row}", self.file, self.frame, self.station)?;
        writeln!(f, "calibration: {}", self.calibration)?;
        writeln!(f, "{}", self.moved())?;
        writeln!(f, "{:<44} {:>12} {:>12} {:>9}", "", "change", "range", "sigma")?;
        writeln!(f, "{:<44} {:>12} {:>12}", "raw", "", metres(self.raw_range_m))?;
        for line in &self.stages {
            write_stage(f, line)?;
        }
        writeln!(
            f,
            "{:<44} {:>12} {:>12} {:>9}",
            "final",
            "",
            metres(self.range_m),
            self.sigma_m.map_or("-".to_owned(), |sigma| format!("{:.2} mm", 1e3 * sigma))
        )?;
        if let Some(amplitude) = self.amplitude {
            writeln!(f, "amplitude: {amplitude:.1}")?;
        }
        if let Some([x, y, z]) = self.point_m {
            writeln!(f, "point in the camera's frame: {x:.4} {y:.4} {z:.4} m")?;
        }
        if self.flags.is_empty() {
            return write!(f, "flags: none");
        }
        write!(f, "flags:")?;
        for flag in &self.flags {
            let by = flag.stage.map_or_else(|| "with the frame".to_owned(), |stage| format!("by {stage}"));
            write!(f, "\n  {} ({by}): {}", flag.flag.replace('_', " "), flag.reason)?;
            if let Some(sigmas) = flag.threshold_sigmas {
                write!(f, " [threshold: {sigmas:.1} sigma]")?;
            }
        }
        Ok(())
    }
}

impl Explanation {
    /// `moved -13.2 mm: offset -9.0, periodic -3.0, scattering -1.2`.
    fn moved(&self) -> String {
        let mut groups: Vec<(&str, f64)> = Vec::new();
        for part in self.stages.iter().flat_map(|line| &line.parts) {
            match groups.iter_mut().find(|(name, _)| *name == part.group) {
                Some((_, sum)) => *sum += part.change_m,
                None => groups.push((part.group, part.change_m)),
            }
        }
        groups.retain(|(name, _)| *name != WHOLE_INTERVALS);
        groups.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let parts: Vec<String> = groups.iter().map(|(name, sum)| format!("{name} {:+.1}", 1e3 * sum)).collect();
        let parts = if parts.is_empty() { "no stage changed it".to_owned() } else { parts.join(", ") };
        let whole = if self.whole_intervals_m == 0.0 {
            String::new()
        } else {
            format!("; besides {:+.4} m of whole ambiguity intervals", self.whole_intervals_m)
        };
        format!("moved {:+.1} mm: {parts}{whole}", 1e3 * self.moved_m)
    }
}

fn write_stage(f: &mut fmt::Formatter<'_>, line: &StageLine) -> fmt::Result {
    let sigma = line.sigma_m.map_or("-".to_owned(), |sigma| format!("{:.2} mm", 1e3 * sigma));
    let change = line.change_m.map_or("-".to_owned(), millimetres);
    writeln!(f, "{:<44} {change:>12} {:>12} {sigma:>9}", line.stage, metres(line.range_m))?;
    for part in &line.parts {
        writeln!(f, "  {:<42} {:>12}", part.what, millimetres(part.change_m))?;
    }
    Ok(())
}

fn metres(range_m: Option<f64>) -> String {
    range_m.map_or("-".to_owned(), |range| format!("{range:.4} m"))
}

fn millimetres(change_m: f64) -> String {
    if change_m == 0.0 { "0".to_owned() } else { format!("{:+.2} mm", 1e3 * change_m) }
}
