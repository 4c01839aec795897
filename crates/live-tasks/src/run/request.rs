use std::net::SocketAddr;
use std::path::PathBuf;

use live_frames::DriftStage;
use live_frames::tracking::MapOptions;

use super::summary::LiveStatus;
use crate::sources::LiveSource;
use crate::streams::StreamTarget;

/// Which frames to process, of which camera, and what to do with them.
#[derive(Debug, Clone)]
pub struct LiveRequest {
    /// Where frames come from.
    pub source: LiveSource,
    /// Survey whose `survey.ron` tells the camera; `None`: the recording's own.
    pub survey: Option<PathBuf>,
    /// The calibration; `None`: the one beside that `survey.ron`, if there is one.
    pub calibration: Option<PathBuf>,
    /// Where clouds go.
    pub ply: Option<StreamTarget>,
    /// Where images go, as MCAP.
    pub mcap: Option<StreamTarget>,
    /// Frames after which it ends; `None`: it ends with the source.
    pub frames: Option<u64>,
    /// Whether a recording is played without waiting. Then no frame is dropped, whatever the source: it has to wait.
    pub every_frame: bool,
    /// Amplitude below which pixels are flagged, in the samples' unit.
    pub low_amplitude: Option<f64>,
    /// No range is longer, metre.
    pub maximum_range_m: Option<f64>,
    /// When the camera was switched on, on the clock of the frames; `None`: as the survey states it.
    pub power_on_s: Option<f64>,
    /// Whether a calibrated drift is taken off.
    pub drift: DriftStage,
    /// Port of the page on this machine; 0: any that is free.
    pub view: Option<u16>,
    /// Whether the camera's pose is sought, and what becomes of its path.
    pub tracking: Option<LiveTracking>,
}

/// What becomes of the camera's path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LiveTracking {
    /// Where poses go, line by line.
    pub trajectory: Option<StreamTarget>,
    /// File of the map, which is written when the stream has ended.
    pub map: Option<PathBuf>,
    /// How fine the map is, and how large it may become.
    pub map_options: MapOptions,
}

impl LiveRequest {
    /// A request that processes the frames of a source and nothing else.
    pub fn new(source: LiveSource) -> Self {
        Self {
            source,
            survey: None,
            calibration: None,
            ply: None,
            mcap: None,
            frames: None,
            every_frame: false,
            low_amplitude: None,
            maximum_range_m: None,
            power_on_s: None,
            drift: DriftStage::Apply,
            view: None,
            tracking: None,
        }
    }

    /// Where results go.
    pub(super) fn targets(&self) -> Vec<StreamTarget> {
        let tracking = self.tracking.as_ref();
        let trajectory = tracking.and_then(|tracking| tracking.trajectory.clone());
        let map = tracking.and_then(|tracking| tracking.map.clone()).map(StreamTarget::File);
        [self.ply.clone(), self.mcap.clone(), trajectory, map].into_iter().flatten().collect()
    }
}

/// Who watches a stream.
pub trait LiveWatch {
    /// The page is at this address.
    fn page(&mut self, _address: SocketAddr) {}
    /// Whether it is to end now: asked after each frame, and twenty times a second while none comes. What there is by then is written
    /// as at any other end.
    fn should_end(&mut self) -> bool {
        false
    }
    /// How it stands, once a second.
    fn status(&mut self, _status: &LiveStatus) {}
}

/// Nobody watches.
impl LiveWatch for () {}
