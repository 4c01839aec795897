//! A recording of another format becomes MCAP: every stream that has a type in ROS.

use std::collections::BTreeMap;

use atomic_output::FileWriter;
use commands::range_io::azure::RationalIntrinsics;
use commands::{Error, Progress, Result};
use recordings::{Kind, McapWriter, Message, Payload, Recording, StreamId};

use super::camera::{factory, info_of};
use super::scan::{Scan, scan};
use super::topics::topic;
use super::{ConvertRequest, ConvertSummary, check_file, refused};
use crate::access::{doubts, each_message, failed};

/// Converts a recording to MCAP.
pub(super) fn convert(request: &ConvertRequest, progress: &dyn Progress) -> Result<ConvertSummary> {
    check_file(request)?;
    let plain = ConvertRequest::new(&request.input, &request.out);
    if *request != plain {
        return Err(refused("to MCAP all streams of a recording are taken over as they are: give --out alone"));
    }
    let scan = scan(request, progress)?;
    let mut recording = Recording::open(&request.input).map_err(failed("convert", &request.input))?;
    let file = FileWriter::create(&request.out).map_err(commands::range_io::Error::from)?;
    let mut out = Out::new(file, factory_of(&scan)?).map_err(access(request))?;
    each_message("convert", "writing messages", &mut recording, progress, |recording, message| {
        out.message(recording, &message)
    })?;
    let summary = ConvertSummary {
        input: request.input.display().to_string(),
        format: recording.format().name().to_owned(),
        out: request.out.display().to_string(),
        stream: "all".to_owned(),
        level: "messages".to_owned(),
        ..ConvertSummary::default()
    };
    out.finish(request, &scan, &recording, summary)
}

/// The factory calibration for the depth images of an Azure Kinect, with their stream.
fn factory_of(scan: &Scan) -> Result<Option<(usize, RationalIntrinsics)>> {
    let depth = scan.streams.iter().position(|stream| stream.kind == Kind::Depth && stream.image.is_some());
    let Some(depth) = depth.filter(|_| scan.cameras.is_empty()) else { return Ok(None) };
    let size = scan.streams[depth].image.as_ref().map_or([0; 2], |(size, _)| *size);
    Ok(factory(scan, size)?.map(|found| (depth, found)))
}

/// What is written to.
struct Out {
    writer: McapWriter<FileWriter>,
    topics: BTreeMap<usize, StreamId>,
    factory: Option<(usize, RationalIntrinsics)>,
    written: usize,
    passed_over: BTreeMap<usize, usize>,
}

impl Out {
    fn new(file: FileWriter, factory: Option<(usize, RationalIntrinsics)>) -> std::io::Result<Self> {
        let (topics, passed_over) = (BTreeMap::new(), BTreeMap::new());
        Ok(Self { writer: McapWriter::new(file)?, topics, factory, written: 0, passed_over })
    }

    fn message(&mut self, recording: &Recording, message: &Message) -> Result<()> {
        let time_ns = message.time_ns();
        if matches!(message.payload, Payload::Bytes(_) | Payload::Unreadable(_)) {
            *self.passed_over.entry(message.stream).or_default() += 1;
            return Ok(());
        }
        let failed = |error: recordings::Error| refused(error.to_string());
        let stream = &recording.streams()[message.stream];
        if let Some((depth, factory)) = self.factory
            && depth == message.stream
        {
            let camera = self.writer.stream(&topic(stream).replace("image_raw", "camera_info")).map_err(failed)?;
            let info = info_of(&factory, &stream.name);
            self.writer.message(camera, time_ns, &Payload::CameraInfo(Box::new(info))).map_err(failed)?;
            self.written += 1;
        }
        let known = self.topics.get(&message.stream).copied();
        let id = known.map_or_else(|| self.writer.stream(&topic(stream)).map_err(failed), Ok)?;
        self.topics.insert(message.stream, id);
        self.writer.message(id, time_ns, &message.payload).map_err(failed)?;
        self.written += 1;
        Ok(())
    }

    fn finish(
        self,
        request: &ConvertRequest,
        scan: &Scan,
        recording: &Recording,
        mut summary: ConvertSummary,
    ) -> Result<ConvertSummary> {
        if self.written == 0 {
            return Err(refused(format!("{} has no message that has a type in ROS", request.input.display())));
        }
        let file = self.writer.finish().map_err(access(request))?;
        file.commit().map_err(commands::range_io::Error::from)?;
        summary.frames = self.written;
        for (stream, messages) in self.passed_over {
            summary.left_out.push(format!("{} ({messages} messages)", scan.streams[stream].name));
        }
        if scan.streams.iter().any(|stream| stream.kind == Kind::Range && stream.messages > 0) {
            summary.findings.push(
                "/range/image_raw has ranges along the rays, not depths, for which ROS has no type of its own"
                    .to_owned(),
            );
        }
        summary.doubts = doubts(recording);
        Ok(summary)
    }
}

fn access(request: &ConvertRequest) -> impl FnOnce(std::io::Error) -> Error {
    let path = request.out.clone();
    move |source| Error::Access { path, source }
}
