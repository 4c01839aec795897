//! The search.

use crate::grid::scatter::widen;
use nalgebra::Vector2;
use range_image::Raster;

use super::assembly::{Assembly, assemble};
use super::checkerboard::{Checkerboard, CheckerboardOptions};
use super::choice::{Laid, choose};
use super::corners::refine::{Measured, refine};
use super::labels::Labeling;
use super::saddles::Level;
use super::smoothness::without_strays;
use crate::error::{NotFound, Result};
use crate::image::levels::Levels;
use crate::image::noise::noise_deviation;
use crate::image::smoothing::{filled, halved};
use crate::sightings::measured_point::{BoardSighting, MeasuredPoint, NodePoint};

/// Scales of the search, each half as fine as the one before: at the third, fields of 20 pixels are as those of 5.
const LEVELS: usize = 3;

/// Contrast over noise below which no board is looked for: no corner of small fields would stand out.
const LEAST_CONTRAST: f64 = 3.0;

/// Least deviation of the noise, in parts of the contrast: no optics follow the model of an edge more closely.
const LEAST_NOISE: f64 = 1e-3;

/// Share of a board's nodes beyond which coarser scales are not looked at.
const NEARLY_ALL: f64 = 0.97;

/// Finds a checkerboard in an image, without a start value.
///
/// `image` holds amplitudes or grey values of any scale and offset, rows from the top; NaN where there is no value. The
/// board lies on paper that is as bright as its bright fields; fields may be as small as five pixels, tilted by up to 60
/// degrees, blurred by up to 1.5 pixels. Positions are `(col, row)` in pixels, 0-based, lens distortion included; the
/// covariance of each comes from the scatter of the residuals, and at least from the noise that the options state.
///
/// A part of a board is an answer where its place on the board is settled: by its size, by the sides at which the board
/// ends, and by the colours of the fields. Node (0, 0) is the one beyond which the outer field is dark. Where both ways
/// round look the same (an even sum of columns and rows), it is the one nearest to the upper left corner of the image, and
/// [`BoardSighting::ambiguity`] says so. A mirrored image looks like one that is not: it is taken as seen.
///
/// # Errors
/// [`NotFound`] says why there is no answer: no contrast, saturation, another size, a part that fits in several places,
/// several boards.
///
/// ```
/// use targets::range_image::Raster;
/// use targets::{Checkerboard, CheckerboardOptions, find_checkerboard};
///
/// // A board of 5 x 4 inner corners with fields of 16 pixels, on white.
/// let image = Raster::from_fn(160, 130, |col, row| {
///     let inside = (30..126).contains(&col) && (25..105).contains(&row);
///     let dark = inside && ((col - 30) / 16 + (row - 25) / 16) % 2 == 0;
///     if dark { 20.0 } else { 180.0 + 0.1 * ((col * 7 + row * 13) % 5) as f32 }
/// });
/// let board = Checkerboard::new(5, 4, 0.03)?;
/// let seen = find_checkerboard(&image, &board, &CheckerboardOptions::default())?;
/// assert!(seen.complete && seen.nodes.len() == 20);
/// let first = seen.nodes[0];
/// assert_eq!(first.node, [0, 0]);
/// assert!((first.point.pixel[0] - 45.5).abs() < 0.05 && (first.point.pixel[1] - 40.5).abs() < 0.05);
/// # Ok::<(), targets::Error>(())
/// ```
pub fn find_checkerboard(
    image: &Raster<f32>,
    board: &Checkerboard,
    options: &CheckerboardOptions,
) -> Result<BoardSighting> {
    options.validate()?;
    let noise = options.noise.unwrap_or_else(|| noise_deviation(image));
    let no_contrast = |contrast: f64| NotFound::NoContrast { contrast, noise };
    let full = filled(image).ok_or(no_contrast(f64::NAN))?;
    let levels = Levels::of(image, noise).ok_or(no_contrast(f64::NAN))?;
    let contrast = levels.contrast();
    // Also of no numbers.
    if !(contrast > LEAST_CONTRAST * noise && contrast.is_finite()) {
        return Err(no_contrast(contrast).into());
    }
    let noise = noise.max(LEAST_NOISE * contrast);
    let laid = search(&full, noise, &levels, board, options)?;
    let least_noise = options.noise.unwrap_or(0.0);
    let measured = Measured { image, noise, least_noise, plateau: levels.plateau.unwrap_or(f64::INFINITY) };
    sighting(&measured, board, options, laid)
}

/// The lattice that is the board, from the finest scale at which there is one.
fn search(
    full: &Raster<f32>,
    noise: f64,
    levels: &Levels,
    board: &Checkerboard,
    options: &CheckerboardOptions,
) -> Result<Laid> {
    let needed = options.least_nodes(board);
    let all = (board.columns() * board.rows()) as f64;
    let mut image = full.clone();
    let mut best: Option<Laid> = None;
    let mut reason: Option<NotFound> = None;
    for scale in 0..LEVELS {
        let pixel = 2.0_f64.powi(scale as i32);
        let level = Level::new(&image, pixel, noise / pixel);
        let saddles = level.saddles();
        let points: Vec<Vector2<f64>> = saddles.iter().map(|saddle| saddle.position).collect();
        let lay = |assembly: Assembly| Laid::new(&level, assembly, &points, board);
        let laid = assemble(&level, &saddles).into_iter().map(lay).collect();
        match choose(laid, saddles.len(), needed, board) {
            Ok(found) => {
                if best.as_ref().is_none_or(|best| best.count() < found.count()) {
                    best = Some(found);
                }
            }
            Err(several @ NotFound::SeveralBoards { .. }) => return Err(several.into()),
            Err(other) => reason = Some(reason.map_or(other.clone(), |reason| reason.clearer(other))),
        }
        if best.as_ref().is_some_and(|best| best.count() as f64 >= NEARLY_ALL * all) {
            break;
        }
        image = halved(&image);
    }
    let nothing = reason.unwrap_or(NotFound::TooFewPoints { found: 0, needed });
    Ok(best.ok_or_else(|| nothing.with_saturation(levels.saturated))?)
}

/// Corners of the lattice with their labels.
fn sighting(
    measured: &Measured<'_>,
    board: &Checkerboard,
    options: &CheckerboardOptions,
    mut laid: Laid,
) -> Result<BoardSighting> {
    let labeling = laid.upper_left().ok_or(NotFound::TooFewPoints { found: 0, needed: options.least_nodes(board) })?;
    add_missing(&mut laid, &labeling, board);
    let corners = refine(measured, &laid.assembly, &mut laid.points);
    let (corners, residual_px) = without_strays(corners);
    let (found, needed) = (corners.len(), options.least_nodes(board));
    if found < needed {
        return Err(NotFound::TooFewPoints { found, needed }.into());
    }
    let mut nodes: Vec<NodePoint> = corners
        .iter()
        .map(|corner| NodePoint {
            node: labeling.of(corner.node).map(|index| index.max(0) as usize),
            point: MeasuredPoint { pixel: corner.position.into(), covariance: corner.covariance },
        })
        .collect();
    nodes.sort_by_key(|node| [node.node[1], node.node[0]]);
    widen(&mut nodes);
    let complete = nodes.len() == board.columns() * board.rows();
    Ok(BoardSighting { nodes, complete, ambiguity: board.symmetry(), residual_px })
}

/// Puts nodes of the board that no saddle was found for where those about them have them: the fit decides.
fn add_missing(laid: &mut Laid, labeling: &Labeling, board: &Checkerboard) {
    let labels = (0..board.rows() as i32).flat_map(|j| (0..board.columns() as i32).map(move |i| [i, j]));
    let missing =
        labels.map(|label| labeling.node_at(label)).filter(|node| !laid.assembly.lattice.nodes.contains_key(node));
    let predicted =
        missing.filter_map(|node| Some((node, laid.assembly.lattice.predict(&laid.points, node, 2)?.position)));
    let predicted: Vec<_> = predicted.collect();
    for (node, position) in predicted {
        laid.assembly.lattice.nodes.insert(node, laid.points.len());
        laid.points.push(position);
    }
}
