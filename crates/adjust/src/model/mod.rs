//! What is put in: observations with their covariances, priors, constraints, and the adjustment that holds them.

pub(crate) mod adjustment;
pub(crate) mod blame;
pub(crate) mod datum_defect;
pub(crate) mod exclusion;
pub(crate) mod ids;
