//! What multipath does to the ranges of a scene, estimated from the scene itself.

use range_image::{Flags, Modulation, RangeFrame, Raster};
use rayon::prelude::*;

use crate::error::{require_not_negative, require_positive, require_probability};
use crate::numbers::vector::dot;
use crate::scene::bending::{Bending, bending};
use crate::scene::patches::{Facet, PatchSize, Patches, Square, Surfaces, solid_angles};
use crate::scene::radiosity::{Bounced, Radiosity};
use crate::{Error, Result};

/// How amplitudes become albedos.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum AlbedoScale {
    /// The brightest tenth of the scene, in terms of albedo, begins with this albedo.
    BrightestTenth(f64),
    /// Amplitude of a white surface that faces the camera at one metre, in the camera's unit.
    WhiteAtOneMetre(f64),
    /// The same albedo everywhere, whatever the amplitudes are.
    Uniform(f64),
}

/// What it takes to flag a predicted error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum RiskEvidence {
    /// The prediction itself: what light that bounced does to ranges that nothing was taken off.
    #[default]
    Prediction,
    /// Walls that are bent as predicted, see [`Bending`]. What they show of the prediction counts; where they show nothing,
    /// nothing is flagged.
    Bending {
        /// Probability that a scene whose walls are not bent counts as bent.
        false_alarm: f64,
    },
}

/// How the risk is estimated and when it is flagged.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct RiskOptions {
    /// Modulation frequency, hertz; `None`, the default, gives the limit of low frequencies, where ranges add by their
    /// amplitudes.
    pub modulation_hz: Option<f64>,
    /// How amplitudes become albedos. Default: `BrightestTenth(0.7)`.
    pub albedo: AlbedoScale,
    /// Side of the largest flat patches, pixels: a power of two times `cell_px`. Default: 16 pixels.
    pub patch_px: usize,
    /// Side of the cells that the risk is computed for, and of the smallest patches, pixels. Default: 4 pixels.
    pub cell_px: usize,
    /// Root mean square distance from a plane, beyond noise, up to which a patch is flat, metre. Default: 0.01 m.
    pub flatness_m: f64,
    /// The risk is flagged above this many standard deviations of the range and above `floor_m`. Default: 1.
    pub sigmas: f64,
    /// Smallest error that is flagged, metre. Default: 0.005 m.
    pub floor_m: f64,
    /// What it takes to flag anything. Default: [`RiskEvidence::Prediction`].
    pub evidence: RiskEvidence,
}

impl Default for RiskOptions {
    /// Low frequency; walls of albedo 0.7; patches of 16 and cells of 4 pixels, flat to 1 cm; flags from 5 mm and one
    /// standard deviation. The work grows with the square of the number of pixels: see [`Self::for_width`].
    fn default() -> Self {
        Self {
            modulation_hz: None,
            albedo: AlbedoScale::BrightestTenth(0.7),
            patch_px: 16,
            cell_px: 4,
            flatness_m: 0.01,
            sigmas: 1.0,
            floor_m: 0.005,
            evidence: RiskEvidence::Prediction,
        }
    }
}

impl RiskOptions {
    /// The default with cells of a 32nd to a 64th of the width, and patches of four cells: as much work for any frame.
    pub fn for_width(width: usize) -> Self {
        let cell_px = (width / 32).max(2);
        let cell_px = if cell_px.is_power_of_two() { cell_px } else { cell_px.next_power_of_two() / 2 };
        Self { patch_px: 4 * cell_px, cell_px, ..Self::default() }
    }

    fn validate(&self) -> Result<()> {
        let albedo = match self.albedo {
            AlbedoScale::BrightestTenth(value) => ("BrightestTenth", value),
            AlbedoScale::WhiteAtOneMetre(value) => ("WhiteAtOneMetre", value),
            AlbedoScale::Uniform(value) => ("Uniform", value),
        };
        require_positive(albedo.0, albedo.1)?;
        require_positive("flatness_m", self.flatness_m)?;
        require_not_negative("sigmas", self.sigmas)?;
        require_not_negative("floor_m", self.floor_m)?;
        if let RiskEvidence::Bending { false_alarm } = self.evidence {
            require_probability("false_alarm", false_alarm)?;
        }
        let (patch, cell) = (self.patch_px, self.cell_px);
        if cell < 2 {
            return Err(Error::OutOfDomain { name: "cell_px", value: cell as f64, expected: "at least 2 pixels" });
        }
        if !patch.is_multiple_of(cell) || !(patch / cell).is_power_of_two() {
            let expected = "a power of two times cell_px";
            return Err(Error::OutOfDomain { name: "patch_px", value: patch as f64, expected });
        }
        Ok(())
    }
}

/// The risk of each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Risk {
    /// Expected error of the range by light that bounced once, metre: positive where ranges are too long; NaN where the
    /// pixel is part of no flat patch.
    pub risk_m: Raster<f32>,
    /// Amplitude of that light relative to the direct light; NaN as above.
    pub ratio: Raster<f32>,
    /// Pixels with a risk.
    pub assessed: usize,
    /// Pixels whose risk was flagged.
    pub flagged: usize,
    /// Flat patches that the scene was cut into.
    pub patches: usize,
    /// How the shape of the walls agrees with the predicted errors.
    pub bending: Bending,
}

/// Estimates for each pixel how far light that bounced once shifts its range, and sets [`Flags::MULTIPATH`] where that is
/// more than the options allow. Ranges stay as they are.
///
/// Needs one frequency or none at all: only ranges, amplitudes and the viewing directions. The scene in view is cut into
/// flat, diffuse patches, whose albedo follows from the amplitude; each sends the light of the source, which stands at
/// the perspective centre, on to all others that it faces. At each cell, the amplitudes add as complex numbers with half
/// the length of their way as range (Sect. 4.9).
///
/// - `directions`: unit viewing directions in the camera's frame, row by row; NaN where a pixel has none.
/// - A **room corner** shows a positive risk towards the corner, and so does the front of a box above a table. A dark
///   surface beside a bright one suffers most: its direct light is weak, the light that arrives is not.
///
/// Not in the estimate: light by way of surfaces that the camera does not see, light that bounces more than once (of
/// albedo 0.7, some further fifth), mirrors and gloss, and what stands between two patches.
pub fn assess_risk(frame: &mut RangeFrame, directions: &[[f64; 3]], options: &RiskOptions) -> Result<Risk> {
    frame.validate()?;
    options.validate()?;
    require_directions(frame, directions)?;
    let (width, height) = (frame.width(), frame.height());
    let size = PatchSize { patch_px: options.patch_px, cell_px: options.cell_px, flatness_m: options.flatness_m };
    let angles = solid_angles(directions, width, height);
    let surfaces = Surfaces::new(frame, directions, &angles);
    let patches = surfaces.patches(&size);
    let bounced = bounced(&patches, options)?;
    let nothing = Raster::filled(width, height, f32::NAN);
    let mut risk = Risk {
        risk_m: nothing.clone(),
        ratio: nothing,
        assessed: 0,
        flagged: 0,
        patches: patches.patches.len(),
        bending: Bending::UNKNOWN,
    };
    for ((_, square), bounced) in patches.cells.iter().zip(&bounced) {
        fill(&surfaces, *square, bounced, &mut risk);
    }
    risk.bending = bending(&surfaces, &patches, directions, &risk.risk_m);
    flag(frame, options, &mut risk);
    Ok(risk)
}

/// What each cell receives.
fn bounced(patches: &Patches, options: &RiskOptions) -> Result<Vec<Bounced>> {
    let modulation = options.modulation_hz.map(Modulation::new).transpose()?;
    let wavenumber = modulation.map_or(0.0, |modulation| modulation.phase_from_range(1.0));
    let white = white_at_one_metre(patches, &options.albedo);
    let radiosity = |facet: &Facet| {
        let albedo = match options.albedo {
            AlbedoScale::Uniform(albedo) => albedo,
            _ => facet.amplitude / (facet.irradiance() * white),
        };
        // Foil sends its light back to the source; to all else it is white at most. What has no amplitude sends nothing.
        if albedo.is_finite() { albedo.min(1.0) * facet.irradiance() } else { 0.0 }
    };
    let radiosity = Radiosity::new(patches, wavenumber, radiosity);
    Ok(patches.cells.par_iter().map(|(facet, _)| radiosity.bounced_to(facet)).collect())
}

/// Amplitude of a white surface that faces the camera at one metre.
fn white_at_one_metre(patches: &Patches, scale: &AlbedoScale) -> f64 {
    let albedo = match *scale {
        AlbedoScale::WhiteAtOneMetre(amplitude) => return amplitude,
        AlbedoScale::Uniform(_) => return 1.0,
        AlbedoScale::BrightestTenth(albedo) => albedo,
    };
    let cells = patches.cells.iter().map(|(facet, _)| facet.amplitude / facet.irradiance());
    let mut relative: Vec<f64> = cells.filter(|value| value.is_finite()).collect();
    if relative.is_empty() {
        return f64::NAN;
    }
    let tenth = relative.len() * 9 / 10;
    *relative.select_nth_unstable_by(tenth, f64::total_cmp).1 / albedo
}

fn fill(surfaces: &Surfaces, square: Square, bounced: &Bounced, risk: &mut Risk) {
    for (index, _) in surfaces.pixels(square) {
        risk.risk_m.as_mut_slice()[index] = bounced.error_m as f32;
        risk.ratio.as_mut_slice()[index] = bounced.ratio as f32;
        risk.assessed += 1;
    }
}

fn flag(frame: &mut RangeFrame, options: &RiskOptions, risk: &mut Risk) {
    let part = match options.evidence {
        RiskEvidence::Prediction => 1.0,
        RiskEvidence::Bending { false_alarm } => risk.bending.sure_part(false_alarm) as f32,
    };
    let pixels = frame.flags.as_mut_slice().iter_mut().zip(frame.sigma.as_slice()).zip(risk.risk_m.as_slice());
    for ((flags, sigma), error) in pixels {
        // `max` leaves a sigma that is not known out.
        let threshold = (options.sigmas as f32 * sigma).max(options.floor_m as f32);
        if part * error.abs() > threshold {
            *flags |= Flags::MULTIPATH;
            risk.flagged += 1;
        }
    }
}

/// Fails unless there is a unit vector, or NaN, for each of enough pixels.
fn require_directions(frame: &RangeFrame, directions: &[[f64; 3]]) -> Result<()> {
    let (width, height) = (frame.width(), frame.height());
    if width < 3 || height < 3 {
        return Err(Error::TooSmall { width, height, least: 3 });
    }
    let (found, expected) = (directions.len(), width * height);
    if found != expected {
        return Err(Error::Count { what: "viewing directions", found, expected });
    }
    for (index, direction) in directions.iter().enumerate() {
        let length = dot(direction, direction).sqrt();
        if (length - 1.0).abs() > 1e-3 {
            return Err(Error::NotUnit { index, length });
        }
    }
    Ok(())
}

/// Ranges from depths (camera looks along -z), for [`assess_risk`] at level depth: `range = depth / -u_z`.
///
/// NaN where the depth is, or where the direction does not point forward.
pub fn ranges_from_depths(depth_m: &Raster<f32>, directions: &[[f64; 3]]) -> Result<Raster<f32>> {
    let (found, expected) = (directions.len(), depth_m.len());
    if found != expected {
        return Err(Error::Count { what: "viewing directions", found, expected });
    }
    let range = |(depth, direction): (&f32, &[f64; 3])| {
        let forward = -direction[2];
        if forward > 0.0 { (f64::from(*depth) / forward) as f32 } else { f32::NAN }
    };
    let ranges = depth_m.as_slice().iter().zip(directions).map(range).collect();
    Ok(Raster::from_vec(depth_m.width(), depth_m.height(), ranges)?)
}
