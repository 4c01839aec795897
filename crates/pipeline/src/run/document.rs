//! The sections of the report, from the figures of merit to the flags.

use range_image::Flags;
use report::{
    Axes, CATEGORIES, ColourMap, Direction, Document, Figure, NO_VALUE, Scale, Series, StationCloud, cloud_figure,
    curves, histogram, raster_figure, rgb_figure,
};

use crate::Result;
use crate::figures::correction_maps::correction_maps;
use crate::run::summary::Summary;
use crate::statistics::quantile;
use crate::survey::outcome::Outcome;
use crate::survey::truth::range_errors;
use crate::survey::view::{Snapshot, View, ViewData};
use crate::trends::section::remaining_errors;
use report::millimetres;

/// Stations whose pictures are shown; further ones would make the page heavy without telling more.
const PICTURED_STATIONS: usize = 8;

/// The whole page.
pub(crate) fn render(outcome: &Outcome, summary: &Summary) -> Result<String> {
    let lead = format!(
        "{} frames of {} stations, {} x {} pixels, input level {}. Calibration: {}.",
        summary.frames, summary.stations, summary.size_px[0], summary.size_px[1], summary.level, summary.calibration
    );
    let mut page = Document::new(&format!("rangecam: {}", summary.pipeline), &lead);
    figures_of_merit(&mut page, summary);
    page.warnings(&summary.doubts);
    stages(&mut page, summary);
    errors(&mut page, outcome);
    remaining_errors(&mut page, &summary.remaining);
    registration(&mut page, outcome, summary)?;
    pictures(&mut page, outcome)?;
    flags(&mut page, outcome, summary);
    Ok(page.html())
}

fn figures_of_merit(page: &mut Document, summary: &Summary) {
    let mut cards = vec![(summary.points.to_string(), "points".to_owned())];
    let mut card = |value: String, name: &str| cards.push((value, name.to_owned()));
    if let Some(sigma) = summary.sigma_range_median_m {
        card(millimetres(Some(sigma)), "median sigma of a range");
    }
    if let Some(truth) = &summary.truth {
        card(millimetres(Some(truth.ranges.range_error_median_m)), "median range error");
        card(millimetres(Some(truth.ranges.range_error_p95_m)), "95 % of range errors below");
        card(format!("{:.2} %", 100.0 * truth.ranges.wrap_count_right_fraction), "wrap counts right");
        if let (Some(position), Some(attitude)) = (truth.position_error_max_m, truth.attitude_error_max_deg) {
            card(millimetres(Some(position)), "largest position error");
            card(format!("{attitude:.3}°"), "largest attitude error");
        }
    }
    if let Some(reference) = &summary.reference {
        card(millimetres(Some(reference.robust_standard_deviation_m)), "robust deviation from the reference range");
    }
    card(format!("{:.1} %", 100.0 * summary.flags_fraction.get("any").copied().unwrap_or(0.0)), "pixels flagged");
    card(format!("{:.1} s", summary.seconds), "time");
    page.merits(cards);
}

fn stages(page: &mut Document, summary: &Summary) {
    page.section("What each stage did");
    let longest = summary.stages.iter().map(|stage| stage.seconds).fold(f64::MIN_POSITIVE, f64::max);
    let rows: Vec<Vec<String>> = summary
        .stages
        .iter()
        .map(|stage| {
            let findings: Vec<String> =
                stage.findings.iter().map(|(name, value)| format!("{name} {value:.4}")).collect();
            vec![
                stage.name.to_owned(),
                format!("{:.0} ms ({:.0} %)", 1e3 * stage.seconds, 100.0 * stage.seconds / longest),
                millimetres(stage.change_median_m),
                millimetres(stage.truth.as_ref().map(|truth| truth.range_error_median_m)),
                millimetres(stage.truth.as_ref().map(|truth| truth.range_error_p95_m)),
                findings.join("; "),
            ]
        })
        .collect();
    let head =
        ["stage", "time (share of the longest)", "median change", "median error after", "95 % below", "findings"];
    page.table(head, rows);
    if !summary.ruled_out.is_empty() {
        page.subsection("What the input level rules out");
        let rows: Vec<_> = summary.ruled_out.iter().map(|(stage, why)| vec![stage.clone(), why.clone()]).collect();
        page.table(["stage", "why"], rows);
    }
    let gain: Vec<(f64, f64)> = summary
        .stages
        .iter()
        .enumerate()
        .filter_map(|(k, stage)| stage.truth.as_ref().map(|truth| (k as f64, 1e3 * truth.range_error_median_m)))
        .collect();
    if gain.len() > 1 {
        let upper: Vec<(f64, f64)> = summary
            .stages
            .iter()
            .enumerate()
            .filter_map(|(k, stage)| stage.truth.as_ref().map(|truth| (k as f64, 1e3 * truth.range_error_p95_m)))
            .collect();
        let axes = Axes {
            title: "Range error after each stage",
            x: "stage, in the order of the table (0 is the first)",
            y: "mm",
        };
        let sets = [
            Series { name: "median", colour: CATEGORIES[0], values: gain },
            Series { name: "95 % below", colour: CATEGORIES[1], values: upper },
        ];
        page.figures([(curves(&axes, &sets), "On the pixels that no flag excludes at that stage.".to_owned())]);
    }
}

fn errors(page: &mut Document, outcome: &Outcome) {
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for view in &outcome.views {
        let (Some(first), Some(last), Some(flags)) = (errors_before(view), range_errors(view), view.flags()) else {
            continue;
        };
        before.extend(first.iter().map(|error| 1e3 * error));
        let kept = last.iter().zip(flags.as_slice()).filter(|(_, flags)| flags.is_empty());
        after.extend(kept.map(|(error, _)| 1e3 * error));
    }
    if after.is_empty() {
        return;
    }
    page.section("Errors against the truth");
    let wide = quantile(&mut before.iter().map(|error| error.abs()).collect::<Vec<_>>(), 0.98);
    let narrow = quantile(&mut after.iter().map(|error| error.abs()).collect::<Vec<_>>(), 0.99);
    let axes = |title| Axes { title, x: "measured minus true range, mm", y: "% of pixels" };
    let both = [
        Series { name: "before, all pixels", colour: CATEGORIES[1], values: before },
        Series { name: "after, unflagged", colour: CATEGORIES[0], values: after.clone() },
    ];
    let only = [Series { name: "after, unflagged", colour: CATEGORIES[0], values: after }];
    page.figures([
        (
            histogram(&axes("Before and after"), [-wide, wide], &both),
            "Before: as the camera alone would give it, modulo the ambiguity interval. What lies outside the span is \
             counted in the outermost bins."
                .to_owned(),
        ),
        (histogram(&axes("After"), [-narrow, narrow], &only), "The same, enlarged.".to_owned()),
    ]);
}

/// Errors of the ranges as the camera alone gives them, modulo the ambiguity interval, metre.
fn errors_before(view: &View) -> Option<Vec<f64>> {
    let (truth, before) = (view.truth.as_ref()?, view.before.as_ref()?);
    let pairs = before.range.as_slice().iter().zip(truth.range.as_slice());
    Some(
        pairs
            .map(|(range, truth)| {
                let error = f64::from(*range) - f64::from(*truth);
                view.modulation.map_or(error, |modulation| crate::survey::truth::wrap(error, modulation))
            })
            .collect(),
    )
}

fn registration(page: &mut Document, outcome: &Outcome, summary: &Summary) -> Result<()> {
    if outcome.clouds.is_empty() {
        return Ok(());
    }
    let Some(poses) = outcome.common_poses() else {
        page.section("The clouds");
        page.paragraph("The stations are in no common frame: each cloud is in the frame of its own camera (x right, y up, looking along -z).");
        let rows: Vec<_> =
            summary.own_clouds.iter().map(|cloud| vec![cloud.view.clone(), cloud.file.clone()]).collect();
        page.table(["view", "file"], rows);
        pairs(page, summary);
        return Ok(());
    };
    page.section("The cloud");
    let clouds: Vec<StationCloud<'_>> = outcome
        .clouds
        .iter()
        .zip(&outcome.views)
        .zip(&poses)
        .map(|((cloud, view), pose)| StationCloud {
            name: &view.station,
            points: crate::survey::outcome::world_points(cloud, &pose.world_from_camera),
            position: pose.world_from_camera.translation.vector.into(),
        })
        .collect();
    let [above, side] = Direction::above_and_side(outcome.vertical_axis);
    let note = "The middle half along the direction of view, unflagged points, one colour a station; dots are the perspective centres.";
    page.figures([
        (cloud_figure("From above", &clouds, above)?, note.to_owned()),
        (cloud_figure("From the side", &clouds, side)?, String::new()),
    ]);
    if summary.registration.is_some() {
        page.subsection("Stations");
        page.table(
            ["station", "x m", "y m", "z m", "sigma of position", "position error", "attitude error"],
            station_rows(outcome, summary),
        );
    }
    pairs(page, summary);
    Ok(())
}

fn pairs(page: &mut Document, summary: &Summary) {
    let Some(registration) = &summary.registration else { return };
    page.subsection("Pairs");
    let rows: Vec<Vec<String>> = registration
        .pairs
        .iter()
        .map(|pair| {
            vec![
                format!("{} to {}", pair.source, pair.target),
                format!("{:.0} %", 100.0 * pair.overlap),
                millimetres(Some(pair.rms_m)),
                pair.iterations.to_string(),
                format!("{:.4} m", pair.distance_m),
            ]
        })
        .collect();
    page.table(["pair", "overlap", "rms along the normals", "iterations", "distance of the stations"], rows);
}

fn station_rows(outcome: &Outcome, summary: &Summary) -> Vec<Vec<String>> {
    let row = |(view, pose): (&View, &crate::survey::outcome::StationPose)| {
        let position = pose.world_from_camera.translation.vector;
        let truth = summary.truth.as_ref().and_then(|truth| truth.stations.get(&view.station));
        vec![
            view.station.clone(),
            format!("{:.4}", position.x),
            format!("{:.4}", position.y),
            format!("{:.4}", position.z),
            millimetres(pose.position_sigma_m()),
            millimetres(truth.and_then(|truth| truth.position_error_m)),
            truth.and_then(|truth| truth.attitude_error_deg).map_or("-".to_owned(), |error| format!("{error:.4}°")),
        ]
    };
    outcome.views.iter().zip(&outcome.poses).map(row).collect()
}

fn pictures(page: &mut Document, outcome: &Outcome) -> Result<()> {
    page.section("Before and after, station by station");
    let scales = Scales::of(outcome);
    for view in outcome.views.iter().take(PICTURED_STATIONS) {
        page.subsection(&view.name());
        page.figures(view_figures(view, &scales)?);
    }
    if outcome.views.len() > PICTURED_STATIONS {
        page.paragraph(&format!("{} further stations are not pictured.", outcome.views.len() - PICTURED_STATIONS));
    }
    Ok(())
}

/// One scale for all stations, so that their pictures can be compared.
struct Scales {
    amplitude: Scale,
    range: Scale,
    error_before: Scale,
    error_after: Scale,
}

impl Scales {
    fn of(outcome: &Outcome) -> Self {
        let gather = |pick: &dyn Fn(&View) -> Vec<f64>, share: f64| {
            quantile(&mut outcome.views.iter().flat_map(pick).collect::<Vec<_>>(), share)
        };
        let amplitude = |view: &View| view.before.iter().flat_map(log_amplitude).collect::<Vec<_>>();
        let range = |view: &View| {
            let snapshot = view.snapshot();
            snapshot.iter().flat_map(|s| values(s.range.as_slice())).collect::<Vec<_>>()
        };
        let error = |view: &View| errors_before(view).unwrap_or_default().iter().map(|e| 1e3 * e.abs()).collect();
        let wide = gather(&error, 0.95);
        let symmetric = |limit: f64| Scale { map: ColourMap::Diverging, low: -limit, high: limit, unit: "mm" };
        Self {
            amplitude: Scale {
                map: ColourMap::Grey,
                low: gather(&amplitude, 0.01),
                high: gather(&amplitude, 0.99),
                unit: "lg",
            },
            range: Scale { map: ColourMap::Sequential, low: 0.0, high: gather(&range, 0.995), unit: "m" },
            error_before: symmetric(wide),
            error_after: symmetric((wide / 10.0).max(5.0)),
        }
    }
}

fn values(data: &[f32]) -> Vec<f64> {
    data.iter().map(|value| f64::from(*value)).collect()
}

fn log_amplitude(snapshot: &Snapshot) -> Vec<f64> {
    snapshot.amplitude.as_slice().iter().map(|a| if *a > 0.0 { f64::from(a.log10()) } else { f64::NAN }).collect()
}

fn view_figures(view: &View, scales: &Scales) -> Result<Vec<(Figure, String)>> {
    let (width, _) = view.size();
    let mut figures = Vec::new();
    let mut add = |title: &str, values: &[f64], scale: &Scale| -> Result<()> {
        figures.push((raster_figure(title, width, values, scale)?, String::new()));
        Ok(())
    };
    if let Some(before) = &view.before {
        if before.amplitude.as_slice().iter().any(|a| a.is_finite()) {
            add("Amplitude before", &log_amplitude(before), &scales.amplitude)?;
        }
        add("Range before", &values(before.range.as_slice()), &scales.range)?;
    }
    if let Some(after) = view.snapshot() {
        if after.amplitude.as_slice().iter().any(|a| a.is_finite()) {
            add("Amplitude after", &log_amplitude(&after), &scales.amplitude)?;
        }
        add("Range after", &values(after.range.as_slice()), &scales.range)?;
    }
    if let (Some(before), Some(after)) = (errors_before(view), range_errors(view)) {
        let in_millimetres = |errors: &[f64]| errors.iter().map(|e| 1e3 * e).collect::<Vec<_>>();
        add("Range error before", &in_millimetres(&before), &scales.error_before)?;
        add("Range error after (all pixels)", &in_millimetres(&after), &scales.error_after)?;
    } else if let (Some(before), Some(after)) = (&view.before, view.snapshot()) {
        let change = before.range.as_slice().iter().zip(after.range.as_slice());
        let change: Vec<f64> = change.map(|(b, a)| 1e3 * f64::from(a - b)).collect();
        let limit = quantile(&mut change.iter().map(|c| c.abs()).collect::<Vec<_>>(), 0.95).max(1.0);
        add(
            "Range, after minus before",
            &change,
            &Scale { map: ColourMap::Diverging, low: -limit, high: limit, unit: "mm" },
        )?;
    }
    figures.extend(correction_maps(view)?);
    if let Some(risk) = &view.multipath_risk_m {
        let risk: Vec<f64> = risk.as_slice().iter().map(|risk| 1e3 * f64::from(*risk)).collect();
        let high = quantile(&mut risk.clone(), 0.99);
        let high = if high.is_finite() { high.max(1.0) } else { 1.0 };
        let scale = Scale { map: ColourMap::Sequential, low: 0.0, high, unit: "mm" };
        let note =
            "What light that bounced once in the scene is expected to add to the ranges. Grey: part of no flat patch.";
        figures.push((raster_figure("Expected multipath error", width, &risk, &scale)?, note.to_owned()));
    }
    figures.push((flag_picture(view)?, "Grey: no flag. Colours as in the table of flags.".to_owned()));
    Ok(figures)
}

fn flag_picture(view: &View) -> Result<Figure> {
    let (width, _) = view.size();
    let flags = view.flags().map(range_image::Raster::as_slice).unwrap_or_default();
    let colour = |flags: &Flags| {
        let first = Flags::NAMED.iter().position(|(flag, _)| flags.contains(*flag));
        first.map_or(NO_VALUE, |k| CATEGORIES[k])
    };
    let rgb: Vec<u8> = flags.iter().flat_map(colour).collect();
    Ok(rgb_figure("Flags", width, &rgb)?)
}

fn flags(page: &mut Document, outcome: &Outcome, summary: &Summary) {
    page.section("Flags by reason");
    page.paragraph("A flagged pixel keeps its value; the cloud's figures and pictures leave it out.");
    let rows: Vec<Vec<String>> = Flags::NAMED
        .iter()
        .enumerate()
        .map(|(k, (_, name))| {
            let fraction = summary.flags_fraction.get(*name).copied().unwrap_or(0.0);
            vec![(*name).replace('_', " "), COLOUR_NAMES[k].to_owned(), format!("{:.2} %", 100.0 * fraction)]
        })
        .collect();
    page.table(["reason", "colour in the pictures", "pixels"], rows);
    let sigma: Vec<f64> = outcome
        .views
        .iter()
        .filter_map(|view| match &view.data {
            ViewData::Range(frame) => Some(frame.sigma.as_slice().iter().zip(frame.flags.as_slice())),
            _ => None,
        })
        .flatten()
        .filter(|(sigma, flags)| flags.is_empty() && sigma.is_finite())
        .map(|(sigma, _)| 1e3 * f64::from(*sigma))
        .collect();
    if !sigma.is_empty() {
        let high = quantile(&mut sigma.clone(), 0.99);
        let axes = Axes { title: "Standard deviation of the ranges", x: "sigma, mm", y: "% of pixels" };
        let sets = [Series { name: "unflagged", colour: CATEGORIES[2], values: sigma }];
        page.figures([(histogram(&axes, [0.0, high], &sets), String::new())]);
    }
}

/// Names of the first colours of [`CATEGORIES`], in the order of [`Flags::NAMED`].
const COLOUR_NAMES: [&str; Flags::NAMED.len()] =
    ["blue", "orange", "green", "red", "purple", "brown", "pink", "grey", "olive"];
