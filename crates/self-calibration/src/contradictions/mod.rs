//! Why a result cannot be trusted, by alternatives that explain the observations better.

pub(crate) mod catalogue;
pub(crate) mod causes;
pub(crate) mod explain;
pub(crate) mod judgement;
pub(crate) mod rejection_words;
pub(crate) mod suspicion;
