//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::unwrap_used, missing_docs)]

// Private and small: its tests stand beside it, and run here because the library is not built a second time for them.
#[allow(dead_code)]
#[path = "../src/record/date.rs"]
mod date;
mod memory;
mod outputs;
mod plans;

// What `date` asks for.
use commands::made;
