//! The carrier's trajectory.

use nalgebra::{Isometry3, Matrix6, Vector3};
use rigid_pose::{Uncertain, is_finite};

use crate::{Error, Result};

/// A pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedPose {
    /// Time, second.
    pub time_s: f64,
    /// The pose with its covariance in the tangent `[dt, dθ]` of [`rigid_pose::step_pose`]; zero for one without error.
    pub pose: Uncertain,
}

/// Refuses poses that are no poses, and covariances that are none.
pub(crate) fn check(what: &'static str, poses: &[TimedPose]) -> Result<()> {
    for (index, timed) in poses.iter().enumerate() {
        let refuse = |reason| Err(Error::InvalidPose { what, index, reason });
        if !timed.time_s.is_finite() {
            return refuse("its time is not finite");
        }
        if !is_finite(&timed.pose.pose) || (timed.pose.pose.rotation.norm() - 1.0).abs() > 1e-6 {
            return refuse("it is no finite rigid pose");
        }
        let covariance = &timed.pose.covariance;
        let scale = covariance.amax();
        if covariance.iter().any(|value| !value.is_finite())
            || (covariance - covariance.transpose()).amax() > 1e-9 * scale
        {
            return refuse("its covariance is not finite and symmetric");
        }
        if covariance.symmetric_eigenvalues().min() < -1e-9 * scale {
            return refuse("its covariance has a negative eigenvalue");
        }
        if index > 0 && timed.time_s <= poses[index - 1].time_s {
            return refuse("its time is not later than that of the pose before");
        }
    }
    Ok(())
}

/// The carrier between two of its poses: its translation is linear in time, its rotation turns evenly.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub(crate) start_s: f64,
    pub(crate) start: Isometry3<f64>,
    /// Per second, world axes.
    pub(crate) velocity: Vector3<f64>,
    /// Per second, carrier axes.
    pub(crate) rate: Vector3<f64>,
    covariances: [Matrix6<f64>; 2],
    seconds: f64,
}

impl Span {
    /// Where the carrier is at a time (second) by the poses around it; `None` outside its trajectory, and between poses that are
    /// further apart than `max_gap_s`.
    pub(crate) fn at(carrier: &[TimedPose], time_s: f64, max_gap_s: f64) -> Option<Self> {
        let after = carrier.partition_point(|pose| pose.time_s <= time_s);
        let before = carrier.get(after.checked_sub(1)?)?;
        let still = |pose: &TimedPose| Self {
            start_s: pose.time_s,
            start: pose.pose.pose,
            velocity: Vector3::zeros(),
            rate: Vector3::zeros(),
            covariances: [pose.pose.covariance; 2],
            seconds: f64::INFINITY,
        };
        let Some(next) = carrier.get(after) else { return (before.time_s >= time_s).then(|| still(before)) };
        let seconds = next.time_s - before.time_s;
        if seconds > max_gap_s {
            return (before.time_s >= time_s).then(|| still(before));
        }
        let (a, b) = (&before.pose.pose, &next.pose.pose);
        Some(Self {
            start_s: before.time_s,
            start: *a,
            velocity: (b.translation.vector - a.translation.vector) / seconds,
            rate: (a.rotation.inverse() * b.rotation).scaled_axis() / seconds,
            covariances: [before.pose.covariance, next.pose.covariance],
            seconds,
        })
    }

    /// The carrier at a time as [`Span::at`] has it, and how it moves there by poses up to half of `baseline_s` before and after, as
    /// far as no gap breaks them: between neighbours noise may move it more than its motion.
    pub(crate) fn moving(carrier: &[TimedPose], time_s: f64, max_gap_s: f64, baseline_s: f64) -> Option<Self> {
        let near = Self::at(carrier, time_s, max_gap_s)?;
        let now = near.pose(time_s);
        let Some([first, last]) = ends(carrier, time_s, max_gap_s, baseline_s) else { return Some(near) };
        let seconds = last.time_s - first.time_s;
        let (a, b) = (&first.pose.pose, &last.pose.pose);
        let turn = a.rotation * (a.rotation.inverse() * b.rotation).scaled_axis() / seconds;
        Some(Self {
            start_s: time_s,
            start: now.pose,
            velocity: (b.translation.vector - a.translation.vector) / seconds,
            rate: now.pose.rotation.inverse() * turn,
            covariances: [now.covariance; 2],
            seconds: f64::INFINITY,
        })
    }

    /// The pose at a time, with its covariance; the errors of both poses are taken as independent.
    pub(crate) fn pose(&self, time_s: f64) -> Uncertain {
        let since = time_s - self.start_s;
        let share = since / self.seconds;
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(self.rate * since);
        let translation = self.start.translation.vector + self.velocity * since;
        let [before, after] = self.covariances;
        let whole = share <= 0.0;
        Uncertain {
            pose: Isometry3::from_parts(translation.into(), self.start.rotation * turn),
            covariance: if whole { before } else { before * (1.0 - share).powi(2) + after * share * share },
        }
    }
}

/// First and last pose of the carrier that a motion is taken from: around a time, apart by `baseline_s` at most or neighbours, with no
/// gap between them. `None` where the time lies between no two of them.
pub(crate) fn ends(carrier: &[TimedPose], time_s: f64, max_gap_s: f64, baseline_s: f64) -> Option<[&TimedPose; 2]> {
    let after = carrier.partition_point(|pose| pose.time_s <= time_s);
    let joined = |pair: &[TimedPose]| pair[1].time_s - pair[0].time_s <= max_gap_s;
    if after == 0 || after == carrier.len() || !joined(&carrier[after - 1..=after]) {
        return None;
    }
    let (mut first, mut last) = (after - 1, after);
    while first > 0 && carrier[first - 1].time_s >= time_s - 0.5 * baseline_s && joined(&carrier[first - 1..=first]) {
        first -= 1;
    }
    while last + 1 < carrier.len()
        && carrier[last + 1].time_s <= time_s + 0.5 * baseline_s
        && joined(&carrier[last..=last + 1])
    {
        last += 1;
    }
    Some([&carrier[first], &carrier[last]])
}
