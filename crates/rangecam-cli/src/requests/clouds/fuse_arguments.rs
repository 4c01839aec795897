//! What can be typed behind `fuse`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use cloud_tasks::FuseRequest;
use cloud_tasks::range_io::clouds::CloudFormat;

use crate::requests::calibration::calibrate_arguments::default_out;
use crate::requests::values::positive;

#[derive(Debug, Args)]
pub(crate) struct FuseArguments {
    /// Folder of a result with `cloud.ply` and `common_errors.ron`, as `run` writes it.
    result: PathBuf,
    /// Edge of the cells that points are fused in, metre; default: 0.05.
    #[arg(long, value_name = "METRE", value_parser = positive)]
    voxel: Option<f64>,
    /// Take calibration and poses as they are, and do not let surfaces that several frames see correct them.
    #[arg(long)]
    as_stated: bool,
    /// Format of the clouds.
    #[arg(long, value_enum, default_value_t = Format::Ply)]
    format: Format,
    /// Output folder; default: out/<name of the result>-fused.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl FuseArguments {
    pub(crate) fn request(self) -> FuseRequest {
        let out = self.out.unwrap_or_else(|| default_out(&self.result, "-fused"));
        FuseRequest {
            result: self.result,
            voxel_m: self.voxel,
            as_stated: self.as_stated,
            format: self.format.into(),
            out,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    Ply,
    Pcd,
    E57,
}

impl From<Format> for CloudFormat {
    fn from(format: Format) -> Self {
        match format {
            Format::Ply => Self::Ply,
            Format::Pcd => Self::Pcd,
            Format::E57 => Self::E57,
        }
    }
}
