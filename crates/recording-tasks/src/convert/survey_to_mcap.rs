//! A survey's frames become MCAP: depth images, amplitudes, the camera, inertial samples and temperatures.

use atomic_output::FileWriter;
use camera_model::{Camera, RayTable};
use commands::range_io::calibration::Calibration;
use commands::range_io::survey::{InputFrame, Level, Survey, read_frame};
use commands::range_io::tables::read_imu;
use commands::{Error, INERTIAL_DATA, Progress, Result, root_of};
use recordings::{CameraInfo, McapWriter, Payload, StreamId};

use super::{CameraUsed, ConvertRequest, ConvertSummary, ImuUsed, check_file, imu, refused, ros};

/// Coordinate system of the images: x right, y down, z forward.
const FRAME_ID: &str = "camera_depth_optical_frame";

/// Converts a survey to MCAP.
pub(super) fn convert(request: &ConvertRequest, progress: &dyn Progress) -> Result<ConvertSummary> {
    check_file(request)?;
    if request.stream.is_some() || request.level.is_some() || request.station.is_some() || request.imu.is_some() {
        return Err(refused("a survey has no streams to choose from: leave out --stream, --level, --station, --imu"));
    }
    let survey = Survey::read(&request.input)?;
    if matches!(survey.level, Level::Samples | Level::Phase) {
        let level = survey.level.name();
        return Err(refused(format!("frames at level `{level}` have no type in ROS: run a pipeline on them first")));
    }
    if let Some(index) = survey.frames.iter().position(|frame| frame.timestamp_s.is_none()) {
        return Err(refused(format!("frames[{index}] of the survey has no timestamp_s, which every message needs")));
    }
    let root = root_of(&request.input);
    let (camera, source) = camera(request, &survey)?;
    let (info, residual_px) = ros::plumb_bob(FRAME_ID, &camera)?;
    let mut summary = ConvertSummary {
        input: request.input.display().to_string(),
        format: "survey".to_owned(),
        out: request.out.display().to_string(),
        stream: topic_of(survey.level).to_owned(),
        level: if survey.level == Level::Intensity { "intensity" } else { "depth" }.to_owned(),
        camera: Some(CameraUsed { source, model: "plumb_bob".to_owned(), residual_px }),
        ..ConvertSummary::default()
    };
    let file = FileWriter::create(&request.out).map_err(commands::range_io::Error::from)?;
    let access = |source| Error::Access { path: request.out.clone(), source };
    let mut out = Out::new(McapWriter::new(file).map_err(access)?, &survey, &camera, info)?;
    progress.begin("writing frames", survey.frames.len());
    for index in 0..survey.frames.len() {
        let frame = read_frame(&survey, &root, index)?;
        out.frame(&survey, index, frame, &mut summary)?;
        progress.advance(index + 1);
    }
    progress.finish();
    if let Some(file) = survey.extras.get(INERTIAL_DATA) {
        summary.imu = Some(out.imu(&root.join(file))?);
        summary.findings.push("/imu has the axes of the inertial unit; its mounting is not written".to_owned());
    }
    if survey.level == Level::Range {
        summary.findings.push("ranges became depths along the viewing axis, by the camera named above".to_owned());
    }
    let file = out.writer.finish().map_err(access)?;
    file.commit().map_err(commands::range_io::Error::from)?;
    Ok(summary)
}

/// The calibrated camera, where there is one, and where it comes from.
fn camera(request: &ConvertRequest, survey: &Survey) -> Result<(Camera, String)> {
    let beside = root_of(&request.input).join(Calibration::FILE_NAME);
    let file = request.calibration.clone().or_else(|| beside.is_file().then_some(beside));
    let Some(file) = file else { return Ok((survey.camera.nominal_camera()?, Survey::FILE_NAME.to_owned())) };
    let camera = Calibration::read(&file)?.camera()?;
    let (found, wanted) = (&camera.format, &survey.camera);
    if [found.width, found.height] != [wanted.width, wanted.height] {
        let words = format!(
            "is of {} x {} pixels, the survey of {} x {}",
            found.width, found.height, wanted.width, wanted.height
        );
        return Err(Error::Incompatible(format!("{} {words}", file.display())));
    }
    Ok((camera, file.display().to_string()))
}

fn topic_of(level: Level) -> &'static str {
    if level == Level::Intensity { "/ir/image_raw" } else { "/depth/image_raw" }
}

/// What is written to.
struct Out {
    writer: McapWriter<FileWriter>,
    images: StreamId,
    cameras: StreamId,
    info: CameraInfo,
    rays: Option<RayTable>,
}

impl Out {
    fn new(mut writer: McapWriter<FileWriter>, survey: &Survey, camera: &Camera, info: CameraInfo) -> Result<Self> {
        let topic = topic_of(survey.level);
        let cameras = writer.stream(&topic.replace("image_raw", "camera_info")).map_err(failed)?;
        let images = writer.stream(topic).map_err(failed)?;
        let rays = if survey.level == Level::Range {
            Some(RayTable::new(camera).map_err(|error| Error::Camera(error.to_string()))?)
        } else {
            None
        };
        Ok(Self { writer, images, cameras, info, rays })
    }

    fn frame(&mut self, survey: &Survey, index: usize, frame: InputFrame, summary: &mut ConvertSummary) -> Result<()> {
        let entry = &survey.frames[index];
        let time_ns = nanoseconds(entry.timestamp_s.unwrap_or(0.0));
        let (plane, amplitude) = match frame {
            InputFrame::Depth { depth, amplitude, .. } => (depth, amplitude),
            InputFrame::Range { range, amplitude, .. } => {
                let rays = self.rays.as_ref();
                let depth = rays.map(|rays| rays.range_to_depth(&range)).transpose();
                (depth.map_err(|error| Error::Camera(error.to_string()))?.unwrap_or(range), amplitude)
            }
            InputFrame::Intensity(image) => (image, None),
            _ => return Err(refused("frames at this level have no type in ROS")),
        };
        self.put(self.cameras, time_ns, &Payload::CameraInfo(Box::new(self.info.clone())))?;
        self.put(self.images, time_ns, &ros::image(FRAME_ID, &plane)?)?;
        summary.frames += 1;
        if let Some(amplitude) = amplitude {
            let stream = self.writer.stream("/amplitude/image_raw").map_err(failed)?;
            self.put(stream, time_ns, &ros::image(FRAME_ID, &amplitude)?)?;
            summary.amplitudes = Some("/amplitude/image_raw".to_owned());
            summary.with_amplitude += 1;
        }
        if let Some(celsius) = entry.temperature_c {
            let stream = self.writer.stream("/temperature").map_err(failed)?;
            self.put(stream, time_ns, &Payload::Temperature(celsius))?;
            summary.with_temperature += 1;
        }
        Ok(())
    }

    fn imu(&mut self, file: &std::path::Path) -> Result<ImuUsed> {
        let samples = read_imu(file)?;
        let stream = self.writer.stream("/imu").map_err(failed)?;
        for sample in &samples {
            self.put(stream, nanoseconds(sample.timestamp_s), &imu::payload(sample))?;
        }
        let (from, written_as) = (file.display().to_string(), "/imu".to_owned());
        Ok(ImuUsed { stream: from, written_as, samples: samples.len(), left_out: 0 })
    }

    fn put(&mut self, stream: StreamId, time_ns: i64, payload: &Payload) -> Result<()> {
        self.writer.message(stream, time_ns, payload).map_err(failed)
    }
}

/// Seconds in whole nanoseconds.
fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

fn failed(error: recordings::Error) -> Error {
    match error {
        recordings::Error::Io { file, source, .. } => Error::Access { path: file, source },
        other => refused(other.to_string()),
    }
}
