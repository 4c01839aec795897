//! An estimation of noise for people.

use std::fmt;

use report::{Axes, CATEGORIES, Column, Document, Series, curves};

use crate::noise::summary::{NoiseSummary, SigmaBinSummary};

impl fmt::Display for NoiseSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

/// All of it.
pub(crate) fn document(summary: &NoiseSummary) -> Document {
    let lead = format!(
        "Random errors of {}, estimated from {} values of the repeated frames of {} stations of {}. Calibration: {}.",
        summary.noise_of,
        summary.values,
        summary.stations.len(),
        summary.survey,
        summary.calibration
    );
    let mut document = Document::new("rangecam: noise", lead + &thinned(summary.every));
    document.merits([
        (summary.sigma_verdict.clone(), "pixels against their own scatter"),
        (format!("{:.3}", summary.sigma_ratio), "variance of the pixels over what they are given"),
        (format!("{:.1} %", 100.0 * summary.misfit), "misfit of the variances"),
        (format!("{:.2} %", 100.0 * summary.moved_share), "of the values moved, left out"),
        (format!("{:.2}", summary.sigma0), "sigma0"),
        (summary.redundancy.to_string(), "redundancy"),
    ]);
    document.warnings(&summary.doubts);
    parameters(&mut document, summary);
    transfer(&mut document, summary);
    sigma(&mut document, summary);
    stations(&mut document, summary);
    document.closing(format!(
        "took {:.1} s; written to {}: calibration.ron, summary.json, report.html",
        summary.seconds,
        summary.out.display()
    ));
    document
}

/// Which pixels were taken of surveys that have too many.
fn thinned(every: usize) -> String {
    if every == 1 { String::new() } else { format!(" Of {every} pixels one was taken, evenly spread.") }
}

fn parameters(document: &mut Document, summary: &NoiseSummary) {
    document.section("The noise");
    let rows = summary.parameters.iter().map(|parameter| {
        let sigma = if parameter.held { "held".to_owned() } else { format!("{:.5}", parameter.sigma) };
        vec![parameter.name.clone(), format!("{:.5}", parameter.value), sigma, parameter.unit.clone()]
    });
    let columns = [Column::words("parameter"), Column::number("value"), Column::number("sigma"), Column::words("unit")];
    document.table(columns, rows.collect());
    if let Some(correlation) = summary.correlation {
        document.paragraph(format!("Correlation of the two variances: {correlation:.2}."));
    }
    document.paragraph(format!("Variances were taken {}.", summary.variances));
    if summary.noise_of == "ranges" {
        document.paragraph(format!("The camera's amplitude is the light {}.", summary.amplitude_scale));
        document.paragraph(match summary.shared {
            Some(shared) => format!(
                "Neighbouring pixels have {:.0} +- {:.1} % of their variance in common, over {} pixels: a mean over them does not \
                 remove it.",
                100.0 * shared.share,
                100.0 * shared.sigma,
                shared.width_px
            ),
            None => "Neighbouring pixels have nothing in common.".to_owned(),
        });
    }
}

fn transfer(document: &mut Document, summary: &NoiseSummary) {
    let (x, y) = match summary.noise_of {
        "samples" => ("mean sample", "standard deviation, sample units"),
        _ => ("received amplitude", "standard deviation, mm"),
    };
    let unit = if summary.noise_of == "samples" { 1.0 } else { 1e3 };
    document.section("Standard deviation against light");
    let axes = Axes { title: "Frames against their mean", x, y };
    let observed = summary.bins.iter().map(|bin| (bin.light, unit * bin.sigma_observed)).collect();
    let modelled = summary.bins.iter().map(|bin| (bin.light, unit * bin.sigma_modelled)).collect();
    let series = [
        Series { name: "observed", colour: CATEGORIES[0], values: observed },
        Series { name: "modelled", colour: CATEGORIES[1], values: modelled },
    ];
    document.figures([curves(&axes, &series).caption("Each point is the mean over values of like light.")]);
}

fn sigma(document: &mut Document, summary: &NoiseSummary) {
    document.section("Is the pixels' sigma true?");
    document.explanation(
        "Variance of the pixels over the frames, over the variance that the noise gives them. If it is true, all classes \
         lie within their limits in 999 of 1000 cases.",
    );
    let point = |pick: fn(&SigmaBinSummary) -> f64| {
        summary.sigma_bins.iter().map(|bin| (f64::midpoint(bin.amplitude[0], bin.amplitude[1]), pick(bin))).collect()
    };
    let axes = Axes { title: "Standardised residuals", x: "amplitude", y: "variance" };
    let series = [
        Series { name: "observed", colour: CATEGORIES[0], values: point(|bin| bin.ratio) },
        Series { name: "lower limit", colour: CATEGORIES[1], values: point(|bin| bin.limits[0]) },
        Series { name: "upper limit", colour: CATEGORIES[2], values: point(|bin| bin.limits[1]) },
    ];
    document.figures([curves(&axes, &series).caption(summary.sigma_verdict.clone())]);
    let rows = summary.sigma_bins.iter().map(|bin| {
        vec![
            format!("{:.1} to {:.1}", bin.amplitude[0], bin.amplitude[1]),
            bin.values.to_string(),
            format!("{:.3}", bin.ratio),
            format!("{:.3} to {:.3}", bin.limits[0], bin.limits[1]),
        ]
    });
    document.long_table(["amplitude", "values", "variance", "limits"].map(Column::number), rows.collect());
}

/// Frames of a station whose scatter is shown: of more nobody reads on.
const MOST_FACTORS: usize = 1000;

fn stations(document: &mut Document, summary: &NoiseSummary) {
    document.section("The stations");
    document.explanation(
        "Variance from successive differences over variance about the mean: 1 where nothing drifts. Scatter of each frame \
         over the noise: 1 where all frames are alike.",
    );
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
    let rows = summary.stations.iter().map(|station| {
        let shown = station.frame_factors.iter().take(MOST_FACTORS).map(|factor| format!("{factor:.3}"));
        let rest = station.frame_factors.len().saturating_sub(MOST_FACTORS);
        let rest = (rest > 0).then(|| format!("and of {rest} further frames in summary.json"));
        let factors: Vec<String> = shown.chain(rest).collect();
        vec![
            station.station.clone(),
            station.frames.to_string(),
            number(station.drift_ratio),
            number(station.drift_ratio_sigma),
            if station.drifts { "yes" } else { "no" }.to_owned(),
            factors.join(", "),
        ]
    });
    let columns = [
        Column::words("station"),
        Column::number("frames"),
        Column::number("successive over whole variance"),
        Column::number("its sigma"),
        Column::words("drifts"),
        Column::words("frames' scatter"),
    ];
    document.table(columns, rows.collect());
}
