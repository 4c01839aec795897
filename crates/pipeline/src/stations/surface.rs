//! A station in the form that is registered fastest: pixels of a camera, or voxels.

use std::sync::Arc;

use global_registration::{CoarseOptions, FeatureCloud, Viewpoint, align_without_guess};
use icp_registration::{DegeneracyPolicy, IcpOptions, IcpResult, IcpTarget, VoxelAlignmentOptions, VoxelCloud};
use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;
use projective_registration::{FrameAlignmentOptions, OrganisedFrame, Projection, align_frames, frame_consistency};

use crate::stations::station::{Station, Windows};
use crate::{Error, Result};

/// Distances beyond this many times the typical residual belong to something else.
const RESIDUAL_REACH: f64 = 5.0;
/// The same in spacings of the points of the surface.
const SPACING_REACH: f64 = 2.0;

/// A pose farther from a start than this many times its error belongs to something else.
const REACH: f64 = 2.0;
/// Every how many nodes of frames are compared to choose between two poses.
const CONSISTENCY_STRIDE: usize = 2;

/// One station, prepared.
pub struct Surface {
    /// Its points with normals, as they are registered one by one.
    pub target: IcpTarget,
    frame: Option<OrganisedFrame>,
    voxels: Option<VoxelCloud>,
    viewpoint: Viewpoint,
}

/// Where an alignment starts.
#[derive(Debug, Clone, Copy)]
pub enum Start {
    /// A pose that somebody stated.
    Guess(Isometry3<f64>),
    /// Right to this distance, metre.
    Found(Isometry3<f64>, f64),
}

impl Surface {
    /// Prepares a station; `normal_half_width_px`: of the windows that normals of a frame come from.
    pub fn new(station: &Station, normal_half_width_px: usize) -> Result<Self> {
        let fail = |error: icp_registration::Error| Error::registration(&station.name, &error);
        let target = IcpTarget::new(station.cloud(normal_half_width_px, Windows::Alike)?).map_err(fail)?;
        let frame = station.projection.as_ref().and_then(|projection| frame(station, projection));
        // Clouds too small to fill voxels are registered point by point.
        let voxels = match frame {
            Some(_) => None,
            None => VoxelCloud::new(&with_normals(&target), None).ok(),
        };
        let viewpoint = if station.is_seen_from_origin() { Viewpoint::Origin } else { Viewpoint::Unknown };
        Ok(Self { target, frame, voxels, viewpoint })
    }

    /// Usable points.
    pub fn points(&self) -> usize {
        self.target.cloud().len()
    }

    /// Looks for `self_from_source` where nothing is known of it.
    pub fn search(&self, source: &Self) -> std::result::Result<Start, global_registration::Error> {
        let options = CoarseOptions::default();
        let features = |surface: &Self| {
            let options = CoarseOptions { viewpoint: surface.viewpoint, ..options.clone() };
            // Normals of the nearest neighbours, which run across edges, would leave the planes of a scene too few.
            FeatureCloud::new(surface.target.cloud(), &options)
        };
        let found = align_without_guess(&features(source)?, &features(self)?, &options)?;
        Ok(Start::Found(found.target_from_source, 2.0 * found.voxel_m))
    }

    /// Fine alignment of `source` with this station.
    pub fn align(&self, source: &Self, start: Start) -> std::result::Result<IcpResult, icp_registration::Error> {
        let (guess, error_m) = match start {
            Start::Guess(guess) => (guess, None),
            Start::Found(guess, error_m) => (guess, Some(error_m)),
        };
        // Held at a guess that is far off, misaligned surfaces would never come together.
        let degeneracy = DegeneracyPolicy::Report;
        let pixels = self.frame.as_ref().zip(source.frame.as_ref());
        let by_pixels = pixels.and_then(|(target, source)| {
            let result = align_frames(source, target, &guess, &FrameAlignmentOptions::default()).ok()?;
            let moved = (result.target_from_source.translation.vector - guess.translation.vector).norm();
            error_m.is_none_or(|error_m| moved <= REACH * error_m).then_some(result)
        });
        if let Some(result) = by_pixels.as_ref().filter(|result| result.is_trustworthy()) {
            return Ok(result.clone());
        }
        if let (Some(target), Some(source)) = (&self.voxels, &source.voxels) {
            let options =
                VoxelAlignmentOptions { degeneracy, max_start_error_m: error_m, ..VoxelAlignmentOptions::default() };
            // Where voxels leave something open, single points have the last word.
            if let Ok(result) = target.align(source, &guess, &options)
                && result.is_trustworthy()
            {
                return Ok(result);
            }
        }
        let options = IcpOptions { degeneracy, initial_correspondence_distance_m: error_m, ..IcpOptions::default() };
        let by_points = self.target.align(source.target.cloud(), &guess, &options);
        let (Some(by_pixels), Some((target, source))) = (by_pixels, pixels) else { return by_points };
        let Ok(by_points) = by_points else { return Ok(by_pixels) };
        // Neither is sure: the frames tell which they contradict less.
        let agreement = |result: &IcpResult| {
            let both = frame_consistency(source, target, &result.target_from_source, CONSISTENCY_STRIDE);
            both.agreeing.saturating_sub(both.contradicting)
        };
        Ok(if agreement(&by_points) > agreement(&by_pixels) { by_points } else { by_pixels })
    }

    /// Signed distance of a point (this station's frame, metre) from the surface; positive on the side that the station
    /// looks at. `None` where there is no surface.
    pub fn distance(&self, point: &Point3<f64>, rms_m: f64) -> Option<f64> {
        let reach = (RESIDUAL_REACH * rms_m).max(SPACING_REACH * self.target.spacing_m());
        let nearest = self.target.tree().nearest(point).ok().filter(|nearest| nearest.distance_m <= reach)?;
        let (at, normal) = (self.target.cloud().points[nearest.index], self.target.normals()[nearest.index]);
        let across = normal.dot(&(point - at));
        let side = if normal.dot(&at.coords) > 0.0 { -across } else { across };
        side.is_finite().then_some(side)
    }
}

/// The pixels of a station, prepared; `None` where they are not on the rays of its camera.
pub fn frame(station: &Station, projection: &Arc<Projection>) -> Option<OrganisedFrame> {
    let points = station.usable_points();
    let sigma = station.file.sigma.as_deref().filter(|sigma| sigma.iter().any(|value| *value > 0.0));
    OrganisedFrame::new(projection, &points, sigma).ok()
}

fn with_normals(target: &IcpTarget) -> Cloud {
    Cloud { normals: Some(target.normals().to_vec()), ..target.cloud().clone() }
}
