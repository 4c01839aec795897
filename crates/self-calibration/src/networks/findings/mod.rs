//! What comes out: values with their deviations, verdicts, and contradictions with their causes.

pub(crate) mod contradiction;
pub(crate) mod outcome;
