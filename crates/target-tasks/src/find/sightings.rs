//! The target in one station's picture, with a range for each of its points.

use nalgebra::Vector2;
use pipeline::Result;
use range_image::Raster;
use range_io::tables::TargetObservation;
use targets::{BoardSighting, DarkRange, NodePoint, NotFound, TargetRange, target_range};

use crate::find::pictures::Picture;
use crate::kind::BoardKind;

/// Radius of the surroundings that a node's range is taken from, in spacings of the nodes: the four fields about a corner
/// share them, and a disc of the usual 0.2 to 0.35 spacings is seen with some of its ground. Over twice as much the range
/// errors of a camera bend by millimetres where a board is tilted.
const SURROUNDINGS: f64 = 0.45;

/// Pixels that the surroundings reach to at least: 37 of them tell a plane.
const LEAST_RADIUS_PX: f64 = 3.5;

/// What was seen from one station.
pub(crate) struct Sighting {
    pub(crate) station: String,
    pub(crate) light: Raster<f32>,
    /// The board, or why there is none.
    pub(crate) board: std::result::Result<BoardSighting, NotFound>,
    pub(crate) observations: Vec<TargetObservation>,
}

impl Sighting {
    pub(crate) fn new(picture: Picture, kind: &BoardKind) -> Result<Self> {
        let board = match kind.find(&picture.light) {
            Ok(board) => Ok(board),
            Err(targets::Error::NotFound(reason)) => Err(reason),
            Err(error) => {
                return Err(pipeline::Error::Estimate { what: "targets", source: error.into() });
            }
        };
        let observations = board.as_ref().map_or_else(|_| Vec::new(), |board| observations(board, &picture));
        let Picture { station, light, .. } = picture;
        Ok(Self { station, light, board, observations })
    }

    /// Points of the board in its plane, metre, and where they were seen.
    pub(crate) fn pairs(&self, kind: &BoardKind) -> Option<Vec<([f64; 2], [f64; 2])>> {
        let nodes = &self.board.as_ref().ok()?.nodes;
        let place = |node| {
            let point = kind.node_m(node);
            [point.x, point.y]
        };
        Some(nodes.iter().map(|seen| (place(seen.node), seen.point.pixel)).collect())
    }
}

fn observations(board: &BoardSighting, picture: &Picture) -> Vec<TargetObservation> {
    let ranges = ranges(board, picture);
    let row = |(seen, range): (&NodePoint, Option<PartRange>)| {
        let variance = |axis: usize| seen.point.covariance[(axis, axis)];
        TargetObservation {
            station: picture.station.clone(),
            target: BoardKind::name(seen.node),
            pixel: Some(seen.point.pixel),
            range_m: range.map(|range| range.range_m),
            sigma_pixel: Some([0, 1].map(|axis| variance(axis).sqrt())),
            sigma_range_m: range.map(|range| range.sigma_m),
            amplitude: range.map(|range| range.amplitude).filter(|amplitude| amplitude.is_finite()),
            integration_time_s: picture.integration_time_s,
        }
    };
    board.nodes.iter().zip(ranges).map(row).collect()
}

/// The range of a target as one part of its surroundings shows it.
#[derive(Clone, Copy)]
struct PartRange {
    range_m: f64,
    sigma_m: f64,
    amplitude: f64,
}

impl PartRange {
    fn of(found: TargetRange, takes_dark: bool) -> Self {
        let TargetRange { range_m, sigma_m, amplitude, dark, .. } = found;
        match dark.filter(|_| takes_dark) {
            Some(DarkRange { range_m, sigma_m, amplitude }) => Self { range_m, sigma_m, amplitude },
            None => Self { range_m, sigma_m, amplitude },
        }
    }
}

/// The range of each node that has one: on its bright part, and of every other node on its dark part where
/// scattered light was taken off, which falls on dark parts from bright ones and shifts their ranges. Bright and dark at one
/// distance tell range errors by amplitude from errors by distance; bright parts alone are the darker the farther they are.
///
/// Deviations hold what the surroundings do to ranges beside the noise: surroundings of half the area bend half as much, so that
/// twice the difference is what the bend of the whole does, in the mean over a board.
fn ranges(board: &BoardSighting, picture: &Picture) -> Vec<Option<PartRange>> {
    let Some((frame, camera)) = &picture.ranges else { return vec![None; board.nodes.len()] };
    let within = |index: usize, share: f64| {
        let radius = (SURROUNDINGS * spacing_px(board, index)).max(LEAST_RADIUS_PX);
        target_range(frame, camera, board.nodes[index].point.pixel, radius * share.sqrt()).ok()
    };
    let found: Vec<_> = (0..board.nodes.len()).map(|index| within(index, 1.0)).collect();
    let bends = found.iter().enumerate().filter_map(|(index, whole)| {
        let (whole, half) = ((*whole)?, within(index, 0.5)?);
        let by_chance = (half.sigma_m.powi(2) - whole.sigma_m.powi(2)).max(0.0);
        Some(4.0 * ((half.range_m - whole.range_m).powi(2) - by_chance))
    });
    let (count, sum) = bends.fold((0.0, 0.0), |(count, sum), bend| (count + 1.0, sum + bend));
    let bend: f64 = if count > 0.0 { (sum / count).max(0.0) } else { 0.0 };
    let part = |(seen, found): (&NodePoint, &Option<TargetRange>)| {
        let takes_dark = picture.is_restored && (seen.node[0] + seen.node[1]) % 2 == 1;
        let mut range = PartRange::of((*found)?, takes_dark);
        range.sigma_m = (range.sigma_m.powi(2) + bend).sqrt();
        // A node without a range is an image point all the same.
        (range.sigma_m > 0.0).then_some(range)
    };
    board.nodes.iter().zip(&found).map(part).collect()
}

/// Distance of a node from its nearest neighbour in the image.
fn spacing_px(board: &BoardSighting, index: usize) -> f64 {
    let place = |seen: &NodePoint| Vector2::from(seen.point.pixel);
    let own = place(&board.nodes[index]);
    let others = board.nodes.iter().enumerate().filter(|(other, _)| *other != index);
    others.map(|(_, seen)| (place(seen) - own).norm()).fold(f64::INFINITY, f64::min)
}
