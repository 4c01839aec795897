use crate::carried::CarrySummary;
use range_image::{Flags, Raster};

/// What became of a frame; lent by the processor until the next one comes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProcessedFrame {
    /// Time stamp, second.
    pub timestamp_s: f64,
    /// Number of the frame among those processed, from 0.
    pub number: u64,
    /// Corrected ranges from the perspective centre, metre; NaN where there is no value.
    pub range: Raster<f32>,
    /// Points in the camera's frame (x right, y up, looking along -z), metre, pixel by pixel; NaN where there is none. Single precision:
    /// a micrometre at 8 m.
    pub points: Vec<[f32; 3]>,
    /// Standard deviations of the ranges by noise, metre; NaN where they are not known.
    pub sigma: Raster<f32>,
    /// Reasons to distrust a pixel.
    pub flags: Raster<Flags>,
    /// Amplitudes of the first frequency in the samples' unit, scattered light taken off.
    pub amplitude: Raster<f32>,
    /// Where the whole ambiguity intervals came from; nothing for several frequencies.
    pub counts: CarrySummary,
    /// Drift that was taken off, metre.
    pub drift_m: f64,
    /// Pose, where tracking is on. It holds only where its state [has one](tracking::TrackingState::has_pose): what stands in a
    /// lost frame is a guess.
    #[cfg(feature = "tracking")]
    pub pose: Option<tracking::TrackedPose>,
}

impl ProcessedFrame {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let plane = Raster::filled(width, height, f32::NAN);
        Self {
            range: plane.clone(),
            sigma: plane.clone(),
            amplitude: plane,
            flags: Raster::filled(width, height, Flags::NO_DATA),
            points: vec![[f32::NAN; 3]; width * height],
            ..Self::default()
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.range.width()
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.range.height()
    }
}
