//! Figures of a run.

pub(crate) mod correction_maps;
pub(crate) mod pictures;

use nalgebra::Point3;
use report::{Axes, CATEGORIES, Direction, Figure, Series, StationCloud, cloud_figure, histogram};
use statistics::quantile;

use crate::Result;
use crate::run::figures::pictures::{PICTURED_STATIONS, Scales};
use crate::run::kept::{Kept, Values};
use crate::survey::records::{StationPose, ViewRecord};

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
    /// Poses of the stations that were found: coordinates in metre, and the standard deviation of the position.
    pub(crate) poses: Vec<(String, [f64; 3], Option<f64>)>,
}

impl Figures {
    /// `found`: poses that were found; `common`: of all views in one frame, in which an axis is vertical.
    pub(crate) fn new(
        kept: Kept,
        found: &[StationPose],
        common: Option<&[StationPose]>,
        vertical_axis: usize,
    ) -> Result<Self> {
        let Kept { views, pictures, values, .. } = kept;
        let scales = Scales::of(&values);
        let poses = views.iter().zip(found).map(|(view, pose)| {
            (view.station.clone(), pose.world_from_camera.translation.vector.into(), pose.position_sigma_m())
        });
        Ok(Self {
            cloud: cloud_figures(&views, &values, common, vertical_axis)?,
            poses: poses.collect(),
            not_pictured: views.len().saturating_sub(PICTURED_STATIONS),
            views: pictures.into_iter().map(|pictures| pictures.figures(&scales)).collect::<Result<_>>()?,
            sigma: sigma_figure(&values),
            errors: error_figures(&values),
        })
    }
}

/// The cloud from above and from the side; none where there is no common frame.
fn cloud_figures<'a>(
    views: &'a [ViewRecord],
    values: &Values,
    common: Option<&[StationPose]>,
    vertical_axis: usize,
) -> Result<Vec<Figure>> {
    let Some(poses) = common.filter(|_| views.iter().any(|view| view.points.is_some())) else {
        return Ok(Vec::new());
    };
    let cloud = |((view, points), pose): ((&'a ViewRecord, &Vec<[f64; 3]>), &StationPose)| StationCloud {
        name: &view.station,
        points: points.iter().map(|point| (pose.world_from_camera * Point3::from(*point)).coords.into()).collect(),
        position: pose.world_from_camera.translation.vector.into(),
    };
    let clouds: Vec<StationCloud<'_>> = views.iter().zip(&values.points).zip(poses).map(cloud).collect();
    let [above, side] = Direction::above_and_side(vertical_axis);
    let note = "The middle half along the direction of view, unflagged points, one colour a station; dots are the perspective centres.";
    Ok(vec![cloud_figure("From above", &clouds, above)?.caption(note), cloud_figure("From the side", &clouds, side)?])
}

/// Histograms of the errors against the truth.
fn error_figures(values: &Values) -> Vec<Figure> {
    let [before, after] = values.errors_m.each_ref().map(|errors| errors.iter().map(|m| 1e3 * m).collect::<Vec<_>>());
    if after.is_empty() {
        return Vec::new();
    }
    let share =
        |errors: &[f64], share| quantile(&mut errors.iter().map(|error| error.abs()).collect::<Vec<_>>(), share);
    let (wide, narrow) = (share(&before, 0.98), share(&after, 0.99));
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

/// Standard deviations of the unflagged ranges.
fn sigma_figure(values: &Values) -> Option<Figure> {
    let sigma: Vec<f64> = values.sigma_m.iter().filter(|sigma| sigma.is_finite()).map(|sigma| 1e3 * sigma).collect();
    (!sigma.is_empty()).then(|| {
        let high = quantile(&mut sigma.clone(), 0.99);
        let axes = Axes { title: "Standard deviation of the ranges", x: "sigma, mm", y: "% of pixels" };
        let sets = [Series { name: "unflagged", colour: CATEGORIES[2], values: sigma }];
        histogram(&axes, [0.0, high], &sets)
    })
}
