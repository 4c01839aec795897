//! Folders that `fuse` wrote: their cloud has lost what its points have in common, which the result that it was made of still tells.

use std::path::Path;

use serde::Deserialize;

/// What `summary.json` of a fused cloud says of where it came from.
#[derive(Deserialize)]
struct FusedSummary {
    /// Folder of the result that was fused.
    result: String,
    /// Only the summary of a fused cloud counts them.
    #[serde(rename = "fused_points")]
    _fused_points: usize,
}

/// The folder that the fused cloud in this one was made of; `None` where it is none, or says nothing of it.
pub(crate) fn fused_from(folder: &Path) -> Option<String> {
    let text = std::fs::read_to_string(folder.join("summary.json")).ok()?;
    serde_json::from_str::<FusedSummary>(&text).ok().map(|summary| summary.result)
}
