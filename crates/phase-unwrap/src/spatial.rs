//! Unwrapping of one frequency.

use std::f32::consts::TAU;

use range_image::Raster;

use crate::borders::Borders;
use crate::brightness::{Brightness, Incidence};
use crate::forest::{Forest, NO_LABEL};
use crate::grid::Grid;
use crate::known::{check_span, resolve_known};
use crate::offsets::Offsets;
use crate::planes::Planes;
use crate::reliability::{Smoothness, reliability};
use crate::segments::Segments;
use crate::surface::Surface;
use crate::unwrapped::labels_from_one;
use crate::{Error, Island, KnownWraps, Result, SpatialOptions, Unwrapped};

/// Unwraps one image; see [`Unwrapper::unwrap`]. Allocates its buffers anew.
pub fn unwrap_spatial(
    phase: &Raster<f32>,
    amplitude: Option<&Raster<f32>>,
    mask: Option<&Raster<bool>>,
    options: &SpatialOptions,
) -> Result<Unwrapped> {
    Unwrapper::new(*options)?.unwrap(phase, amplitude, mask, KnownWraps::Nothing)
}

/// Unwraps images of one frequency one after the other and keeps its buffers.
#[derive(Debug, Default)]
pub struct Unwrapper {
    options: SpatialOptions,
    surface: Surface,
    amplitude: Vec<f32>,
    cost: Vec<f32>,
    smoothness: Smoothness,
    forest: Forest,
    segments: Segments,
    borders: Borders,
    planes: Planes,
    brightness: Brightness,
    offsets: Offsets,
}

impl Unwrapper {
    /// Fails where an option lies outside its domain.
    pub fn new(options: SpatialOptions) -> Result<Self> {
        options.validate()?;
        Ok(Self { options, ..Self::default() })
    }

    /// Wrap counts of one image.
    ///
    /// `phase` is in radians in `[0, 2 pi]`; what is not finite is masked. `amplitude` is in any unit. In `mask`, true
    /// means use.
    ///
    /// With amplitudes the image is cut at possible jumps, and each segment's absolute count is found from the inverse
    /// square law, continuity and what is `known`. Without, every island gets one minimum spanning tree
    /// `[Herraez2002]`; its counts are relative, the lowest 0, unless something is known.
    pub fn unwrap(
        &mut self,
        phase: &Raster<f32>,
        amplitude: Option<&Raster<f32>>,
        mask: Option<&Raster<bool>>,
        known: KnownWraps<'_>,
    ) -> Result<Unwrapped> {
        let mut out = Unwrapped::default();
        self.unwrap_into(phase, amplitude, mask, known, &mut out)?;
        Ok(out)
    }

    /// As [`Unwrapper::unwrap`], into an existing result of any size, which an error leaves as it was.
    pub fn unwrap_into(
        &mut self,
        phase: &Raster<f32>,
        amplitude: Option<&Raster<f32>>,
        mask: Option<&Raster<bool>>,
        known: KnownWraps<'_>,
        out: &mut Unwrapped,
    ) -> Result<()> {
        let grid = Grid::new(phase.width(), phase.height())?;
        self.load_phase(&grid, phase, mask)?;
        let known = resolve_known(&grid, phase, &self.surface, known)?;
        let Some(amplitude) = amplitude else {
            self.unwrap_relative(&grid, &known, out);
            return Ok(());
        };
        phase.require_same_size(amplitude, "amplitude")?;
        grid.pad(amplitude, f32::NAN, &mut self.amplitude);
        self.surface.set_amplitude(&grid, &self.amplitude, self.options.amplitude_noise);
        if self.surface.has_amplitude() {
            return self.unwrap_absolute(&grid, &known, out);
        }
        self.unwrap_relative(&grid, &known, out);
        Ok(())
    }

    /// Bytes that the buffers of the relative tree hold, without the result.
    pub fn bytes(&self) -> usize {
        (self.surface.phase.capacity() + self.cost.capacity()) * size_of::<f32>() + self.forest.bytes()
    }

    fn load_phase(&mut self, grid: &Grid, phase: &Raster<f32>, mask: Option<&Raster<bool>>) -> Result<()> {
        if let Some(mask) = mask {
            phase.require_same_size(mask, "mask")?;
        }
        grid.pad(phase, f32::NAN, &mut self.surface.phase);
        let mut used = 0_usize;
        for (row, start) in grid.row_starts().enumerate() {
            let masked = mask.map(|mask| &mask.as_slice()[row * grid.width..][..grid.width]);
            for (col, value) in self.surface.phase[start..start + grid.width].iter_mut().enumerate() {
                if !value.is_finite() || masked.is_some_and(|mask| !mask[col]) {
                    *value = f32::NAN;
                } else if !(0.0..=TAU).contains(value) {
                    return Err(Error::PhaseOutsideCycle { col, row, value: *value });
                } else {
                    used += 1;
                }
            }
        }
        if used == 0 { Err(Error::AllMasked { pixels: phase.len() }) } else { Ok(()) }
    }

    fn unwrap_relative(&mut self, grid: &Grid, known: &[(usize, i32)], out: &mut Unwrapped) {
        self.smoothness.measure(grid, &self.surface.phase, None, &mut self.cost);
        self.forest.grow(grid, &self.surface.phase, &self.cost, None);
        let fixed = self.fix_islands(known);
        for (label, wraps) in self.forest.label.iter().zip(&mut self.forest.wraps) {
            if *label != NO_LABEL {
                *wraps = wraps.saturating_add(fixed[*label as usize].0);
            }
        }
        labels_from_one(grid, &self.forest, &mut out.segment);
        labels_from_one(grid, &self.forest, &mut out.island);
        grid.crop(&self.forest.wraps, &mut out.wraps, |&wraps| wraps);
        grid.crop(&self.cost, &mut out.confidence, |&cost| reliability(cost));
        let islands = fixed.iter().map(|&(_, known)| Island { offset_known: known, segments: 1, ..Island::default() });
        out.islands.clear();
        out.islands.extend(islands);
        out.typical_amplitude_at_interval = None;
        out.count_pixels(self.options.minimum_confidence);
    }

    /// Offset of each tree, and whether something known fixed it: the median of what is known, else lowest count 0.
    fn fix_islands(&self, known: &[(usize, i32)]) -> Vec<(i32, bool)> {
        let mut lowest = vec![i32::MAX; self.forest.components];
        for (&label, &wraps) in self.forest.label.iter().zip(&self.forest.wraps) {
            if label != NO_LABEL {
                let lowest = &mut lowest[label as usize];
                *lowest = wraps.min(*lowest);
            }
        }
        let mut offsets = vec![Vec::new(); self.forest.components];
        for &(pixel, wraps) in known {
            offsets[self.forest.label[pixel] as usize].push(wraps.saturating_sub(self.forest.wraps[pixel]));
        }
        let fix = |(mut offsets, lowest): (Vec<i32>, i32)| {
            let middle = offsets.len() / 2;
            if offsets.is_empty() { (-lowest, false) } else { (*offsets.select_nth_unstable(middle).1, true) }
        };
        offsets.into_iter().zip(lowest).map(fix).collect()
    }

    fn unwrap_absolute(&mut self, grid: &Grid, known: &[(usize, i32)], out: &mut Unwrapped) -> Result<()> {
        let options = self.options;
        check_span(grid, known, options.maximum_wraps)?;
        self.smoothness.measure(grid, &self.surface.phase, Some(&self.surface.variance), &mut self.cost);
        self.segments.build(grid, &self.surface, &mut self.cost, &mut self.forest, &options);
        self.borders.collect(grid, &self.surface, &self.forest);
        let pixels = &self.segments.pixels;
        let labels = usize::from(options.maximum_wraps) + 1;
        let incidence = options.geometry.as_ref().map(|geometry| {
            self.planes.measure(grid, &self.surface, &self.forest, geometry, pixels, labels);
            Incidence { grid, geometry, slope: &self.planes.slope }
        });
        self.brightness.measure(&self.surface, &self.forest, pixels, incidence, options.maximum_wraps);
        if incidence.is_some() {
            self.brightness.add_costs(&self.planes.costs);
        }
        self.brightness.add_known(&self.forest, known);
        self.offsets.find(&self.brightness, &self.borders.ties, pixels, &options);
        labels_from_one(grid, &self.forest, &mut out.segment);
        self.apply_offsets();
        labels_from_one(grid, &self.forest, &mut out.island);
        grid.crop(&self.forest.wraps, &mut out.wraps, |&wraps| wraps);
        grid.crop(&self.segments.hold, &mut out.confidence, |&hold| hold);
        out.islands.clear();
        out.islands.resize(self.borders.islands, Island { offset_known: true, ..Island::default() });
        for &island in &self.borders.island {
            out.islands[island as usize].segments += 1;
        }
        out.typical_amplitude_at_interval = self.offsets.log_constant.map(f32::exp);
        out.count_pixels(options.minimum_confidence);
        Ok(())
    }

    /// Shifts each segment; labels become those of the islands, the hold of a pixel its confidence.
    fn apply_offsets(&mut self) {
        let maximum = i32::from(self.options.maximum_wraps);
        let pixels = self.forest.label.iter_mut().zip(&mut self.forest.wraps).zip(&mut self.segments.hold);
        for ((label, wraps), confidence) in pixels {
            if *label == NO_LABEL {
                continue;
            }
            let segment = *label as usize;
            let count = *wraps + i32::from(self.offsets.offset[segment]);
            *wraps = count.clamp(0, maximum);
            // A count out of span was no solution: the pixel keeps the nearest, and says that it is a guess.
            let agreed = if *wraps == count { (0.5 * self.offsets.margin[segment]).tanh() } else { 0.0 };
            *confidence *= agreed;
            *label = self.borders.island[segment];
        }
    }
}
