//! What a run writes: clouds as they come, then poses, common errors, summary and page.

pub(crate) mod clouds;
pub(crate) mod common_errors;
pub(crate) mod results;
