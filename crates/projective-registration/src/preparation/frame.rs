//! A frame prepared for registration.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::preparation::bits::{median_of_bits, positive_bits};
use crate::preparation::blocks::Points;
use crate::preparation::grid::Grid;
use crate::preparation::nodes::{LARGEST_DEPTH_M, LEAST_DEPTH_M, NodeRow};
use crate::preparation::planes::{FREEDOM, MOMENT, PlaneRow, ROUNDING};
use crate::preparation::projection::Projection;
use point_cloud::Cloud;
use rigid_pose::{Centred, require_length};

/// Windows whose mean square deviation exceeds that of most by this factor hold no plane.
const LARGEST_MISFIT: f32 = 3.0;
/// Typical tilt of planes by noise about either axis, radian, beyond which larger nodes are taken: there half of the right
/// pairs enclose more than 45 degrees, and are refused.
const LARGEST_TILT: f32 = 0.5;
/// Nodes from which typical values are taken.
const SAMPLE: usize = 1024;

/// A frame prepared for registration: planes through its nodes, each the average of a square of pixels. Its memory is
/// used again by [`OrganisedFrame::update`].
#[derive(Debug, Clone)]
pub struct OrganisedFrame {
    projection: Arc<Projection>,
    /// The projection's, fine or coarse.
    pub(crate) grid: Arc<Grid>,
    pub(crate) inverse_depth: Vec<f32>,
    spread: Vec<f32>,
    /// Share of the pixels of each node that are valid.
    share: Vec<f32>,
    /// Where its inverse depth belongs, from its middle along columns and rows, in nodes.
    pub(crate) place: Vec<[f32; 2]>,
    /// Whether all pixels are valid.
    is_whole: bool,
    /// Plane of each node: unit normal away from the camera, distance; NaN where there is none.
    pub(crate) planes: Vec<[f32; 4]>,
    /// Distances of the planes and their standard deviations before others were absorbed, where any may have been.
    pub(crate) measured: Vec<[f32; 2]>,
    /// Standard deviation of the distance, metre.
    pub(crate) sigma: Vec<f32>,
    misfit: Vec<f32>,
    /// What the spread is multiplied by: 1 where the noise was given.
    noise: f32,
    scratch: Vec<u32>,
    pub(crate) points: Points,
    pub(crate) has_sigma: bool,
}

impl OrganisedFrame {
    /// Prepares a frame: one point a pixel of `projection`, row by row, camera frame, metre; NaN where there is no
    /// range. `sigma`: standard deviation of the ranges, metre; without it, inverse depth is taken as equally precise
    /// all over the frame, and how precise is estimated. Pixels whose sigma is not positive take no part either: a node is
    /// made from those that are valid, wherever they lie in its square, and one without any, but surrounded by others, from
    /// theirs.
    ///
    /// # Errors
    /// [`InputError::LengthMismatch`](rigid_pose::InputError::LengthMismatch) where points or sigma do not fill the frame; [`Error::PointsOffRays`] where points do
    /// not lie on the rays of their pixels.
    pub fn new<T: Copy + Into<f64> + Sync>(
        projection: &Arc<Projection>,
        points: &[[T; 3]],
        sigma: Option<&[f32]>,
    ) -> Result<Self> {
        let grid = Arc::clone(&projection.grids[0]);
        let nodes = grid.len();
        let mut frame = Self {
            projection: Arc::clone(projection),
            inverse_depth: vec![f32::NAN; nodes],
            spread: vec![0.0; nodes],
            share: vec![1.0; nodes],
            place: vec![[0.0; 2]; nodes],
            is_whole: true,
            planes: vec![[f32::NAN; 4]; nodes],
            measured: Vec::new(),
            sigma: vec![0.0; nodes],
            misfit: vec![f32::NAN; nodes],
            noise: 1.0,
            scratch: Vec::with_capacity(SAMPLE),
            points: Points::new(&grid),
            grid,
            has_sigma: false,
        };
        frame.update(points, sigma)?;
        Ok(frame)
    }

    /// Puts another frame of the same camera in place of this one, without allocating memory.
    ///
    /// # Errors
    /// As [`OrganisedFrame::new`]; the frame then stays as it was.
    pub fn update<T: Copy + Into<f64> + Sync>(&mut self, points: &[[T; 3]], sigma: Option<&[f32]>) -> Result<()> {
        let (width, height) = (self.projection.width(), self.projection.height());
        let expected = width * height;
        require_length("points of the frame", expected, points.len())?;
        require_length("sigma", expected, sigma.map(<[f32]>::len))?;
        check_rays(&self.projection, points)?;
        self.has_sigma = sigma.is_some();
        for level in 0..self.projection.grids.len() {
            self.divide(level);
            self.reduce(points, sigma);
            self.fit_planes();
            self.refuse_misfits();
            if self.tilt() <= LARGEST_TILT {
                break;
            }
        }
        if !self.is_whole {
            self.centre();
        }
        self.points.gather(&self.grid, &self.inverse_depth, &self.planes, &self.sigma);
        Ok(())
    }

    /// The camera.
    pub fn projection(&self) -> &Arc<Projection> {
        &self.projection
    }

    /// Number of nodes that have a plane.
    pub fn len(&self) -> usize {
        self.points.counts[self.points.counts.len() - 1]
    }

    /// Whether no node has a plane.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The nodes as a cloud: points (averages over a square of pixels), normals towards the camera, and standard
    /// deviations of the averages along their rays. Nodes without a plane, at edges and holes, are marked as rim and have
    /// no normal.
    pub fn to_cloud(&self) -> Cloud {
        let grid = &self.grid;
        let seen: Vec<usize> = (0..grid.len()).filter(|&k| self.inverse_depth[k].is_finite()).collect();
        let has_plane = |k: usize| self.planes[k][3].is_finite();
        let vector = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let point = |k: usize| {
            let (depth, [u, v]) = (1.0 / f64::from(self.inverse_depth[k]), grid.ray(k, self.place[k]));
            Point3::new(f64::from(u) * depth, f64::from(v) * depth, -depth)
        };
        let normal = |k: usize| {
            let n = vector([self.planes[k][0], self.planes[k][1], self.planes[k][2]]);
            if has_plane(k) { -n.normalize() } else { Vector3::repeat(f64::NAN) }
        };
        let sigma = |k: usize| {
            let (w, spread) = (self.inverse_depth[k], self.spread[k]);
            f64::from(spread * self.noise.max(ROUNDING * w / spread) / (w * w * grid.cosine[k]))
        };
        Cloud {
            points: seen.iter().map(|&k| point(k)).collect(),
            normals: Some(seen.iter().map(|&k| normal(k)).collect()),
            sigma: Some(seen.iter().map(|&k| sigma(k)).collect()),
            rim: Some(seen.iter().map(|&k| !has_plane(k)).collect()),
            ..Cloud::default()
        }
    }

    /// A copy that others are aligned with, but that is not aligned with others: without what only that takes.
    #[must_use]
    pub fn as_target(&self) -> Self {
        Self {
            projection: Arc::clone(&self.projection),
            grid: Arc::clone(&self.grid),
            inverse_depth: self.inverse_depth.clone(),
            spread: self.spread.clone(),
            share: Vec::new(),
            place: self.place.clone(),
            is_whole: self.is_whole,
            planes: self.planes.clone(),
            measured: self.planes.iter().zip(&self.sigma).map(|(plane, sigma)| [plane[3], *sigma]).collect(),
            sigma: self.sigma.clone(),
            misfit: Vec::new(),
            noise: self.noise,
            scratch: Vec::new(),
            points: self.points.without_blocks(),
            has_sigma: self.has_sigma,
        }
    }

    /// Where the lists of the frame lie, and how much they hold.
    #[cfg(test)]
    pub(crate) fn memory(&self) -> Vec<(usize, usize)> {
        let singles = [&self.inverse_depth, &self.spread, &self.share, &self.sigma, &self.misfit];
        let mut memory: Vec<(usize, usize)> = singles.iter().map(|v| (v.as_ptr() as usize, v.capacity())).collect();
        memory.push((self.place.as_ptr() as usize, self.place.capacity()));
        memory.push((self.planes.as_ptr() as usize, self.planes.capacity()));
        memory.push((self.scratch.as_ptr() as usize, self.scratch.capacity()));
        memory.push((self.points.blocks.as_ptr() as usize, self.points.blocks.capacity()));
        memory
    }

    /// Its middle at a pose, and its radius: about what its motions are.
    pub(crate) fn centred(&self, pose: &Isometry3<f64>) -> Centred {
        let centre = (pose * Point3::from(self.points.centre)).coords;
        Centred { centre, radius_m: self.points.radius_m.max(f64::MIN_POSITIVE) }
    }

    /// Takes another of the projection's grids.
    fn divide(&mut self, level: usize) {
        let grid = &self.projection.grids[level];
        if Arc::ptr_eq(grid, &self.grid) {
            return;
        }
        self.grid = Arc::clone(grid);
        for list in [&mut self.inverse_depth, &mut self.spread, &mut self.share, &mut self.sigma, &mut self.misfit] {
            list.resize(grid.len(), 0.0);
        }
        self.place.resize(grid.len(), [0.0; 2]);
        self.planes.resize(grid.len(), [f32::NAN; 4]);
        self.points.arrange(grid);
        // The lists are filled anew.
        self.is_whole = false;
    }

    fn reduce<T: Copy + Into<f64> + Sync>(&mut self, points: &[[T; 3]], sigma: Option<&[f32]>) {
        let (grid, width) = (&self.grid, self.projection.width());
        let values = self.inverse_depth.par_chunks_mut(grid.cols).zip(self.spread.par_chunks_mut(grid.cols));
        let pixels = self.share.par_chunks_mut(grid.cols).zip(self.place.par_chunks_mut(grid.cols));
        let rows = values.zip(pixels).enumerate().with_min_len(8).with_max_len(16);
        let is_whole = self.is_whole;
        let reduced = rows.map(|(row, ((inverse_depth, spread), (share, place)))| {
            let row = NodeRow { grid, row, width, points, sigma, inverse_depth, spread, share, place, is_whole };
            pulp::Arch::new().dispatch(row)
        });
        self.is_whole = reduced.reduce(|| true, |a, b| a && b);
    }

    fn fit_planes(&mut self) {
        let grid = &self.grid;
        let (inverse_depth, spread) = (&self.inverse_depth[..], &self.spread[..]);
        let (share, place, is_whole) = (&self.share[..], &self.place[..], self.is_whole);
        let outputs = (self.planes.par_chunks_mut(grid.cols), self.sigma.par_chunks_mut(grid.cols));
        let rows = outputs.0.zip(outputs.1).zip(self.misfit.par_chunks_mut(grid.cols));
        rows.enumerate().with_min_len(8).with_max_len(16).for_each(|(row, ((planes, sigma), misfit))| {
            let row = PlaneRow { grid, row, inverse_depth, spread, is_whole, share, place, planes, sigma, misfit };
            pulp::Arch::new().dispatch(row);
        });
    }

    /// Typical tilt of the planes by noise about either axis, radian, as for small ones; 0 where there are no planes.
    fn tilt(&mut self) -> f32 {
        let step = self.planes.len().div_ceil(SAMPLE).max(1);
        let known = (0..self.planes.len()).step_by(step).filter(|&k| self.planes[k][3].is_finite());
        let tilts = known.map(|k| {
            let [a, b, c, d] = self.grid.gradient[k];
            (a * d - b * c).abs().sqrt() * self.noise * self.spread[k] / (self.inverse_depth[k] * MOMENT.sqrt())
        });
        self.scratch.clear();
        self.scratch.extend(tilts.map(positive_bits));
        median_of_bits(&mut self.scratch).unwrap_or(0.0)
    }

    /// Takes the planes off windows that hold more than one, and scales the noise where its size was not given.
    fn refuse_misfits(&mut self) {
        let step = self.misfit.len().div_ceil(SAMPLE).max(1);
        self.scratch.clear();
        let known = self.misfit.iter().step_by(step).copied().filter(|m| m.is_finite());
        self.scratch.extend(known.map(positive_bits));
        let freedom = f64::from(FREEDOM);
        // Median of a mean of squares (Wilson and Hilferty).
        let expected = (1.0 - 2.0 / (9.0 * freedom)).powi(3);
        let typical = (f64::from(median_of_bits(&mut self.scratch).unwrap_or(0.0)) / expected) as f32;
        let scale = if self.has_sigma { 1.0 } else { typical.sqrt() };
        self.noise = scale;
        let limit = LARGEST_MISFIT * if self.has_sigma { typical.max(1.0) } else { typical };
        let nodes = self.planes.par_iter_mut().zip(&mut self.sigma).zip(&self.misfit);
        nodes.with_min_len(4096).for_each(|((plane, sigma), misfit)| {
            let rounding = ROUNDING * plane[3] / *sigma;
            let holds = *misfit <= limit + rounding * rounding;
            // NaN fails.
            if !holds {
                *plane = [f32::NAN; 4];
            }
            *sigma *= scale.max(rounding);
        });
    }

    /// Moves the nodes with planes along them from the places of their pixels to their middles; nodes without pixels are
    /// put on their planes.
    fn centre(&mut self) {
        let (grid, noise) = (&self.grid, self.noise);
        let nodes = self.inverse_depth.par_iter_mut().zip(&mut self.spread).zip(&mut self.place);
        let planes = self.planes.par_iter().zip(&self.sigma).zip(grid.u.par_iter().zip(&grid.v));
        nodes.zip(planes).with_min_len(4096).for_each(|(((w, spread), place), ((plane, sigma), (u, v)))| {
            // No branches: they would be guessed wrong at every hole.
            let (has_plane, middle) = (plane[3].is_finite(), (plane[0] * u + plane[1] * v - plane[2]) / plane[3]);
            *spread = if has_plane & w.is_nan() { sigma * middle / (plane[3] * noise) } else { *spread };
            *w = if has_plane { middle } else { *w };
            *place = if has_plane { [0.0; 2] } else { *place };
        });
    }
}

/// Refuses frames most of whose points lie beside the rays of their pixels, by a sample of them.
fn check_rays<T: Copy + Into<f64>>(projection: &Projection, points: &[[T; 3]]) -> Result<()> {
    let (mut off, mut tried, mut example) = (0, 0, 0);
    let step = points.len() / 101 + 1;
    for index in (0..points.len()).step_by(step) {
        let p = points[index].map(Into::into);
        if !(p[2].abs() > LEAST_DEPTH_M && p[2].abs() < LARGEST_DEPTH_M && p[0].is_finite() && p[1].is_finite()) {
            continue;
        }
        tried += 1;
        let at = [(index % projection.width()) as f64, (index / projection.width()) as f64];
        let found = projection.pixel(&Point3::from(p));
        if !found.is_some_and(|f| (f[0] - at[0]).abs() <= 1.0 && (f[1] - at[1]).abs() <= 1.0) {
            off += 1;
            example = index;
        }
    }
    if 2 * off > tried { Err(Error::PointsOffRays { index: example }) } else { Ok(()) }
}
