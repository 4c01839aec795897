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
        let frames = Frames { source, target };
        let result = self.registered(frames, guess)?;
        Ok(self.with_influence(result, frames))
    }

    /// As [`FrameAligner::align_apart`], from a guess that is known as well as a registration knows it: the last steps alone, which hold
    /// on to what lies within noise there. Something large that moves by itself draws no pose to where it would stand still, as where
    /// all that is in reach takes part first. Nothing is searched for.
    pub fn align_near(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<(IcpResult, Option<Influence>)> {
        let rest = self.without_strays(source, target, guess);
        let frames = Frames { source: &rest, target };
        let track = Self::start(frames, guess)?;
        let (_, result) = self.end(track, frames)?;
        Ok(self.with_influence(result, frames))
    }

    fn with_influence(&mut self, result: IcpResult, frames: Frames<'_>) -> (IcpResult, Option<Influence>) {
        let Frames { source, target } = frames;
        let influence = target.influence(source, &result.target_from_source, &mut self.sightings, &mut self.scratch);
        (result, influence)
    }
}
