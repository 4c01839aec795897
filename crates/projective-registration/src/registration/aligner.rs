//! The registration of two frames, level by level.

use nalgebra::{Isometry3, Matrix6, Vector6};
use statistics::SIGMA_OF_MAD;

use crate::error::Result;
use crate::options::FrameAlignmentOptions;
use crate::partners::pairs::Rules;
use crate::partners::sums::{SUMS, median_residual, normal_equations};
use crate::partners::track::{Frames, LAST_LEVEL, Track, is_within_noise};
use crate::preparation::blocks::Block;
use crate::preparation::frame::OrganisedFrame;
use crate::registration::quality::{Cell, Verdict};
use crate::shared_error::Sighting;
use icp_registration::quality::{FEWEST_PAIRS, OPEN};
use icp_registration::{IcpResult, StopReason};
use rigid_pose::{Centred, InputError, require_pose, symmetrised};

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
    pub(crate) means: Vec<[f32; 2]>,
    pub(crate) sightings: Vec<Sighting>,
    /// Memory for the points of a source without what strays.
    pub(crate) rest: Vec<Block>,
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
            means: Vec::new(),
            sightings: Vec::new(),
            rest: Vec::new(),
        })
    }

    /// The options.
    pub fn options(&self) -> &FrameAlignmentOptions {
        &self.options
    }

    pub(crate) fn registered(&mut self, frames: Frames<'_>, guess: &Isometry3<f64>) -> Result<IcpResult> {
        let track = Self::start(frames, guess)?;
        let first = self.follow_levels(track.clone(), frames);
        if self.options.search { self.searched(first, &track, frames) } else { first.map(|(_, result)| result) }
    }

    /// A pose that has not moved yet.
    pub(crate) fn start(frames: Frames<'_>, guess: &Isometry3<f64>) -> Result<Track> {
        require_pose("the guess", guess)?;
        for (what, frame) in [("the source frame", frames.source), ("the target frame", frames.target)] {
            if frame.len() < FEWEST_PAIRS {
                return Err(InputError::TooFewPoints { what, found: frame.len(), needed: FEWEST_PAIRS }.into());
            }
        }
        let rules = Rules { extra_variance: 0.0, widening: 1.0 };
        let (free, last_step) = (Matrix6::identity(), Vector6::zeros());
        Ok(Track { pose: *guess, iterations: 0, rules, free, last_step, over_sigma: f64::INFINITY })
    }

    /// The whole way from the guess.
    fn follow_levels(&mut self, mut track: Track, frames: Frames<'_>) -> Result<(Track, IcpResult)> {
        let first = frames.first_level();
        self.open(&mut track, frames, frames.blocks(first))?;
        self.approach(&mut track, frames, first)?;
        self.end(track, frames)
    }

    /// The levels from one on, but for the last.
    pub(crate) fn approach(&mut self, track: &mut Track, frames: Frames<'_>, first: usize) -> Result<()> {
        for level in first..LAST_LEVEL {
            self.descend(track, frames, frames.blocks(level), COARSE_ITERATIONS)?;
        }
        Ok(())
    }

    /// The last level, and the result.
    pub(crate) fn end(&mut self, mut track: Track, frames: Frames<'_>) -> Result<(Track, IcpResult)> {
        let stop = self.settle(&mut track, frames)?;
        let result = self.result(&track, frames, stop)?;
        Ok((track, result))
    }

    /// Sets the variance of what is not aligned from the residuals at the guess.
    pub(crate) fn open(&mut self, track: &mut Track, frames: Frames<'_>, blocks: &[Block]) -> Result<()> {
        let radius = frames.target.points.radius_m.max(frames.radius_m());
        track.rules.extra_variance = (radius * radius) as f32;
        let moved = frames.moved(track);
        let median = median_residual(&moved.0, blocks, SAMPLE, &mut self.scratch)
            .ok_or_else(|| Self::too_few(0, frames.source.len(), track))?;
        let scale = SIGMA_OF_MAD * median * radius;
        track.rules.extra_variance = (scale * scale) as f32;
        Ok(())
    }

    /// Passes one level with at most so many iterations.
    pub(crate) fn descend(
        &mut self,
        track: &mut Track,
        frames: Frames<'_>,
        blocks: &[Block],
        iterations: usize,
    ) -> Result<()> {
        for _ in 0..iterations {
            if track.iterations >= self.options.max_iterations {
                break;
            }
            let wide = track.iterations < WIDE_ITERATIONS;
            track.rules.widening = if wide { 3.0 } else { 1.0 };
            let (step, frame) = self.step(track, frames, blocks, 1e-4)?;
            if !wide {
                self.narrow(track, frames, blocks);
            }
            if step < COARSE_TOLERANCE * frame.radius_m && !wide {
                break;
            }
        }
        Ok(())
    }

    /// Lowers the variance of what is not aligned to what the residuals show.
    fn narrow(&mut self, track: &mut Track, frames: Frames<'_>, blocks: &[Block]) {
        let (moved, _) = frames.moved(track);
        let median = median_residual(&moved, blocks, SAMPLE, &mut self.scratch).unwrap_or(0.0);
        let square = (SIGMA_OF_MAD * median).powi(2) as f32;
        track.rules.extra_variance *= square.clamp(0.05, 1.0);
    }

    /// One step, and how far it moves points at the radius, metre.
    pub(crate) fn step(
        &mut self,
        track: &mut Track,
        frames: Frames<'_>,
        blocks: &[Block],
        damping: f64,
    ) -> Result<(f64, Centred)> {
        let (moved, frame) = frames.moved(track);
        let normal = normal_equations(&moved, blocks, &mut self.chunks);
        if normal.pairs < FEWEST_PAIRS {
            return Err(Self::too_few(normal.pairs, frames.source.len(), track).into());
        }
        let step = normal.equations.step(&track.free, damping)?;
        track.pose = frame.moved(&track.pose, &step);
        track.iterations += 1;
        track.last_step = step;
        track.over_sigma = step.dot(&(normal.equations.matrix * step)).sqrt();
        Ok((step.norm(), frame))
    }

    /// What the pairs of some nodes say about the pose.
    pub(crate) fn verdict(&mut self, track: &Track, frames: Frames<'_>, blocks: &[Block]) -> Result<Verdict> {
        let (moved, frame) = frames.moved(track);
        let limit_m = self.options.max_motion_sigma_m.unwrap_or(OPEN * frame.radius_m);
        Verdict::new(&moved, blocks, limit_m, &mut self.cells)
    }

    fn result(&mut self, track: &Track, frames: Frames<'_>, stop: StopReason) -> Result<IcpResult> {
        let verdict = self.verdict(track, frames, frames.all_blocks())?;
        let frame = frames.source.centred(&track.pose);
        let normal = &verdict.normal;
        let mut pose = track.pose;
        if self.options.noise_fraction.is_some() && stop == StopReason::Converged {
            pose = frame.moved(&pose, &normal.equations.step(&track.free, 0.0)?);
        }
        let to_tangent = frame.tangent_from_motion(&pose);
        let centred = verdict.directions.covariance(frame.radius_m, None);
        let stop = if stop == StopReason::MaxIterations && is_within_noise(&track.last_step, &centred) {
            StopReason::WithinNoise
        } else {
            stop
        };
        Ok(IcpResult {
            target_from_source: pose,
            covariance: symmetrised(&(to_tangent * centred * to_tangent.transpose())),
            overlap: normal.pairs as f64 / frames.source.len() as f64,
            rms_m: (normal.square / normal.weight).sqrt(),
            iterations: track.iterations,
            stop,
            correspondences: normal.pairs,
            max_correspondence_distance_m: f64::from(track.rules.reach())
                * (normal.pairs as f64 / normal.weight).sqrt(),
            degenerate: verdict.directions.undetermined(&frame),
        })
    }

    fn too_few(found: usize, of: usize, track: &Track) -> InputError {
        InputError::TooFewCorrespondences {
            found,
            of,
            needed: FEWEST_PAIRS,
            max_distance_m: f64::from(track.rules.reach() * track.rules.extra_variance.sqrt()),
            iteration: track.iterations,
        }
    }
}

#[cfg(test)]
mod tests;
