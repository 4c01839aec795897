//! The frame at its levels: raw samples, complex images, ranges.

use crate::{ComplexChannel, Error, Flags, Modulation, Raster, Result};

/// Raw correlation samples as the sensor delivers them, one contiguous block in `[F, N, H, W]` order.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Floating point (also signed differences of two taps).
    F32(Vec<f32>),
    /// Unsigned counts.
    U16(Vec<u16>),
    /// Signed differences of two taps.
    I16(Vec<i16>),
}

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::I16(values) => values.len(),
        }
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Raw correlation samples in a buffer of somebody else, in `[F, N, H, W]` order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SampleSlice<'a> {
    /// Floating point (also signed differences of two taps).
    F32(&'a [f32]),
    /// Unsigned counts.
    U16(&'a [u16]),
    /// Signed differences of two taps.
    I16(&'a [i16]),
}

impl SampleSlice<'_> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U16(values) => values.len(),
            Self::I16(values) => values.len(),
        }
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a> From<&'a Samples> for SampleSlice<'a> {
    fn from(samples: &'a Samples) -> Self {
        match samples {
            Samples::F32(values) => Self::F32(values),
            Samples::U16(values) => Self::U16(values),
            Samples::I16(values) => Self::I16(values),
        }
    }
}

impl<'a> From<&'a [f32]> for SampleSlice<'a> {
    fn from(values: &'a [f32]) -> Self {
        Self::F32(values)
    }
}

impl<'a> From<&'a [u16]> for SampleSlice<'a> {
    fn from(values: &'a [u16]) -> Self {
        Self::U16(values)
    }
}

impl<'a> From<&'a [i16]> for SampleSlice<'a> {
    fn from(values: &'a [i16]) -> Self {
        Self::I16(values)
    }
}

/// One frame at level `samples` that is borrowed: what a driver hands over without giving it away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawView<'a> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) phase_steps: usize,
    pub(crate) modulations: &'a [Modulation],
    pub(crate) samples: SampleSlice<'a>,
}

impl<'a> RawView<'a> {
    /// Samples in `[F, N, H, W]` order, `F` being the number of `modulations`; refuses what [`RawFrame::new`] refuses.
    pub fn new(
        width: usize,
        height: usize,
        phase_steps: usize,
        modulations: &'a [Modulation],
        samples: SampleSlice<'a>,
    ) -> Result<Self> {
        if phase_steps < 3 {
            return Err(Error::OutOfDomain {
                name: "phase_steps",
                value: phase_steps as f64,
                expected: "offset, amplitude and phase need at least 3 phase steps",
            });
        }
        if modulations.is_empty() {
            return Err(Error::OutOfDomain {
                name: "modulations",
                value: 0.0,
                expected: "a raw frame has at least one modulation frequency",
            });
        }
        let planes = modulations.len() * phase_steps;
        let expected = width.saturating_mul(height).saturating_mul(planes);
        if samples.len() != expected {
            let height = height.saturating_mul(planes);
            return Err(Error::RasterLength { width, height, expected, found: samples.len() });
        }
        Ok(Self { width, height, phase_steps, modulations, samples })
    }
}

/// One frame at level `samples`: F frequencies with N phase steps `theta_n = 2 pi n / N` each.
#[derive(Debug, Clone, PartialEq)]
pub struct RawFrame {
    width: usize,
    height: usize,
    phase_steps: usize,
    modulations: Vec<Modulation>,
    samples: Samples,
}

impl RawFrame {
    /// Takes samples in `[F, N, H, W]` order, `F` being the number of `modulations`.
    pub fn new(
        width: usize,
        height: usize,
        phase_steps: usize,
        modulations: Vec<Modulation>,
        samples: Samples,
    ) -> Result<Self> {
        RawView::new(width, height, phase_steps, &modulations, (&samples).into())?;
        Ok(Self { width, height, phase_steps, modulations, samples })
    }

    /// The frame as something borrowed.
    pub fn view(&self) -> RawView<'_> {
        let Self { width, height, phase_steps, modulations, samples } = self;
        RawView { width: *width, height: *height, phase_steps: *phase_steps, modulations, samples: samples.into() }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Number N of equidistant phase steps.
    pub fn phase_steps(&self) -> usize {
        self.phase_steps
    }

    /// The modulation of each of the F frequencies.
    pub fn modulations(&self) -> &[Modulation] {
        &self.modulations
    }

    /// All samples in `[F, N, H, W]` order.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }
}

/// One frame at level `phase`: complex images of all frequencies and one flag plane.
#[derive(Debug, Clone, PartialEq)]
pub struct ComplexFrame {
    /// One channel a frequency, all of one size.
    pub channels: Vec<ComplexChannel>,
    /// Reasons to distrust a pixel.
    pub flags: Raster<Flags>,
}

impl ComplexFrame {
    /// A frame without channels and pixels, to be filled by [`Demodulator::demodulate_into`](crate::Demodulator).
    pub fn empty() -> Self {
        Self { channels: Vec::new(), flags: Raster::default() }
    }

    /// Gives the frame the size and the modulations of `raw`, with an offset or without, keeping the planes that fit.
    pub(crate) fn reshape(&mut self, raw: &RawView<'_>, offset: bool) {
        let (width, height) = (raw.width, raw.height);
        if (self.width(), self.height()) != (width, height) {
            self.flags = Raster::filled(width, height, Flags::empty());
        }
        self.channels.truncate(raw.modulations.len());
        for (index, &modulation) in raw.modulations.iter().enumerate() {
            match self.channels.get_mut(index) {
                None => self.channels.push(ComplexChannel::without_data(modulation, [width, height], offset)),
                Some(channel) => channel.reshape(modulation, [width, height], offset),
            }
        }
    }

    /// Fails unless all planes of all channels have the size of the flag plane.
    pub fn validate(&self) -> Result<()> {
        for channel in &self.channels {
            self.flags.require_same_size(&channel.real, "real part")?;
            channel.validate()?;
        }
        Ok(())
    }

    /// Decides [`Flags::LOW_AMPLITUDE`] anew: where the amplitude at any frequency is below `limit`.
    ///
    /// The phase of a pixel errs by sigma over amplitude. In a mean of n frames sigma is `√n` times smaller, so that the
    /// phase is as good as that of a single frame of amplitude a where the mean has `a / √n`.
    pub fn flag_low_amplitude(&mut self, limit: f64) {
        let square = (limit * limit) as f32;
        for flags in self.flags.as_mut_slice() {
            flags.remove(Flags::LOW_AMPLITUDE);
        }
        for channel in &self.channels {
            let parts = channel.real.as_slice().iter().zip(channel.imaginary.as_slice());
            for (flags, (re, im)) in self.flags.as_mut_slice().iter_mut().zip(parts) {
                if re * re + im * im < square {
                    flags.insert(Flags::LOW_AMPLITUDE);
                }
            }
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.flags.width()
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.flags.height()
    }
}

/// One frame at level `range`: radial ranges with sigma, amplitude and flags.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeFrame {
    /// Euclidean distance from the perspective centre in metres; NaN where there is no value.
    pub range: Raster<f32>,
    /// Standard deviation of the range in metres; NaN where it is not known.
    pub sigma: Raster<f32>,
    /// Amplitude in the camera's unit; NaN where the camera gives none.
    pub amplitude: Raster<f32>,
    /// Reasons to distrust a pixel.
    pub flags: Raster<Flags>,
}

impl RangeFrame {
    /// Ranges alone, metre: sigma and amplitude are NaN, nothing is flagged.
    ///
    /// ```
    /// use range_image::{RangeFrame, Raster};
    ///
    /// let bare = RangeFrame::from_range(Raster::filled(176, 144, 3.0));
    /// let frame = RangeFrame { sigma: Raster::filled(176, 144, 0.005), ..bare };
    /// assert!(frame.validate().is_ok() && frame.amplitude[(0, 0)].is_nan());
    /// ```
    pub fn from_range(range: Raster<f32>) -> Self {
        let (width, height) = (range.width(), range.height());
        let unknown = Raster::filled(width, height, f32::NAN);
        Self { range, sigma: unknown.clone(), amplitude: unknown, flags: Raster::filled(width, height, Flags::empty()) }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.range.width()
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.range.height()
    }

    /// Fails unless all planes have the size of the range plane.
    pub fn validate(&self) -> Result<()> {
        self.range.require_same_size(&self.sigma, "sigma")?;
        self.range.require_same_size(&self.amplitude, "amplitude")?;
        self.range.require_same_size(&self.flags, "flags")
    }
}
