//! The registration of two clouds of voxels.

use nalgebra::Isometry3;

use super::cloud::VoxelCloud;
use super::level::Level;
use super::options::VoxelAlignmentOptions;
use super::pairs::{Matcher, Pair, Partners, System, matched};
use super::wide::Wide;
use crate::error::Result;
use crate::kernel::RobustKernel;
use crate::quality::{Cells, FEWEST_PAIRS, Free, OPEN, SMALL_STEP, Verdict};
use crate::result::{DegeneracyPolicy, IcpResult, StopReason};
use rigid_pose::{InputError, motion_length, require_pose};

/// Partners of a level are not looked for anew when a step is below this fraction of its voxels, and after so many steps in any
/// case: a coarse level ends then, in the finest one they are kept.
const SETTLED_STEP: f64 = 0.02;
const MOST_SEARCHES: usize = 15;
/// Least size of those cells: planes of voxels nearer than three share points.
const VOXELS_PER_CELL: f64 = 6.0;

impl VoxelCloud {
    /// Aligns `source` with this cloud, starting at `guess` (both poses `target_from_source`).
    ///
    /// Minimised is `Σ w (n·(R p + t − q))²` over the means p, q of paired voxels, n halfway between their normals
    /// `[Rusinkiewicz2019]`, w from the scatter of their points and a robust kernel; voxels of falling size.
    ///
    /// # Errors
    /// [`InputError::TooFewCorrespondences`] where the clouds do not overlap or hold too few planes; [`InputError::NonFinite`]
    /// for the guess, [`InputError::InvalidOption`].
    pub fn align(
        &self,
        source: &VoxelCloud,
        guess: &Isometry3<f64>,
        options: &VoxelAlignmentOptions,
    ) -> Result<IcpResult> {
        options.validate()?;
        require_pose("the guess", guess)?;
        let (pairs, scratch) = (Vec::new(), Vec::new());
        let run = Run { target: self, source, options, pose: *guess, iterations: 0, free: Free::all(), pairs, scratch };
        run.finish(guess)
    }
}

struct Run<'a> {
    target: &'a VoxelCloud,
    source: &'a VoxelCloud,
    options: &'a VoxelAlignmentOptions,
    pose: Isometry3<f64>,
    iterations: usize,
    /// Motions that do not stay as they are, in a frame that stays.
    free: Free,
    pairs: Vec<Pair>,
    scratch: Vec<f64>,
}

impl<'a> Run<'a> {
    fn finish(mut self, guess: &Isometry3<f64>) -> Result<IcpResult> {
        let mut matchers = self.matchers();
        self.approach(&mut matchers)?;
        let least_squares = self.options.kernel == RobustKernel::None;
        let coarse = if least_squares { RobustKernel::None } else { RobustKernel::Cauchy };
        for matcher in &matchers[..matchers.len() - 1] {
            self.search(*matcher, coarse)?;
        }
        let last = matchers[matchers.len() - 1];
        let mut stop = self.settle(last)?;
        if self.options.degeneracy == DegeneracyPolicy::HoldAtGuess
            && let Some((pose, free)) = self.verdict(last)?.back_at(guess, &self.pose)
        {
            (self.pose, self.free) = (pose, free);
            stop = self.settle(last)?;
        }
        self.result(last, stop)
    }

    /// Levels of the source from coarse to fine, each with the target's level of the most similar size.
    fn matchers(&self) -> Vec<Matcher<'a>> {
        let (target, source) = (self.target, self.source);
        let matcher = |level: &'a Level| {
            let unlike = |other: f64| (other / level.size_m).ln().abs();
            let nearest = target.levels.iter().min_by(|a, b| unlike(a.size_m).total_cmp(&unlike(b.size_m)));
            let nearest = nearest.unwrap_or(&target.levels[0]);
            Matcher { source: level, target: nearest, target_lattice: &target.lattice }
        };
        source.levels.iter().rev().map(matcher).collect()
    }

    /// Brings the pose to where the first of the levels that are left can find partners.
    fn approach(&mut self, matchers: &mut Vec<Matcher<'a>>) -> Result<()> {
        if let Some(error_m) = self.options.max_start_error_m
            && let Some(start) = matchers.iter().rposition(|m| m.target.size_m >= error_m)
        {
            matchers.drain(..start);
            return Ok(());
        }
        let wide = Wide::new(&self.source.levels, &self.target.levels, self.source.radius_m);
        let first = self.options.max_start_error_m.unwrap_or(0.5 * self.target.radius_m);
        let (pose, steps) = wide.descend(&self.pose, first, 0.5 * matchers[0].target.size_m)?;
        self.pose = pose;
        self.iterations += steps;
        Ok(())
    }

    fn system(
        &mut self,
        matcher: Matcher<'_>,
        pose: &Isometry3<f64>,
        partners: Partners,
        kernel: RobustKernel,
    ) -> System<'_> {
        matcher.fill(pose, partners, &mut self.pairs);
        System::new(&self.pairs, kernel, &mut self.scratch)
    }

    /// Iterates while partners change; the length of the last step, metre.
    fn search(&mut self, matcher: Matcher<'_>, kernel: RobustKernel) -> Result<f64> {
        let mut step_m = f64::INFINITY;
        for _ in 0..MOST_SEARCHES {
            step_m = self.step(matcher, Partners::Anew, kernel)?;
            if step_m < SETTLED_STEP * matcher.target.size_m {
                break;
            }
        }
        Ok(step_m)
    }

    /// Iterates on the finest level.
    fn settle(&mut self, matcher: Matcher<'_>) -> Result<StopReason> {
        let tolerance_m = SMALL_STEP * self.target.radius_m;
        let mut step_m = self.search(matcher, self.options.kernel)?;
        while step_m > tolerance_m {
            if self.iterations >= self.options.max_iterations {
                return Ok(StopReason::MaxIterations);
            }
            step_m = self.step(matcher, Partners::Kept, self.options.kernel)?;
        }
        Ok(StopReason::Converged)
    }

    /// One step; its length, metre.
    fn step(&mut self, matcher: Matcher<'_>, partners: Partners, kernel: RobustKernel) -> Result<f64> {
        let (pose, free) = (self.pose, self.free);
        let mut system = self.enough(matcher, partners, kernel)?;
        system.frame = free.frame.unwrap_or(system.frame);
        let frame = system.frame;
        let mut step = system.normal_equations().step(&free.projection, 0.0)?;
        // Partners give no reason to move farther than they can be apart.
        step /= (motion_length(&step) / (2.0 * matcher.target.size_m)).max(1.0);
        self.pose = frame.moved(&pose, &step);
        self.iterations += 1;
        Ok(motion_length(&step))
    }

    fn enough(&mut self, matcher: Matcher<'_>, partners: Partners, kernel: RobustKernel) -> Result<System<'_>> {
        let (pose, iteration, needed) = (self.pose, self.iterations, FEWEST_PAIRS);
        let system = self.system(matcher, &pose, partners, kernel);
        if system.count < needed {
            let (found, of, max_distance_m) = (system.count, matcher.source.voxels.len(), matcher.limit_m());
            return Err(InputError::TooFewCorrespondences { found, of, needed, max_distance_m, iteration }.into());
        }
        Ok(system)
    }

    /// What the pairs of the pose say about it.
    fn verdict(&mut self, matcher: Matcher<'_>) -> Result<Verdict> {
        let max_sigma_m = self.options.max_motion_sigma_m.unwrap_or(OPEN * self.target.radius_m);
        let system = self.enough(matcher, Partners::Anew, self.options.kernel)?;
        let cell_m = (system.frame.radius_m / Cells::PER_RADIUS).max(VOXELS_PER_CELL * matcher.target.size_m);
        Verdict::new(&system.cells(matcher.target, cell_m), max_sigma_m)
    }

    fn result(mut self, matcher: Matcher<'_>, stop: StopReason) -> Result<IcpResult> {
        let verdict = self.verdict(matcher)?;
        let system = System::new(&self.pairs, self.options.kernel, &mut self.scratch);
        let seen: f64 = matched(&self.pairs).map(|p| p.count).sum();
        Ok(IcpResult {
            target_from_source: self.pose,
            covariance: verdict.covariance(&self.pose, None),
            // A voxel between two surfaces counts for both.
            overlap: (seen / self.source.points as f64).min(1.0),
            rms_m: system.rms_m(),
            iterations: self.iterations,
            stop,
            correspondences: system.count,
            max_correspondence_distance_m: matcher.limit_m(),
            degenerate: verdict.undetermined(),
        })
    }
}
