//! What the point spread function is estimated from.

use range_image::{ComplexFrame, RangeFrame, Raster};

use crate::{Error, Result};

/// The same scene at rest, once with a bright object in the foreground and once without it.
///
/// Both frames are averages of as many exposures as there is time for, of the same frequencies and the same integration
/// time. Several captures, with the object at other distances and other places of the image, may be given at once.
#[derive(Debug, Clone, Copy)]
pub struct ForegroundCapture<'a> {
    /// The scene with the object.
    pub with_object: &'a ComplexFrame,
    /// The scene without it.
    pub without_object: &'a ComplexFrame,
    /// True where the object is, or its shadow, or anything else that moved. Without it, the object is found by
    /// [`crate::object_mask`].
    pub object: Option<&'a Raster<bool>>,
}

/// A single view of a bright near surface and a far one, whose true phase is known.
///
/// The amplitude of the far surface need not be known: only the part of the observed light that is perpendicular to the
/// true phasor is taken, which is scattered light alone.
#[derive(Debug, Clone, Copy)]
pub struct TwoPlaneCapture<'a> {
    /// The scene as observed.
    pub observed: &'a ComplexFrame,
    /// For each frequency the true phase of the far surface in radians; NaN on the near surface, at its edges, and
    /// wherever else the true phase is not known.
    pub true_phase: &'a [Raster<f32>],
}

/// Any capture that tells of scattering.
#[derive(Debug, Clone, Copy)]
pub enum Capture<'a> {
    /// With and without an object.
    Foreground(ForegroundCapture<'a>),
    /// Two surfaces in one view.
    TwoPlane(TwoPlaneCapture<'a>),
}

impl<'a> From<ForegroundCapture<'a>> for Capture<'a> {
    fn from(capture: ForegroundCapture<'a>) -> Self {
        Self::Foreground(capture)
    }
}

impl<'a> From<TwoPlaneCapture<'a>> for Capture<'a> {
    fn from(capture: TwoPlaneCapture<'a>) -> Self {
        Self::TwoPlane(capture)
    }
}

/// A frame with the object and one without it.
impl<'a> From<(&'a ComplexFrame, &'a ComplexFrame)> for Capture<'a> {
    fn from((with_object, without_object): (&'a ComplexFrame, &'a ComplexFrame)) -> Self {
        Self::Foreground(ForegroundCapture { with_object, without_object, object: None })
    }
}

/// The true phases of a [`TwoPlaneCapture`], one raster for each frequency of `observed`, from true ranges in metres
/// (NaN where they are not known), such as a plane that was fitted to a region without scattering or measured otherwise.
pub fn true_phases(observed: &ComplexFrame, truth: &RangeFrame) -> Result<Vec<Raster<f32>>> {
    observed.flags.require_same_size(&truth.range, "true ranges")?;
    let phases = |modulation: range_image::Modulation| {
        truth.range.map(|&range| modulation.phase_from_range(f64::from(range)) as f32)
    };
    Ok(observed.channels.iter().map(|channel| phases(channel.modulation)).collect())
}

impl Capture<'_> {
    /// Columns and rows, after all planes were found to agree.
    pub(in crate::estimate) fn checked_size(&self) -> Result<[usize; 2]> {
        let frame = match self {
            Self::Foreground(capture) => {
                capture.check()?;
                capture.with_object
            }
            Self::TwoPlane(capture) => {
                capture.check()?;
                capture.observed
            }
        };
        Ok([frame.width(), frame.height()])
    }
}

impl ForegroundCapture<'_> {
    fn check(&self) -> Result<()> {
        self.with_object.validate()?;
        self.without_object.validate()?;
        self.with_object.flags.require_same_size(&self.without_object.flags, "the frame without the object")?;
        if let Some(object) = self.object {
            self.with_object.flags.require_same_size(object, "the mask of the object")?;
        }
        let frequencies = |frame: &ComplexFrame| -> Vec<u64> {
            frame.channels.iter().map(|channel| channel.modulation.frequency_hz().to_bits()).collect()
        };
        if frequencies(self.with_object) != frequencies(self.without_object) {
            let reason = "the frames with and without the object were not taken at the same frequencies";
            return Err(Error::Capture { reason: reason.to_owned() });
        }
        require_channels(self.with_object)
    }
}

impl TwoPlaneCapture<'_> {
    fn check(&self) -> Result<()> {
        self.observed.validate()?;
        for phase in self.true_phase {
            self.observed.flags.require_same_size(phase, "true phase")?;
        }
        let (expected, found) = (self.observed.channels.len(), self.true_phase.len());
        if found != expected {
            let reason = format!("{found} true phases were given for {expected} frequencies");
            return Err(Error::Capture { reason });
        }
        require_channels(self.observed)
    }
}

fn require_channels(frame: &ComplexFrame) -> Result<()> {
    if !frame.channels.is_empty() && !frame.flags.is_empty() {
        return Ok(());
    }
    Err(Error::Capture { reason: "a frame has no frequency or no pixel".to_owned() })
}
