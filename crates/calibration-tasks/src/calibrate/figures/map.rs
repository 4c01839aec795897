//! The network from above and from the side.

use std::fmt::Write;

use camera_model::Camera;
use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, SymmetricEigen, Vector3};
use report::{CATEGORIES, Direction, Figure, Labels, escape, hex, open_svg, ticks};
use self_calibration::{AdjustedStation, AdjustedTarget};
use statistics::quantile;

use crate::calibrate::figures::image_residuals::round_factor;
use crate::calibrate::figures::spread::spread;

const WIDTH: f64 = 590.0;
const TALLEST: f64 = 560.0;
const EDGE: f64 = 34.0;
const TITLE: f64 = 22.0;
/// Half axes of a 95 % ellipse in standard deviations: the root of the 95 % quantile of chi squared with two degrees of
/// freedom.
const ELLIPSE_95: f64 = 2.447_746_830_680_816;
/// Longer half axis of the median ellipse of the targets, in pixels of the figure.
const TYPICAL_ELLIPSE: f64 = 11.0;

/// Stations drawn as pyramids, targets with ellipses, and dots of each kind, at most.
const MOST_PYRAMIDS: usize = 30;
const MOST_ELLIPSES: usize = 120;
const MOST_DOTS: usize = 2_000;

/// A station that does not exist yet, with a word for it.
pub(crate) struct Proposed {
    pub(crate) name: String,
    pub(crate) world_from_camera: Isometry3<f64>,
}

pub(crate) fn figures(
    camera: &Camera,
    stations: &[AdjustedStation],
    targets: &[AdjustedTarget],
    proposed: &[Proposed],
) -> Vec<(Figure, String)> {
    let [above, side] = Direction::above_and_side(vertical_axis(stations));
    let places: Vec<_> = stations.iter().map(|station| station.world_from_camera.translation.vector).collect();
    let pyramids = spread(&places, MOST_PYRAMIDS);
    let ellipses = spread(&targets.iter().map(|target| target.point.coords).collect::<Vec<_>>(), MOST_ELLIPSES);
    let mut figures = Vec::new();
    for (title, direction) in [("From above", above), ("From the side", side)] {
        let poses = stations.iter().map(|station| &station.world_from_camera);
        let poses = poses.chain(proposed.iter().map(|candidate| &candidate.world_from_camera));
        let Some(view) = View::around(poses, targets, direction) else { continue };
        let exaggeration = view.exaggeration(targets);
        let mut svg = open_svg(title, view.size[0], view.size[1] + TITLE);
        view.grid(&mut svg);
        view.targets(&mut svg, targets, &ellipses, exaggeration);
        let mut labels = Labels::new(view.size);
        for station in stations.iter().step_by(stations.len().div_ceil(MOST_DOTS).max(1)) {
            view.dot(&mut svg, &station.world_from_camera, CATEGORIES[0]);
        }
        for station in pyramids.iter().map(|index| &stations[*index]) {
            view.station(&mut svg, camera, &station.world_from_camera, CATEGORIES[0], "");
            view.ellipse(&mut svg, &station.world_from_camera.translation.vector, &position(station), exaggeration, 0);
        }
        for candidate in proposed {
            view.station(&mut svg, camera, &candidate.world_from_camera, CATEGORIES[1], "4 3");
        }
        let named = pyramids.iter().map(|index| (&stations[*index].world_from_camera, &stations[*index].name));
        for (pose, name) in named.chain(proposed.iter().map(|new| (&new.world_from_camera, &new.name))) {
            labels.place(&mut svg, view.at(&pose.translation.vector), name);
        }
        svg.push_str("</svg>");
        let thinned = Thinned {
            pyramids: [pyramids.len(), stations.len()],
            ellipses: [ellipses.len(), targets.len()],
            unnamed: labels.left_out,
        };
        figures.push((Figure::new(svg), caption(exaggeration, !proposed.is_empty(), &thinned)));
    }
    figures
}

/// What of a large network is not drawn.
struct Thinned {
    /// Stations drawn as pyramids, and all.
    pyramids: [usize; 2],
    /// Targets drawn with ellipses, and all.
    ellipses: [usize; 2],
    /// Names that would have run over others.
    unnamed: usize,
}

impl Thinned {
    fn words(&self) -> String {
        let drawn = [(self.pyramids, "stations are drawn in full"), (self.ellipses, "targets have their ellipses")];
        let part = drawn.into_iter().filter(|([drawn, all], _)| drawn < all).map(|([drawn, all], what)| {
            format!(" {drawn} of {all} {what}, spread as widely as possible; the others are dots.")
        });
        let unnamed =
            (self.unnamed > 0).then(|| format!(" {} names are left out, as they would run over others.", self.unnamed));
        part.chain(unnamed).collect()
    }
}

fn caption(exaggeration: Option<f64>, proposed: bool, thinned: &Thinned) -> String {
    let ellipses = exaggeration.map_or_else(String::new, |factor| {
        format!(" Ellipses: 95 % of the adjusted position, {factor} times exaggerated.")
    });
    let new = if proposed { " Orange and dashed: proposed stations." } else { "" };
    format!("Pyramids: stations with what they see; green dots: targets.{ellipses}{new}{}", thinned.words())
}

fn position(station: &AdjustedStation) -> Matrix3<f64> {
    station.covariance.fixed_view::<3, 3>(0, 0).into_owned()
}

/// The world's axis that the cameras' own upward axes are nearest to. Rolled cameras cancel out in the sum of squares
/// only between the other two axes, so that the viewing axes decide: up is what cameras look along least.
fn vertical_axis(stations: &[AdjustedStation]) -> usize {
    let mut up = Vector3::zeros();
    for station in stations {
        let rotation = station.world_from_camera.rotation;
        up += (rotation * Vector3::y()).abs() - 2.0 * (rotation * Vector3::z()).abs();
    }
    let axis = up.imax();
    // A figure has z or y up; a world whose x is vertical is shown as it lies.
    if axis == 1 { 1 } else { 2 }
}

/// What a figure shows of the world.
struct View {
    direction: Direction,
    low: [f64; 2],
    metres_per_pixel: f64,
    size: [f64; 2],
}

impl View {
    fn around<'a>(
        poses: impl Iterator<Item = &'a Isometry3<f64>>,
        targets: &[AdjustedTarget],
        direction: Direction,
    ) -> Option<Self> {
        let places = poses.map(|pose| Point3::from(pose.translation.vector));
        let places: Vec<Point3<f64>> = places.chain(targets.iter().map(|target| target.point)).collect();
        let axes = [direction.right, direction.up];
        let bound = |pick: fn(f64, f64) -> f64, start: f64| {
            axes.map(|axis| places.iter().map(|place| place[axis]).filter(|v| v.is_finite()).fold(start, pick))
        };
        let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let spans = [0, 1].map(|k| (high[k] - low[k]).max(1e-3));
        if !spans.iter().all(|span| span.is_finite()) {
            return None;
        }
        let metres_per_pixel = (spans[0] / (WIDTH - 2.0 * EDGE)).max(spans[1] / (TALLEST - 2.0 * EDGE));
        let size = [WIDTH, spans[1] / metres_per_pixel + 2.0 * EDGE];
        // The narrower extent is centred.
        let spare = (WIDTH - 2.0 * EDGE) * metres_per_pixel - spans[0];
        let low = [low[0] - spare / 2.0, low[1]];
        Some(Self { direction, low, metres_per_pixel, size })
    }

    fn at(&self, place: &Vector3<f64>) -> [f64; 2] {
        let x = EDGE + (place[self.direction.right] - self.low[0]) / self.metres_per_pixel;
        let y = TITLE + self.size[1] - EDGE - (place[self.direction.up] - self.low[1]) / self.metres_per_pixel;
        [x, y]
    }

    fn grid(&self, svg: &mut String) {
        let (width, bottom) = (self.size[0], self.size[1] + TITLE);
        // Writing to a string can't fail.
        let _ = write!(
            svg,
            r##"<rect x="0.5" y="{TITLE}" width="{}" height="{}" fill="#fbfcfd" stroke="#c5ccd6"/>"##,
            width - 1.0,
            self.size[1] - 0.5
        );
        let span = |from: f64, pixels: f64| {
            [from - EDGE * self.metres_per_pixel, from + (pixels - EDGE) * self.metres_per_pixel]
        };
        let (values, decimals) = ticks(span(self.low[0], width), 7);
        for value in values {
            let x = EDGE + (value - self.low[0]) / self.metres_per_pixel;
            let _ = write!(
                svg,
                r##"<path d="M{x:.1} {TITLE}V{bottom:.1}" stroke="#e4e8ed"/><text x="{:.1}" y="{:.1}" class="tick">{value:.decimals$} m</text>"##,
                x + 2.0,
                bottom - 3.0
            );
        }
        let (values, decimals) = ticks(span(self.low[1], self.size[1]), 6);
        for value in values {
            let y = bottom - EDGE - (value - self.low[1]) / self.metres_per_pixel;
            let _ = write!(
                svg,
                r##"<path d="M0 {y:.1}H{width}" stroke="#e4e8ed"/><text x="2" y="{:.1}" class="tick">{value:.decimals$} m</text>"##,
                y - 2.0
            );
        }
    }

    /// How much larger than true the ellipses are drawn; `None` where no target has one.
    fn exaggeration(&self, targets: &[AdjustedTarget]) -> Option<f64> {
        let longest = |target: &AdjustedTarget| {
            let (axes, _) = self.axes(&target.covariance)?;
            Some(ELLIPSE_95 * axes[0])
        };
        let typical = quantile(&mut targets.iter().filter_map(longest).collect::<Vec<_>>(), 0.5);
        (typical > 0.0).then(|| round_factor(TYPICAL_ELLIPSE * self.metres_per_pixel / typical))
    }

    /// Half axes (metre, longer first) and direction of the longer one in the plane of the figure (radian).
    fn axes(&self, covariance: &Matrix3<f64>) -> Option<([f64; 2], f64)> {
        let Direction { right, up, .. } = self.direction;
        let (a, b, c) = (covariance[(right, right)], covariance[(right, up)], covariance[(up, up)]);
        if !(a.is_finite() && b.is_finite() && c.is_finite() && a + c > 0.0) {
            return None;
        }
        let eigen = SymmetricEigen::new(Matrix2::new(a, b, b, c));
        let longer = eigen.eigenvalues.imax();
        let axis = eigen.eigenvectors.column(longer).into_owned();
        let lengths = [longer, 1 - longer].map(|k| eigen.eigenvalues[k].max(0.0).sqrt());
        Some((lengths, axis.y.atan2(axis.x)))
    }

    fn ellipse(
        &self,
        svg: &mut String,
        place: &Vector3<f64>,
        covariance: &Matrix3<f64>,
        exaggeration: Option<f64>,
        colour: usize,
    ) {
        let (Some(exaggeration), Some((axes, angle))) = (exaggeration, self.axes(covariance)) else { return };
        let [x, y] = self.at(place);
        let [rx, ry] = axes.map(|axis| axis * ELLIPSE_95 * exaggeration / self.metres_per_pixel);
        let _ = write!(
            svg,
            r#"<ellipse cx="{x:.1}" cy="{y:.1}" rx="{rx:.1}" ry="{ry:.1}" transform="rotate({:.1} {x:.1} {y:.1})" fill="{}" fill-opacity="0.12" stroke="{1}" stroke-opacity="0.7" stroke-width="0.8"/>"#,
            -angle.to_degrees(),
            hex(CATEGORIES[colour])
        );
    }

    fn targets(&self, svg: &mut String, targets: &[AdjustedTarget], ellipses: &[usize], exaggeration: Option<f64>) {
        for target in ellipses.iter().map(|index| &targets[*index]) {
            self.ellipse(svg, &target.point.coords, &target.covariance, exaggeration, 2);
        }
        for target in targets.iter().step_by(targets.len().div_ceil(MOST_DOTS).max(1)) {
            let [x, y] = self.at(&target.point.coords);
            let _ = write!(
                svg,
                r#"<circle cx="{x:.1}" cy="{y:.1}" r="2" fill="{}"><title>{}</title></circle>"#,
                hex(CATEGORIES[2]),
                escape(&target.name)
            );
        }
    }

    /// The pyramid from the perspective centre through the corners of the image.
    fn station(&self, svg: &mut String, camera: &Camera, pose: &Isometry3<f64>, colour: [u8; 3], dashes: &str) {
        let (right, bottom) = (camera.format.width as f64 - 0.5, camera.format.height as f64 - 0.5);
        let length = 36.0 * self.metres_per_pixel;
        let [x, y] = self.at(&pose.translation.vector);
        let (mut edges, mut base) = (String::new(), String::new());
        for pixel in [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]] {
            let ray = camera.ray(pixel);
            // All corners in one plane across the viewing axis.
            let corner = pose.translation.vector + pose.rotation * ray * (length / -ray.z);
            let [cx, cy] = self.at(&corner);
            let _ = write!(edges, "M{x:.1} {y:.1}L{cx:.1} {cy:.1}");
            let _ = write!(base, "{}{cx:.1} {cy:.1}", if base.is_empty() { 'M' } else { 'L' });
        }
        let colour = hex(colour);
        let _ = write!(
            svg,
            r#"<path d="{base}Z{edges}" fill="{colour}" fill-opacity="0.1" stroke="{colour}" stroke-width="1" stroke-opacity="0.8" stroke-dasharray="{dashes}"/><circle cx="{x:.1}" cy="{y:.1}" r="2.6" fill="{colour}"/>"#
        );
    }

    fn dot(&self, svg: &mut String, pose: &Isometry3<f64>, colour: [u8; 3]) {
        let [x, y] = self.at(&pose.translation.vector);
        let _ = write!(svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="1.6" fill="{}"/>"#, hex(colour));
    }
}
