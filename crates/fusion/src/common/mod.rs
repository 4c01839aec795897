//! Errors that many points have in common, as surfaces that several frames see show them.

mod disagreement;
mod equations;
mod isolate;
mod posterior;
mod rows;
mod shared_error;
mod split;
mod trust;

pub(crate) use disagreement::{Squares, variance_factors};
pub(crate) use isolate::{Conditioned, condition};
pub(crate) use rows::{Row, by_station, form, mean, rows};
pub(crate) use shared_error::without_shared;
pub(crate) use split::split;
