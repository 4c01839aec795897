use thiserror::Error;

use crate::Shape;

/// Why something was not measured.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument or option lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the argument.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A region that encloses nothing.
    #[error("the region is none: {0}")]
    Region(String),
    /// A region whose extent has no end in some direction.
    #[error("the region has no end: a footprint needs a box, sphere, cylinder or prism")]
    Unbounded,
    /// A point that is not in the cloud.
    #[error("point {index} is asked for, the cloud has {points}")]
    NoSuchPoint {
        /// The index.
        index: usize,
        /// Points of the cloud.
        points: usize,
    },
    /// Too few points with a standard deviation.
    #[error(
        "{points} points for a {shape} ({unusable} further ones without position or standard deviation), {needed} are \
         needed: enlarge the region, or record the place again"
    )]
    TooFewPoints {
        /// What was to be fitted.
        shape: Shape,
        /// Usable points.
        points: usize,
        /// Points without finite position or positive standard deviation.
        unusable: usize,
        /// Points needed.
        needed: usize,
    },
    /// Points along a line.
    #[error(
        "the points are nearly on a line: {length_m:.4} m long, {width_m:.4} m wide; the plane's direction is known to \
         {sigma_rad:.3} rad, at most {limit_rad:.3} rad is accepted: widen the region"
    )]
    Collinear {
        /// Extent along the line, metre.
        length_m: f64,
        /// Extent across it, metre.
        width_m: f64,
        /// Standard deviation of the normal's direction, radian.
        sigma_rad: f64,
        /// Largest accepted.
        limit_rad: f64,
    },
    /// Too small a part of a sphere or cylinder.
    #[error(
        "the region is too small a part of a {shape}: the standard deviation of the {what} is {sigma:.3}, at most {limit:.3} \
         is accepted: enlarge the region"
    )]
    NotDetermined {
        /// What was to be fitted.
        shape: Shape,
        /// What is open.
        what: &'static str,
        /// Its standard deviation.
        sigma: f64,
        /// Largest accepted.
        limit: f64,
    },
    /// Most points belong to something else.
    #[error(
        "the region is no {shape}: {percent:.0} % of its {points} points lie elsewhere, at most {limit_percent:.0} % are \
         accepted: choose a region that shows the {shape} alone"
    )]
    NotThatShape {
        /// What was to be fitted.
        shape: Shape,
        /// Points of the region.
        points: usize,
        /// Share of the points that were left out, percent.
        percent: f64,
        /// Largest accepted, percent.
        limit_percent: f64,
    },
    /// Planes between which there is no one distance.
    #[error(
        "the planes are not parallel: the angle between them is {angle_deg:.2} degrees, at most {limit_deg:.2} are \
         accepted for a distance; ask for the angle, or for the distance of a point from a plane"
    )]
    NotParallel {
        /// The angle, degree.
        angle_deg: f64,
        /// Largest accepted, degree.
        limit_deg: f64,
    },
    /// A footprint of which no cell has points.
    #[error("none of the {cells} cells of the region's footprint has a point")]
    NoCells {
        /// Cells of the footprint.
        cells: usize,
    },
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
