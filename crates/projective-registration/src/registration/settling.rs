//! The last level: iterations on all nodes until the pose stands, or wanders within its noise.

use nalgebra::Vector6;
use statistics::SIGMA_OF_MAD;

use crate::error::Result;
use crate::partners::sums::median_residual;
use crate::partners::track::{Frames, Track, is_within_noise};
use crate::preparation::blocks::Block;
use crate::registration::aligner::{FrameAligner, SAMPLE};
use icp_registration::StopReason;
use icp_registration::quality::SMALL_STEP;

/// Length of a step over its standard deviation, as the weights of the pairs tell it, below which all nodes take part instead
/// of a quarter. Their poses differ by about two of these anyway. It decides on time alone: see docs/benchmarks.md.
const COARSE_FRACTION: f64 = 1.0;
/// Steps before which the reach of the kernel is set. Where a step on a quarter of the nodes is short before that, the rest follow on all.
const NARROWINGS: usize = 3;
/// Steps after which it is first seen whether the pose has got anywhere, and then after twice as many as before: where nodes
/// change back and forth between planes, steps never become short. A power of 2; it decides on time alone.
const WANDERING: usize = 4;

impl FrameAligner {
    /// Iterates on all points until the pose stands.
    pub(crate) fn settle(&mut self, track: &mut Track, frames: Frames<'_>) -> Result<StopReason> {
        let blocks = frames.all_blocks();
        track.rules.extra_variance = 0.0;
        let mut narrowings = NARROWINGS;
        // A quarter of the nodes first: only the last steps need all.
        let fraction = self.options.noise_fraction.unwrap_or(COARSE_FRACTION);
        self.iterate(track, frames, frames.finest_part(), fraction, &mut narrowings)?;
        self.iterate(track, frames, blocks, self.options.noise_fraction.unwrap_or(0.0), &mut narrowings)
    }

    /// Iterates on some nodes until a step is short, or shorter than so many standard deviations, or the pose only wanders.
    fn iterate(
        &mut self,
        track: &mut Track,
        frames: Frames<'_>,
        blocks: &[Block],
        over_sigma: f64,
        narrowings: &mut usize,
    ) -> Result<StopReason> {
        let (mut steps, mut way, mut most) = (0, Vector6::zeros(), 1);
        let are_some = blocks.len() < frames.all_blocks().len();
        while track.iterations < self.options.max_iterations {
            if *narrowings > 0 {
                self.rescale(track, frames, *narrowings == NARROWINGS);
                *narrowings -= 1;
            }
            let (step, frame) = self.step(track, frames, blocks, 0.0)?;
            if *narrowings > 0 && !(are_some && track.over_sigma <= over_sigma) {
                continue;
            }
            let tolerance = SMALL_STEP * frame.radius_m;
            if step <= tolerance || track.over_sigma <= over_sigma {
                return Ok(StopReason::Converged);
            }
            (steps, way) = (steps + 1, way + track.last_step);
            // Back where it was, it goes in a circle (cycles are found with marks that are set ever more seldom).
            if way.norm() <= tolerance {
                break;
            }
            if steps == most {
                if most >= WANDERING && self.is_within_noise(track, frames, blocks, &way)? {
                    return Ok(StopReason::WithinNoise);
                }
                (steps, way, most) = (0, Vector6::zeros(), 2 * most);
            }
        }
        Ok(StopReason::MaxIterations)
    }

    /// Whether a way is shorter than a tenth of the standard deviation of the pose where it ends.
    fn is_within_noise(
        &mut self,
        track: &Track,
        frames: Frames<'_>,
        blocks: &[Block],
        way: &Vector6<f64>,
    ) -> Result<bool> {
        let verdict = self.verdict(track, frames, blocks)?;
        let radius_m = frames.source.centred(&track.pose).radius_m;
        Ok(is_within_noise(way, &verdict.directions.covariance(radius_m, None)))
    }

    /// Sets the reach of the kernel from the residuals.
    fn rescale(&mut self, track: &mut Track, frames: Frames<'_>, first: bool) {
        if first {
            track.rules.widening = 10.0;
        }
        let (moved, _) = frames.moved(track);
        let blocks = frames.all_blocks();
        let median = median_residual(&moved, blocks, SAMPLE, &mut self.scratch).unwrap_or(0.0);
        track.rules.widening = (SIGMA_OF_MAD * median).max(0.1) as f32;
    }
}
