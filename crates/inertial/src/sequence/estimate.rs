//! One adjustment of all states.

use std::collections::BTreeSet;

use adjust::{
    Adjustment, BlockId, Covariance, GroupId, ObservationId, ParameterBlock, Scale, SnoopingTest, Solution,
    SolveOptions,
};
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};
use rigid_pose::{Uncertain, is_finite};
use statistics::bonferroni;

use crate::noise::{Biases, ImuNoise};
use crate::preintegrated::Preintegrated;
use crate::rest::Unrest;
use crate::sample::InertialSample;
use crate::sequence::equations::{IntervalEquations, Length, Unchanged};
use crate::sequence::noise_at_work::{Known, noise_at_work};
use crate::sequence::options::{CameraPose, InertialSequence, Mounting, SequenceOptions, SequenceState};
use crate::sequence::start::{Start, angle_ratio, contradicting_turns};
use crate::state::StateCovariance;
use crate::{Error, Result};

/// Poses needed: two make a velocity, a third tells it from gravity.
const NEEDED: usize = 3;
/// Level of the test of a whole sequence of samples.
const LEVEL: f64 = 0.001;
/// Times the intervals are integrated anew at the biases found; each squares what first order leaves.
const INTEGRATIONS: usize = 4;
/// Standard deviation of a velocity that no interval tells, m/s: more than any camera has, so that it stays unknown.
const UNKNOWN_VELOCITY: f64 = 100.0;
/// Change of a motion by biases, in its standard deviations, below which it is not integrated anew.
const SMALL_CHANGE: f64 = 0.01;

/// Estimates velocities, biases, gravity and, where it is asked for, the rotation of the mounting from camera poses and the samples
/// between them: the poses with their covariances and the preintegrated motions are observations of one adjustment, in which
/// biases walk. Intervals that contradict the camera are left out one by one and named.
///
/// The first biases are known as [`ImuNoise`](crate::ImuNoise) says: what the motion does not show of them (a bias across gravity of a body
/// that never turns) keeps that deviation.
///
/// # Errors
/// [`Error::TooFewPoses`] below three, [`Error::InvalidPose`], [`Error::NotAscending`], [`Error::NonFinite`], [`Error::Gap`],
/// [`Error::InvalidOption`]; [`Error::Unrest`] where forces are not those of a body on earth; [`Error::Contradiction`] where unit and camera do not fit each other in half of the intervals;
/// [`Error::Adjustment`].
pub fn estimate_sequence(
    poses: &[CameraPose],
    samples: &[InertialSample],
    options: &SequenceOptions,
) -> Result<InertialSequence> {
    check(poses, options)?;
    let interval = |pair: &[CameraPose]| {
        Preintegrated::new(samples, [pair[0].time_s, pair[1].time_s], &Biases::zero(), &options.noise)
    };
    let mut motions: Vec<Preintegrated> = poses.windows(2).map(interval).collect::<Result<_>>()?;
    require_specific_forces(poses, samples, options.gravity_m_s2)?;
    let start = Start::new(poses, &motions, options);
    require_agreement(poses, &motions, contradicting_turns(poses, &motions, &start.camera_from_body))?;
    let mut left_out = BTreeSet::new();
    // At biases of zero the motions are far from their reference: nothing is judged by them.
    let first = Network::new(poses, &motions, options, &start, &left_out)?.without_tests(&options.solve)?;
    let (mut biases, known) = (first.0, Known { poses, camera_from_body: first.1, gravity: first.2 });
    motions = motions.iter().zip(&biases).map(|(motion, biases)| motion.reintegrated(biases)).collect();
    let noise = noise_at_work(&known, &motions, &options.noise);
    motions = motions.iter().map(|motion| motion.with_noise(&noise)).collect();
    let mut integration = 0;
    loop {
        integration += 1;
        motions = motions.iter().zip(&biases).map(|(motion, biases)| motion.reintegrated(biases)).collect();
        let (network, solution) = without_contradictions(poses, &motions, options, &start, &mut left_out)?;
        if integration == INTEGRATIONS || !network.is_far_from_reference(&solution, &motions)? {
            let contradicting = left_out.into_iter().collect();
            return network.result(&solution, poses, contradicting, (options, noise));
        }
        biases = (0..motions.len()).map(|k| network.biases(&solution, k)).collect::<Result<_>>()?;
    }
}

/// Solves, leaves out the interval that contradicts most, and solves again until none does.
fn without_contradictions<'m>(
    poses: &[CameraPose],
    motions: &'m [Preintegrated],
    options: &SequenceOptions,
    start: &Start,
    left_out: &mut BTreeSet<usize>,
) -> Result<(Network<'m>, Solution)> {
    let without = |left_out: &BTreeSet<usize>| {
        let network = Network::new(poses, motions, options, start, left_out)?;
        let solution = network.adjustment.solve(&options.solve)?;
        Ok::<_, Error>((network, solution))
    };
    let (mut network, mut solution) = without(left_out)?;
    while let Some(suspect) = network.contradicting(&solution, motions.len())? {
        // A wrong motion shows in its neighbours as well: which of them it is, says the sum of squares without each.
        let mut best: Option<(usize, Network<'m>, Solution)> = None;
        let nearby = suspect.saturating_sub(1)..=(suspect + 1).min(motions.len() - 1);
        for interval in nearby.filter(|interval| !left_out.contains(interval)) {
            let mut tried = left_out.clone();
            tried.insert(interval);
            let (network, solution) = without(&tried)?;
            if best.as_ref().is_none_or(|(.., best)| solution.vtpv() < best.vtpv()) {
                best = Some((interval, network, solution));
            }
        }
        let Some((interval, less, solved)) = best else { break };
        left_out.insert(interval);
        (network, solution) = (less, solved);
        require_agreement(poses, motions, left_out.len())?;
    }
    Ok((network, solution))
}

/// Fails where half of the forces between the poses are less than half or more than twice gravity: nothing that is carried moves so, and a
/// bias as large as gravity would fit a camera that turns little.
fn require_specific_forces(poses: &[CameraPose], samples: &[InertialSample], gravity_m_s2: f64) -> Result<()> {
    let span = poses[0].time_s..=poses[poses.len() - 1].time_s;
    let within = samples.iter().filter(|sample| span.contains(&sample.timestamp_s));
    let mut sizes: Vec<f64> = within.map(|sample| sample.specific_force.norm()).collect();
    let usual = statistics::upper_median(&mut sizes);
    if usual < gravity_m_s2 / 2.0 || usual > 2.0 * gravity_m_s2 {
        return Err(Unrest::Force { mean_m_s2: usual }.into());
    }
    Ok(())
}

/// Fails where more than half of the intervals contradict.
fn require_agreement(poses: &[CameraPose], motions: &[Preintegrated], contradicting: usize) -> Result<()> {
    if 2 * contradicting <= motions.len() {
        return Ok(());
    }
    let angle_ratio = angle_ratio(poses, motions);
    Err(Error::Contradiction { contradicting, intervals: motions.len(), angle_ratio })
}

fn check(poses: &[CameraPose], options: &SequenceOptions) -> Result<()> {
    options.noise.check()?;
    for (name, value) in [("gravity_m_s2", options.gravity_m_s2), ("gravity_sigma_m_s2", options.gravity_sigma_m_s2)] {
        if !(value > 0.0 && value < 1e6) {
            return Err(Error::InvalidOption { name, value, expected: "positive and below 1e6" });
        }
    }
    let mounted = match options.mounting {
        Mounting::Known(pose) => is_finite(&pose),
        Mounting::UnknownRotation { lever_arm } => lever_arm.iter().all(|x| x.is_finite()),
    };
    if !mounted {
        return Err(Error::NonFinite { what: "mounting", index: 0 });
    }
    if poses.len() < NEEDED {
        return Err(Error::TooFewPoses { found: poses.len(), needed: NEEDED });
    }
    for (index, pose) in poses.iter().enumerate() {
        if !pose.time_s.is_finite() || index > 0 && pose.time_s <= poses[index - 1].time_s {
            return Err(Error::NotAscending { what: "camera pose", index });
        }
        if !is_finite(&pose.pose.pose) || (pose.pose.pose.rotation.norm() - 1.0).abs() > 1e-6 {
            return Err(Error::InvalidPose { index, reason: "it is no finite rigid pose" });
        }
        if pose.pose.covariance.iter().any(|value| !value.is_finite()) || pose.pose.covariance.cholesky().is_none() {
            return Err(Error::InvalidPose { index, reason: "its covariance is not positive definite" });
        }
    }
    Ok(())
}

/// All unknowns and observations.
struct Network<'m> {
    adjustment: Adjustment<'m>,
    poses: Vec<BlockId>,
    velocities: Vec<BlockId>,
    biases: Vec<BlockId>,
    gravity: BlockId,
    mounting: BlockId,
    inertial: GroupId,
    intervals: Vec<(usize, ObservationId)>,
}

impl<'m> Network<'m> {
    fn new(
        poses: &[CameraPose],
        motions: &'m [Preintegrated],
        options: &SequenceOptions,
        start: &Start,
        left_out: &BTreeSet<usize>,
    ) -> Result<Self> {
        let mut adjustment = Adjustment::new();
        let mut lists: [Vec<BlockId>; 3] = Default::default();
        for (k, pose) in poses.iter().enumerate() {
            let block = adjustment.add_block(ParameterBlock::pose(&pose.pose.pose).named(format!("pose {k}")));
            let values = adjustment.values(block)?.to_vec();
            adjustment.add_prior(block, &values, &Covariance::from_matrix(&pose.pose.covariance))?;
            lists[0].push(block);
            let velocity = start.velocities[k];
            lists[1].push(
                adjustment.add_block(ParameterBlock::euclidean(velocity.as_slice()).named(format!("velocity {k}"))),
            );
            let reference =
                motions.get(k).or(motions.last()).map_or_else(Vector6::zeros, |motion| motion.biases.to_vector());
            lists[2].push(
                adjustment.add_block(ParameterBlock::euclidean(reference.as_slice()).named(format!("biases {k}"))),
            );
        }
        let [pose_blocks, velocities, biases] = lists;
        let gravity = adjustment.add_block(ParameterBlock::euclidean(start.gravity.as_slice()).named("gravity"));
        let mounting = adjustment.add_block(ParameterBlock::pose(&start.camera_from_body).named("mounting"));
        match options.mounting {
            Mounting::Known(_) => adjustment.hold(mounting)?,
            Mounting::UnknownRotation { .. } => (0..3).try_for_each(|k| adjustment.hold_parameter(mounting, k))?,
        }
        let inertial = adjustment.add_group("inertial");
        let mut network = Self {
            adjustment,
            poses: pose_blocks,
            velocities,
            biases,
            gravity,
            mounting,
            inertial,
            intervals: Vec::new(),
        };
        network.observe(motions, options, left_out)?;
        Ok(network)
    }

    fn observe(
        &mut self,
        motions: &'m [Preintegrated],
        options: &SequenceOptions,
        left_out: &BTreeSet<usize>,
    ) -> Result<()> {
        let noise = &options.noise;
        let sixfold = |gyro: f64, accel: f64| Covariance::from_sigmas(&[gyro, gyro, gyro, accel, accel, accel]);
        let first = sixfold(noise.gyro_bias_sigma, noise.accel_bias_sigma);
        if let Some(&biases) = self.biases.first() {
            self.adjustment.add_prior(biases, &[0.0; 6], &first)?;
        }
        let walk = self.adjustment.add_group("bias walk");
        for (k, motion) in motions.iter().enumerate() {
            let root = motion.seconds.sqrt();
            let blocks = [self.biases[k], self.biases[k + 1]];
            let covariance = sixfold(noise.gyro_walk * root, noise.accel_walk * root);
            self.adjustment.add_observation(walk, Unchanged { blocks }, &covariance)?;
            if left_out.contains(&k) {
                continue;
            }
            let blocks = [
                self.poses[k],
                self.velocities[k],
                self.biases[k],
                self.poses[k + 1],
                self.velocities[k + 1],
                self.gravity,
                self.mounting,
            ];
            let equations = IntervalEquations { motion, blocks };
            let covariance = Covariance::from_matrix(&motion.covariance);
            self.intervals.push((k, self.adjustment.add_observation(self.inertial, equations, &covariance)?));
        }
        let open = |k: &usize| {
            let is_out = |interval: usize| interval >= motions.len() || left_out.contains(&interval);
            is_out(*k) && (*k == 0 || is_out(*k - 1))
        };
        for k in (0..self.velocities.len()).filter(open) {
            let values = self.adjustment.values(self.velocities[k])?.to_vec();
            self.adjustment.add_prior(self.velocities[k], &values, &Covariance::from_sigmas(&[UNKNOWN_VELOCITY; 3]))?;
        }
        let length = self.adjustment.add_group("gravity");
        let observed = Length { observed: options.gravity_m_s2, block: [self.gravity] };
        self.adjustment.add_observation(length, observed, &Covariance::from_sigma(options.gravity_sigma_m_s2))?;
        Ok(())
    }

    fn biases(&self, solution: &Solution, k: usize) -> Result<Biases> {
        Ok(Biases::from_vector(&Vector6::from_column_slice(solution.values(self.biases[k])?)))
    }

    /// Solves, and gives the biases of all intervals, the mounting and gravity.
    fn without_tests(&self, options: &SolveOptions) -> Result<(Vec<Biases>, Isometry3<f64>, Vector3<f64>)> {
        let solution = self.adjustment.solve(options)?;
        let biases = (1..self.biases.len()).map(|k| self.biases(&solution, k - 1)).collect::<Result<_>>()?;
        let gravity = Vector3::from_column_slice(solution.values(self.gravity)?);
        Ok((biases, solution.pose(self.mounting)?, gravity))
    }

    /// Whether the biases change a motion by more than first order allows.
    fn is_far_from_reference(&self, solution: &Solution, motions: &[Preintegrated]) -> Result<bool> {
        for (k, motion) in motions.iter().enumerate() {
            let change = self.biases(solution, k)?.to_vector() - motion.biases.to_vector();
            let effect = motion.by_biases * change;
            let sigma = motion.covariance.diagonal().map(f64::sqrt);
            if effect.iter().zip(sigma.iter()).any(|(effect, sigma)| effect.abs() > SMALL_CHANGE * sigma) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The interval that contradicts most, where one does at the level of the whole sequence.
    fn contradicting(&self, solution: &Solution, intervals: usize) -> Result<Option<usize>> {
        let test = solution.snoop(SnoopingTest::Baarda, bonferroni(LEVEL, 9 * intervals))?;
        let worst = test.suspects.iter().find(|suspect| suspect.group == self.inertial);
        let interval = |id: ObservationId| self.intervals.iter().find(|(_, known)| *known == id).map(|(k, _)| *k);
        Ok(worst.and_then(|suspect| interval(suspect.observation)))
    }

    /// Covariance of everything that the way on from a pose depends on.
    fn state_covariance(&self, solution: &Solution, k: usize) -> Result<StateCovariance> {
        let blocks = [(self.poses[k], 0), (self.velocities[k], 6), (self.biases[k], 9), (self.gravity, 15)];
        let mut covariance = StateCovariance::zeros();
        for (first, row) in blocks {
            for (second, column) in blocks {
                let block = solution.covariance_between(first, second, Scale::Prior)?;
                covariance.view_mut((row, column), block.shape()).copy_from(&block);
            }
        }
        Ok(covariance)
    }

    fn result(
        &self,
        solution: &Solution,
        poses: &[CameraPose],
        contradicting: Vec<usize>,
        (options, noise): (&SequenceOptions, ImuNoise),
    ) -> Result<InertialSequence> {
        let six = |block: BlockId| {
            let matrix = solution.covariance(block, Scale::Prior)?;
            Ok::<_, Error>(Matrix6::from_fn(|row, column| matrix[(row, column)]))
        };
        let three = |block: BlockId| {
            let matrix = solution.covariance(block, Scale::Prior)?;
            let value = Vector3::from_column_slice(solution.values(block)?);
            Ok::<_, Error>((value, Matrix3::from_fn(|row, column| matrix[(row, column)])))
        };
        let state = |(k, pose): (usize, &CameraPose)| {
            let covariance = self.state_covariance(solution, k)?;
            let own = covariance.fixed_view::<6, 6>(0, 0).into_owned();
            Ok(SequenceState {
                time_s: pose.time_s,
                world_from_camera: Uncertain { pose: solution.pose(self.poses[k])?, covariance: own },
                velocity: Vector3::from_column_slice(solution.values(self.velocities[k])?),
                biases: self.biases(solution, k)?,
                covariance,
            })
        };
        let (gravity, gravity_covariance) = three(self.gravity)?;
        let camera_from_body = match options.mounting {
            Mounting::Known(pose) => Uncertain::exact(pose),
            Mounting::UnknownRotation { .. } => {
                Uncertain { pose: solution.pose(self.mounting)?, covariance: six(self.mounting)? }
            }
        };
        Ok(InertialSequence {
            states: poses.iter().enumerate().map(state).collect::<Result<_>>()?,
            gravity,
            gravity_covariance,
            camera_from_body,
            contradicting,
            noise,
            redundancy: solution.redundancy(),
            sigma0: solution.sigma0(),
        })
    }
}
