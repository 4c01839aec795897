//! Figures of a tracked sequence.

use nalgebra::Isometry3;
use pipeline::Result;
use report::{
    Axes, CATEGORIES, CHART_SIZE, Canvas, Direction, Figure, Series, StationCloud, cloud_figure, curves, span, to_scale,
};

use crate::track::outcome::{FramePose, Tracked, TrackedFrame};

/// Points of the map in the pictures; more would not show.
const MOST_DRAWN: usize = 400_000;
const TIME: &str = "time since the first frame (s)";
const ONLINE: [u8; 3] = CATEGORIES[0];
const RELOCALISED: [u8; 3] = CATEGORIES[1];
const ADJUSTED: [u8; 3] = CATEGORIES[2];
const LOST: [u8; 3] = CATEGORIES[3];

/// The figures of each section.
#[derive(Default)]
pub(crate) struct Figures {
    pub(crate) path: Vec<Figure>,
    pub(crate) time: Vec<Figure>,
    pub(crate) map: Vec<Figure>,
}

impl Figures {
    pub(crate) fn new(tracked: &Tracked) -> Result<Self> {
        Ok(Self { path: path_figures(tracked), time: time_figures(tracked), map: map_figures(tracked)? })
    }
}

fn path_figures(tracked: &Tracked) -> Vec<Figure> {
    let [above, side] = Direction::above_and_side(tracked.vertical_axis);
    let caption = "One scale in both directions. Orange: found again; red: last pose before a loss. The black dot is \
                   the start.";
    vec![
        path_figure(tracked, "Path from above", above).caption(caption),
        path_figure(tracked, "Path from the side", side),
    ]
}

fn path_figure(tracked: &Tracked, title: &str, direction: Direction) -> Figure {
    const NAMES: [&str; 3] = ["x (m)", "y (m)", "z (m)"];
    let places = |of: fn(&FramePose) -> Isometry3<f64>| -> Vec<(f64, f64)> {
        let place = |pose: &FramePose| {
            let at = of(pose).translation.vector;
            if pose.is_known { (at[direction.right], at[direction.up]) } else { (f64::NAN, f64::NAN) }
        };
        tracked.poses.iter().map(place).collect()
    };
    let (online, adjusted) = (places(|pose| pose.tracked), places(|pose| pose.adjusted));
    let both = || online.iter().chain(&adjusted);
    let (x, y) = to_scale(span(both().map(|point| point.0)), span(both().map(|point| point.1)));
    let axes = Axes { title, x: NAMES[direction.right], y: NAMES[direction.up] };
    let mut canvas = Canvas::new(&axes, CHART_SIZE, x, y);
    canvas.line(&online, ONLINE, "");
    canvas.line(&adjusted, ADJUSTED, "5 3");
    let frames = &tracked.summary.per_frame;
    let chosen = |pick: &dyn Fn(usize) -> bool| -> Vec<(f64, f64)> {
        (0..frames.len()).filter(|&k| pick(k)).map(|k| online[k]).collect()
    };
    canvas.points(&chosen(&|k| frames[k].state == "relocalised"), RELOCALISED, 1.0);
    let before_loss = |k: usize| frames[k].reason.is_none() && frames.get(k + 1).is_some_and(|f| f.reason.is_some());
    canvas.points(&chosen(&before_loss), LOST, 1.0);
    canvas.points(&chosen(&|k| frames[k].state == "started"), [0, 0, 0], 1.0);
    canvas.name(ONLINE, "as tracked");
    canvas.name(ADJUSTED, "adjusted");
    canvas.finish()
}

fn time_figures(tracked: &Tracked) -> Vec<Figure> {
    let frames = &tracked.summary.per_frame;
    let scaled = |factor: f64, pick: fn(&TrackedFrame) -> Option<f64>| -> Vec<(f64, f64)> {
        frames
            .iter()
            .map(|frame| (frame.timestamp_s - frames[0].timestamp_s, factor * pick(frame).unwrap_or(f64::NAN)))
            .collect()
    };
    let curve = |title: &str, y: &str, values: Vec<(f64, f64)>| {
        curves(&Axes { title, x: TIME, y }, &[Series { name: "as tracked", colour: ONLINE, values }])
    };
    let times = [
        ("tracking", ONLINE, scaled(1.0, |f| Some(f.track_ms))),
        ("with reading", RELOCALISED, scaled(1.0, |f| Some(f.total_ms))),
    ];
    let times = times.map(|(name, colour, values)| Series { name, colour, values });
    let state =
        "Part of the frame that agrees with its keyframe. Lost frames lie at zero; where it falls, a keyframe is made.";
    let position = curve("Standard deviation of the position", "sigma (mm)", scaled(1e3, |f| f.position_sigma_m));
    let attitude = curve("Standard deviation of the attitude", "sigma (°)", scaled(1.0, |f| f.attitude_sigma_deg));
    let residuals = curve("Residuals", "rms (mm)", scaled(1e3, |f| f.rms_m));
    let time = curves(&Axes { title: "Time a frame", x: TIME, y: "time (ms)" }, &times);
    vec![
        state_figure(frames).caption(state),
        position.caption("In space, since the datum; as the noise of the ranges makes it expected."),
        attitude,
        residuals.caption("Of each frame on its keyframe."),
        time.caption("Wall-clock time on this machine."),
    ]
}

/// State of tracking at each frame.
fn state_figure(frames: &[TrackedFrame]) -> Figure {
    let start = frames[0].timestamp_s;
    let end = frames[frames.len() - 1].timestamp_s;
    let axes = Axes { title: "State", x: TIME, y: "overlap with the keyframe (%)" };
    let mut canvas = Canvas::new(&axes, CHART_SIZE, span([0.0, end - start].into_iter()), [-4.0, 104.0]);
    let chosen = |pick: fn(&TrackedFrame) -> bool| -> Vec<(f64, f64)> {
        let at = |frame: &TrackedFrame| (frame.timestamp_s - start, 100.0 * frame.overlap);
        frames.iter().filter(|frame| pick(frame)).map(at).collect()
    };
    let line = |frame: &TrackedFrame| {
        let value = if frame.reason.is_none() { 100.0 * frame.overlap } else { f64::NAN };
        (frame.timestamp_s - start, value)
    };
    canvas.line(&frames.iter().map(line).collect::<Vec<_>>(), ONLINE, "");
    canvas.points(&chosen(|frame| frame.became_keyframe), ADJUSTED, 1.0);
    canvas.points(&chosen(|frame| frame.state == "relocalised"), RELOCALISED, 1.0);
    canvas.points(&chosen(|frame| frame.reason.is_some()), LOST, 1.0);
    for (colour, name) in [(ONLINE, "tracked"), (ADJUSTED, "keyframe"), (RELOCALISED, "found again"), (LOST, "lost")] {
        canvas.name(colour, name);
    }
    canvas.finish()
}

fn map_figures(tracked: &Tracked) -> Result<Vec<Figure>> {
    let every = tracked.map.points.len().div_ceil(MOST_DRAWN).max(1);
    let start = tracked.poses.iter().find(|pose| pose.is_known);
    let map = [StationCloud {
        name: "planes of all keyframes",
        points: tracked.map.points.iter().step_by(every).map(|point| point.coords.into()).collect(),
        position: start.map_or([f64::NAN; 3], |pose| pose.adjusted.translation.vector.into()),
    }];
    let mut figures = Vec::new();
    for (name, direction) in
        ["from above", "from the side"].into_iter().zip(Direction::above_and_side(tracked.vertical_axis))
    {
        let caption = "The middle half along the direction of view; the dot is the start. Where keyframes overlap, \
                       surfaces come several times: how they cover each other shows how well the path fits.";
        let figure = cloud_figure(&format!("Map {name}"), &map, direction)?;
        figures.push(if figures.is_empty() { figure.caption(caption) } else { figure });
    }
    Ok(figures)
}
