//! The systematic error of a sensor, which all of its frames share, and what it does to a registration.
//!
//! What a sensor measures wrongly beside its noise is a smooth field over its frame (what is left of its distortion, its
//! delays, its scale), the same in each frame. It does not average out over pixels or frames: two frames see a surface
//! in different places of the field, and so apart. Here the field is a sum of products of Legendre polynomials over the
//! frame, in range where ranges come with their standard deviations, else in inverse depth. Its coefficients have the
//! expectation 0 and, by degree, variances that are estimated from the residuals of registrations beside their random
//! part (quadratic and unbiased `[Rao1971]`): residuals of neighbours differ by the random part alone.

// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Vector3, Vector6};
use statistics::SIGMA_OF_MAD;

use crate::partners::locate::with_locate;
use crate::partners::map::Agreement;
use crate::partners::map::{Partner, Partners};
use crate::preparation::bits::{median_of_bits, positive_bits};
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::legendre::DEGREE;
use crate::registration::products::{ROW, weighted_products};
use icp_registration::TUKEY;
use rigid_pose::Centred;

/// Coefficients of the field: all products of degrees up to that.
pub const COEFFICIENTS: usize = (DEGREE + 1) * (DEGREE + 2) / 2;
/// The coefficients, metre of range or 1/metre of inverse depth: the mean square of the field over the frame is the sum
/// of their squares.
pub type Field = SVector<f64, COEFFICIENTS>;
/// A covariance of the coefficients.
pub type FieldMatrix = SMatrix<f64, COEFFICIENTS, COEFFICIENTS>;
/// Derivative of a pose, tangent `[dt, dtheta]`, by the coefficients.
pub type ByField = SMatrix<f64, 6, COEFFICIENTS>;

/// Widening of the biweight: the field is largest where few nodes lie, at the rim, and its squares there are what is estimated.
const WIDE: f64 = 2.0;
/// Standard deviations by which squares must exceed what noise lets expect (of one degree of freedom: 4 % by chance).
const SIGNIFICANCE: f64 = 2.0;
/// Share of an estimated variance that loops may tell. Residuals do not tell it: those of registrations that follow each
/// other are of the same surfaces as well as of the same sensor. With 0, 0.1, 0.25, 0.5 and 0.75, 500 frames of a Kinect are
/// tracked with 34, 27, 27, 27 and 27 mm, and squared errors reach up to 2.6, 2.9, 3.3, 4.5 and 6.2 of their variances.
const EVERYWHERE: f64 = 0.25;
/// Least random part, in standard deviations of the nodes: below, frames are copies of each other.
const LEAST_RANDOM: f64 = 0.1;

/// Degrees along columns and rows of each coefficient, by their sum.
fn degrees() -> impl Iterator<Item = [usize; 2]> {
    (0..=DEGREE).flat_map(|degree| (0..=degree).map(move |down| [degree - down, down]))
}

/// Variance components of the systematic error of a sensor that all its frames share, and what they were estimated from.
///
/// The error is a field over the frame: a sum of products of Legendre polynomials along columns and rows, normalised to
/// a mean square of 1 over the frame. It is added to the range in metre for frames whose ranges come with standard
/// deviations, else to the inverse depth in 1/metre.
///
/// ```
/// use projective_registration::SharedError;
///
/// // A scale of the ranges that is known to 2 mm, and fields of first and second degree of 1 mm.
/// let error = SharedError::known(&[2e-3, 1e-3, 1e-3]);
/// assert_eq!(error.sigma()[1], 1e-3);
/// assert_eq!(error.sigma()[4], 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SharedError {
    /// Of the coefficients of each degree: what is the same everywhere, and what differs from place to place, though
    /// neighbours share it.
    everywhere: [f64; DEGREE + 1],
    local: [f64; DEGREE + 1],
    registrations: usize,
    squares: [Squares; DEGREE + 1],
}

/// Sums over registrations, of one degree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Squares {
    /// Of what the residuals say.
    right: f64,
    /// What noise lets expect of that.
    noise: f64,
    /// What a variance of 1 would add to it.
    gain: f64,
}

impl SharedError {
    /// No shared error: noise is all there is.
    pub fn none() -> Self {
        Self::default()
    }

    /// Given, by a calibration for instance. `sigma`: standard deviation of the coefficients of each degree from 0 on, metre of
    /// range or 1/metre of inverse depth; degrees above 4 have no influence, those that are missing are 0.
    pub fn known(sigma: &[f64]) -> Self {
        let everywhere = std::array::from_fn(|degree| sigma.get(degree).map_or(0.0, |s| s * s));
        Self { everywhere, ..Self::default() }
    }

    /// The same, all of which differs from place to place, so that loops do not tell it.
    pub fn differing(sigma: &[f64]) -> Self {
        let Self { everywhere, local, .. } = Self::known(sigma);
        Self { everywhere: local, local: everywhere, ..Self::default() }
    }

    /// Standard deviation of the coefficients of each degree, metre of range or 1/metre of inverse depth.
    pub fn sigma(&self) -> [f64; DEGREE + 1] {
        std::array::from_fn(|degree| (self.everywhere[degree] + self.local[degree]).sqrt())
    }

    /// Registrations it was estimated from; 0 where it was given.
    pub fn registrations(&self) -> usize {
        self.registrations
    }

    /// As a single registration tells it.
    pub(crate) fn of(influence: &Influence) -> Self {
        let mut shared = Self::none();
        shared.learn(influence);
        shared
    }

    /// Takes what the residuals of a registration say into the estimate: by degree, the variance that makes the
    /// expectation of their squared normal equations what it is.
    pub fn learn(&mut self, influence: &Influence) {
        self.registrations += 1;
        for (k, [across, down]) in degrees().enumerate() {
            let squares = &mut self.squares[across + down];
            squares.right += influence.right[k].powi(2);
            squares.noise += influence.normal[(k, k)];
            for (l, _) in degrees().enumerate().filter(|(_, [c, r])| c + r == across + down) {
                squares.gain += influence.normal[(k, l)].powi(2);
            }
        }
        for (degree, squares) in self.squares.iter().enumerate() {
            let excess = squares.right - squares.noise;
            // The square of noise alone scatters by the root of twice the gain.
            let significant = excess > SIGNIFICANCE * (2.0 * squares.gain).sqrt();
            let variance = if significant { excess / squares.gain } else { 0.0 };
            self.everywhere[degree] = EVERYWHERE * variance;
            self.local[degree] = (1.0 - EVERYWHERE) * variance;
        }
    }

    /// Variances of all coefficients: of what is the same everywhere, which loops may tell.
    pub fn everywhere(&self) -> Field {
        of_degrees(&self.everywhere)
    }

    /// Of what differs from place to place.
    pub fn local(&self) -> Field {
        of_degrees(&self.local)
    }

    /// Covariance of the whole field.
    pub fn of_field(&self) -> FieldMatrix {
        FieldMatrix::from_diagonal(&(self.everywhere() + self.local()))
    }

    /// Covariance of a pose by its derivatives.
    pub fn covariance(&self, by_field: &ByField) -> Matrix6<f64> {
        by_field * self.of_field() * by_field.transpose()
    }
}

fn of_degrees(values: &[f64; DEGREE + 1]) -> Field {
    let mut all = Field::zeros();
    for (value, [across, down]) in all.iter_mut().zip(degrees()) {
        *value = values[across + down];
    }
    all
}

/// What the shared error does to a registration, and what the residuals say about it.
#[derive(Debug, Clone, Copy)]
pub struct Influence {
    /// Derivative of the registered pose by the coefficients.
    pub pose: ByField,
    /// Variance of the pose over what its residuals tell: 1, and up to 2 where the target's planes are means with frames that were
    /// brought to it. What all of its nodes together err by has moved these frames instead of leaving residuals, and is still
    /// the target's own.
    pub kept: f64,
    /// Logarithm of the scale of the source's ranges against the target's, if pose and scale are unknown, its variance by the
    /// random part of the residuals, and its derivative by the coefficients.
    scale: (f64, f64, Field),
    /// Normal equations of the coefficients, the pose eliminated.
    normal: FieldMatrix,
    right: Field,
}

impl Influence {
    /// Logarithm of the scale of the source's ranges against the target's, and its variance.
    pub fn relative_scale(&self, shared: &SharedError) -> (f64, f64) {
        let (logarithm, random, by_field) = &self.scale;
        (*logarithm, random + by_field.component_mul(by_field).dot(&(shared.everywhere() + shared.local())))
    }
}

/// Where the numbers of a sighting stand: behind the derivatives by the pose those by the field, and what follows.
const FIELD: usize = 6;
const SCALE: usize = FIELD + COEFFICIENTS;
const RESIDUAL: usize = SCALE + 1;

/// One source node on its target plane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sighting {
    /// In standard deviations of the nodes' noise.
    residual: f64,
    variance: f64,
    /// Of the target's plane, as a share of that, what frames brought to it have taken off.
    taken: f64,
    /// Derivatives by the pose, by the field and by the logarithm of the scale of the source's ranges, and the residual, metre; 0 in what is left.
    row: [f64; ROW],
    /// Whether the sample before is its neighbour.
    follows: bool,
}

impl OrganisedFrame {
    /// What the shared error does to the pose of `source`, registered with this frame; `None` where the nodes that
    /// they share do not determine the pose.
    pub(crate) fn influence(
        &self,
        source: &Self,
        self_from_source: &Isometry3<f64>,
        sightings: &mut Vec<Sighting>,
        scratch: &mut Vec<u32>,
    ) -> Option<Influence> {
        let frame = source.centred(self_from_source);
        sightings.clear();
        let mut follows = false;
        let each = |partner: Option<Partner>| {
            let partner = partner.filter(Partner::may_be_the_same);
            if let Some(p) = &partner {
                let place = &self_from_source.translation.vector;
                sightings.push(self.sighting(source, place, p, &frame, follows));
            }
            follows = partner.is_some();
        };
        let stride = source.stride_for(Agreement::NODES);
        with_locate(self, Partners { target: self, source, pose: self_from_source, stride, each });
        let to_tangent = frame.tangent_from_motion(self_from_source);
        reduced(sightings, &to_tangent, scratch)
    }

    #[inline(always)]
    fn sighting(
        &self,
        source: &Self,
        source_place: &Vector3<f64>,
        partner: &Partner,
        frame: &Centred,
        follows: bool,
    ) -> Sighting {
        let plane = self.planes[partner.node as usize].map(f64::from);
        let normal = Vector3::new(plane[0], plane[1], plane[2]);
        let point = Vector3::from(partner.point.map(f64::from));
        // Points move along their rays, and planes with them.
        let by_scale = normal.dot(&(point - source_place));
        let (of_source, of_target) = (source.field(partner.source as usize), self.field(partner.node as usize));
        let variance = f64::from(partner.variance);
        // Planes that have learnt from other frames lie between the errors of these.
        let node = partner.node as usize;
        let now = [plane[3], f64::from(self.sigma[node])];
        let [distance, sigma] = self.measured.get(node).map_or(now, |measured| measured.map(f64::from));
        let residual = f64::from(partner.residual) + now[0] - distance;
        let taken = (sigma * sigma - now[1] * now[1]) / variance;
        let mut row = [0.0; ROW];
        row[..FIELD].copy_from_slice(frame.derivative(&point, &normal).as_slice());
        for (value, (source, target)) in row[FIELD..SCALE].iter_mut().zip(of_source.iter().zip(of_target)) {
            *value = source * by_scale - target * plane[3];
        }
        (row[SCALE], row[RESIDUAL]) = (by_scale, residual);
        Sighting { residual: residual / variance.sqrt(), variance, taken, row, follows }
    }

    /// Relative change of a node's depth by each coefficient.
    #[inline(always)]
    fn field(&self, node: usize) -> [f64; COEFFICIENTS] {
        let grid = &self.grid;
        let (across, down) = (&grid.legendre[0][node % grid.cols], &grid.legendre[1][node / grid.cols]);
        let [a, b, c, distance] = self.planes[node].map(f64::from);
        let inverse_depth = (a * f64::from(grid.u[node]) + b * f64::from(grid.v[node]) - c) / distance;
        let relative = if self.has_sigma { inverse_depth * f64::from(grid.cosine[node]) } else { -1.0 / inverse_depth };
        let (mut field, mut k) = ([0.0; COEFFICIENTS], 0);
        for degree in 0..=DEGREE {
            for r in 0..=degree {
                field[k] = across[degree - r] * down[r] * relative;
                k += 1;
            }
        }
        field
    }
}

/// Standard deviation of values of expectation 0, from their median.
fn scale(values: impl Iterator<Item = f64>, scratch: &mut Vec<u32>) -> Option<f64> {
    scratch.clear();
    scratch.extend(values.map(|v| positive_bits(v.abs() as f32)));
    median_of_bits(scratch).map(|median| SIGMA_OF_MAD * f64::from(median))
}

fn reduced(sightings: &[Sighting], to_tangent: &Matrix6<f64>, scratch: &mut Vec<u32>) -> Option<Influence> {
    // Neighbours see the same shared error: their difference is the random part, twice.
    let steps = sightings.windows(2).filter(|pair| pair[1].follows).map(|pair| pair[1].residual - pair[0].residual);
    let random = (scale(steps, scratch)? / 2.0_f64.sqrt()).max(LEAST_RANDOM);
    let reach = WIDE * TUKEY * scale(sightings.iter().map(|s| s.residual), scratch)?.max(random);
    let weighted = |s: &Sighting| {
        let u = s.residual / reach;
        (s.row, (1.0 - u * u).max(0.0).powi(2) / (s.variance * random * random))
    };
    let sums = weighted_products(sightings.iter().map(weighted));
    let matrix = Matrix6::from_fn(|r, c| sums[r][c]);
    let cross = ByField::from_fn(|r, c| sums[r][FIELD + c]);
    let normal = FieldMatrix::from_fn(|r, c| sums[FIELD + r][FIELD + c]);
    let gradient = Vector6::from_fn(|r, _| sums[r][RESIDUAL]);
    let right = Field::from_fn(|r, _| sums[FIELD + r][RESIDUAL]);
    let (scale, scale_right) = (sums[SCALE][SCALE], sums[SCALE][RESIDUAL]);
    let scale_cross = Vector6::from_fn(|r, _| sums[r][SCALE]);
    let scale_field = Field::from_fn(|r, _| sums[FIELD + r][SCALE]);
    let weight: f64 = sightings.iter().map(|s| 1.0 / s.variance).sum();
    let taken: f64 = sightings.iter().map(|s| s.taken / s.variance).sum();
    let factor = matrix.cholesky()?;
    let pose = -factor.solve(&cross);
    let followed = factor.solve(&scale_cross);
    let scale = scale - scale_cross.dot(&followed);
    let logarithm = (scale_right - gradient.dot(&followed)) / scale;
    let scale_by_field = (scale_field + pose.transpose() * scale_cross) / scale;
    Some(Influence {
        normal: normal + cross.transpose() * pose,
        right: right + pose.transpose() * gradient,
        scale: (logarithm, 1.0 / scale, scale_by_field),
        pose: to_tangent * pose,
        kept: 1.0 + taken / weight,
    })
}
