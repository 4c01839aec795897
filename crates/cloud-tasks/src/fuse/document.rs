//! What was fused, for people.

use std::cmp::Reverse;
use std::fmt;

use report::{Column, Document, Figure, millimetres, rounded};

use super::summary::{ContradictionSummary, FuseSummary};

impl fmt::Display for FuseSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self, Vec::new()).fmt(f)
    }
}

/// Reasons as `summary.json` has them, in words.
const REASONS: [(&str, &str); 8] = [
    ("seen_through", "another frame saw a surface behind it, through it"),
    ("behind", "it lies behind a surface that other frames saw"),
    ("off_surface", "it lies off the surface that its own frame saw around it"),
    ("outvoted", "its surface cannot be there beside what more frames saw"),
    ("between", "mixed: between two surfaces that its frame saw side by side"),
    ("at_edge", "beside an edge: it may belong to either surface"),
    ("uneven", "its neighbours lie on no plane"),
    ("alone", "too few neighbours to tell a surface"),
];

/// All of it.
pub(crate) fn document(summary: &FuseSummary, pictures: Vec<Figure>) -> Document {
    let calibration = summary.calibration.as_deref().unwrap_or("none");
    let lead = format!("The cloud of {} with each surface once; calibration {calibration}.", summary.result);
    let mut document = Document::new("rangecam: fuse", lead);
    let sigma = summary.sigma.as_ref();
    document.merits([
        (summary.fused_points.to_string(), "fused points"),
        (format!("{} of {}", summary.points.fused, summary.points.all), "points that they were made of"),
        (millimetres(sigma.map(|sigma| sigma.median_m)), "median standard deviation, from all sources"),
        (millimetres(Some(summary.voxel_m)), "spacing"),
    ]);
    document.warnings(&summary.doubts);
    document.section("The fused points");
    document.explanation(
        "Standard deviations are those along the normal, from all sources. What all frames have in common is not averaged away: \
         noise goes down with more points, calibration, drift and poses only as far as surfaces tell them.",
    );
    shares(&mut document, summary);
    document.list(&summary.findings);
    shared_error(&mut document, summary);
    document.figures(pictures);
    thickness(&mut document, summary);
    document.section("Points that are in none");
    reasons(&mut document, summary);
    contradictions(&mut document, summary);
    corrections(&mut document, summary);
    let ([fused, unfused], out) = (&summary.clouds, summary.out.display());
    document.closing(format!("{fused}, {unfused}, summary.json and report.html are in {out}"));
    document
}

fn shares(document: &mut Document, summary: &FuseSummary) {
    let Some(sigma) = &summary.sigma else { return };
    let columns = [Column::words("source"), Column::number("mean share of the variance, %")];
    let rows = sigma.shares.iter().map(|(name, share)| vec![(*name).to_owned(), rounded(100.0 * share, 1)]);
    document.table(columns, rows.collect());
    let words = format!("Nineteen of twenty have a standard deviation below {}.", millimetres(Some(sigma.below_95_m)));
    document.paragraph(words);
}

fn thickness(document: &mut Document, summary: &FuseSummary) {
    let Some(thickness) = &summary.thickness else { return };
    document.section("Thickness of surfaces");
    document.explanation(
        "Robust standard deviation of points across the plane of their fused point, over the mean of its points. What is above noise \
         is what frames do not have in common.",
    );
    let row = |name: &str, value: f64| vec![name.to_owned(), millimetres(Some(value))];
    let rows = vec![
        row("as the result has the points", thickness.before_m),
        row("what was found of the common errors taken off", thickness.after_m),
        row("what noise alone gives", thickness.noise_m),
        row("what noise gives with what neighbouring pixels share", thickness.noise_and_sensor_m),
    ];
    document.table([Column::words("points"), Column::number("spread")], rows);
}

fn shared_error(document: &mut Document, summary: &FuseSummary) {
    let Some(shared) = &summary.shared_error else { return };
    document.section("The error that all frames share");
    document.explanation(
        "What a depth camera measures wrongly in the same pixels of all its frames, of a depth of one metre; it grows with the squared depth. \
         It does not average out over frames, but frames that see a surface in different pixels see it apart, and so it shows.",
    );
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let rows = vec![
        row("standard deviation, as surfaces tell it", millimetres(Some(shared.sigma_at_1_m))),
        row("taken off, root mean square", millimetres(Some(shared.taken_off_rms_m))),
        row("standard deviation of what remains, root mean square", millimetres(Some(shared.sigma_after_rms_m))),
        row("alike over (correlation 1/e)", format!("{:.0} pixels", shared.length_px)),
    ];
    document.table([Column::words("error"), Column::number("at one metre")], rows);
}

fn reasons(document: &mut Document, summary: &FuseSummary) {
    let share = |count: usize| format!("{:.2}", 100.0 * count as f64 / summary.points.all.max(1) as f64);
    let row = |name: &str, words: &str, count: usize| {
        vec![name.to_owned(), words.to_owned(), count.to_string(), share(count)]
    };
    let found = |name: &str| summary.unfused.get(name).copied().unwrap_or(0);
    let mut rows: Vec<Vec<String>> = REASONS.iter().map(|(name, words)| row(name, words, found(name))).collect();
    if found("other") > 0 {
        rows.push(row("other", "another reason", found("other")));
    }
    rows.push(row("flagged", "it has a flag and took no part", summary.points.flagged));
    rows.push(row("unusable", "it has no position or no standard deviation", summary.points.unusable));
    let columns =
        [Column::words("reason"), Column::words("meaning"), Column::number("points"), Column::number("of all, %")];
    document.table(columns, rows);
}

/// Pairs of frames in the table of contradictions: those with most points say where to look.
const MOST_PAIRS: usize = 12;

fn contradictions(document: &mut Document, summary: &FuseSummary) {
    if !summary.contradictions.is_empty() {
        document.section("Surfaces that cannot both be there");
        let mut worst: Vec<&ContradictionSummary> = summary.contradictions.iter().collect();
        worst.sort_by_key(|found| Reverse(found.pairs));
        let further = worst.len().saturating_sub(MOST_PAIRS);
        let rows = worst.into_iter().take(MOST_PAIRS).map(|found| {
            let [front, through] = [&found.front, &found.seen_through_by].map(String::clone);
            let distance = millimetres(Some(found.median_distance_m));
            vec![front, through, found.pairs.to_string(), distance, format!("{:.1}", found.largest_deviations)]
        });
        let columns = [
            Column::words("saw the front"),
            Column::words("saw through it"),
            Column::number("pairs of fused points"),
            Column::number("median distance"),
            Column::number("largest, deviations"),
        ];
        document.table(columns, rows.collect());
        if further > 0 {
            document.paragraph(format!(
                "Fewer points are between {further} further pairs of frames: summary.json has all."
            ));
        }
    }
    if !summary.apart.is_empty() {
        document.section("Stations that do not fit the others");
        let rows = summary.apart.iter().map(|apart| {
            let shifts: Vec<String> = apart.shifts.iter().map(|(name, value)| format!("{name} {value:+.4}")).collect();
            vec![apart.frames.join(", "), apart.others.join(", "), format!("{:.1e}", apart.p_value), shifts.join(", ")]
        });
        let columns = [
            Column::words("frames"),
            Column::words("against"),
            Column::number("p"),
            Column::words("change of the pose that would be needed, metre and radian"),
        ];
        document.table(columns, rows.collect());
    }
}

fn corrections(document: &mut Document, summary: &FuseSummary) {
    let rows: Vec<Vec<String>> = summary
        .corrections
        .iter()
        .filter(|correction| correction.value != 0.0)
        .map(|correction| {
            let scale = Some(correction.sigma_after);
            let [value, before, after] = [correction.value, correction.sigma_before, correction.sigma_after]
                .map(|number| crate::document::digits(number, scale, 2));
            vec![correction.name.clone(), correction.source.to_owned(), value, before, after]
        })
        .collect();
    if !rows.is_empty() {
        document.section("What was found of the common errors");
        let columns = [
            Column::words("error"),
            Column::words("source"),
            Column::number("taken off"),
            Column::number("sigma as stated"),
            Column::number("sigma of what remains"),
        ];
        document.long_table(columns, rows);
    }
}
