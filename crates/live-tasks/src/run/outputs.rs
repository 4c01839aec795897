//! What is written of each frame.

use commands::{Error, Result};
use live_frames::ProcessedFrame;

use super::request::LiveRequest;
use super::setup::request;
use crate::streams::{McapStream, PlyStream, Sink, StreamTarget};

/// The streams that a request asks for.
pub(super) struct Outputs {
    clouds: Option<(StreamTarget, PlyStream<Sink>)>,
    images: Option<(StreamTarget, McapStream<Sink>)>,
}

impl Outputs {
    pub(super) fn open(asked: &LiveRequest) -> Result<Self> {
        if asked.ply.is_some() && asked.ply == asked.mcap {
            return Err(request("clouds and images are to go to one place; give each its own".to_owned()));
        }
        let clouds = asked.ply.as_ref().map(|target| Ok::<_, Error>((target.clone(), PlyStream::new(target.open()?))));
        let images = asked.mcap.as_ref().map(|target| {
            let recording = McapStream::new(target.open()?);
            Ok::<_, Error>(target.written(recording)?.map(|recording| (target.clone(), recording)))
        });
        Ok(Self { clouds: clouds.transpose()?, images: images.transpose()?.flatten() })
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
        Ok(())
    }
}
