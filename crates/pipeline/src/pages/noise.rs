//! The report of an estimation of noise.

use crate::noise::NoiseSummary;
use report::{Axes, CATEGORIES, Document, Series, curves};

/// The whole page.
pub(crate) fn render_noise(summary: &NoiseSummary) -> String {
    let lead = format!(
        "Random errors of {}, estimated from the repeated frames of {}. Calibration: {}.",
        summary.noise_of, summary.survey, summary.calibration
    );
    let mut page = Document::new("rangecam: noise", &lead);
    page.warnings(&summary.doubts);
    page.merits([
        (summary.sigma_verdict.clone(), "pixels against their own scatter".to_owned()),
        (format!("{:.1} %", 100.0 * summary.misfit), "misfit of the variances".to_owned()),
        (format!("{:.2} %", 100.0 * summary.moved_share), "of the values moved, left out".to_owned()),
        (format!("{:.2}", summary.sigma0), "sigma0".to_owned()),
    ]);
    parameters(&mut page, summary);
    transfer(&mut page, summary);
    sigma(&mut page, summary);
    stations(&mut page, summary);
    page.html()
}

fn parameters(page: &mut Document, summary: &NoiseSummary) {
    page.section("The noise");
    let rows: Vec<Vec<String>> = summary
        .parameters
        .iter()
        .map(|parameter| {
            vec![
                parameter.name.clone(),
                format!("{:.5}", parameter.value),
                if parameter.held { "held".to_owned() } else { format!("{:.5}", parameter.sigma) },
                parameter.unit.clone(),
            ]
        })
        .collect();
    page.table(["parameter", "value", "sigma", "unit"], rows);
    if let Some(correlation) = summary.correlation {
        page.paragraph(&format!("Correlation of the two variances: {correlation:.2}."));
    }
    page.paragraph(&format!("Variances were taken {}.", summary.variances));
    if summary.noise_of == "ranges" {
        page.paragraph(&format!("The camera's amplitude is the light {}.", summary.amplitude_scale));
    }
}

fn transfer(page: &mut Document, summary: &NoiseSummary) {
    let (x, y) = match summary.noise_of {
        "samples" => ("mean sample", "standard deviation, sample units"),
        _ => ("received amplitude", "standard deviation, mm"),
    };
    let unit = if summary.noise_of == "samples" { 1.0 } else { 1e3 };
    page.section("Standard deviation against light");
    let axes = Axes { title: "Frames against their mean", x, y };
    let observed = summary.bins.iter().map(|bin| (bin.light, unit * bin.sigma_observed)).collect();
    let modelled = summary.bins.iter().map(|bin| (bin.light, unit * bin.sigma_modelled)).collect();
    let series = [
        Series { name: "observed", colour: CATEGORIES[0], values: observed },
        Series { name: "modelled", colour: CATEGORIES[1], values: modelled },
    ];
    page.figures([(curves(&axes, &series), "Each point is the mean over values of like light.".to_owned())]);
}

fn sigma(page: &mut Document, summary: &NoiseSummary) {
    page.section("Is the pixels' sigma true?");
    page.paragraph(
        "Variance of the pixels over the frames, over the variance that the noise gives them. If it is true, all classes \
         lie within their limits in 999 of 1000 cases.",
    );
    let point = |pick: fn(&crate::SigmaBinSummary) -> f64| {
        summary.sigma_bins.iter().map(|bin| (f64::midpoint(bin.amplitude[0], bin.amplitude[1]), pick(bin))).collect()
    };
    let axes = Axes { title: "Standardised residuals", x: "amplitude", y: "variance" };
    let series = [
        Series { name: "observed", colour: CATEGORIES[0], values: point(|bin| bin.ratio) },
        Series { name: "lower limit", colour: CATEGORIES[1], values: point(|bin| bin.limits[0]) },
        Series { name: "upper limit", colour: CATEGORIES[2], values: point(|bin| bin.limits[1]) },
    ];
    page.figures([(curves(&axes, &series), summary.sigma_verdict.clone())]);
    let rows: Vec<Vec<String>> = summary
        .sigma_bins
        .iter()
        .map(|bin| {
            vec![
                format!("{:.1} to {:.1}", bin.amplitude[0], bin.amplitude[1]),
                bin.values.to_string(),
                format!("{:.3}", bin.ratio),
                format!("{:.3} to {:.3}", bin.limits[0], bin.limits[1]),
            ]
        })
        .collect();
    page.table(["amplitude", "values", "variance", "limits"], rows);
}

fn stations(page: &mut Document, summary: &NoiseSummary) {
    page.section("The stations");
    page.paragraph(
        "Variance from successive differences over variance about the mean: 1 where nothing drifts. Scatter of each frame \
         over the noise: 1 where all frames are alike.",
    );
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
    let rows: Vec<Vec<String>> = summary
        .stations
        .iter()
        .map(|station| {
            let factors: Vec<String> = station.frame_factors.iter().map(|factor| format!("{factor:.3}")).collect();
            vec![
                station.station.clone(),
                station.frames.to_string(),
                number(station.drift_ratio),
                number(station.drift_ratio_sigma),
                if station.drifts { "yes" } else { "no" }.to_owned(),
                factors.join(", "),
            ]
        })
        .collect();
    page.table(["station", "frames", "ratio", "its sigma", "drifts", "frames' scatter"], rows);
}
