//! One cloud with colours: a rig and an epoch in, clouds out.

use std::path::PathBuf;
use std::time::Instant;

use atomic_output::{Destination, write_text};
use commands::{Inputs, Progress, json, produce};
use nalgebra::Isometry3;
use pipeline::{Error, Result};
use range_io::ply::{CloudFile, Precision, write_cloud};

use crate::colour::inputs::{MOUNTINGS, Pair};
use crate::colour::paint::{Colouring, colour_points};
use crate::colour::summary::ColourSummary;
use crate::file::RigFile;

/// What is to be coloured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColourRequest {
    /// Folder with `rig.ron`; the cameras' folders are surveys with frames.
    pub rig: PathBuf,
    /// Name of the station of both cameras.
    pub epoch: String,
    /// Folder that `calibrate` wrote of the rig; `None`: `mountings.csv` lies beside `rig.ron`, and `calibration.ron` in the folder of each
    /// camera.
    pub calibration: Option<PathBuf>,
    /// The range camera; `None`: the first one.
    pub from: Option<String>,
    /// The camera whose image gives the colours; `None`: the first one of images alone.
    pub by: Option<String>,
    /// Output folder.
    pub out: PathBuf,
}

/// Puts the colours of one camera of a rig onto the points of another, and writes `cloud.ply` (points with colours, in the frame of the rig),
/// `uncoloured.ply` (those that the other camera does not see) and `summary.json`.
///
/// # Errors
/// What is wrong with a file or with the request; [`Error::Refused`] where no point is seen by both cameras.
pub fn colour(request: &ColourRequest, progress: &dyn Progress) -> Result<ColourSummary> {
    let rig = RigFile::read(&request.rig)?;
    let inputs = Inputs::default().path(&request.rig).maybe(request.calibration.as_deref());
    let inputs = rig.cameras.iter().fold(inputs, |inputs, camera| inputs.survey(&request.rig.join(camera.folder())));
    let inputs = inputs.path(request.rig.join(MOUNTINGS));
    produce(&request.out, &inputs, |destination| colour_into(destination, request, progress))
}

fn colour_into(destination: &Destination, request: &ColourRequest, progress: &dyn Progress) -> Result<ColourSummary> {
    let clock = Instant::now();
    let pair = Pair::read(request, progress)?;
    let [range_pose, colour_pose] = pair.rig_from_camera;
    let range_from_colour = range_pose.inverse() * colour_pose;
    let colouring =
        colour_points(&pair.frame, &pair.range_camera, &pair.image, &pair.colour_camera, &range_from_colour);
    let mut summary = ColourSummary::new(request, &pair.names, &colouring, pair.apart_s);
    if summary.coloured == 0 {
        let source = summary.nothing_seen().into();
        return Err(Error::Refused { summary: json(&summary)?, source, written: None });
    }
    let clouds = [true, false].map(|is_coloured| cloud(&pair, &colouring, &range_pose, is_coloured));
    summary.seconds = clock.elapsed().as_secs_f64();
    let folder = destination.open()?;
    for (name, cloud) in ["cloud.ply", "uncoloured.ply"].into_iter().zip(&clouds) {
        write_cloud(folder.file(name)?, cloud, Precision::Single)?;
    }
    write_text(folder.file("summary.json")?, &json(&summary)?)?;
    folder.commit()?;
    Ok(summary)
}

/// The points that have a colour, or those that have none.
fn cloud(pair: &Pair, colouring: &Colouring, rig_from_range: &Isometry3<f64>, is_coloured: bool) -> CloudFile {
    let frame = &pair.frame;
    let width = frame.width();
    let mut cloud = CloudFile::default();
    let (mut colours, mut intensity, mut sigma, mut flags) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (index, colour) in colouring.colours.iter().enumerate() {
        let range = f64::from(frame.range.as_slice()[index]);
        if colour.is_ok() != is_coloured || !(range > 0.0 && range.is_finite()) {
            continue;
        }
        let point = pair.range_camera.point([(index % width) as f64, (index / width) as f64], range);
        cloud.points.push((rig_from_range * point).coords.into());
        intensity.push(frame.amplitude.as_slice()[index]);
        sigma.push(frame.sigma.as_slice()[index]);
        flags.push(frame.flags.as_slice()[index].bits());
        colours.extend(colour.ok().map(|colour| colour.map(|value| value.round().clamp(0.0, 255.0) as u8)));
    }
    cloud.colours = is_coloured.then_some(colours);
    CloudFile { intensity: Some(intensity), sigma: Some(sigma), flags: Some(flags), ..cloud }
}
