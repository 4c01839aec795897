//! Points with descriptors that were found by other means than the surface.

use nalgebra::Point3;

use crate::description::descriptors::DescriptorTable;
use crate::error::Result;
use rigid_pose::{InputError, require_count, require_length, require_points};

/// Points in a cloud's frame with a descriptor each.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    pub(crate) points: Vec<Point3<f64>>,
    pub(crate) table: DescriptorTable,
}

impl Features {
    /// `points`: metre, in the frame of the cloud they belong to. `descriptors`: `width` values a point, one after the
    /// other, compared by the angle between them.
    ///
    /// # Errors
    /// [`InputError::NonFinite`], [`InputError::LengthMismatch`], [`InputError::InvalidOption`] for a width of 0.
    pub fn new(points: Vec<Point3<f64>>, descriptors: &[f32], width: usize) -> Result<Self> {
        require_count("width", width, 1)?;
        require_points("feature", &points)?;
        require_length("descriptors", points.len().saturating_mul(width), descriptors.len())?;
        // Beyond this the square of a value overflows.
        if let Some(index) = descriptors.iter().position(|v| v.is_nan() || v.abs() >= 1e15) {
            return Err(InputError::NonFinite { what: "descriptors", index }.into());
        }
        Ok(Self { points, table: DescriptorTable::of_vectors(descriptors.to_vec(), width) })
    }

    /// The points, metre.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points
    }

    /// Number of features.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Descriptor of a feature: a vector of unit length (or zero).
    pub fn descriptor(&self, index: usize) -> Option<&[f32]> {
        (index < self.len()).then(|| self.table.row(index))
    }
}
