#![doc = include_str!("../README.md")]

mod constants;
mod error;
mod kind;
mod sense;
mod surfaces;
mod unit;

pub use camera_model;
pub use constants::{RepeatedValue, repeated_values};
pub use error::Error;
use error::Result;
pub use kind::{Kind, KindJudgement, in_words, judge_kind};
pub use range_image;
pub use sense::SenseVotes;
pub use surfaces::{Bending, bendings};
pub use unit::{UnitWitness, judge_unit};
