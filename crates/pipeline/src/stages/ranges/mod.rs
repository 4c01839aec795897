//! Range errors taken off.

pub(crate) mod correct;
pub(crate) mod reference_path;
