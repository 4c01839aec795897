//! Random and systematic errors of a registration, told apart.

use nalgebra::Isometry3;

use crate::error::Result;
use crate::partners::track::Frames;
use crate::preparation::frame::OrganisedFrame;
use crate::registration::aligner::FrameAligner;
use crate::shared_error::{Influence, SharedError};
use icp_registration::IcpResult;
use rigid_pose::symmetrised;

impl FrameAligner {
    /// As [`align_frames`](crate::align_frames), without allocating memory once frames of this size have been aligned.
    ///
    /// # Errors
    /// As [`align_frames`](crate::align_frames).
    pub fn align(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<IcpResult> {
        let (mut result, influence) = self.align_apart(source, target, guess)?;
        if let Some(influence) = influence {
            let shared = self.options.shared_error.unwrap_or_else(|| SharedError::of(&influence));
            result.covariance = symmetrised(&(result.covariance + shared.covariance(&influence.pose)));
        }
        Ok(result)
    }

    /// As [`FrameAligner::align`], with a covariance of the random part alone, and what the shared error does to the pose.
    pub fn align_apart(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<(IcpResult, Option<Influence>)> {
        let frames = Frames::new(source, target);
        let result = self.registered(frames, guess)?;
        Ok(self.with_influence(result, frames))
    }

    /// As [`FrameAligner::align_apart`], where something large may move by itself, from a guess `target_from_source` that is nearly known: by
    /// the velocity, or a sensor of motion. Cells of the frame that stray from the target there, by more than most cells let expect, take no
    /// part, and the last steps alone are gone, which hold on to what lies within noise of the guess. Nothing is searched for. The
    /// covariance is of what took part.
    ///
    /// # Errors
    /// As [`align_frames`](crate::align_frames).
    pub fn align_near(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<(IcpResult, Option<Influence>)> {
        let points = self.without_strays(source, target, guess);
        let frames = Frames { source, target, points: &points };
        let result = Self::start(frames, guess).and_then(|track| self.end(track, frames));
        let result = result.map(|(_, result)| self.with_influence(result, frames));
        self.rest = points.blocks;
        result
    }

    fn with_influence(&mut self, result: IcpResult, frames: Frames<'_>) -> (IcpResult, Option<Influence>) {
        let Frames { source, target, .. } = frames;
        let influence = target.influence(source, &result.target_from_source, &mut self.sightings, &mut self.scratch);
        (result, influence)
    }
}
