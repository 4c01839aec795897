//! What a network consists of.

use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, SMatrix};

/// Stations, targets, sightings and known distances, with the approximate calibration to start from.
///
/// Frames: world (object space, metre) and camera as in [`camera_model`]; stations are `world_from_camera`.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Start values of interior orientation and lens; what is not estimated is held at them.
    pub camera: Camera,
    /// Start values of the range terms, with the ambiguity interval; what is not estimated is held at them.
    pub range_model: RangeErrorModel,
    /// Stations; their names are unique.
    pub stations: Vec<Station>,
    /// Targets; their names are unique.
    pub targets: Vec<NetworkTarget>,
    /// Targets seen by the range camera.
    pub sightings: Vec<Sighting>,
    /// Scale bars, distances along a track, laboratory reference ranges.
    pub distances: Vec<KnownDistance>,
    /// The passive camera of a joint setup.
    pub passive: Option<PassiveCamera>,
}

/// One exposure of the range camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// Name.
    pub name: String,
    /// Approximate or known pose; `None` where it is to be found.
    pub world_from_camera: Option<Isometry3<f64>>,
    /// Covariance of the pose's tangent step (`[dt world m, dθ camera rad]`) where the pose is weighted control.
    pub covariance: Option<Matrix6<f64>>,
    /// Integration time; stations of different times have range terms of their own.
    pub integration_time_s: Option<f64>,
    /// What its ranges are known to have drifted by (Sect. 4.7), metre: taken off as d0 is. Zero for a warm camera.
    pub drift_m: f64,
}

/// One target.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkTarget {
    /// Name.
    pub name: String,
    /// Approximate or known position, metre; `None` where it is to be found.
    pub point: Option<Point3<f64>>,
    /// Covariance of the position, m², where it is weighted control.
    pub covariance: Option<Matrix3<f64>>,
}

/// One target seen from one station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Position in [`Network::stations`].
    pub station: usize,
    /// Position in [`Network::targets`].
    pub target: usize,
    /// Observed image point `(col, row)`, pixel.
    pub pixel: Option<[f64; 2]>,
    /// Standard deviations of column and row, pixel.
    pub sigma_pixel: [f64; 2],
    /// Observed range, unwrapped, metre.
    pub range_m: Option<f64>,
    /// Standard deviation of the range, metre.
    pub sigma_range_m: f64,
    /// Amplitude in the camera's unit.
    pub amplitude: Option<f64>,
}

/// A distance known from outside, metre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownDistance {
    /// One end.
    pub from: DistanceEnd,
    /// The other end.
    pub to: DistanceEnd,
    /// Distance, metre.
    pub distance_m: f64,
    /// Its standard deviation, metre.
    pub sigma_m: f64,
}

/// An end of a known distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DistanceEnd {
    /// The perspective centre of a station, by its position in [`Network::stations`].
    Station(usize),
    /// A target, by its position in [`Network::targets`].
    Target(usize),
}

/// The pre-calibrated passive camera of a joint setup, rigidly mounted beside the range camera.
#[derive(Debug, Clone, PartialEq)]
pub struct PassiveCamera {
    /// Its calibration.
    pub camera: Camera,
    /// Covariance of `[xp, yp, c, k1, k2, k3, p1, p2, b1, b2]`, in their units; `None`: held without error, as is each
    /// parameter whose variance is zero.
    pub covariance: Option<SMatrix<f64, 10, 10>>,
    /// Approximate relative orientation `range_camera_from_passive`; `None` where it is to be found.
    pub range_camera_from_passive: Option<Isometry3<f64>>,
    /// Its image points; it exposes at the stations of the range camera.
    pub image_points: Vec<PassiveImagePoint>,
}

/// A target in an image of the passive camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassiveImagePoint {
    /// Position in [`Network::stations`].
    pub station: usize,
    /// Position in [`Network::targets`].
    pub target: usize,
    /// Observed image point `(col, row)`, pixel.
    pub pixel: [f64; 2],
    /// Standard deviations of column and row, pixel.
    pub sigma_pixel: [f64; 2],
}
