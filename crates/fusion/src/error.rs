/// What is wrong with a cloud that is to be fused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No points.
    #[error("there are no points to fuse")]
    Empty,
    /// More points than indices of 32 bit.
    #[error("{0} points: at most 4,000,000,000 are fused at a time")]
    TooMany(usize),
    /// Arrays that belong together differ in length.
    #[error("{what} has {found} entries, there are {expected} points")]
    Length {
        /// Which array.
        what: &'static str,
        /// Points.
        expected: usize,
        /// Entries.
        found: usize,
    },
    /// A coordinate that is no number.
    #[error("{what} {index} is not finite: leave out what was not measured")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, from 0.
        index: usize,
    },
    /// A frame beyond the list of perspective centres.
    #[error(
        "point {point} is of frame {frame}, but perspective centres are given for {frames} frames (0 is the first)"
    )]
    Frame {
        /// The point.
        point: usize,
        /// Its frame.
        frame: u32,
        /// Perspective centres.
        frames: usize,
    },
    /// A point in the perspective centre of its frame has no ray.
    #[error(
        "point {point} lies in the perspective centre of its frame {frame}: cameras write so what they did not measure"
    )]
    AtCentre {
        /// The point.
        point: usize,
        /// Its frame.
        frame: u32,
    },
    /// A point that is said to be known without error, or with an error that is no number.
    #[error(
        "the variance of point {point} is {value} m²: it must be finite and positive (the noise of a range is above 1 nm)"
    )]
    Variance {
        /// The point.
        point: usize,
        /// Trace of its covariance.
        value: f64,
    },
    /// A derivative by a common error that is not described, or no number.
    #[error("point {point} has a derivative of {value} by common error {column} of {errors}: both must exist")]
    Derivative {
        /// The point.
        point: usize,
        /// Column of the common errors.
        column: usize,
        /// Common errors.
        errors: usize,
        /// Length of the derivative.
        value: f64,
    },
    /// An option outside its domain.
    #[error("option {name} is {value}: it must be {expected}")]
    OutOfDomain {
        /// The option's field.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// Cells so small against the cloud that they cannot be numbered.
    #[error(
        "cells of {voxel_m} m in a cloud of {extent_m} m: at most two million along an axis; are the points in metre?"
    )]
    Cells {
        /// Size of a cell.
        voxel_m: f64,
        /// Largest extent of the points.
        extent_m: f64,
    },
    /// Noise beside which a cell is nothing.
    #[error(
        "half of the points have a standard deviation above {sigma_m} m, a cell has {voxel_m} m: take cells of {least_m} m or more"
    )]
    CellsBelowNoise {
        /// Size of a cell.
        voxel_m: f64,
        /// Median of the points' standard deviations.
        sigma_m: f64,
        /// The least size that serves.
        least_m: f64,
    },
    /// All points at one place.
    #[error("all {0} points lie at one place")]
    Coincident(usize),
    /// Nowhere enough points on a plane.
    #[error(
        "no surface among {points} points in {cells} cells of {voxel_m} m ({per_cell:.1} a cell, extent {extent_m:.3} m): \
         give the points in metre, or take cells with ten points and more of which a surface has many"
    )]
    NoSurface {
        /// Points.
        points: usize,
        /// Cells with points.
        cells: usize,
        /// Size of a cell.
        voxel_m: f64,
        /// Points in a cell with points.
        per_cell: f64,
        /// Largest extent of the points.
        extent_m: f64,
    },
    /// An error that all frames share whose nodes are no common errors.
    #[error("the last node of the shared error is common error {last} (0 is the first), there are {errors}")]
    SharedError {
        /// Column of the last node.
        last: usize,
        /// Common errors.
        errors: usize,
    },
    /// Correlations of the common errors that have no eigenvalues.
    #[error("the covariance of the common errors cannot be decomposed")]
    Decomposition,
}

pub(crate) type Result<T> = std::result::Result<T, Error>;
