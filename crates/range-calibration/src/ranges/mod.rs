//! Range terms from differences of ranges.

pub(crate) mod amplitude_or_position;
pub(crate) mod hyperbola_real;
pub(crate) mod observation;
pub(crate) mod offset_table;
pub(crate) mod range_terms;
