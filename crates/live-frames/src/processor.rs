//! The object that a camera's callback calls.

use range_image::{ComplexFrame, RawView, SampleSlice};
use range_io::calibration::Calibration;

use crate::calibration::PreparedCalibration;
use crate::camera::{Exposure, LiveCamera};
use crate::carried::CarrySummary;
use crate::error::{Error, Result};
use crate::frame::ProcessedFrame;
use crate::stages::{Limits, Stages};
use crate::work::complex::demodulated;
use crate::work::counts::Counts;
#[cfg(feature = "tracking")]
use crate::work::pose::Pose;
use crate::work::ranges::Rules;

/// Takes the frames of one camera from samples to corrected points, one call a frame.
///
/// All memory is its own and kept: a frame whose counts are carried allocates nothing, see the README for the others.
#[derive(Debug)]
pub struct Processor {
    camera: LiveCamera,
    stages: Stages,
    limits: Limits,
    calibration: PreparedCalibration,
    complex: ComplexFrame,
    counts: Counts,
    frame: ProcessedFrame,
    last_s: Option<f64>,
    processed: u64,
    #[cfg(feature = "tracking")]
    pose: Option<Pose>,
}

impl Processor {
    /// A processor for frames of a camera with its calibration.
    ///
    /// # Errors
    /// What [`PreparedCalibration::new`] refuses, and stages and limits outside their domains.
    pub fn new(camera: &LiveCamera, calibration: &Calibration, stages: Stages, limits: Limits) -> Result<Self> {
        let prepared = PreparedCalibration::new(camera, calibration, &stages)?;
        Self::with_prepared(prepared, stages, limits)
    }

    /// As [`Self::new`], with a calibration that was made ready before.
    pub fn with_prepared(calibration: PreparedCalibration, stages: Stages, limits: Limits) -> Result<Self> {
        limits.validate()?;
        stages.unwrap.validate()?;
        let camera = calibration.live_camera().clone();
        Ok(Self {
            complex: ComplexFrame::empty(),
            counts: Counts::new(&calibration, &stages.unwrap)?,
            frame: ProcessedFrame::new(camera.width, camera.height),
            last_s: None,
            processed: 0,
            #[cfg(feature = "tracking")]
            pose: stages.tracking.as_ref().map(|options| Pose::new(&calibration, options)).transpose()?,
            camera,
            stages,
            limits,
            calibration,
        })
    }

    /// The camera that frames come from.
    pub fn camera(&self) -> &LiveCamera {
        &self.camera
    }

    /// The stages.
    pub fn stages(&self) -> &Stages {
        &self.stages
    }

    /// The last frame, as it was returned.
    pub fn last(&self) -> &ProcessedFrame {
        &self.frame
    }

    /// Exchanges the calibration: the next frame has the new one. The old one comes back, so that it may be dropped elsewhere.
    ///
    /// Whole intervals and the pose go on as they were; where the camera's rays have changed, tracking begins a new map at
    /// the last pose.
    ///
    /// # Errors
    /// [`Error::OtherCamera`] for a calibration that was made ready for another camera; nothing has changed then.
    pub fn set_calibration(&mut self, calibration: PreparedCalibration) -> Result<PreparedCalibration> {
        if calibration.live_camera() != &self.camera {
            let words = |camera: &LiveCamera| {
                let (size, steps) = (format!("{} x {} pixels", camera.width, camera.height), camera.phase_steps);
                format!("{size}, {steps} steps at {:?}", camera.modulations)
            };
            let (found, expected) = (words(calibration.live_camera()), words(&self.camera));
            return Err(Error::OtherCamera { what: "camera", found, expected });
        }
        #[cfg(feature = "tracking")]
        if let Some(pose) = &mut self.pose
            && calibration.camera != self.calibration.camera
        {
            pose.begin_anew(&calibration)?;
        }
        self.counts.set_calibration(&calibration, &self.stages.unwrap)?;
        Ok(std::mem::replace(&mut self.calibration, calibration))
    }

    /// Forgets the frames before, as after a cut: times may begin anew. The camera is then sought in the map.
    pub fn restart(&mut self) {
        self.last_s = None;
        self.counts.restart();
        #[cfg(feature = "tracking")]
        if let Some(pose) = &mut self.pose {
            pose.cut();
        }
    }

    /// Says where the camera is at the first frame that tracking starts with: the datum. Nothing changes once it has started, or
    /// where no pose is sought.
    ///
    /// # Errors
    /// [`Error::Tracking`] for a pose that is not finite.
    #[cfg(feature = "tracking")]
    pub fn place_first(&mut self, world_from_first: tracking::nalgebra::Isometry3<f64>) -> Result<()> {
        match &mut self.pose {
            Some(pose) => pose.place_first(&self.calibration, world_from_first),
            None => Ok(()),
        }
    }

    /// Keeps what the camera sees in this map; see [`tracking::Tracker::keep_map`]. Nothing where no pose is sought.
    #[cfg(feature = "tracking")]
    pub fn keep_map(&mut self, map: tracking::SurfaceMap) {
        if let Some(pose) = &mut self.pose {
            pose.keep_map(map);
        }
    }

    /// The tracker, with its keyframes and map; `None` where no pose is sought.
    #[cfg(feature = "tracking")]
    pub fn tracker(&self) -> Option<&tracking::Tracker> {
        self.pose.as_ref().map(Pose::tracker)
    }

    /// Takes a frame from its samples, `[F, N, H, W]`, to corrected points; a time stamp in seconds will do for `exposure`
    /// where the calibration asks for nothing else.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::Time`], [`Error::Missing`], [`Error::Exposure`], [`Error::Unstated`], and a drift outside of what
    /// it was fitted in ([`Error::Models`]): the frame is refused as a whole, and the next one may be given. What is wrong
    /// with single pixels is flagged.
    pub fn process<'a>(
        &mut self,
        samples: impl Into<SampleSlice<'a>>,
        exposure: impl Into<Exposure>,
    ) -> Result<&ProcessedFrame> {
        let (samples, exposure) = (samples.into(), exposure.into());
        // To the threads that work once a frame: each loop by itself would be waited for, and find its planes at another processor.
        rayon::scope(|_| self.take(samples, &exposure))?;
        Ok(&self.frame)
    }

    fn take(&mut self, samples: SampleSlice<'_>, exposure: &Exposure) -> Result<()> {
        self.check(&samples, exposure)?;
        let drift_m = self.calibration.drift_m(exposure)?;
        let ready = self.calibration.ready(exposure, drift_m)?;
        let LiveCamera { width, height, phase_steps, ref modulations, .. } = self.camera;
        let raw = RawView::new(width, height, phase_steps, modulations, samples)?;
        if self.last_s.is_some_and(|before_s| exposure.timestamp_s - before_s > self.limits.longest_gap_s) {
            self.counts.restart();
        }
        demodulated(&raw, &mut self.calibration, self.limits.most_missing, &mut self.complex)?;
        let calibration = &self.calibration;
        let rules = Rules {
            rays: &calibration.rays,
            restorer: calibration.scattering.as_ref().map(|scattering| &scattering.restorer),
            corrections: ready.map(|index| calibration.corrections(index)),
            span: calibration.span,
            all_outside: calibration.too_warm_or_cold(exposure),
            minimum_confidence: self.stages.unwrap.minimum_confidence,
            width,
        };
        self.counts.finish(&mut self.complex, &rules, &mut self.frame)?;
        self.frame.number = self.processed;
        self.processed += 1;
        self.frame.timestamp_s = exposure.timestamp_s;
        self.frame.drift_m = drift_m;
        self.last_s = Some(exposure.timestamp_s);
        #[cfg(feature = "tracking")]
        if let Some(pose) = &mut self.pose {
            self.frame.pose = None;
            self.frame.pose = Some(pose.track(exposure.timestamp_s, &self.frame)?);
        }
        Ok(())
    }

    fn check(&self, samples: &SampleSlice<'_>, exposure: &Exposure) -> Result<()> {
        let (found, expected) = (samples.len(), self.camera.samples());
        if found != expected {
            let LiveCamera { width, height, phase_steps: steps, ref modulations, .. } = self.camera;
            let frequencies = modulations.len();
            return Err(Error::Size { found, expected, width, height, frequencies, steps });
        }
        let (timestamp_s, before_s) = (exposure.timestamp_s, self.last_s.unwrap_or(f64::NEG_INFINITY));
        if !timestamp_s.is_finite() || timestamp_s <= before_s {
            return Err(Error::Time { timestamp_s, before_s });
        }
        Ok(())
    }

    /// Where the counts of the last frame came from.
    pub fn counts(&self) -> &CarrySummary {
        &self.frame.counts
    }
}
