//! The mounting of a camera from poses of both.

use adjust::{Adjustment, BlockId, Covariance, Differentiated, ObservationId, ParameterBlock, Scale, Solution};
use nalgebra::{Isometry3, Matrix6, Vector6};
use rigid_pose::{Uncertain, pose_difference};
use statistics::{chi_squared_limit, upper_median};

use crate::mounting::carrier::{Span, TimedPose, check};
use crate::mounting::clocks::{baseline, best_offset};
use crate::mounting::closed_form::{Motion, from_rotations, motions, with_lever_arm};
use crate::mounting::determined::{Undetermined, open_lever_arm};
use crate::mounting::equations::{KnownLeverArm, PoseEquations, covariance};
use crate::mounting::options::{Mounting, MountingOptions, MountingResidual, TimeOffset};
use crate::relative::samples;
use crate::{Error, Result};

/// Poses that determine a mounting: two motions about different axes.
const NEEDED: usize = 3;
/// Level of the test of one pose: one right pose in a thousand fails.
const LEVEL: f64 = 0.001;
/// Squares beyond so many times the limit contradict a mounting that three noisy poses make.
const ROUGH: f64 = 25.0;
/// Solutions with covariances of the solution before, at least; the second changes them by a share of their own error.
const PASSES: usize = 2;
/// And at most, of which each takes the carrier's poses at the time offset of the one before.
const MOST_PASSES: usize = 20;
/// An offset is settled that changes by less than so many of its standard deviations. Within that the carrier moves evenly; less would
/// follow the noise of the poses around each time, which differs from offset to offset.
const SETTLED: f64 = 1.0;
/// Largest standard deviation of the camera's rotation, radian: beyond, a linearisation does not describe it.
const WEAKEST_TURN: f64 = 0.1;

/// Estimates how a camera is mounted on a carrier (hand-eye calibration; lever arm and boresight) from poses of both:
/// `carrier` are `world_from_carrier`, ascending in time, `camera` are `target_from_camera` from
/// [`resect`](crate::resect) or a registration, each with its covariance (that of the sum of both must be positive definite). The world
/// of the carrier and the frame of the targets may differ; that transformation comes out as well.
///
/// The start is the closed form `A X = X B` `[Park1994]` of samples of three poses, judged by all; the adjustment
/// minimises the squares over the covariances of both poses, and leaves out poses that contradict the others.
///
/// # Errors
/// [`Error::TooFewPoses`] below three poses of the camera that the trajectory covers; [`Error::InvalidPose`], [`Error::InvalidOption`];
/// [`Error::UndeterminedMounting`] with what the motion leaves open; [`Error::PosesContradict`] where no mounting fits half of the poses:
/// wrong units, axes, senses or times; [`Error::Adjustment`].
///
/// ```
/// use orientation::nalgebra::{Isometry3, Matrix6, Vector3};
/// use orientation::rigid_pose::Uncertain;
/// use orientation::{MountingOptions, TimedPose, estimate_mounting};
///
/// let carrier_from_camera = Isometry3::new(Vector3::new(0.05, 0.0, 0.12), Vector3::new(0.0, 0.0, 1.57));
/// let world_from_target = Isometry3::new(Vector3::new(1.0, 0.2, 0.0), Vector3::new(0.1, 0.0, 0.4));
/// let (mut carrier, mut camera) = (Vec::new(), Vec::new());
/// for k in 0..8 {
///     let t = f64::from(k);
///     let at = Isometry3::new(Vector3::new(0.5, 0.3 * t.sin(), 0.8), Vector3::new(0.4 * t.cos(), 0.3 * (2.0 * t).sin(), 0.2 * t));
///     let covariance = Matrix6::identity() * 1e-8; // 0.1 mm and 0.1 mrad
///     carrier.push(TimedPose { time_s: t, pose: Uncertain { pose: at, covariance } });
///     let seen = world_from_target.inverse() * at * carrier_from_camera;
///     camera.push(TimedPose { time_s: t, pose: Uncertain { pose: seen, covariance } });
/// }
/// let found = estimate_mounting(&carrier, &camera, &MountingOptions::default())?;
/// let lever_arm = found.carrier_from_camera.pose.translation.vector;
/// assert!((lever_arm - carrier_from_camera.translation.vector).norm() < 1e-8);
/// # Ok::<(), orientation::Error>(())
/// ```
pub fn estimate_mounting(carrier: &[TimedPose], camera: &[TimedPose], options: &MountingOptions) -> Result<Mounting> {
    check("carrier", carrier)?;
    check("camera", camera)?;
    options.check()?;
    let offset_s = match options.time_offset {
        TimeOffset::Known(offset_s) => offset_s,
        TimeOffset::Within(most_s) => best_offset(carrier, camera, most_s, options.max_gap_s),
    };
    let moments = Moments { carrier, camera, options, baseline_s: None };
    let covered: Vec<usize> = (0..camera.len()).filter(|&index| moments.at(index, offset_s).is_some()).collect();
    if covered.len() < NEEDED {
        return Err(Error::TooFewPoses { found: covered.len(), needed: NEEDED });
    }
    let start = moments.start(&covered, offset_s)?;
    let baseline_s = moments.baseline(&covered, offset_s)?;
    let moments = Moments { baseline_s, ..moments };
    let estimate = moments.settled(&covered, start)?;
    moments.result(&covered, &estimate)
}

/// Variances of a position and of a rotation, carrier and camera together, of each pose.
fn variances(both: &[(Uncertain, &Uncertain)]) -> [Vec<f64>; 2] {
    let variance = |pose: &Uncertain, at: usize| pose.covariance.fixed_view::<3, 3>(at, at).trace() / 3.0;
    [0, 3].map(|at| both.iter().map(|(a, b)| (variance(a, at) + variance(b, at)).max(f64::MIN_POSITIVE)).collect())
}

/// A mounting on the way.
#[derive(Debug, Clone, Copy)]
struct Guess {
    carrier_from_camera: Isometry3<f64>,
    world_from_target: Isometry3<f64>,
    offset_s: f64,
}

/// What an adjustment gave.
struct Estimate {
    guess: Guess,
    solution: Solution,
    blocks: [BlockId; 3],
    used: Vec<bool>,
}

/// Both lists of poses.
struct Moments<'a> {
    carrier: &'a [TimedPose],
    camera: &'a [TimedPose],
    options: &'a MountingOptions,
    /// Seconds over which the carrier's motion is taken where the time offset is to be found.
    baseline_s: Option<f64>,
}

impl Moments<'_> {
    /// Where the carrier is at the moment of a pose of the camera.
    fn at(&self, index: usize, offset_s: f64) -> Option<Uncertain> {
        let time_s = self.camera[index].time_s + offset_s;
        Span::at(self.carrier, time_s, self.options.max_gap_s).map(|span| span.pose(time_s))
    }

    /// Difference of one pose to the model and the covariance of that; `None` where the trajectory does not cover it.
    fn misfit(&self, index: usize, guess: &Guess) -> Option<(Vector6<f64>, Matrix6<f64>)> {
        let carrier = self.at(index, guess.offset_s)?;
        let camera = &self.camera[index].pose;
        let model = guess.world_from_target.inverse() * carrier.pose * guess.carrier_from_camera;
        let covariance = covariance(&carrier, camera, &guess.carrier_from_camera, &guess.world_from_target);
        Some((pose_difference(&model, &camera.pose), covariance))
    }

    fn square(&self, index: usize, guess: &Guess) -> f64 {
        let square =
            self.misfit(index, guess).and_then(|(v, covariance)| Some(v.dot(&covariance.cholesky()?.solve(&v))));
        square.unwrap_or(f64::INFINITY)
    }

    /// Over which time the carrier's motion is taken; `None` where the clocks are known.
    fn baseline(&self, covered: &[usize], offset_s: f64) -> Result<Option<f64>> {
        let TimeOffset::Within(_) = self.options.time_offset else { return Ok(None) };
        let poses = |index: &usize| Some((self.at(*index, offset_s)?, &self.camera[*index].pose));
        let both: Vec<(Uncertain, &Uncertain)> = covered.iter().filter_map(poses).collect();
        let times_s: Vec<f64> = covered.iter().map(|&index| self.camera[index].time_s + offset_s).collect();
        let variances = variances(&both).map(|mut all| upper_median(&mut all));
        let found = baseline(self.carrier, &times_s, self.options.max_gap_s, variances);
        found.map(Some).ok_or_else(|| Error::UndeterminedMounting { undetermined: vec![Undetermined::TimeOffset] })
    }

    /// The mounting from a closed form that most poses agree with.
    fn start(&self, covered: &[usize], offset_s: f64) -> Result<Guess> {
        let poses = |index: &usize| Some((self.at(*index, offset_s)?, &self.camera[*index].pose));
        let both: Vec<(Uncertain, &Uncertain)> = covered.iter().filter_map(poses).collect();
        let pairs: Vec<[Isometry3<f64>; 2]> =
            both.iter().map(|(carrier, camera)| [carrier.pose, camera.pose]).collect();
        let [shifts, turns] = variances(&both);
        let open = open_lever_arm(&pairs, &turns);
        if let (Some(open), None) = (open, &self.options.lever_arm) {
            return Err(Error::UndeterminedMounting { undetermined: vec![open] });
        }
        let variances = [shifts, turns.clone()].map(|mut all| upper_median(&mut all));
        let closed = |motions: &[Motion]| match (&self.options.lever_arm, open) {
            (Some(lever), Some(_)) => with_lever_arm(motions, lever, variances),
            _ => from_rotations(motions),
        };
        let limit = ROUGH * chi_squared_limit(6.0, LEVEL);
        let cost =
            |guess: &Guess| covered.iter().map(|&index| (self.square(index, guess) / limit).min(1.0)).sum::<f64>();
        let guesses = samples::<NEEDED>(pairs.len(), self.options.seed).into_iter().flat_map(|sample| {
            let chosen = sample.map(|i| pairs[i]);
            let mounting = closed(&motions(&chosen));
            // The target stands where one of them sees it.
            chosen.into_iter().filter_map(move |[carrier, camera]| {
                let carrier_from_camera = mounting?;
                let world_from_target = carrier * carrier_from_camera * camera.inverse();
                Some(Guess { carrier_from_camera, world_from_target, offset_s })
            })
        });
        let best = guesses.map(|guess| (cost(&guess), guess)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, guess)) = best else {
            let open = if open.is_some() { Undetermined::Boresight } else { Undetermined::LeverArm };
            return Err(Error::UndeterminedMounting { undetermined: vec![open] });
        };
        Self::require_agreement(&pairs, covered.iter().filter(|&&index| self.square(index, &guess) <= limit).count())?;
        Ok(guess)
    }

    /// Fails where less than half of the poses agree; says how differently carrier and camera turn.
    fn require_agreement(pairs: &[[Isometry3<f64>; 2]], agreeing: usize) -> Result<()> {
        if 2 * agreeing >= pairs.len() && agreeing >= NEEDED {
            return Ok(());
        }
        let turned = |pair: &[[Isometry3<f64>; 2]]| Motion::between(&pair[0], &pair[1]).turns().map(|turn| turn.norm());
        let mut differences: Vec<f64> = pairs.windows(2).map(turned).map(|[a, b]| (a - b).abs()).collect();
        let angle_rad = upper_median(&mut differences);
        Err(Error::PosesContradict { agreeing, poses: pairs.len(), angle_rad })
    }

    /// Adjusts, leaves out what contradicts, the worst pose at a time, and takes back what fits, until nothing changes.
    fn settled(&self, covered: &[usize], start: Guess) -> Result<Estimate> {
        let limit = chi_squared_limit(6.0, LEVEL);
        let mut used: Vec<bool> = covered.iter().map(|&index| self.square(index, &start) <= ROUGH * limit).collect();
        let mut rejected = vec![false; covered.len()];
        let mut guess = start;
        loop {
            let estimate = self.adjusted(covered, &used, guess)?;
            guess = estimate.guess;
            let squares: Vec<f64> = covered.iter().map(|&index| self.square(index, &guess)).collect();
            let worst = (0..covered.len()).filter(|&i| used[i]).max_by(|&a, &b| squares[a].total_cmp(&squares[b]));
            if let Some(worst) = worst.filter(|&worst| squares[worst] > limit) {
                (used[worst], rejected[worst]) = (false, true);
                let left = used.iter().filter(|used| **used).count();
                let pairs: Vec<_> = covered
                    .iter()
                    .filter_map(|&i| Some([self.at(i, guess.offset_s)?.pose, self.camera[i].pose.pose]))
                    .collect();
                Self::require_agreement(&pairs, left)?;
                continue;
            }
            let back: Vec<usize> =
                (0..covered.len()).filter(|&i| !used[i] && !rejected[i] && squares[i] <= limit).collect();
            if back.is_empty() {
                return Ok(estimate);
            }
            for i in back {
                used[i] = true;
            }
        }
    }

    fn adjusted(&self, covered: &[usize], used: &[bool], start: Guess) -> Result<Estimate> {
        let mut guess = start;
        let mut pass = 0;
        loop {
            let (adjustment, blocks, _) = self.adjustment(covered, used, &guess)?;
            let solution = adjustment.solve(&self.options.solve)?;
            let before_s = guess.offset_s;
            guess = Guess {
                carrier_from_camera: solution.pose(blocks[0])?,
                world_from_target: solution.pose(blocks[1])?,
                offset_s: solution.values(blocks[2])?.first().copied().unwrap_or(f64::NAN),
            };
            pass += 1;
            let moved_s = (guess.offset_s - before_s).abs();
            let settled = self.baseline_s.is_none()
                || solution
                    .standard_deviations(blocks[2], Scale::Prior)?
                    .iter()
                    .all(|sigma_s| moved_s <= SETTLED * sigma_s);
            if pass >= PASSES && settled {
                return Ok(Estimate { guess, solution, blocks, used: used.to_vec() });
            }
            if pass == MOST_PASSES {
                return Err(Error::UndeterminedMounting { undetermined: vec![Undetermined::TimeOffset] });
            }
        }
    }

    /// The equations of the poses that are used, with covariances at a guess.
    fn adjustment(
        &self,
        covered: &[usize],
        used: &[bool],
        guess: &Guess,
    ) -> Result<(Adjustment<'_>, [BlockId; 3], Vec<ObservationId>)> {
        let mut adjustment = Adjustment::new();
        let mounting = adjustment.add_block(ParameterBlock::pose(&guess.carrier_from_camera).named("mounting"));
        let target = adjustment.add_block(ParameterBlock::pose(&guess.world_from_target).named("target"));
        let offset = adjustment.add_block(ParameterBlock::euclidean([guess.offset_s]).named("time offset"));
        if let TimeOffset::Known(_) = self.options.time_offset {
            adjustment.hold(offset)?;
        }
        let blocks = [mounting, target, offset];
        let group = adjustment.add_group("poses");
        let mut observations = Vec::with_capacity(covered.len());
        for (&index, _) in covered.iter().zip(used).filter(|(_, used)| **used) {
            let time_s = self.camera[index].time_s;
            let baseline_s = self.baseline_s.unwrap_or(0.0);
            let span = Span::moving(self.carrier, time_s + guess.offset_s, self.options.max_gap_s, baseline_s);
            let (Some((_, covariance)), Some(span)) = (self.misfit(index, guess), span) else { continue };
            let equations = PoseEquations { span, time_s, target_from_camera: self.camera[index].pose.pose };
            let equations = Differentiated::new(&adjustment, blocks, equations).map_err(adjust::Error::from)?;
            observations.push(adjustment.add_observation(group, equations, &Covariance::from_matrix(&covariance))?);
        }
        if let Some(lever) = &self.options.lever_arm {
            // The rotation has no prior: what is not observed of it is a defect.
            let known = adjustment.add_group("lever arm");
            let equations = Differentiated::new(&adjustment, [mounting], KnownLeverArm(lever.vector))
                .map_err(adjust::Error::from)?;
            adjustment.add_observation(known, equations, &Covariance::from_matrix(&lever.covariance))?;
        }
        Ok((adjustment, blocks, observations))
    }

    fn result(&self, covered: &[usize], estimate: &Estimate) -> Result<Mounting> {
        let Estimate { guess, solution, blocks, used } = estimate;
        let block = |first: usize, second: usize| {
            let matrix = solution.covariance_between(blocks[first], blocks[second], Scale::Prior)?;
            Ok::<_, Error>(Matrix6::from_fn(|row, column| matrix[(row, column)]))
        };
        let time_offset_s = match self.options.time_offset {
            TimeOffset::Known(_) => None,
            TimeOffset::Within(most_s) => {
                let sigma_s =
                    solution.standard_deviations(blocks[2], Scale::Prior)?.first().copied().unwrap_or(f64::NAN);
                if sigma_s.is_nan() || sigma_s > most_s {
                    return Err(Error::UndeterminedMounting { undetermined: vec![Undetermined::TimeOffset] });
                }
                Some([guess.offset_s, sigma_s])
            }
        };
        let mounting = block(0, 0)?;
        let sigma_turn = mounting.fixed_view::<3, 3>(3, 3).symmetric_eigenvalues().max().max(0.0).sqrt();
        if sigma_turn.is_nan() || sigma_turn > WEAKEST_TURN {
            return Err(Error::UndeterminedMounting { undetermined: vec![Undetermined::Boresight] });
        }
        let residual = |&index: &usize| {
            let (v, _) = self.misfit(index, guess)?;
            let (shift_m, turn_rad) = (v.fixed_rows::<3>(0).into_owned(), v.fixed_rows::<3>(3).into_owned());
            Some(MountingResidual { index, shift_m, turn_rad, square: self.square(index, guess) })
        };
        Ok(Mounting {
            carrier_from_camera: Uncertain { pose: guess.carrier_from_camera, covariance: mounting },
            world_from_target: Uncertain { pose: guess.world_from_target, covariance: block(1, 1)? },
            cross_covariance: block(0, 1)?,
            time_offset_s,
            residuals: covered.iter().filter_map(residual).collect(),
            gross_errors: covered.iter().zip(used).filter(|(_, used)| !**used).map(|(index, _)| *index).collect(),
            uncovered: (0..self.camera.len()).filter(|index| !covered.contains(index)).collect(),
            redundancy: solution.redundancy(),
            sigma0: solution.sigma0(),
        })
    }
}
