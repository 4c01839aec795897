//! Figures of a run.

use range_image::Flags;
use report::{
    Axes, CATEGORIES, ColourMap, Direction, Figure, NO_VALUE, Scale, Series, StationCloud, cloud_figure, histogram,
    raster_figure, rgb_figure,
};

use crate::Result;
use crate::run::correction_maps::correction_maps;
use crate::survey::outcome::{Outcome, world_points};
use crate::survey::truth::{range_errors, wrap};
use crate::survey::view::{Snapshot, View, ViewData};
use statistics::quantile;

/// Stations whose pictures are shown; further ones would make the page heavy without telling more.
const PICTURED_STATIONS: usize = 8;

/// What the page shows beside the summary.
#[derive(Default)]
pub(crate) struct Figures {
    /// Histograms of the errors against the truth.
    pub(crate) errors: Vec<Figure>,
    /// The cloud in the common frame.
    pub(crate) cloud: Vec<Figure>,
    /// Before and after, by view.
    pub(crate) views: Vec<(String, Vec<Figure>)>,
    /// Views that are not pictured.
    pub(crate) not_pictured: usize,
    /// Standard deviations of the ranges.
    pub(crate) sigma: Option<Figure>,
    /// Poses of the stations: coordinates in metre, and the standard deviation of the position.
    pub(crate) poses: Vec<(String, [f64; 3], Option<f64>)>,
}

impl Figures {
    pub(crate) fn new(outcome: &Outcome) -> Result<Self> {
        let scales = Scales::of(outcome);
        let pictured = outcome.views.iter().take(PICTURED_STATIONS);
        let views = pictured.map(|view| Ok((view.name(), view_figures(view, &scales)?))).collect::<Result<_>>()?;
        let poses = outcome.views.iter().zip(&outcome.poses).map(|(view, pose)| {
            (view.station.clone(), pose.world_from_camera.translation.vector.into(), pose.position_sigma_m())
        });
        Ok(Self {
            errors: error_figures(outcome),
            cloud: cloud_figures(outcome)?,
            views,
            not_pictured: outcome.views.len().saturating_sub(PICTURED_STATIONS),
            sigma: sigma_figure(outcome),
            poses: poses.collect(),
        })
    }
}

/// The cloud from above and from the side; none where there is no common frame.
fn cloud_figures(outcome: &Outcome) -> Result<Vec<Figure>> {
    let Some(poses) = outcome.common_poses().filter(|_| !outcome.clouds.is_empty()) else { return Ok(Vec::new()) };
    let clouds: Vec<StationCloud<'_>> = outcome
        .clouds
        .iter()
        .zip(&outcome.views)
        .zip(&poses)
        .map(|((cloud, view), pose)| StationCloud {
            name: &view.station,
            points: world_points(cloud, &pose.world_from_camera),
            position: pose.world_from_camera.translation.vector.into(),
        })
        .collect();
    let [above, side] = Direction::above_and_side(outcome.vertical_axis);
    let note = "The middle half along the direction of view, unflagged points, one colour a station; dots are the perspective centres.";
    Ok(vec![cloud_figure("From above", &clouds, above)?.caption(note), cloud_figure("From the side", &clouds, side)?])
}

/// Histograms of the errors against the truth.
fn error_figures(outcome: &Outcome) -> Vec<Figure> {
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
        return Vec::new();
    }
    let wide = quantile(&mut before.iter().map(|error| error.abs()).collect::<Vec<_>>(), 0.98);
    let narrow = quantile(&mut after.iter().map(|error| error.abs()).collect::<Vec<_>>(), 0.99);
    let axes = |title| Axes { title, x: "measured minus true range, mm", y: "% of pixels" };
    let both = [
        Series { name: "before, all pixels", colour: CATEGORIES[1], values: before },
        Series { name: "after, unflagged", colour: CATEGORIES[0], values: after.clone() },
    ];
    let only = [Series { name: "after, unflagged", colour: CATEGORIES[0], values: after }];
    let note = "Before: as the camera alone would give it, modulo the ambiguity interval. What lies outside the span is \
                counted in the outermost bins.";
    vec![
        histogram(&axes("Before and after"), [-wide, wide], &both).caption(note),
        histogram(&axes("After"), [-narrow, narrow], &only).caption("The same, enlarged."),
    ]
}

/// Errors of the ranges as the camera alone gives them, modulo the ambiguity interval, metre.
fn errors_before(view: &View) -> Option<Vec<f64>> {
    let (truth, before) = (view.truth.as_ref()?, view.before.as_ref()?);
    let pairs = before.range.as_slice().iter().zip(truth.range.as_slice());
    Some(
        pairs
            .map(|(range, truth)| {
                let error = f64::from(*range) - f64::from(*truth);
                view.modulation.map_or(error, |modulation| wrap(error, modulation))
            })
            .collect(),
    )
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

fn view_figures(view: &View, scales: &Scales) -> Result<Vec<Figure>> {
    let (width, _) = view.size();
    let mut figures = Vec::new();
    let mut add = |title: &str, values: &[f64], scale: &Scale| -> Result<()> {
        figures.push(raster_figure(title, width, values, scale)?);
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
        figures.push(raster_figure("Expected multipath error", width, &risk, &scale)?.caption(note));
    }
    figures.push(flag_picture(view)?.caption("Grey: no flag. Colours as in the table of flags."));
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

/// Standard deviations of the unflagged ranges.
fn sigma_figure(outcome: &Outcome) -> Option<Figure> {
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
        return Some(histogram(&axes, [0.0, high], &sets));
    }
    None
}
