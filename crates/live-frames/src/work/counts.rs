//! From complex images to corrected points: whole intervals of one frequency are carried from frame to frame, those of several
//! are found by each pixel's own phases.

use range_image::ComplexFrame;

use crate::calibration::PreparedCalibration;
use crate::error::Result;
use crate::frame::ProcessedFrame;
use crate::stages::UnwrapStage;
use crate::work::one::One;
use crate::work::ranges::Rules;
use crate::work::several::Several;

/// What finds the counts, and what follows of them.
#[derive(Debug)]
pub(crate) enum Counts {
    One(Box<One>),
    Several(Several),
}

impl Counts {
    pub(crate) fn new(calibration: &PreparedCalibration, stage: &UnwrapStage) -> Result<Self> {
        let camera = calibration.live_camera();
        if camera.modulations.len() == 1 {
            return Ok(Self::One(Box::new(One::new(calibration, stage)?)));
        }
        Ok(Self::Several(Several::new(camera, stage)?))
    }

    /// Takes over what a new calibration says of the camera.
    pub(crate) fn set_calibration(&mut self, calibration: &PreparedCalibration, stage: &UnwrapStage) -> Result<()> {
        match self {
            Self::One(one) => Ok(one.unwrapper.set_options(calibration.spatial_options(stage.maximum_range_m))?),
            Self::Several(_) => Ok(()),
        }
    }

    /// Nothing is carried into the next frame.
    pub(crate) fn restart(&mut self) {
        if let Self::One(one) = self {
            one.unwrapper.restart();
        }
    }

    /// Takes a frame to corrected points.
    pub(crate) fn finish(
        &mut self,
        complex: &mut ComplexFrame,
        rules: &Rules<'_>,
        frame: &mut ProcessedFrame,
    ) -> Result<()> {
        match self {
            Self::One(one) => frame.counts = one.finish(complex, rules, frame)?,
            Self::Several(several) => several.finish(complex, rules, frame)?,
        }
        Ok(())
    }
}
