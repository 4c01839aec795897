//! The fused cloud.

use nalgebra::{Matrix3, Point3, Vector3};
use point_uncertainty::{CommonErrors, PointErrors, Shares, Source};

use crate::common::Row;
use crate::input::NO_NEIGHBOURHOOD;
use crate::patches::is_smaller;

/// A fused point: a small piece of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Surfel {
    /// Where it is, metre.
    pub position: Point3<f64>,
    /// Unit normal, on the side that it was seen from.
    pub normal: Vector3<f64>,
    /// Radius of a disc over which points scatter as those of the surfel do, metre.
    pub radius_m: f64,
    /// Mean amplitude of its points; NaN where none has one.
    pub amplitude: f64,
    /// Points that it was made of.
    pub points: u32,
    /// Frames that saw it, ascending.
    pub frames: Vec<u32>,
    /// Variance of its height along the normal by sources, square metre.
    pub shares: Shares,
    /// Variance of what a bent surface differs from the plane through its points, square metre.
    pub shape_variance: f64,
    /// By how many times the variance of all sources is larger than stated, since frames disagree here by so much more than they should;
    /// 1 where they do not.
    pub variance_factor: f64,
}

impl Surfel {
    /// Standard deviation of its height along the normal, from all sources, metre.
    pub fn sigma_m(&self) -> f64 {
        (self.shares.variance() + self.disagreement_variance() + self.shape_variance).sqrt()
    }

    /// The part of it that its points alone err by, metre: noise, neighbourhoods and shape, as frames show them, without what many points
    /// have in common. Fused points beside each other scatter by so much.
    pub fn own_sigma_m(&self) -> f64 {
        let own = self.shares.of(Source::Noise) + self.shares.of(Source::Sensor);
        (own * self.variance_factor + self.shape_variance).sqrt()
    }

    /// What the disagreement of frames adds to the variance that the sources state, square metre.
    pub fn disagreement_variance(&self) -> f64 {
        (self.variance_factor - 1.0) * self.shares.variance()
    }
}

/// Why a point is in no surfel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// Contradicts: another frame saw a surface behind it, through it.
    SeenThrough {
        /// The frame that saw through.
        frame: u32,
        /// The surfel that it saw.
        surfel: u32,
        /// Distance along the surfel's normal over its standard deviation.
        deviations: f64,
    },
    /// Contradicts: it lies behind a surface that other frames saw.
    Behind {
        /// The surfel that hides it.
        surfel: u32,
        /// Distance along the surfel's normal over its standard deviation.
        deviations: f64,
    },
    /// Contradicts: it lies off the surface that its own frame saw around it.
    OffSurface {
        /// The surfel.
        surfel: u32,
        /// Distance along the surfel's normal over its standard deviation.
        deviations: f64,
    },
    /// Contradicts: its surface cannot be there beside what more frames saw.
    Outvoted,
    /// Mixed: between two surfaces that its frame saw side by side.
    Between {
        /// The nearer surfel.
        front: u32,
        /// The farther surfel.
        behind: u32,
    },
    /// Beside an edge: its errors allow it to belong to either surface, and its choice would bend both.
    AtEdge,
    /// Its neighbours lie on no plane: an edge, or a shape finer than a cell.
    Uneven,
    /// Alone: too few neighbours to tell a surface.
    Alone,
}

impl Reason {
    /// Whether the point contradicts others.
    pub fn is_contradiction(&self) -> bool {
        matches!(self, Self::SeenThrough { .. } | Self::Behind { .. } | Self::OffSurface { .. } | Self::Outvoted)
    }
}

/// A point that is in no surfel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unfused {
    /// Index of the point.
    pub point: usize,
    /// Why.
    pub reason: Reason,
}

/// Two surfels of which one hides the other from a frame that saw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contradiction {
    /// Where the surfel in front is, which was not seen by `seen_through_by`.
    pub front: Point3<f64>,
    /// A frame that saw the front.
    pub front_frame: u32,
    /// Where the surfel behind is.
    pub behind: Point3<f64>,
    /// The frame that saw the one behind, through the one in front.
    pub seen_through_by: u32,
    /// Distance along the normal of the one in front, metre.
    pub distance_m: f64,
    /// The same over its standard deviation.
    pub deviations: f64,
}

/// A station whose pose does not agree with its covariance and the surfaces of the others. Its surfaces stand beside theirs.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Its frames.
    pub frames: Vec<u32>,
    /// Frames that see the same surfaces elsewhere. Where there are only those of one station, it may be that one which errs.
    pub others: Vec<u32>,
    /// Probability of such a disagreement where the covariance is true, after Holm's correction for all stations.
    pub p_value: f64,
    /// By how much its pose would have to change, by name of the common error, in its unit.
    pub shifts: Vec<(String, f64)>,
}

/// What surfaces tell of the error that all frames of a sensor share: of the values at its nodes before they were estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedError {
    /// Standard deviation, 1/metre of inverse depth.
    pub sigma_per_m: f64,
    /// Distance in the image at which the correlation is 1/e, pixel.
    pub length_px: f64,
    /// By how much the logarithm of the likelihood of all that frames see together is larger than without it.
    pub evidence: f64,
}

/// A cloud in which each surface stands once.
///
/// It is [`PointErrors`] of its surfels, with [`Fused::common`]: distances between fused points have their standard deviations
/// as those between single points have.
#[derive(Debug, Clone, PartialEq)]
pub struct Fused {
    /// The fused points, by cells.
    pub surfels: Vec<Surfel>,
    /// The points that are in none, in ascending order.
    pub unfused: Vec<Unfused>,
    /// The surfel of each point.
    pub surfel_of_point: Vec<Option<u32>>,
    /// Surfels that could not both be there. Where more frames spoke against one than for it, it was given up and is none of `surfels`.
    pub contradictions: Vec<Contradiction>,
    /// How many surfels were given up so; the reason of their points is [`Reason::Outvoted`].
    pub outvoted: usize,
    /// How many of `surfels` a frame has seen through.
    pub seen_through: usize,
    /// By how many times the noise of points and of their neighbourhoods is larger than stated, in the variance: as points scatter about
    /// the flattest quarter of the planes of single frames, times what frames differ by at most places beyond that; 1 where it is not. It is in
    /// [`Surfel::shares`].
    pub noise_factor: f64,
    /// The variance of points about the flattest quarter of the planes of single frames over what is stated of it. Where it is below one
    /// nothing is taken as smaller: a camera that smooths its images hides its noise there, not between frames.
    pub noise_within_frames: f64,
    /// Stations that do not fit the others.
    pub apart: Vec<Apart>,
    /// What was found of the common errors, in their units, and has been taken off the points. Zeros where they were not estimated.
    pub corrections: Vec<f64>,
    /// The error that all frames of the sensor share; `None` where it was not asked for, or does not show.
    pub shared_error: Option<SharedError>,
    /// The common errors that remain.
    pub common: CommonErrors,
    pub(crate) rows: Vec<Row>,
    /// Neighbourhood with the largest part, and shift of the surfel by its deviation.
    pub(crate) strongest: Vec<(u64, f64)>,
}

impl Fused {
    /// Whether points scatter within frames by clearly less than is stated of their noise, so that standard deviations may be too large.
    pub fn noise_is_overstated(&self) -> bool {
        is_smaller(self.noise_within_frames)
    }
}

impl PointErrors for Fused {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        let surfel = &self.surfels[point];
        let shared = if self.strongest[point].0 == NO_NEIGHBOURHOOD { 0.0 } else { self.strongest[point].1.powi(2) };
        let beside = surfel.disagreement_variance() + surfel.shape_variance;
        let own = surfel.shares.of(Source::Noise) + surfel.shares.of(Source::Sensor) + beside;
        surfel.normal * surfel.normal.transpose() * (own - shared).max(0.0)
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        let (neighbourhood, shift) = self.strongest[point];
        (neighbourhood != NO_NEIGHBOURHOOD).then(|| (neighbourhood, self.surfels[point].normal * shift))
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        let normal = self.surfels[point].normal;
        derivatives.extend(self.rows[point].iter().map(|(column, by)| (*column as usize, normal * *by)));
    }
}
