//! Whether a pose holds: what agrees, what contradicts, and what tells it from others.

pub(crate) mod among;
pub(crate) mod distinct;
pub(crate) mod free_space;
pub(crate) mod judge;
pub(crate) mod looked_through;
pub(crate) mod refine;
pub(crate) mod shared_error;
