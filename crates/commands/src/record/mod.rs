//! What a result is recorded with: when and what it was made from.

pub(crate) mod date;
pub(crate) mod digest;
pub mod made;
