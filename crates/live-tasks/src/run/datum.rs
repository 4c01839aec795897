//! Where the first frame is, which fixes the world.

use commands::{Result, root_of};
use live_frames::Processor;
use live_frames::tracking::nalgebra::Isometry3;
use range_io::survey::Survey;
use range_io::tables::read_stations;

use super::request::LiveRequest;
use super::setup::request;
use crate::sources::frame_time_s;

/// Poses of the stations of a recording by the times of their frames; none of any other source.
#[derive(Debug, Default)]
pub(super) struct Datum {
    known: Vec<(f64, String, Isometry3<f64>)>,
    /// Station of the frame that tracking started with.
    station: Option<String>,
    started: bool,
}

impl Datum {
    pub(super) fn read(asked: &LiveRequest) -> Result<Self> {
        let Some(path) = asked.source.recording().filter(|_| asked.tracking.is_some()) else {
            return Ok(Self::default());
        };
        let stations = root_of(path).join("stations.csv");
        if !stations.is_file() {
            return Ok(Self::default());
        }
        let (survey, stations) = (Survey::read(path)?, read_stations(stations)?);
        let entries = survey.frames.iter().enumerate();
        let known = entries.filter_map(|(index, entry)| {
            let row = stations.iter().find(|row| row.station == entry.station)?;
            Some((frame_time_s(entry, index), row.station.clone(), row.world_from_camera))
        });
        Ok(Self { known: known.collect(), ..Self::default() })
    }

    /// Index of the world's axis that points up: stations have a vertical one, a camera looks ahead.
    pub(super) fn vertical_axis(&self) -> usize {
        if self.known.is_empty() { 1 } else { 2 }
    }

    /// Places a frame, in case tracking starts with it.
    pub(super) fn place(&mut self, processor: &mut Processor, timestamp_s: f64) -> Result<()> {
        if self.started || self.known.is_empty() {
            return Ok(());
        }
        self.started = processor.tracker().is_some_and(|tracker| tracker.keyframes() > 0);
        if self.started {
            return Ok(());
        }
        let found = self.known.iter().find(|(time_s, ..)| time_s.to_bits() == timestamp_s.to_bits());
        self.station = found.map(|(_, station, _)| station.clone());
        let pose = found.map_or_else(Isometry3::identity, |(.., pose)| *pose);
        processor.place_first(pose).map_err(|error| request(format!("stations.csv: {error}")))
    }

    pub(super) fn words(&self) -> String {
        match &self.station {
            Some(station) => format!("station {station} held at its pose in stations.csv"),
            None => "the camera's axes at the first frame: x right, y up, looking along -z".to_owned(),
        }
    }
}
