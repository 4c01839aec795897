//! Unwrapping of one frequency.

use range_image::Raster;

use crate::absolute::brightness::{Brightness, Incidence};
use crate::absolute::offsets::Offsets;
use crate::absolute::planes::Planes;
use crate::entry::temporal::Block;
use crate::image::borders::Borders;
use crate::image::known::{Known, check_span, resolve_known};
use crate::image::segments::Segments;
use crate::image::surface::Surface;
use crate::tree::cycle::{count_from_given, into_cycle};
use crate::tree::forest::{Forest, NO_LABEL};
use crate::tree::grid::Grid;
use crate::tree::reliability::{Smoothness, noise_cost, reliability};
use crate::tree::seams::{Seam, cyclic_seams, wrap_rim};
use crate::tree::unwrapped::labels_from_one;
use crate::{Boundary, EdgeWeight, Error, Island, KnownWraps, Result, SpatialOptions, Unwrapped};

/// Unwraps one image; see [`Unwrapper::unwrap`]. Allocates its buffers anew.
///
/// `phase`, `amplitude` and `mask` have one size; phases are radians, amplitudes of any unit, `true` in the mask means use.
///
/// # Errors
/// [`Error::Empty`], [`Error::AllMasked`], [`Error::OutOfDomain`] for an option, [`Error::NoiseUnknown`],
/// [`Error::Raster`] where sizes differ.
///
/// ```
/// use std::f32::consts::{PI, TAU};
///
/// use phase_unwrap::range_image::Raster;
/// use phase_unwrap::{SpatialOptions, unwrap_spatial};
///
/// // A ramp over two cycles, as phases in (-pi, pi].
/// let ramp = Raster::from_fn(40, 60, |_col, row| 0.2 * row as f32);
/// let phase = ramp.map(|value| (value + PI).rem_euclid(TAU) - PI);
/// let found = unwrap_spatial(&phase, None, None, &SpatialOptions::default())?;
/// let unwrapped = |row: usize| phase[(0, row)] + TAU * found.wraps[(0, row)] as f32;
/// assert!((unwrapped(59) - unwrapped(0) - 0.2 * 59.0).abs() < 1e-4);
/// # Ok::<(), phase_unwrap::Error>(())
/// ```
pub fn unwrap_spatial(
    phase: &Raster<f32>,
    amplitude: Option<&Raster<f32>>,
    mask: Option<&Raster<bool>>,
    options: &SpatialOptions,
) -> Result<Unwrapped> {
    Unwrapper::new(*options)?.unwrap(phase, amplitude, mask, KnownWraps::Nothing)
}

/// One image and what comes with it; all rasters of one size.
#[derive(Debug, Clone, Copy)]
pub struct PhaseInput<'a> {
    /// Wrapped phase, radians; what is not finite is masked. What lies outside `[0, 2 pi]` is taken there, see
    /// [`Unwrapper::unwrap`].
    pub phase: &'a Raster<f32>,
    /// Amplitude in any unit. With it counts are absolute.
    pub amplitude: Option<&'a Raster<f32>>,
    /// Standard deviation of the phase, radians. It weights the links of the tree, see [`EdgeWeight`], and goes before
    /// what follows from the amplitude. What is not finite or negative stands for a phase that says nothing.
    pub sigma: Option<&'a Raster<f32>>,
    /// True means use.
    pub mask: Option<&'a Raster<bool>>,
    /// Counts known beforehand.
    pub known: KnownWraps<'a>,
}

impl<'a> PhaseInput<'a> {
    /// A phase and nothing else.
    pub fn new(phase: &'a Raster<f32>) -> Self {
        Self { phase, amplitude: None, sigma: None, mask: None, known: KnownWraps::Nothing }
    }
}

/// Unwraps images of one frequency one after the other and keeps its buffers.
#[derive(Debug, Default)]
pub struct Unwrapper {
    options: SpatialOptions,
    surface: Surface,
    /// The padded amplitude or sigma while it is taken in.
    plane: Vec<f32>,
    cost: Vec<f32>,
    smoothness: Smoothness,
    seams: Vec<Seam>,
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

    /// Other options, valid ones, for the images to come.
    pub fn set_options(&mut self, options: SpatialOptions) {
        self.options = options;
    }

    /// Noise of each part of the complex image of the last image with amplitudes: given, or estimated.
    pub fn amplitude_noise(&self) -> f32 {
        self.surface.amplitude_noise
    }

    /// Wrap counts of one image.
    ///
    /// `phase` is in radians; what is not finite is masked. `amplitude` is in any unit. In `mask`, true means use.
    ///
    /// Phases of another cycle, such as those in `(-pi, pi]`, are taken into `[0, 2 pi]` first. What is said of counts
    /// (the lowest 0, at most `maximum_wraps`) holds there; the counts in the result, and those that are known, belong to
    /// the phases as given: the unwrapped phase is `phase + 2 pi wraps`.
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
        self.unwrap_input_into(&PhaseInput { phase, amplitude, sigma: None, mask, known }, out)
    }

    /// As [`Unwrapper::unwrap_into`], with all that an image can bring along.
    pub fn unwrap_input_into(&mut self, input: &PhaseInput<'_>, out: &mut Unwrapped) -> Result<()> {
        let phase = input.phase;
        let grid = Grid::new(phase.width(), phase.height())?;
        self.load_phase(&grid, &into_cycle(phase), input.mask)?;
        wrap_rim(&grid, self.options.boundaries, &mut self.surface.phase);
        let absolute = self.load_noise(&grid, input)?;
        let span = absolute.then_some(self.options.maximum_wraps);
        let known = resolve_known(&grid, phase, &self.surface, input.known, span)?;
        let with_noise = absolute || input.sigma.is_some();
        self.require_noise(with_noise)?;
        if !absolute {
            self.borrow_planes(out);
        }
        self.measure_cost(&grid, with_noise);
        cyclic_seams(&grid, [1, grid.height, grid.height], self.options.boundaries, &mut self.seams);
        if absolute {
            self.unwrap_absolute(&grid, &known, out)?;
        } else {
            self.unwrap_relative(&grid, &known, out)?;
        }
        let island = out.island.as_slice();
        count_from_given(phase, |index| island[index] > 0, &mut out.wraps);
        Ok(())
    }

    /// One tree over the frames of a block, relative counts.
    pub(crate) fn unwrap_block(&mut self, block: &Block, stack: &Raster<f32>, out: &mut Unwrapped) -> Result<()> {
        let grid = &block.grid;
        self.load_phase(grid, stack, None)?;
        wrap_rim(grid, [self.options.boundaries[0], Boundary::Open], &mut self.surface.phase);
        self.require_noise(false)?;
        self.borrow_planes(out);
        self.measure_cost(grid, false);
        block.add_time(&self.surface.phase, &mut self.cost);
        block.seams(&self.surface.phase, &self.options, &mut self.seams);
        self.unwrap_relative(grid, &Known::default(), out)
    }

    /// Bytes that the buffers of the relative tree hold, without the result.
    pub fn bytes(&self) -> usize {
        let planes = (self.surface.phase.capacity() + self.cost.capacity()) * size_of::<f32>();
        planes + self.seams.capacity() * size_of::<Seam>() + self.forest.bytes()
    }

    fn load_phase(&mut self, grid: &Grid, phase: &Raster<f32>, mask: Option<&Raster<bool>>) -> Result<()> {
        if let Some(mask) = mask {
            phase.require_same_size(mask, "mask")?;
        }
        grid.pad(phase, f32::NAN, &mut self.surface.phase);
        let mut used = 0_usize;
        for (row, start) in grid.row_starts().enumerate() {
            let values = &mut self.surface.phase[start..start + grid.width];
            if let Some(mask) = mask {
                for (value, &use_it) in values.iter_mut().zip(&mask.as_slice()[row * grid.width..]) {
                    *value = if use_it { *value } else { f32::NAN };
                }
            }
            for value in values {
                *value = if value.is_finite() { *value } else { f32::NAN };
                used += usize::from(!value.is_nan());
            }
        }
        if used == 0 { Err(Error::AllMasked { pixels: phase.len() }) } else { Ok(()) }
    }

    /// Variance of the phase from the amplitude or the user's sigma; says whether any amplitude is known.
    fn load_noise(&mut self, grid: &Grid, input: &PhaseInput<'_>) -> Result<bool> {
        let mut known = false;
        if let Some(amplitude) = input.amplitude {
            input.phase.require_same_size(amplitude, "amplitude")?;
            grid.pad(amplitude, f32::NAN, &mut self.plane);
            self.surface.set_amplitude(grid, &self.plane, self.options.amplitude_noise);
            known = self.surface.has_amplitude();
        }
        if let Some(sigma) = input.sigma {
            input.phase.require_same_size(sigma, "sigma")?;
            grid.pad(sigma, f32::NAN, &mut self.plane);
            self.surface.set_sigma(&self.plane);
        }
        Ok(known)
    }

    fn require_noise(&self, with_noise: bool) -> Result<()> {
        let needed = self.options.edge_weight == EdgeWeight::Noise;
        if needed && !with_noise { Err(Error::NoiseUnknown) } else { Ok(()) }
    }

    /// The relative tree works in the memory of its result: three planes less. Nothing fails from here on.
    fn borrow_planes(&mut self, out: &mut Unwrapped) {
        self.forest.label = std::mem::take(&mut out.island).into_vec();
        self.forest.wraps = std::mem::take(&mut out.wraps).into_vec();
        self.cost = std::mem::take(&mut out.confidence).into_vec();
    }

    fn measure_cost(&mut self, grid: &Grid, with_noise: bool) {
        let Self { surface, cost, smoothness, .. } = self;
        let variance = with_noise.then_some(surface.variance.as_slice());
        match (self.options.edge_weight, variance) {
            (EdgeWeight::Noise, Some(variance)) => noise_cost(grid, &surface.phase, variance, cost),
            (_, variance) => smoothness.measure(grid, &surface.phase, variance, cost),
        }
    }

    /// Works in the planes borrowed from `out` and gives them back as the image's own.
    fn unwrap_relative(&mut self, grid: &Grid, known: &Known, out: &mut Unwrapped) -> Result<()> {
        self.forest.grow(grid, &self.surface.phase, &self.cost, None, &self.seams);
        let fixed = self.fix_islands(known);
        for (label, wraps) in self.forest.label.iter().zip(&mut self.forest.wraps) {
            if let Some((offset, _)) = fixed.get(*label as usize) {
                *wraps = wraps.saturating_add(*offset);
            }
        }
        labels_from_one(grid, &self.forest, &mut out.segment);
        // No label is the largest number, which wraps to zero.
        out.island = grid.image(std::mem::take(&mut self.forest.label), |label| label.wrapping_add(1))?;
        out.wraps = grid.image(std::mem::take(&mut self.forest.wraps), |wraps| wraps)?;
        out.confidence = grid.image(std::mem::take(&mut self.cost), reliability)?;
        let islands = fixed.iter().map(|&(_, known)| Island { offset_known: known, segments: 1, ..Island::default() });
        out.islands.clear();
        out.islands.extend(islands);
        out.typical_amplitude_at_interval = None;
        out.count_pixels(self.options.minimum_confidence);
        Ok(())
    }

    /// Offset of each tree, and whether something known fixed it: the median of what is known, else lowest count 0.
    fn fix_islands(&self, known: &Known) -> Vec<(i32, bool)> {
        let mut lowest = vec![i32::MAX; self.forest.components];
        for (&label, &wraps) in self.forest.label.iter().zip(&self.forest.wraps) {
            if label != NO_LABEL {
                let lowest = &mut lowest[label as usize];
                *lowest = wraps.min(*lowest);
            }
        }
        let mut offsets = vec![Vec::new(); self.forest.components];
        for &(pixel, wraps) in &known.pixels {
            offsets[self.forest.label[pixel] as usize].push(wraps.saturating_sub(self.forest.wraps[pixel]));
        }
        let fix = |(mut offsets, lowest): (Vec<i32>, i32)| {
            let middle = offsets.len() / 2;
            if offsets.is_empty() { (-lowest, false) } else { (*offsets.select_nth_unstable(middle).1, known.absolute) }
        };
        offsets.into_iter().zip(lowest).map(fix).collect()
    }

    fn unwrap_absolute(&mut self, grid: &Grid, known: &Known, out: &mut Unwrapped) -> Result<()> {
        let options = self.options;
        check_span(grid, known, options.maximum_wraps)?;
        self.segments.build(grid, &self.surface, &mut self.cost, &mut self.forest);
        self.borders.collect(grid, &self.surface, &self.forest, &self.seams);
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
        // From log odds to a confidence once a segment, not once a pixel.
        let sure: Vec<f32> = self.offsets.margin.iter().map(|margin| (0.5 * margin).tanh()).collect();
        let pixels = self.forest.label.iter_mut().zip(&mut self.forest.wraps).zip(&mut self.segments.hold);
        for ((label, wraps), confidence) in pixels {
            if *label == NO_LABEL {
                continue;
            }
            let segment = *label as usize;
            let count = *wraps + i32::from(self.offsets.offset[segment]);
            *wraps = count.clamp(0, maximum);
            // A count out of span was no solution: the pixel keeps the nearest, and says that it is a guess.
            let agreed = if *wraps == count { sure[segment] } else { 0.0 };
            *confidence *= agreed;
            *label = self.borders.island[segment];
        }
    }
}
