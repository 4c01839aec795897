//! Which of the targets of known coordinates is which, where nothing but their arrangement tells.

mod names;
mod options;
mod search;

pub use names::{NameCheckOptions, NameVerdict, check_names};
pub use options::{Identification, IdentificationOptions, UnnamedTarget};
pub use search::identify_targets;
