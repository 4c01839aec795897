//! From a guess that is far off to the neighbourhood of the answer: samples of both clouds, each source sample paired
//! with the target sample that is nearest in place and direction, at a scale that falls.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use super::level::{Level, Voxel};
use super::samples::{Samples, Sought};
use crate::error::Result;
use rigid_pose::{Centred, MotionEquations};

/// Samples of the source and of the target.
const SOURCE_SAMPLES: usize = 400;
const TARGET_SAMPLES: usize = 1000;
/// Factor of the scale from one step to the next.
const FALL: f64 = 0.8;

/// How much the squared sine between normals counts in pairing, beside the squared distance over the scale. Without it a sixth less of a
/// Kinect's pairs come right; half and twice are as good.
const DIRECTION: f64 = 4.0;
/// How much the distance along the plane counts in the step, beside that across. Half and twice are as good, within three
/// of 120 simulated pairs and one of 116 of a Kinect.
const ALONG: f64 = 0.03;

/// Samples of two clouds.
pub(crate) struct Wide {
    source: Vec<Voxel>,
    target: Samples,
    radius_m: f64,
}

impl Wide {
    pub fn new(source: &[Level], target: &[Level], radius_m: f64) -> Self {
        let target = Samples::new(sample(target, TARGET_SAMPLES), radius_m.max(f64::MIN_POSITIVE));
        Self { source: sample(source, SOURCE_SAMPLES), target, radius_m }
    }

    /// The pose reached from `guess` while the scale falls from `first_m` to `last_m`, and the steps it took.
    pub fn descend(&self, guess: &Isometry3<f64>, first_m: f64, last_m: f64) -> Result<(Isometry3<f64>, usize)> {
        let (mut pose, mut scale, mut steps) = (*guess, first_m, 0);
        while scale > last_m {
            let Some(frame) = self.frame(&pose) else { break };
            let step = self.step(&pose, scale, frame)?;
            let length = step.norm() / (2.0 * scale);
            pose = frame.moved(&pose, &(step / length.max(1.0)));
            steps += 1;
            scale *= FALL;
        }
        Ok((pose, steps))
    }

    fn frame(&self, pose: &Isometry3<f64>) -> Option<Centred> {
        let about = Centred::about(self.source.iter().map(|voxel| (pose * voxel.mean).coords), 0.0);
        (self.radius_m > 0.0 && !self.source.is_empty() && !self.target.voxels.is_empty())
            .then_some(Centred { radius_m: self.radius_m, ..about })
    }

    fn step(&self, pose: &Isometry3<f64>, scale: f64, frame: Centred) -> Result<Vector6<f64>> {
        let mut equations = MotionEquations::default();
        let sought = |voxel: &Voxel| {
            let (place, normal) = (pose * voxel.mean, pose.rotation * voxel.normal);
            Sought { place, normal, scale_m: scale, direction: DIRECTION }
        };
        let sought: Vec<Sought> = self.source.iter().map(sought).collect();
        for (&Sought { place: moved, normal, .. }, index) in sought.iter().zip(self.target.nearest(&sought)) {
            let target = &self.target.voxels[index];
            let offset = moved - target.mean;
            let cosine = target.normal.dot(&normal);
            let weight = cosine * cosine / (1.0 + offset.norm_squared() / (scale * scale)).powi(2);
            let bisector = (target.normal + normal * cosine.signum()).normalize();
            equations.add(&frame.derivative(&moved.coords, &bisector), weight, bisector.dot(&offset));
            for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                equations.add(&frame.derivative(&moved.coords, &axis), weight * ALONG, axis.dot(&offset));
            }
        }
        // What is next to the planes' distances holds every motion: nothing needs damping.
        Ok(equations.step(&Matrix6::identity(), 0.0)?)
    }
}

/// Planes evenly from the coarsest level that has so many.
fn sample(levels: &[Level], wanted: usize) -> Vec<Voxel> {
    let level = levels.iter().rev().find(|level| level.planes().count() >= wanted).unwrap_or(&levels[0]);
    level.planes().copied().step_by(level.planes().count().div_ceil(wanted).max(1)).collect()
}
