//! Which of the targets of known coordinates is which, where nothing but their arrangement tells.

mod options;
mod search;

pub use options::{Identification, IdentificationOptions, UnnamedTarget};
pub use search::identify_targets;
