//! A result's frames as one cloud in which each surface stands once: from files to files.

mod clouds;
mod document;
mod figures;
mod input;
mod summarise;
mod summary;
mod thickness;

use std::time::Instant;

use atomic_output::{Destination, write_text};
use commands::{Error, Inputs, Progress, Result, json, produce, tiles};
use fusion::{CommonErrorUse, FusionOptions, Registered};
use range_io::clouds::CloudFormat;

use crate::measure::left_out;
use crate::request::FuseRequest;
use crate::result::ResultCloud;
use input::{Usable, refused, slip};
pub use summary::{
    ApartSummary, ContradictionSummary, Correction, CountedPoints, FuseSummary, SharedErrorSummary, SigmaSummary,
    ThicknessSummary,
};

/// Fuses the points of a result, and writes `cloud` and `unfused` in the format asked for, `summary.json` and `report.html`.
///
/// # Errors
/// [`Error::Refused`] where the points show no surface; [`Error::Request`] where the result lacks its common errors or means
/// nothing, or the spacing is none. Every error leaves what was there.
pub fn fuse(request: &FuseRequest, progress: &dyn Progress) -> Result<FuseSummary> {
    let inputs = Inputs::default().path(&request.result);
    produce(&request.out, &inputs, |destination| work(request, destination, progress))
}

/// Reading, fusing, figures, files.
const STEPS: usize = 4;

fn work(asked: &FuseRequest, destination: &Destination, progress: &dyn Progress) -> Result<FuseSummary> {
    let clock = Instant::now();
    progress.begin("fuse", STEPS);
    let mut options = options(asked);
    let mut cloud = ResultCloud::read(&asked.result).map_err(named)?;
    let mut summary = summarise::begin(asked, &cloud, &options, clouds::ending(asked.format)?);
    if options.common_errors == CommonErrorUse::Estimate {
        options.shared_error = cloud.share_error()?;
    }
    let usable = Usable::new(&cloud, asked)?;
    summary.points.unusable = cloud.usable.len() - usable.indices.len();
    summary.doubts.extend(left_out(&cloud));
    progress.advance(1);
    let input = Registered {
        points: &usable.points,
        frames: &usable.frames,
        centres: &usable.centres,
        amplitudes: Some(&usable.amplitudes),
    };
    let fused = match fusion::fuse(&input, &usable, &cloud.common, &options) {
        Ok(fused) => fused,
        Err(error) => return Err(refused(&summary, usable.in_cloud(error))?),
    };
    progress.advance(1);
    let moved = usable.moved(&fused.corrections);
    summarise::finish(&mut summary, &usable, &moved, &fused, &options);
    summary.seconds = commands::made::seconds_since(clock);
    let pictures = figures::figures(&usable, &moved, &fused, &options)?;
    progress.advance(1);
    let folder = destination.open()?;
    let [cloud, unfused] = &mut summary.clouds;
    clouds::write_fused(folder.file(&*cloud)?, &fused)?;
    let further = clouds::write_unfused(folder.file(&*unfused)?, &usable, &fused)?;
    if matches!(asked.format, CloudFormat::Ply) {
        for (name, file, points) in [("cloud", cloud, fused.surfels.len()), ("unfused", unfused, further)] {
            if let Some(tiled) = tiles::of_cloud(&folder, name, points as u64)? {
                *file = tiled.file;
            }
        }
    }
    let page = document::document(&summary, pictures);
    write_text(folder.file("summary.json")?, &json(&summary)?)?;
    write_text(folder.file("report.html")?, &page.html())?;
    folder.commit()?;
    progress.finish();
    Ok(summary)
}

fn options(asked: &FuseRequest) -> FusionOptions {
    let default = FusionOptions::default();
    FusionOptions {
        voxel_m: asked.voxel_m.unwrap_or(default.voxel_m),
        common_errors: if asked.as_stated { CommonErrorUse::AsStated } else { CommonErrorUse::Estimate },
        ..default
    }
}

/// What reading a result says, under this command's name.
fn named(error: Error) -> Error {
    match error {
        Error::Request { message, .. } => slip(message),
        other => other,
    }
}
