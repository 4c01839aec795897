//! Small vectors and matrices.

pub(crate) mod cholesky;
pub(crate) mod vector;
