//! The measurements of one pixel at all frequencies, with the frequency response taken off.

use range_image::{ComplexFrame, Flags, Modulation};

use crate::error::require_not_negative;
use crate::{Error, FrequencyResponse, Result};

/// Most frequencies that one frame may have: a pixel's measurements live in arrays of this length.
pub const MAXIMUM_FREQUENCIES: usize = 8;

/// What calibration leaves over and noise does not contain, taken as further, independent errors of each frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct Systematics {
    /// Standard deviation of what is left of the range errors of one frequency, metre.
    pub floor_m: f64,
    /// Relative standard deviation of the contrast at one frequency.
    pub floor_contrast: f64,
}

impl Default for Systematics {
    /// 2 mm and 1 %, as after a calibration.
    fn default() -> Self {
        Self { floor_m: 0.002, floor_contrast: 0.01 }
    }
}

impl Systematics {
    /// Noise alone.
    pub const NONE: Self = Self { floor_m: 0.0, floor_contrast: 0.0 };

    /// Refuses what is negative or not finite.
    pub fn validate(&self) -> Result<()> {
        require_not_negative("floor_m", self.floor_m)?;
        require_not_negative("floor_contrast", self.floor_contrast)
    }
}

/// One frequency of one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Term {
    /// Phase of one metre of range, radian.
    pub wavenumber: f64,
    /// Real part over the contrast.
    pub re: f64,
    /// Imaginary part over the contrast.
    pub im: f64,
    /// Inverse variance of either part, with the systematic errors.
    pub weight: f64,
}

impl Term {
    /// Square of the amplitude over the contrast.
    pub fn square(&self) -> f64 {
        self.re * self.re + self.im * self.im
    }
}

/// All usable frequencies of one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pixel {
    terms: [Term; MAXIMUM_FREQUENCIES],
    count: usize,
}

impl Pixel {
    pub fn terms(&self) -> &[Term] {
        &self.terms[..self.count]
    }

    /// Adds a frequency; those beyond the most allowed are refused before any pixel is loaded.
    pub fn push(&mut self, term: Term) {
        if let Some(place) = self.terms.get_mut(self.count) {
            *place = term;
            self.count += 1;
        }
    }
}

/// What the pixels of a frame have in common.
#[derive(Debug, Clone)]
pub(crate) struct System {
    modulations: Vec<Modulation>,
    wavenumber: Vec<f64>,
    contrast: Vec<f64>,
    systematics: Systematics,
}

impl System {
    /// Refuses fewer than `least` frequencies, equal ones, and a response that does not fit them.
    pub fn new(
        modulations: &[Modulation],
        response: &FrequencyResponse,
        systematics: &Systematics,
        least: usize,
    ) -> Result<Self> {
        let found = modulations.len();
        if !(least..=MAXIMUM_FREQUENCIES).contains(&found) {
            return Err(Error::FrequencyCount { found, least, most: MAXIMUM_FREQUENCIES });
        }
        systematics.validate()?;
        response.validate(found)?;
        let wavenumber: Vec<f64> = modulations.iter().map(|modulation| modulation.phase_from_range(1.0)).collect();
        for (second, wave) in wavenumber.iter().enumerate() {
            let same = |other: &f64| (other / wave - 1.0).abs() < 1e-6;
            if let Some(first) = wavenumber[..second].iter().position(same) {
                let frequency_hz = modulations[second].frequency_hz();
                return Err(Error::RepeatedFrequency { first, second, frequency_hz });
            }
        }
        let contrast = response.contrast.clone();
        Ok(Self { modulations: modulations.to_vec(), wavenumber, contrast, systematics: *systematics })
    }

    pub fn wavenumbers(&self) -> &[f64] {
        &self.wavenumber
    }

    /// Fails unless the frame is whole, not empty, and modulated as the system is.
    pub fn require_frame(&self, frame: &ComplexFrame) -> Result<()> {
        frame.validate()?;
        if frame.flags.is_empty() {
            return Err(Error::TooSmall { width: frame.width(), height: frame.height(), least: 1 });
        }
        let (found, expected) = (frame.channels.len(), self.modulations.len());
        if found != expected {
            return Err(Error::Count { what: "channels of the frame", found, expected });
        }
        for (channel, (expected, found)) in self.modulations.iter().zip(&frame.channels).enumerate() {
            let (expected_hz, found_hz) = (expected.frequency_hz(), found.modulation.frequency_hz());
            if *expected != found.modulation {
                return Err(Error::OtherFrequency { channel, expected_hz, found_hz });
            }
        }
        Ok(())
    }

    /// Fails where a channel has values and sigma in none of its pixels.
    pub fn require_sigma(frame: &ComplexFrame) -> Result<()> {
        let known = |plane: &range_image::Raster<f32>| plane.as_slice().iter().any(|value| value.is_finite());
        match frame.channels.iter().position(|channel| !known(&channel.sigma) && known(&channel.real)) {
            Some(channel) => Err(Error::SigmaUnknown { channel }),
            None => Ok(()),
        }
    }

    /// The frequencies of a pixel at which value and sigma are known and the amplitude is at least `least_snr` sigma.
    pub fn load(&self, frame: &ComplexFrame, index: usize, least_snr: f64) -> Pixel {
        let mut pixel = Pixel::default();
        for ((channel, wavenumber), contrast) in frame.channels.iter().zip(&self.wavenumber).zip(&self.contrast) {
            let at = |plane: &range_image::Raster<f32>| f64::from(plane.as_slice()[index]) / contrast;
            let (re, im, sigma) = (at(&channel.real), at(&channel.imaginary), at(&channel.sigma));
            if let Some(term) = self.term(*wavenumber, [re, im], sigma)
                && term.square() > (least_snr * sigma).powi(2)
            {
                pixel.push(term);
            }
        }
        pixel
    }

    /// A frequency with its weight; `None` where that is not known, as where there is neither noise nor a floor.
    fn term(&self, wavenumber: f64, [re, im]: [f64; 2], sigma: f64) -> Option<Term> {
        let floor = (self.systematics.floor_m * wavenumber).max(self.systematics.floor_contrast);
        let variance = sigma * sigma + floor * floor * (re * re + im * im);
        let weight = 1.0 / variance;
        let usable = re.is_finite() && im.is_finite() && sigma >= 0.0 && variance > 0.0 && weight.is_normal();
        usable.then_some(Term { wavenumber, re, im, weight })
    }
}

/// Reasons for which the value of a pixel says nothing of the paths of its light.
pub(crate) const USELESS: Flags = Flags::NO_DATA.union(Flags::SATURATED).union(Flags::MOTION);
