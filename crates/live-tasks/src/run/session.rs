//! Frame after frame.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use commands::{Error, Result, json};
use live_frames::Error as Refusal;
use live_frames::tracking::SurfaceMap;

use super::drift::DriftReport;
use super::feed::{Arrival, Feed};
use super::outputs::{Outputs, write_map};
use super::path::{MapReport, PathReport};
use super::request::{LiveRequest, LiveWatch};
use super::setup::{Setup, misfit, request};
use super::summary::{Ended, LiveSummary};
use super::tally::{Tally, per_second, reason};
use crate::sources::FrameSource;
use crate::view::LiveView;
use crate::wire::{FrameError, LiveFrame};

/// Longest wait for a frame before status and page are looked after.
const WAIT: Duration = Duration::from_millis(50);
/// Time between two status lines.
const BETWEEN_STATUS: Duration = Duration::from_secs(1);
/// A time stamp that is further back than this, second, is that of a clock that began anew; a smaller step is a frame out of order.
const CLOCK_BEGAN_ANEW_S: f64 = 1.0;

/// Processes the frames of a source until it ends.
///
/// # Errors
/// [`Error::Request`] and errors of files where camera, source or the first frame are not what they should be;
/// [`Error::Refused`] where no frame could be processed.
pub fn live(asked: &LiveRequest, watch: &mut dyn LiveWatch) -> Result<LiveSummary> {
    let setup = Setup::new(asked)?;
    let source = asked.source.open(!asked.every_frame)?;
    Session::new(asked, setup, watch)?.run(source)
}

/// As [`live`], with frames of a source of one's own; that of the request names it.
pub fn live_from(source: Box<dyn FrameSource>, asked: &LiveRequest, watch: &mut dyn LiveWatch) -> Result<LiveSummary> {
    Session::new(asked, Setup::new(asked)?, watch)?.run(source)
}

struct Session<'a> {
    asked: &'a LiveRequest,
    setup: Setup,
    watch: &'a mut dyn LiveWatch,
    tally: Tally,
    outputs: Outputs,
    view: Option<LiveView>,
    last_status: Instant,
}

impl<'a> Session<'a> {
    fn new(asked: &'a LiveRequest, setup: Setup, watch: &'a mut dyn LiveWatch) -> Result<Self> {
        let outputs = Outputs::open(asked)?;
        let view = asked.view.map(|port| {
            let fail = |source| Error::Access { path: format!("127.0.0.1:{port}").into(), source };
            LiveView::new(port, setup.datum.vertical_axis()).map_err(fail)
        });
        let view = view.transpose()?;
        if let Some(view) = &view {
            watch.page(view.address());
        }
        Ok(Self { asked, setup, watch, tally: Tally::new(), outputs, view, last_status: Instant::now() })
    }

    fn run(mut self, source: Box<dyn FrameSource>) -> Result<LiveSummary> {
        let mut feed = Feed::new(source, self.asked.every_frame);
        let (ended, words) = loop {
            match feed.next(WAIT) {
                Arrival::Frame(frame) => {
                    let ended = self.take(&frame)?;
                    feed.give_back(frame);
                    if let Some(ended) = ended {
                        break (ended, None);
                    }
                }
                Arrival::Nothing => {}
                Arrival::End(Ok(())) => break (Ended::Source, None),
                Arrival::End(Err(error)) => break self.broken(&error, &feed)?,
            }
            self.look_after(&feed);
            if self.watch.should_end() {
                break (Ended::Asked, None);
            }
        };
        self.finish(ended, words, &feed)
    }

    /// Processes one frame; how the stream ended, where it did.
    fn take(&mut self, frame: &LiveFrame) -> Result<Option<Ended>> {
        let header = &frame.header;
        if let Some(words) = misfit(header, self.setup.processor.camera()) {
            if self.tally.nothing_yet() {
                return Err(request(format!("{}: {words}", self.asked.source)));
            }
            self.tally.refuse("another camera", words);
            return Ok(None);
        }
        let drift = DriftReport::of(self.setup.drift.as_ref(), self.setup.processor.camera().power_on_s, header);
        self.tally.arrived(header, frame.arrived, drift);
        self.setup.datum.place(&mut self.setup.processor, header.timestamp_s)?;
        if let Err(error) = self.process(frame) {
            self.tally.refuse(reason(&error), format!("at {} s: {error}", header.timestamp_s));
            return Ok(None);
        }
        let processed = self.setup.processor.last();
        match self.outputs.write(processed)? {
            Some(points) => self.tally.points += points,
            None => return Ok(Some(Ended::OutputClosed)),
        }
        self.tally.done(processed, frame.arrived);
        Ok((self.asked.frames == Some(self.tally.processed)).then_some(Ended::Frames))
    }

    fn process(&mut self, frame: &LiveFrame) -> std::result::Result<(), Refusal> {
        let processor = &mut self.setup.processor;
        match processor.process(&frame.samples, frame.header.exposure()) {
            Err(Refusal::Time { timestamp_s, before_s }) if before_s - timestamp_s > CLOCK_BEGAN_ANEW_S => {
                self.tally.restarts += 1;
                processor.restart();
                processor.process(&frame.samples, frame.header.exposure()).map(drop)
            }
            done => done.map(drop),
        }
    }

    /// A source that cannot be read further: wrong input where it was so from the first frame on.
    fn broken(&self, error: &FrameError, feed: &Feed) -> Result<(Ended, Option<String>)> {
        let is_first = self.tally.nothing_yet() && feed.unreadable().get().is_none();
        match error {
            FrameError::CutOff { .. } => Ok((Ended::CutOff, Some(error.to_string()))),
            FrameError::Read { .. } | FrameError::Memory { .. } => Ok((Ended::Damaged, Some(error.to_string()))),
            _ if is_first => Err(request(format!("{}: {error}", self.asked.source))),
            _ => Ok((Ended::Damaged, Some(error.to_string()))),
        }
    }

    /// Tells who watches, and who looks at the page.
    fn look_after(&mut self, feed: &Feed) {
        if let Some(view) = self.view.as_mut().filter(|_| self.tally.processed > 0) {
            view.offer(self.setup.processor.last(), &|| {
                serde_json::to_string(&self.tally.status(feed)).unwrap_or_default()
            });
        }
        if self.last_status.elapsed() >= BETWEEN_STATUS {
            self.last_status = Instant::now();
            self.watch.status(&self.tally.status(feed));
        }
    }

    fn finish(self, ended: Ended, ended_words: Option<String>, feed: &Feed) -> Result<LiveSummary> {
        self.watch.status(&self.tally.status(feed));
        let (path, map) = self.path();
        let tally = &self.tally;
        let mut summary = LiveSummary {
            source: self.asked.source.to_string(),
            survey: self.setup.survey,
            calibration: self.setup.calibration,
            clouds: self.asked.ply.as_ref().and_then(|target| target.file().cloned()),
            recording: self.asked.mcap.as_ref().and_then(|target| target.file().cloned()),
            frames: tally.processed,
            dropped: feed.dropped(),
            refused: tally.refused(feed),
            restarts: tally.restarts,
            points: tally.points,
            seconds: tally.seconds(),
            frames_per_second: per_second(tally.processed, tally.seconds()),
            latency: tally.latencies.summary(),
            flags: tally.flags(),
            temperatures_c: tally.temperatures_c,
            drift: tally.drift.clone(),
            path,
            ended,
            ended_words,
            doubts: Vec::new(),
        };
        summary.judge();
        // A reader that wanted nothing at all is no refusal.
        if summary.frames == 0 && ended != Ended::OutputClosed {
            let why = summary.doubts.first().map_or_else(|| "none came".to_owned(), ToString::to_string);
            let source = format!("{}: no frame was processed; {why}", summary.source).into();
            return Err(Error::Refused { summary: json(&summary)?, source, written: None });
        }
        self.outputs.commit()?;
        if let Some((file, map)) = map {
            write_map(&file, &map)?;
        }
        Ok(summary)
    }

    /// What became of the path, and the map with its file.
    fn path(&self) -> (Option<PathReport>, Option<(PathBuf, SurfaceMap)>) {
        let Some((asked, tracker)) = self.asked.tracking.as_ref().zip(self.setup.processor.tracker()) else {
            return (None, None);
        };
        let map = asked.map.clone().zip(tracker.surface_map());
        let report = PathReport {
            trajectory: asked.trajectory.as_ref().and_then(|target| target.file().cloned()),
            map: map.as_ref().map(|(file, map)| MapReport::of(map, file.clone())),
            ..self.tally.path.report(tracker, self.setup.datum.words())
        };
        (Some(report), map)
    }
}
