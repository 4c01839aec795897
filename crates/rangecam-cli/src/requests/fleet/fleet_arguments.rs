//! What can be typed behind `rangecam fleet`.

use std::path::PathBuf;

use clap::Args;
use workflow_tasks::FleetRequest;

/// Arguments of a fleet's report.
#[derive(Debug, Args)]
pub(crate) struct FleetArguments {
    /// Folder that the workflow ran in: what it recorded of each step (`codes`), `results`, `checks` and `logs`.
    folder: PathBuf,
    /// Output folder.
    #[arg(long, short)]
    out: PathBuf,
}

impl FleetArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> FleetRequest {
        FleetRequest { folder: self.folder, out: self.out }
    }
}
