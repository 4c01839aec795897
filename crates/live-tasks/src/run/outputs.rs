//! What is written of each frame, and at the end.

use std::path::Path;

use commands::{Error, Result};
use live_frames::ProcessedFrame;
use live_frames::tracking::SurfaceMap;
use range_io::clouds::{CloudFile, Precision};
use range_io::ply::write_cloud;

use super::request::LiveRequest;
use super::setup::request;
use crate::streams::{McapStream, PlyStream, Sink, StreamTarget, TrajectoryStream};

/// The streams that a request asks for.
pub(super) struct Outputs {
    clouds: Option<(StreamTarget, PlyStream<Sink>)>,
    images: Option<(StreamTarget, McapStream<Sink>)>,
    poses: Option<(StreamTarget, TrajectoryStream<Sink>)>,
}

impl Outputs {
    pub(super) fn open(asked: &LiveRequest) -> Result<Self> {
        let targets = asked.targets();
        if targets.iter().enumerate().any(|(index, target)| targets[..index].contains(target)) {
            return Err(request("two results are to go to one place; give each its own".to_owned()));
        }
        let clouds = asked.ply.as_ref().map(|target| Ok::<_, Error>((target.clone(), PlyStream::new(target.open()?))));
        let images = asked.mcap.as_ref().map(|target| {
            let recording = McapStream::new(target.open()?);
            Ok::<_, Error>(target.written(recording)?.map(|recording| (target.clone(), recording)))
        });
        if let Some(map) = asked.tracking.as_ref().and_then(|tracking| tracking.map.as_ref()) {
            // It is written when the stream has ended, which is too late to learn that it cannot be.
            drop(StreamTarget::File(map.clone()).open()?);
        }
        let poses = asked.tracking.as_ref().and_then(|tracking| tracking.trajectory.as_ref());
        let poses = poses.map(|target| Ok::<_, Error>((target.clone(), TrajectoryStream::new(target.open()?))));
        Ok(Self { clouds: clouds.transpose()?, images: images.transpose()?.flatten(), poses: poses.transpose()? })
    }

    /// Writes a frame, how many points there are; `None` where nobody reads any more.
    pub(super) fn write(&mut self, frame: &ProcessedFrame) -> Result<Option<u64>> {
        let mut points = 0;
        if let Some((target, stream)) = &mut self.clouds {
            let Some(written) = target.written(stream.write(frame))? else { return Ok(None) };
            points = written as u64;
        }
        if let Some((target, stream)) = &mut self.images
            && target.written(stream.write(frame))?.is_none()
        {
            return Ok(None);
        }
        if let Some((target, stream)) = &mut self.poses
            && let Some(pose) = &frame.pose
            && target.written(stream.write(pose))?.is_none()
        {
            return Ok(None);
        }
        Ok(Some(points))
    }

    /// All is written: files have their names from now on.
    pub(super) fn commit(self) -> Result<()> {
        if let Some((_, stream)) = self.clouds {
            stream.into_inner().commit()?;
        }
        if let Some((target, stream)) = self.images
            && let Some(sink) = target.written(stream.finish())?
        {
            sink.commit()?;
        }
        if let Some((_, stream)) = self.poses {
            stream.into_inner().commit()?;
        }
        Ok(())
    }
}

/// Writes the map as a cloud with normals and standard deviations.
pub(super) fn write_map(file: &Path, map: &SurfaceMap) -> Result<()> {
    let cloud = map.cloud();
    let normals = cloud.normals.unwrap_or_default();
    let cloud = CloudFile {
        points: cloud.points.iter().map(|point| point.coords.into()).collect(),
        normals: Some(normals.iter().map(|normal| [0, 1, 2].map(|axis| normal[axis] as f32)).collect()),
        sigma: cloud.sigma.map(|sigma| sigma.iter().map(|value| *value as f32).collect()),
        ..CloudFile::default()
    };
    Ok(write_cloud(file, &cloud, Precision::Single)?)
}
