//! Poses in single precision, for loops over many points about the origin.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use nalgebra::Isometry3;

/// A pose in single precision.
#[derive(Debug, Clone, Copy)]
pub struct SinglePose {
    /// Rows of the rotation.
    pub rotation: [[f32; 3]; 3],
    /// What points are shifted by after it, metre.
    pub translation: [f32; 3],
}

impl SinglePose {
    /// The same pose, rounded.
    #[must_use]
    pub fn new(pose: &Isometry3<f64>) -> Self {
        let matrix = pose.rotation.to_rotation_matrix();
        Self {
            rotation: std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)] as f32)),
            translation: std::array::from_fn(|k| pose.translation.vector[k] as f32),
        }
    }

    /// A direction, turned.
    #[inline(always)]
    #[must_use]
    pub fn turned(&self, v: [f32; 3]) -> [f32; 3] {
        let row = |r: [f32; 3]| r[0] * v[0] + r[1] * v[1] + r[2] * v[2];
        [row(self.rotation[0]), row(self.rotation[1]), row(self.rotation[2])]
    }

    /// A point, turned and shifted.
    #[inline(always)]
    #[must_use]
    pub fn moved(&self, point: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.turned(point);
        [x + self.translation[0], y + self.translation[1], z + self.translation[2]]
    }
}
