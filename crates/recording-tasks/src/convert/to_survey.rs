//! A recording becomes a survey: frame by frame, with what the recording tells of the camera.

use atomic_output::{Destination, OutputFolder};
use camera_model::Camera;
use commands::range_io::calibration::Calibration;
use commands::range_io::survey::{FrameEntry, InputFrame, Level, Survey, SurveyCamera, write_frame};
use commands::{Inputs, Progress, Result, json, produce};
use recordings::{Image, Message, Payload, Recording};

use super::camera::{Found, of_stream};
use super::frames::{Pairs, Pending, frame};
use super::imu::{FILE, Samples};
use super::scan::{Scan, scan};
use super::{ConvertRequest, ConvertSummary, refused};
use crate::access::{doubts, each_message, failed};

/// A temperature this old says nothing of a frame any more: cameras warm up by a degree in some minutes.
const OLDEST_TEMPERATURE_NS: u64 = 10_000_000_000;

/// Streams that are read in the second pass.
struct Chosen {
    frames: usize,
    level: Level,
    light: Option<usize>,
    imu: Option<usize>,
    temperature: Option<usize>,
    size: [usize; 2],
}

/// Converts a recording to a survey's folder.
pub(super) fn convert(request: &ConvertRequest, progress: &dyn Progress) -> Result<ConvertSummary> {
    let inputs = Inputs::default().path(&request.input).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| {
        let scan = scan(request, progress)?;
        let chosen = choose(request, &scan)?;
        let found = of_stream(request, &scan, chosen.frames)?;
        write(request, &scan, &chosen, found, destination, progress)
    })
}

fn choose(request: &ConvertRequest, scan: &Scan) -> Result<Chosen> {
    let (frames, level) = scan.frames(request)?;
    let size = scan.streams[frames].image.as_ref().map_or([0; 2], |(size, _)| *size);
    let light = if level == Level::Intensity { None } else { scan.light(frames) };
    let is_temperature =
        |stream: &&super::scan::Scanned| stream.kind == recordings::Kind::Temperature && stream.messages > 0;
    let temperature = scan.streams.iter().position(|stream| is_temperature(&stream));
    Ok(Chosen { frames, level, light, imu: scan.imu(request)?, temperature, size })
}

/// What is written to while the recording is read for the second time.
struct Writer<'a> {
    request: &'a ConvertRequest,
    chosen: &'a Chosen,
    folder: OutputFolder,
    entries: Vec<FrameEntry>,
    pairs: Pairs,
    samples: Samples,
    temperature: Option<(i64, f64)>,
    summary: ConvertSummary,
}

fn write(
    request: &ConvertRequest,
    scan: &Scan,
    chosen: &Chosen,
    found: Found,
    destination: &Destination,
    progress: &dyn Progress,
) -> Result<ConvertSummary> {
    let mut recording = Recording::open(&request.input).map_err(failed("convert", &request.input))?;
    let mut writer = Writer {
        request,
        chosen,
        folder: destination.open()?,
        entries: Vec::new(),
        pairs: Pairs::new(chosen.light.is_some()),
        samples: Samples::default(),
        temperature: None,
        summary: ConvertSummary {
            input: request.input.display().to_string(),
            format: recording.format().name().to_owned(),
            out: request.out.display().to_string(),
            stream: scan.streams[chosen.frames].name.clone(),
            level: chosen.level.name().to_owned(),
            amplitudes: chosen.light.map(|light| scan.streams[light].name.clone()),
            ..ConvertSummary::default()
        },
    };
    each_message("convert", "writing frames", &mut recording, progress, |_, message| writer.message(message))?;
    let rest = writer.pairs.finish();
    writer.frames(rest)?;
    writer.finish(scan, found, &recording)
}

impl Writer<'_> {
    fn message(&mut self, message: Message) -> Result<()> {
        let (time_ns, stream) = (message.time_ns(), Some(message.stream));
        let complete = match message.payload {
            Payload::Image(image) if message.stream == self.chosen.frames => {
                let age = |at: i64| at.abs_diff(time_ns) <= OLDEST_TEMPERATURE_NS;
                let temperature_c = self.temperature.filter(|(at, _)| age(*at)).map(|(_, celsius)| celsius);
                self.pairs.add(Pending { time_ns, image, temperature_c })
            }
            Payload::Unreadable(_) if message.stream == self.chosen.frames => {
                self.summary.skip("not what their type says");
                return Ok(());
            }
            Payload::Image(image) if stream == self.chosen.light => self.pairs.add_light(time_ns, image),
            Payload::Imu(imu) if stream == self.chosen.imu => {
                self.samples.add(time_ns, &imu);
                return Ok(());
            }
            Payload::Temperature(celsius) if stream == self.chosen.temperature && celsius.is_finite() => {
                self.temperature = Some((time_ns, celsius));
                return Ok(());
            }
            _ => return Ok(()),
        };
        self.frames(complete)
    }

    fn frames(&mut self, complete: Vec<(Pending, Option<Image>)>) -> Result<()> {
        for (pending, light) in complete {
            match frame(self.chosen.level, &pending.image, light.as_ref(), self.chosen.size) {
                Ok(found) => self.frame(&pending, &found)?,
                Err(reason) => self.summary.skip(reason),
            }
        }
        Ok(())
    }

    fn frame(&mut self, pending: &Pending, frame: &InputFrame) -> Result<()> {
        let number = self.entries.len();
        let file = format!("frames/{number:06}.npz");
        write_frame(self.folder.file(&file)?, frame)?;
        let has_amplitude = matches!(
            frame,
            InputFrame::Depth { amplitude: Some(_), .. } | InputFrame::Range { amplitude: Some(_), .. }
        );
        self.summary.with_amplitude += usize::from(has_amplitude);
        self.summary.with_temperature += usize::from(pending.temperature_c.is_some());
        self.entries.push(FrameEntry {
            file: file.into(),
            station: self.request.station.clone().unwrap_or_else(|| format!("{number:06}")),
            timestamp_s: Some(pending.time_ns as f64 * 1e-9),
            integration_time_s: None,
            temperature_c: pending.temperature_c,
        });
        Ok(())
    }

    fn finish(mut self, scan: &Scan, found: Found, recording: &Recording) -> Result<ConvertSummary> {
        if self.entries.is_empty() {
            return Err(refused(format!("stream `{}` has no image that can be a frame", self.summary.stream)));
        }
        let mut survey = Survey::new(survey_camera(&found.camera), self.chosen.level, self.entries);
        survey.camera_identity = identity(scan);
        survey.firmware = scan.property("K4A_DEPTH_FIRMWARE_VERSION").and_then(printable);
        let summary = &mut self.summary;
        summary.frames = survey.frames.len();
        survey.write(self.folder.file(Survey::FILE_NAME)?)?;
        if let Some(calibration) = &found.calibration {
            calibration.write(self.folder.file(Calibration::FILE_NAME)?)?;
        }
        if let Some(imu) = self.chosen.imu {
            summary.imu = self.samples.write(&self.folder.file(FILE)?, &scan.streams[imu].name)?;
        }
        if summary.imu.is_some() {
            summary.findings.push(format!(
                "{FILE} has the axes of the inertial unit: to use it, name it in `extras` of survey.ron as `imu`, with `camera_from_imu` beside it"
            ));
        }
        summary.camera = Some(found.used);
        if summary.with_amplitude == 0 {
            summary.amplitudes = None;
        }
        let taken = [Some(self.chosen.frames), self.chosen.light, self.chosen.imu, self.chosen.temperature];
        let left_out = scan.streams.iter().enumerate().filter(|(index, stream)| {
            stream.messages > 0 && !taken.contains(&Some(*index)) && stream.kind != recordings::Kind::CameraInfo
        });
        summary.left_out = left_out.map(|(_, stream)| stream.name.clone()).collect();
        summary.doubts = doubts(recording);
        atomic_output::write_text(self.folder.file("summary.json")?, &json(&self.summary)?)?;
        self.folder.commit()?;
        Ok(self.summary)
    }
}

/// The camera block of a survey; the lens is the calibration's.
fn survey_camera(camera: &Camera) -> SurveyCamera {
    SurveyCamera {
        width: camera.format.width,
        height: camera.format.height,
        pixel_pitch_mm: camera.format.pixel_pitch_mm,
        principal_distance_mm: camera.interior.principal_distance_mm,
        principal_point_mm: camera.interior.principal_point_mm,
        modulation_hz: Vec::new(),
        phase_steps: None,
        phase_sense: range_image::PhaseSense::default(),
        phase_offset_rad: 0.0,
        saturation: None,
        raw_scale: 1.0,
    }
}

/// What camera it was, as far as the recorder says.
fn identity(scan: &Scan) -> Option<String> {
    let serial = scan.property("K4A_DEVICE_SERIAL_NUMBER").and_then(printable)?;
    Some(format!("Azure Kinect DK, serial number {serial}"))
}

/// Words that a survey may have: one line of at most 100 bytes.
fn printable(words: &str) -> Option<String> {
    let words = words.trim();
    (!words.is_empty() && words.len() <= 100 && !words.contains(char::is_control)).then(|| words.to_owned())
}
