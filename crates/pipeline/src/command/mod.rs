//! What all commands share: where they write, how they end, what they say on the way.

pub(crate) mod destination;
pub(crate) mod error;
pub(crate) mod progress;
pub(crate) mod verdict;

pub use destination::{Inputs, RefusalFile, json, produce, root_of};
pub use error::drift::DriftError;
pub use error::{Error, Result};
pub use progress::{Progress, Silent};
pub use verdict::{Doubt, DoubtKind, Failure, Judged, Verdict, words_about};
