//! Pictures: the standard deviations on the cloud, their shares, and a section through a wall before and after.

use std::collections::BTreeMap;

use commands::Result;
use fusion::{Fused, FusionOptions, Surfel};
use nalgebra::{Point3, Vector3};
use point_uncertainty::{SharedErrorGrid, Source};
use report::{
    Axes, CATEGORIES, CHART_SIZE, Canvas, ColourMap, Drawn, Figure, LineOfSight, Scale, deviation_figure,
    raster_figure, robust_span, span,
};
use statistics::{quantile, upper_median};

use super::input::Usable;
use super::summarise::{DISAGREEMENT, SHAPE, mean_shares};

/// Places that are looked at for a section.
const CANDIDATES: usize = 50;
/// Half of a section's length in cells.
const REACH: f64 = 12.0;
/// Cosine of the angle by which pieces of one wall may differ: half a cell over a dozen cells is less.
const SAME_WALL: f64 = 0.98;
/// Share of its place that a bar takes.
const BAR: f64 = 0.7;
/// Numbers of frames that have a bar; the last is so many and more.
const MOST_FRAMES: usize = 6;

/// All pictures of a fused cloud.
pub(crate) fn figures(
    usable: &Usable<'_>,
    moved: &[Point3<f64>],
    fused: &Fused,
    options: &FusionOptions,
) -> Result<Vec<Figure>> {
    let mut all = maps(&fused.surfels)?;
    all.push(shares(&fused.surfels));
    all.extend(sections(usable, moved, fused, options.voxel_m));
    if let Some(grid) = options.shared_error.filter(|_| fused.shared_error.is_some()) {
        all.push(shared_error(fused, &grid)?);
    }
    Ok(all)
}

/// What was taken off of the error that all frames share, node by node of its grid over the image.
fn shared_error(fused: &Fused, grid: &SharedErrorGrid) -> Result<Figure> {
    // Where the inverse depth is too large, depths are too small.
    let values: Vec<f64> = fused.corrections[grid.columns()].iter().map(|value| -1e3 * value).collect();
    let largest = quantile(&mut values.iter().map(|value| value.abs()).collect::<Vec<f64>>(), 0.98).max(0.01);
    let scale = Scale { map: ColourMap::Diverging, low: -largest, high: largest, unit: "mm" };
    let figure = raster_figure("The error that all frames share, over the image", grid.nodes()[0], &values, &scale)?;
    Ok(figure.caption(
        "Of a depth of one metre, millimetre; positive where depths are too long. It grows with the squared depth.",
    ))
}

/// The cloud in the colours of its standard deviations, along the two axes that show most of it.
fn maps(surfels: &[Surfel]) -> Result<Vec<Figure>> {
    let points: Vec<[f64; 3]> = surfels.iter().map(|surfel| surfel.position.coords.into()).collect();
    let sigmas: Vec<f64> = surfels.iter().map(|surfel| 1e3 * surfel.sigma_m()).collect();
    let [low, high] = [0.02, 0.98].map(|share| quantile(&mut sigmas.clone(), share));
    // Where all are alike, the scale still has a length.
    let scale = Scale { map: ColourMap::Sequential, low, high: high.max(low + 0.01), unit: "mm" };
    let picture = |view: LineOfSight| -> Result<Figure> {
        let title = format!("Standard deviation along the normal, seen {}", view.name());
        let figure = deviation_figure(&title, &points, &sigmas, view, &scale)?;
        Ok(figure.caption("From all sources, millimetre. Colours end where two of a hundred fused points are beyond."))
    };
    LineOfSight::two(&points).into_iter().map(picture).collect()
}

/// One bar a number of frames, the shares of the variance on each other.
fn shares(surfels: &[Surfel]) -> Figure {
    let axes = Axes {
        title: "Shares",
        x: "frames that see the fused point (6: six and more)",
        y: "mean share of the variance, %",
    };
    let most = surfels.iter().map(|surfel| surfel.frames.len()).max().unwrap_or(1).clamp(1, MOST_FRAMES);
    let mut canvas = Canvas::new(&axes, CHART_SIZE, [0.5, most as f64 + 0.5], [0.0, 100.0]);
    let names: Vec<&str> = Source::ALL.into_iter().map(Source::name).chain([DISAGREEMENT, SHAPE]).collect();
    let of = |frames: usize| surfels.iter().filter(move |surfel| surfel.frames.len().clamp(1, MOST_FRAMES) == frames);
    let means: Vec<_> = (1..=most).map(|frames| (frames, mean_shares(of(frames)))).collect();
    // The tallest first: each next one covers it from below.
    for last in (0..names.len()).rev() {
        let bar = |(frames, shares): &(usize, BTreeMap<&'static str, f64>)| {
            let part = |name: &&str| shares.get(*name).copied().unwrap_or(0.0).max(0.0);
            let all: f64 = names.iter().map(part).sum();
            let height = 100.0 * names[..=last].iter().map(part).sum::<f64>() / all.max(f64::MIN_POSITIVE);
            (*frames as f64 - 0.5 * BAR, *frames as f64 + 0.5 * BAR, height)
        };
        let bars: Vec<(f64, f64, f64)> = means.iter().filter(|(_, shares)| !shares.is_empty()).map(bar).collect();
        canvas.bars(&bars, CATEGORIES[last]);
    }
    for (name, colour) in names.iter().zip(CATEGORIES) {
        canvas.name(colour, name);
    }
    canvas.finish().caption(
        "Shares of the variance by source, mean over the fused points; a share below zero (sources that compensate each other) is not \
         shown.",
    )
}

/// A strip across a wall.
struct Strip {
    middle: Point3<f64>,
    normal: Vector3<f64>,
    along: Vector3<f64>,
    aside: Vector3<f64>,
    voxel_m: f64,
}

impl Strip {
    /// Along the wall (metre) and off it (millimetre), where the point lies in the strip.
    fn place(&self, point: &Point3<f64>) -> Option<(f64, f64)> {
        let way = point - self.middle;
        let (along, off) = (self.along.dot(&way), self.normal.dot(&way));
        let is_in = along.abs() <= REACH * self.voxel_m
            && self.aside.dot(&way).abs() <= self.voxel_m
            && off.abs() <= self.voxel_m;
        is_in.then_some((along, 1e3 * off))
    }

    /// The strip on whose wall most frames saw most.
    fn best(surfels: &[Surfel], voxel_m: f64) -> Option<Self> {
        let most = surfels.iter().map(|surfel| surfel.frames.len()).max()?;
        let seen: Vec<&Surfel> = surfels.iter().filter(|surfel| surfel.frames.len() == most).collect();
        let candidates = seen.iter().step_by(seen.len().div_ceil(CANDIDATES).max(1));
        let strips = candidates.flat_map(|surfel| {
            let normal = surfel.normal;
            let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
            let second = normal.cross(&first);
            [(first, second), (second, first)].map(|(along, aside)| Self {
                middle: surfel.position,
                normal,
                along,
                aside,
                voxel_m,
            })
        });
        let weighed = strips.map(|strip| {
            let weight: usize = strip.on(surfels).map(|surfel| surfel.frames.len()).sum();
            (weight, strip)
        });
        let (_, best) = weighed.reduce(|best, next| if next.0 > best.0 { next } else { best })?;
        Some(best.straightened(surfels))
    }

    /// The fused points of its wall.
    fn on<'a>(&self, surfels: &'a [Surfel]) -> impl Iterator<Item = &'a Surfel> {
        surfels.iter().filter(|s| s.normal.dot(&self.normal) > SAME_WALL && self.place(&s.position).is_some())
    }

    /// Turned from the normal of one fused point, which noise tilts, into the wall that all of them show.
    fn straightened(mut self, surfels: &[Surfel]) -> Self {
        let mean: Vector3<f64> = self.on(surfels).map(|surfel| surfel.normal).sum();
        self.turn(mean);
        let places: Vec<(f64, f64)> = self.on(surfels).filter_map(|surfel| self.place(&surfel.position)).collect();
        let count = places.len().max(1) as f64;
        let x = places.iter().map(|place| place.0).sum::<f64>() / count;
        let y = places.iter().map(|place| place.1).sum::<f64>() / count;
        let squares: f64 = places.iter().map(|place| (place.0 - x).powi(2)).sum();
        let products: f64 = places.iter().map(|place| (place.0 - x) * (place.1 - y)).sum();
        self.middle += self.normal * (1e-3 * y) + self.along * x;
        if squares > 0.0 {
            self.turn(self.normal - self.along * (1e-3 * products / squares));
        }
        self
    }

    fn turn(&mut self, normal: Vector3<f64>) {
        self.normal = normal.normalize();
        self.aside = self.normal.cross(&self.along).normalize();
        self.along = self.aside.cross(&self.normal);
    }
}

/// A section through a wall: the points of the frames as they are in the result, and what became of them.
fn sections(usable: &Usable<'_>, moved: &[Point3<f64>], fused: &Fused, voxel_m: f64) -> Vec<Figure> {
    let Some(strip) = Strip::best(&fused.surfels, voxel_m) else { return Vec::new() };
    let in_strip = |points: &[Point3<f64>]| -> Vec<(u32, (f64, f64))> {
        let placed = points.iter().zip(&usable.frames);
        placed.filter_map(|(point, frame)| Some((*frame, strip.place(point)?))).collect()
    };
    let (before, after) = (in_strip(&usable.points), in_strip(moved));
    let surfels: Vec<(f64, f64)> = fused.surfels.iter().filter_map(|surfel| strip.place(&surfel.position)).collect();
    let all = || before.iter().chain(&after).map(|(_, place)| *place);
    let axes =
        Section { x: span(all().map(|place| place.0)), y: robust_span(all().map(|place| place.1)), cell_m: voxel_m };
    let views = &usable.cloud.views;
    let lines =
        "grey, and of each frame the median along the wall as a line (dark to bright: in the order of the frames)";
    let (figure, drawn) = axes.draw("Section through a wall: before", &before, &[], views);
    let before = figure.caption(format!(
        "Points of the frames as the result has them, two cells deep, {lines}. Heights are exaggerated.{}",
        drawn.words()
    ));
    let (figure, drawn) = axes.draw("Section through a wall: after", &after, &surfels, views);
    let after = figure.caption(format!(
        "The same with what was found of the common errors taken off, and the fused points (black).{}",
        drawn.words()
    ));
    vec![before, after]
}

/// Frames whose names fit beside the title of a section.
const MOST_NAMED: usize = 3;

/// Points of a frame, about, that a median is of, and the fewest.
const POINTS_OF_MEDIAN: f64 = 8.0;
const FEWEST_OF_MEDIAN: usize = 3;
const POINTS_GREY: [u8; 3] = [150, 158, 168];

/// Axes that both sections have.
struct Section {
    x: [f64; 2],
    y: [f64; 2],
    cell_m: f64,
}

impl Section {
    fn draw(
        &self,
        title: &str,
        points: &[(u32, (f64, f64))],
        surfels: &[(f64, f64)],
        views: &[String],
    ) -> (Figure, Drawn) {
        let axes = Axes { title, x: "along the wall, m", y: "along the normal, mm" };
        let mut canvas = Canvas::new(&axes, CHART_SIZE, self.x, self.y);
        let all: Vec<(f64, f64)> = points.iter().map(|(_, place)| *place).collect();
        let drawn = canvas.cloud(&all, POINTS_GREY, 0.5);
        let mut frames: Vec<u32> = points.iter().map(|(frame, _)| *frame).collect();
        frames.sort_unstable();
        frames.dedup();
        let points_per_m = all.len() as f64 / (frames.len().max(1) as f64 * (self.x[1] - self.x[0]));
        let step_m = (0.5 * self.cell_m).max(POINTS_OF_MEDIAN / points_per_m);
        for (at, frame) in frames.iter().enumerate() {
            let colour = ColourMap::Sequential.colour(at as f64 / frames.len().saturating_sub(1).max(1) as f64);
            let places = points.iter().filter(|(of, _)| of == frame).map(|(_, place)| *place);
            canvas.line(&Self::medians(places, step_m), colour, "");
            // Names of many would not fit beside the title.
            if frames.len() <= MOST_NAMED {
                canvas.name(colour, views.get(*frame as usize).map_or("", String::as_str));
            }
        }
        canvas.points(surfels, [0, 0, 0], 1.0);
        (canvas.finish(), drawn)
    }

    /// Medians of heights over so much of the wall each, not a number where there are too few.
    fn medians(places: impl Iterator<Item = (f64, f64)>, step_m: f64) -> Vec<(f64, f64)> {
        let mut heights: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
        for (along, height) in places {
            heights.entry((along / step_m).floor() as i64).or_default().push(height);
        }
        let (Some((&first, _)), Some((&last, _))) = (heights.first_key_value(), heights.last_key_value()) else {
            return Vec::new();
        };
        let mut median = |at: i64| {
            let heights = heights.get_mut(&at).filter(|heights| heights.len() >= FEWEST_OF_MEDIAN);
            heights.map_or(f64::NAN, |heights| upper_median(heights))
        };
        (first..=last).map(|at| ((at as f64 + 0.5) * step_m, median(at))).collect()
    }
}
