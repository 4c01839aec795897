//! The registration of two frames, level by level.

use nalgebra::{Isometry3, Matrix6, Vector6};
use statistics::SIGMA_OF_MAD;

use crate::error::Result;
use crate::options::FrameAlignmentOptions;
use crate::partners::pairs::Rules;
use crate::partners::sums::{SUMS, median_residual, normal_equations};
use crate::partners::track::{FEWEST_POINTS, Track, blocks, is_within_noise, moved};
use crate::preparation::blocks::Block;
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::STRIDES;
use crate::registration::quality::{Cell, Hold, Verdict};
use crate::shared_error::Sighting;
use icp_registration::quality::Residuals;
use icp_registration::{DegeneracyPolicy, IcpResult, StopReason, TUKEY};
use rigid_pose::{Centred, InputError, pose_difference, require_pose, step_pose, symmetrised};

/// Of the biweight.
pub(crate) const BIWEIGHT: f32 = TUKEY as f32;
/// Residuals from which scales are taken.
pub(crate) const SAMPLE: usize = 2048;
/// Iterations on each level but the last.
const COARSE_ITERATIONS: usize = 8;
/// First steps, which are least squares over all that is in reach.
const WIDE_ITERATIONS: usize = 3;
/// Coarse levels end when a step is below this, in units of the radius.
const COARSE_TOLERANCE: f64 = 1e-3;

/// Aligns `source` with `target`, starting at `guess` (both poses `target_from_source`).
///
/// Partners are found by projecting source points into the target frame; minimised are distances from its planes. For
/// streams, keep a [`FrameAligner`].
///
/// # Errors
/// [`InputError::TooFewPoints`] for frames without planes, [`InputError::TooFewCorrespondences`] where frames do not overlap at
/// the guess, [`InputError::NonFinite`] for the guess, [`InputError::InvalidOption`].
pub fn align_frames(
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    guess: &Isometry3<f64>,
    options: &FrameAlignmentOptions,
) -> Result<IcpResult> {
    FrameAligner::new(options.clone())?.align(source, target, guess)
}

/// Registration whose memory is used again.
#[derive(Debug, Clone)]
pub struct FrameAligner {
    pub(crate) options: FrameAlignmentOptions,
    chunks: Vec<[f64; SUMS]>,
    pub(crate) scratch: Vec<u32>,
    pub(crate) cells: Vec<Cell>,
    pub(crate) sightings: Vec<Sighting>,
}

impl FrameAligner {
    /// # Errors
    /// [`InputError::InvalidOption`].
    pub fn new(options: FrameAlignmentOptions) -> Result<Self> {
        options.validate()?;
        Ok(Self {
            options,
            chunks: Vec::new(),
            scratch: Vec::with_capacity(2 * SAMPLE),
            cells: Vec::new(),
            sightings: Vec::new(),
        })
    }

    /// The options.
    pub fn options(&self) -> &FrameAlignmentOptions {
        &self.options
    }

    pub(crate) fn registered(
        &mut self,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<IcpResult> {
        require_pose("the guess", guess)?;
        for (what, frame) in [("the source frame", source), ("the target frame", target)] {
            if frame.len() < self.options.min_correspondences {
                let needed = self.options.min_correspondences;
                return Err(InputError::TooFewPoints { what, found: frame.len(), needed }.into());
            }
        }
        let rules = Rules {
            extra_variance: 0.0,
            reach: BIWEIGHT,
            least_cosine: self.options.max_normal_angle_rad.cos() as f32,
        };
        let (free, last_step) = (Matrix6::identity(), Vector6::zeros());
        let track = Track { pose: *guess, iterations: 0, rules, free, last_step, over_sigma: f64::INFINITY };
        let first = self.follow_levels(track.clone(), source, target, guess);
        if self.hold() == Hold::Undetermined || self.options.other_starts == 0 {
            return first.map(|(_, result)| result);
        }
        self.searched(first, &track, source, target)
    }

    /// The first level that is passed; none where all but the last have too few nodes.
    pub(crate) fn first_level(&self, source: &OrganisedFrame) -> Option<usize> {
        let coarsest = STRIDES.len() - self.options.levels;
        (coarsest..STRIDES.len() - 1).find(|level| source.points.counts[*level] >= FEWEST_POINTS)
    }

    /// The whole way from the guess.
    fn follow_levels(
        &mut self,
        mut track: Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<(Track, IcpResult)> {
        match self.first_level(source) {
            Some(first) => track = self.start(&track, source, target, blocks(source, first))?,
            None => self.open(&mut track, source, target, &source.points.blocks)?,
        }
        self.finish(track, source, target, guess)
    }

    /// The levels after the first one, and the result.
    fn finish(
        &mut self,
        mut track: Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
    ) -> Result<(Track, IcpResult)> {
        self.approach(&mut track, source, target)?;
        self.end(track, source, target, guess, self.hold())
    }

    /// The levels between the first and the last.
    pub(crate) fn approach(
        &mut self,
        track: &mut Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
    ) -> Result<()> {
        for level in self.first_level(source).map_or(STRIDES.len(), |l| l + 1)..STRIDES.len() - 1 {
            self.descend(track, source, target, blocks(source, level))?;
        }
        Ok(())
    }

    /// The last level, and the result.
    pub(crate) fn end(
        &mut self,
        mut track: Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
        hold: Hold,
    ) -> Result<(Track, IcpResult)> {
        let stop = self.settle(&mut track, source, target, hold)?;
        let result = self.result(&track, source, target, guess, stop)?;
        Ok((track, result))
    }

    /// Sets the variance of what is not aligned from the residuals at the guess.
    pub(crate) fn open(
        &mut self,
        track: &mut Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        blocks: &[Block],
    ) -> Result<()> {
        let radius = target.points.radius_m.max(source.points.radius_m);
        track.rules.extra_variance = (radius * radius) as f32;
        let moved = moved(track, source, target);
        let median = median_residual(&moved.0, &track.rules, blocks, SAMPLE, &mut self.scratch)
            .ok_or_else(|| self.too_few(0, source.len(), track))?;
        let scale = SIGMA_OF_MAD * median * radius;
        track.rules.extra_variance = (scale * scale) as f32;
        Ok(())
    }

    /// Passes one level.
    pub(crate) fn descend(
        &mut self,
        track: &mut Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        blocks: &[Block],
    ) -> Result<()> {
        self.descend_by(track, source, target, blocks, COARSE_ITERATIONS)
    }

    /// Passes one level with at most so many iterations.
    pub(crate) fn descend_by(
        &mut self,
        track: &mut Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        blocks: &[Block],
        iterations: usize,
    ) -> Result<()> {
        if self.hold() == Hold::Undetermined {
            let (moved, frame) = moved(track, source, target);
            let limit = self.max_motion_sigma_m(&frame);
            let verdict = Verdict::new(&moved, &track.rules, blocks, limit, Residuals::Misaligned, &mut self.cells)?;
            track.free = verdict.free();
        }
        for _ in 0..iterations {
            if track.iterations >= self.options.max_iterations {
                break;
            }
            let wide = track.iterations < WIDE_ITERATIONS;
            track.rules.reach = if wide { 3.0 * BIWEIGHT } else { BIWEIGHT };
            let (step, frame) = self.step(track, source, target, blocks, 1e-4)?;
            if !wide {
                self.narrow(track, source, target, blocks);
            }
            if step < COARSE_TOLERANCE * frame.radius_m && !wide {
                break;
            }
        }
        Ok(())
    }

    /// Lowers the variance of what is not aligned to what the residuals show.
    fn narrow(&mut self, track: &mut Track, source: &OrganisedFrame, target: &OrganisedFrame, blocks: &[Block]) {
        let (moved, _) = moved(track, source, target);
        let median = median_residual(&moved, &track.rules, blocks, SAMPLE, &mut self.scratch).unwrap_or(0.0);
        let square = (SIGMA_OF_MAD * median).powi(2) as f32;
        track.rules.extra_variance *= square.clamp(0.05, 1.0);
    }

    /// One step, and how far it moves points at the radius, metre.
    pub(crate) fn step(
        &mut self,
        track: &mut Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        blocks: &[Block],
        damping: f64,
    ) -> Result<(f64, Centred)> {
        let (moved, frame) = moved(track, source, target);
        let normal = normal_equations(&moved, &track.rules, blocks, &mut self.chunks);
        if normal.pairs < self.options.min_correspondences {
            return Err(self.too_few(normal.pairs, source.len(), track).into());
        }
        let step = normal.equations.step(&track.free, damping)?;
        track.pose = frame.moved(&track.pose, &step);
        track.iterations += 1;
        track.last_step = step;
        track.over_sigma = step.dot(&(normal.equations.matrix * step)).sqrt();
        Ok((step.norm(), frame))
    }

    fn result(
        &mut self,
        track: &Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        guess: &Isometry3<f64>,
        stop: StopReason,
    ) -> Result<IcpResult> {
        let (moved, frame) = moved(track, source, target);
        let limit = self.max_motion_sigma_m(&frame);
        let verdict =
            Verdict::new(&moved, &track.rules, &source.points.blocks, limit, Residuals::Settled, &mut self.cells)?;
        let normal = &verdict.normal;
        let mut pose = track.pose;
        if self.options.noise_fraction.is_some() && stop == StopReason::Converged {
            pose = frame.moved(&pose, &normal.equations.step(&track.free, 0.0)?);
        }
        let to_tangent = frame.tangent_from_motion(&pose);
        let centred = if let Some(prior) = &self.options.prior {
            let what = "the tangent of the pose";
            let from_tangent = to_tangent.try_inverse().ok_or(InputError::Numerical { what, why: "it is singular" })?;
            let offset = from_tangent * pose_difference(&pose, guess);
            let prior = symmetrised(&(from_tangent * prior * from_tangent.transpose()));
            let (step, covariance) = verdict.fused(&offset, &prior)?;
            pose = step_pose(&pose, &(to_tangent * step));
            covariance
        } else {
            verdict.covariance(frame.radius_m, self.hold())
        };
        let stop = if stop == StopReason::MaxIterations && is_within_noise(&track.last_step, &centred) {
            StopReason::WithinNoise
        } else {
            stop
        };
        Ok(IcpResult {
            target_from_source: pose,
            covariance: symmetrised(&(to_tangent * centred * to_tangent.transpose())),
            overlap: normal.pairs as f64 / source.len() as f64,
            rms_m: (normal.square / normal.weight).sqrt(),
            iterations: track.iterations,
            stop,
            correspondences: normal.pairs,
            max_correspondence_distance_m: f64::from(track.rules.reach) * (normal.pairs as f64 / normal.weight).sqrt(),
            degenerate: verdict.undetermined(&frame),
        })
    }

    /// With a prior, what the frames do not determine comes from it, and must not slide before.
    pub(crate) fn hold(&self) -> Hold {
        let hold = self.options.degeneracy == DegeneracyPolicy::HoldAtGuess || self.options.prior.is_some();
        if hold { Hold::Undetermined } else { Hold::Nothing }
    }

    pub(crate) fn max_motion_sigma_m(&self, frame: &Centred) -> f64 {
        self.options.max_motion_sigma_m.unwrap_or(frame.radius_m / 300.0)
    }

    fn too_few(&self, found: usize, of: usize, track: &Track) -> InputError {
        InputError::TooFewCorrespondences {
            found,
            of,
            needed: self.options.min_correspondences,
            max_distance_m: f64::from(track.rules.reach * track.rules.extra_variance.sqrt()),
            iteration: track.iterations,
        }
    }
}

#[cfg(test)]
mod tests;
