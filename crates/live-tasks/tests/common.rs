//! A small simulated recording, and ways to send it.

use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

use live_tasks::commands::Result;
use live_tasks::{
    FrameError, FrameHeader, FrameSource, FrameStream, LiveFrame, LiveRequest, LiveSource, LiveSummary, Next,
    SampleType, StreamTarget, live, live_from, write_live_frame,
};
use pipeline::{Silent, SimulateSource, simulate};
use range_io::survey::{InputFrame, Survey, read_frame};
use tempfile::TempDir;

/// Frames of the recording.
pub const FRAMES: usize = 8;

/// A wall and a box before a small camera at 50 Hz.
const SCENE: &str = r#"(
    scene: (objects: [
        (name: "wall", albedo: 0.85, shape: Rectangle(corner_m: (-6, -5, 0), edge_u_m: (12, 0, 0), edge_v_m: (0, 10, 0))),
        (name: "box", albedo: 0.5, shape: Cuboid(center_m: (0.2, 0.1, 0.4), size_m: (0.5, 0.4, 0.3))),
    ]),
    camera: (
        geometry: (
            format: (width: 32, height: 24, pixel_pitch_mm: (0.1, 0.1)),
            interior: (principal_point_mm: (0.02, -0.03), principal_distance_mm: 4.0),
            lens: (k1: -1e-3, k2: 0.0, k3: 0.0, p1: 0.0, p2: 0.0),
        ),
        modulation_hz: [30e6], phase_steps: 4,
    ),
    illumination: (source_power: 4e7, modulation_contrast: 0.5, ambient_power: 5e4, vignetting_exponent: 1.0),
    exposure: (frames_per_station: 8, integration_time_s: 0.002, frame_interval_s: 0.02, start_s: 60.0, power_on_s: 0.0),
    stations: [(name: "W", position_m: (0, 0, 2.1), attitude: Euler(omega_deg: 2, phi_deg: 1, kappa_deg: 0))],
    errors: (
        DRIFT
        noise: (shot_variance_per_unit: 0.25, dark_sigma: 5.0),
        digitisation: (sample_type: U16, raw_scale: 2.5),
    ),
)"#;

/// Frames of a camera that moves.
pub const MOVING: usize = 8;

/// The corner of a room with a box and a column.
const ROOM: &str = r#"(
    scene: (objects: [
        (name: "room", albedo: 0.7, shape: Room(min_m: (0, 0, 0), max_m: (4, 3.2, 2.4))),
        (name: "box", albedo: 0.5, shape: Cuboid(center_m: (3.0, 2.4, 0.4), size_m: (0.5, 0.4, 0.8))),
        (name: "column", albedo: 0.6, shape: Cuboid(center_m: (3.7, 1.4, 1.2), size_m: (0.3, 0.3, 2.4))),
    ]),
    camera: (
        geometry: (
            format: (width: 96, height: 72, pixel_pitch_mm: (0.06, 0.06)),
            interior: (principal_point_mm: (0.02, -0.03), principal_distance_mm: 4.0),
        ),
        modulation_hz: [20e6], phase_steps: 4,
    ),
    illumination: (source_power: 4e7, modulation_contrast: 0.5, ambient_power: 5e4),
    exposure: (frames_per_station: 1, integration_time_s: 0.002, frame_interval_s: 0.03, start_s: 60.0),
    stations: [STATIONS],
    errors: (
        noise: (shot_variance_per_unit: 0.25, dark_sigma: 5.0),
        digitisation: (sample_type: U16, raw_scale: 2.5),
    ),
)"#;

/// The recording in a folder of its own.
pub struct World {
    pub folder: TempDir,
}

impl World {
    pub fn new() -> Self {
        Self::with("")
    }

    /// With a drift of the camera.
    pub fn with(drift: &str) -> Self {
        Self::of_scene(&SCENE.replace("DRIFT", drift))
    }

    /// A camera that is moved through a corner of a room, one frame a station, and then looks where this leads it.
    pub fn moving(further: &str) -> Self {
        let steps = (0..MOVING).map(|k| {
            let (x, y) = (1.2 + 0.02 * k as f64, 0.9 + 0.01 * k as f64);
            format!("(name: \"S{k}\", position_m: ({x}, {y}, 1.2), attitude: LookAt(target_m: (3.4, 2.6, 0.9))),")
        });
        Self::of_scene(&ROOM.replace("STATIONS", &(steps.collect::<String>() + further)))
    }

    fn of_scene(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.ron");
        std::fs::write(&scene, text).unwrap();
        let source = SimulateSource {
            scene: scene.display().to_string(),
            seed: 3,
            approximate_position_sigma_m: 0.0,
            approximate_attitude_sigma_deg: 0.0,
            gross_error_share: 0.0,
        };
        simulate(&source, Path::new(""), &folder.path().join("survey"), &Silent).unwrap();
        Self { folder }
    }

    pub fn survey(&self) -> PathBuf {
        self.folder.path().join("survey")
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A request that takes every frame of a source with this camera.
    pub fn request(&self, source: LiveSource) -> LiveRequest {
        LiveRequest { survey: Some(self.survey()), every_frame: true, ..LiveRequest::new(source) }
    }

    /// The recording's frames.
    pub fn frames(&self) -> Vec<LiveFrame> {
        let survey = Survey::read(self.survey()).unwrap();
        let frame = |index: usize| {
            let InputFrame::Samples(raw) = read_frame(&survey, &self.survey(), index).unwrap() else { panic!() };
            let (entry, samples) = (&survey.frames[index], raw.samples().clone());
            let header = FrameHeader {
                sample_type: SampleType::of(&samples),
                width: raw.width(),
                height: raw.height(),
                frequencies: 1,
                phase_steps: raw.phase_steps(),
                timestamp_s: entry.timestamp_s.unwrap(),
                integration_time_s: entry.integration_time_s,
                temperature_c: entry.temperature_c,
            };
            LiveFrame { header, samples, arrived: std::time::Instant::now() }
        };
        (0..survey.frames.len()).map(frame).collect()
    }

    /// The frames as a stream.
    pub fn bytes(&self) -> Vec<u8> {
        self.frames().iter().flat_map(bytes).collect()
    }

    /// Processes a stream from memory.
    pub fn stream(&self, bytes: Vec<u8>) -> Result<LiveSummary> {
        live_from(
            Box::new(Stream(FrameStream::new(Cursor::new(bytes)))),
            &self.request(LiveSource::StandardInput),
            &mut (),
        )
    }

    /// The clouds that a request gives, as one stream of bytes.
    pub fn clouds(&self, request: LiveRequest) -> (LiveSummary, Vec<u8>) {
        let file = self.path("clouds.ply");
        let summary = live(&LiveRequest { ply: Some(StreamTarget::File(file.clone())), ..request }, &mut ()).unwrap();
        (summary, std::fs::read(file).unwrap())
    }
}

/// A frame as it is sent.
pub fn bytes(frame: &LiveFrame) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_live_frame(&mut bytes, &frame.header, &frame.samples).unwrap();
    bytes
}

/// A reader as a source of somebody else's.
pub struct Stream<R>(pub FrameStream<R>);

impl<R: Read + Send> FrameSource for Stream<R> {
    fn next(&mut self, used: Option<LiveFrame>) -> std::result::Result<Next, FrameError> {
        Ok(self.0.next_frame(used)?.map_or(Next::End, Next::Frame))
    }
}
