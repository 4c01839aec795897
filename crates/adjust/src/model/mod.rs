//! What is put in: observations with their covariances, priors, constraints, and the adjustment that holds them.

pub(crate) mod adjustment;
pub(crate) mod blame;
pub(crate) mod check;
pub(crate) mod covariance;
pub(crate) mod datum_defect;
pub(crate) mod differentiated;
pub(crate) mod exclusion;
pub(crate) mod kernel;
pub(crate) mod observation;
pub(crate) mod prior;
