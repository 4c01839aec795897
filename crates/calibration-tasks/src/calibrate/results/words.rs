//! A calibration's summary as words for a terminal.

use std::fmt;

use crate::calibrate::planes::offset::OffsetTableSummary;
use crate::calibrate::results::certificate::HeldOut;
use crate::calibrate::results::summary::CalibrationSummary;
use pipeline::trends::{TrendSummary, sentence};

/// Rejected observations that are named; the table has them all.
const NAMED_REJECTIONS: usize = 8;

impl fmt::Display for CalibrationSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} calibration of {}, start values: {}", self.method, self.survey, self.start)?;
        writeln!(
            f,
            "{} observations, {} unknowns, datum defect {}, redundancy {}, sigma0 {}, {} iterations, {:.1} s",
            self.observations,
            self.unknowns,
            self.datum_defect,
            self.redundancy,
            self.sigma0.map_or_else(|| "not known".to_owned(), |sigma0| format!("{sigma0:.3}")),
            self.iterations,
            self.seconds
        )?;
        self.write_groups(f)?;
        self.write_parameters(f)?;
        self.write_rejected(f)?;
        let lacks = if self.trends.iter().any(TrendSummary::is_trend) { ": the model lacks a term" } else { "" };
        let trends = sentence(&self.trends).map(|sentence| sentence + lacks);
        if let Some(table) = &self.offset_table {
            let OffsetTableSummary { block_px, known_blocks, unknown_blocks, .. } = table;
            writeln!(
                f,
                "table of offsets ({block_px} x {block_px} pixels, {known_blocks} known, {unknown_blocks} not): {}",
                table.verdict
            )?;
        }
        if let Some(HeldOut::Made(check)) = self.certificate.as_ref().map(|certificate| &certificate.hold_out) {
            writeln!(f, "{check}")?;
        }
        for doubt in &self.doubts {
            writeln!(f, "doubt: {doubt}")?;
        }
        for sentence in self.diagnosis.iter().cloned().chain(trends) {
            writeln!(f, "note: {sentence}")?;
        }
        if self.converged {
            write!(
                f,
                "written to {}: report.html, certificate.html, summary.json, calibration.ron, adjusted_stations.csv, \
                 adjusted_targets.csv, residuals.csv",
                self.out.display()
            )
        } else {
            write!(f, "refused; written to {}: summary.json", self.out.display())
        }
    }
}

impl CalibrationSummary {
    fn write_groups(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for group in &self.groups {
            let sigma0 = group.sigma0.map_or_else(|| "-".to_owned(), |sigma0| format!("{sigma0:.2}"));
            let (rms, unit) = readable(group.rms, group.unit);
            writeln!(
                f,
                "  {:<12} {:>6} values, redundancy {:>8.1}, rms {rms:>8.3} {unit}, sigma0 {sigma0}",
                group.name, group.observations, group.redundancy
            )?;
        }
        Ok(())
    }

    fn write_parameters(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.parameters.0.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "{:<10} {:>13} {:>12} {:>12}  {:<16} status",
            "parameter", "value", "+- (prior)", "(posterior)", "unit"
        )?;
        for (name, parameter) in &self.parameters.0 {
            let sigma = |value: f64| match parameter.status {
                "estimated" if value.is_finite() => format!("{value:.2e}"),
                _ => "-".to_owned(),
            };
            let digits = decimals(parameter.sigma_prior);
            writeln!(
                f,
                "{name:<10} {:>13} {:>12} {:>12}  {:<16} {}",
                number(parameter.value, digits),
                sigma(parameter.sigma_prior),
                sigma(parameter.sigma_posterior),
                parameter.unit,
                parameter.status
            )?;
        }
        Ok(())
    }

    fn write_rejected(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for gross in self.rejected.iter().take(NAMED_REJECTIONS) {
            let (residual, unit) = readable(gross.residual, gross.unit);
            writeln!(
                f,
                "rejected: {} of {} from {}{}: residual {residual:.3} {unit}, {:.1} of its sigma",
                gross.component,
                gross.target,
                gross.station,
                gross.line.map_or_else(String::new, |line| format!(" (observations.csv, line {line})")),
                gross.residual_in_sigmas
            )?;
        }
        if self.rejected.len() > NAMED_REJECTIONS {
            writeln!(f, "rejected: {} more, in residuals.csv", self.rejected.len() - NAMED_REJECTIONS)?;
        }
        Ok(())
    }
}

/// Metres as millimetres; other units as they are.
pub(crate) fn readable(value: f64, unit: &str) -> (f64, &str) {
    if unit == "m" { (1e3 * value, "mm") } else { (value, unit) }
}

/// A value down to a tenth of its standard deviation.
pub(crate) fn value_words(value: f64, sigma: f64) -> String {
    number(value, decimals(sigma))
}

/// Decimals that show a value down to a tenth of its standard deviation; `None` where that is too many to read.
fn decimals(sigma: f64) -> Option<usize> {
    let places = 1.0 - sigma.log10().floor();
    (sigma > 0.0 && (0.0..=7.0).contains(&places)).then_some(places as usize)
}

/// A value with so many decimals, or in powers of ten.
fn number(value: f64, decimals: Option<usize>) -> String {
    match decimals {
        Some(decimals) => format!("{value:.decimals$}"),
        None if value == 0.0 => "0".to_owned(),
        None if (1e-3..1e4).contains(&value.abs()) => format!("{value:.5}"),
        None => format!("{value:.4e}"),
    }
}
