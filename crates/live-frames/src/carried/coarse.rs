//! A small image of the frame, solved by the tree as a whole.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use range_image::{ComplexChannel, Raster, with_wide_registers};

use phase_unwrap::{Error, ImageGeometry, KnownWraps, SpatialOptions, Unwrapped, Unwrapper};

/// Columns of a small image, about: those of the cameras whose rooms the absolute counts were measured on.
const COLUMNS: usize = 160;

/// The small image with its counts.
#[derive(Debug, Default)]
pub(crate) struct Coarse {
    unwrapper: Unwrapper,
    /// Pixels of the frame along a side of one of the small image.
    pub factor: usize,
    image: Option<ComplexChannel>,
    phase: Raster<f32>,
    amplitude: Raster<f32>,
    out: Unwrapped,
    sums: [Vec<f32>; 2],
    /// Whether the constant of the last time may not serve again: it was not looked for then, or the frames in between are cut.
    constant_is_old: bool,
}

impl Coarse {
    pub fn resize(&mut self, width: usize, height: usize) {
        self.factor = (width / COLUMNS).max(1);
        let plane = Raster::filled(width.div_ceil(self.factor), height.div_ceil(self.factor), f32::NAN);
        (self.phase, self.amplitude, self.image) = (plane.clone(), plane, None);
        self.sums = [vec![0.0; width], vec![0.0; width]];
    }

    /// The frames to come may be brighter or darker than those before.
    pub fn forget_constant(&mut self) {
        self.constant_is_old = true;
    }

    /// Makes the small image of a frame and solves it; false where it shows nothing.
    pub fn solve(&mut self, channel: &ComplexChannel, options: &SpatialOptions) -> Result<bool, Error> {
        let plane = &self.phase;
        let image = self.image.get_or_insert_with(|| ComplexChannel {
            modulation: channel.modulation,
            real: plane.clone(),
            imaginary: plane.clone(),
            offset: None,
            sigma: plane.clone(),
        });
        means(&channel.real, self.factor, &mut self.sums, &mut image.real);
        means(&channel.imaginary, self.factor, &mut self.sums, &mut image.imaginary);
        image.phase_and_amplitude_into(&mut self.phase, &mut self.amplitude)?;
        if !self.phase.as_slice().iter().any(|phase| phase.is_finite()) {
            return Ok(false);
        }
        let factor = self.factor as f32;
        let geometry = options.geometry.map(|geometry| ImageGeometry {
            principal_distance_px: geometry.principal_distance_px / factor,
            principal_point_px: geometry.principal_point_px.map(|point| (point + 0.5) / factor - 0.5),
        });
        let amplitude_noise = options.amplitude_noise.map(|noise| noise / factor);
        // The constant of the inverse square law belongs to light and scene: every second time that of the time before does, and
        // need not be looked for among all.
        let known = self.out.typical_amplitude_at_interval.filter(|_| !self.constant_is_old);
        self.constant_is_old = known.is_some();
        let mut albedo = options.albedo;
        albedo.typical_amplitude_at_interval = albedo.typical_amplitude_at_interval.or(known);
        self.unwrapper.set_options(SpatialOptions { amplitude_noise, geometry, albedo, ..*options });
        self.unwrapper.unwrap_into(&self.phase, Some(&self.amplitude), None, KnownWraps::Nothing, &mut self.out)?;
        Ok(true)
    }

    /// Phases, counts and confidences of a row of the small image.
    pub fn row(&self, row: usize) -> [&[f32]; 2] {
        let at = row * self.phase.width()..(row + 1) * self.phase.width();
        [&self.phase.as_slice()[at.clone()], &self.out.confidence.as_slice()[at]]
    }

    /// Amplitudes of a row.
    pub fn amplitudes(&self, row: usize) -> &[f32] {
        &self.amplitude.as_slice()[row * self.phase.width()..][..self.phase.width()]
    }

    /// Counts of a row.
    pub fn wraps(&self, row: usize) -> &[i32] {
        &self.out.wraps.as_slice()[row * self.phase.width()..][..self.phase.width()]
    }
}

/// Means of squares of pixels, of those that are finite; NaN where half of them are not.
fn means(plane: &Raster<f32>, factor: usize, [sums, counts]: &mut [Vec<f32>; 2], out: &mut Raster<f32>) {
    let (width, columns) = (plane.width(), out.width());
    for (rows, out) in plane.as_slice().chunks(factor * width).zip(out.as_mut_slice().chunks_mut(columns)) {
        let (sums, counts) = (&mut sums[..width], &mut counts[..width]);
        let pixels = rows.len() / width;
        let complete = with_wide_registers(
            #[inline(always)]
            || add_rows(rows, sums),
        );
        if complete {
            with_wide_registers(
                #[inline(always)]
                || match factor {
                    2 => divide::<2>(sums, factor, pixels, out),
                    3 => divide::<3>(sums, factor, pixels, out),
                    4 => divide::<4>(sums, factor, pixels, out),
                    _ => divide::<1>(sums, factor, pixels, out),
                },
            );
            continue;
        }
        with_wide_registers(
            #[inline(always)]
            || add_finite(rows, sums, counts),
        );
        for (out, (sums, counts)) in out.iter_mut().zip(sums.chunks(factor).zip(counts.chunks(factor))) {
            let (sum, count) = (sums.iter().sum::<f32>(), counts.iter().sum::<f32>());
            let enough = 2.0 * count > (pixels * sums.len()) as f32;
            *out = if enough { sum / count } else { f32::NAN };
        }
    }
}

/// Means from the sums of columns that stand for `pixels` rows, as many of them as there are in a mean of the result.
#[inline(always)]
fn divide<const FACTOR: usize>(sums: &[f32], factor: usize, pixels: usize, out: &mut [f32]) {
    let (whole, _) = sums.as_chunks::<FACTOR>();
    let count = (pixels * FACTOR) as f32;
    let done = if FACTOR == factor { whole.len().min(out.len()) } else { 0 };
    for (out, sums) in out[..done].iter_mut().zip(&whole[..done]) {
        *out = sums.iter().sum::<f32>() / count;
    }
    for (out, sums) in out[done..].iter_mut().zip(sums[done * factor..].chunks(factor)) {
        *out = sums.iter().sum::<f32>() / (pixels * sums.len()) as f32;
    }
}

/// Sums of rows, two at a time, and whether all of them are finite, as they are where every pixel has a value.
#[inline(always)]
fn add_rows(rows: &[f32], sums: &mut [f32]) -> bool {
    let width = sums.len();
    sums.fill(0.0);
    let mut pairs = rows.chunks_exact(2 * width);
    for pair in &mut pairs {
        let (first, second) = pair.split_at(width);
        for ((sum, first), second) in sums.iter_mut().zip(first).zip(second) {
            *sum = *sum + first + second;
        }
    }
    for (sum, value) in sums.iter_mut().zip(pairs.remainder()) {
        *sum += value;
    }
    sums.iter().fold(1_u32, |all, sum| all & u32::from(sum.abs() <= f32::MAX)) == 1
}

/// Sums and numbers of the values that are finite.
#[inline(always)]
fn add_finite(rows: &[f32], sums: &mut [f32], counts: &mut [f32]) {
    sums.fill(0.0);
    counts.fill(0.0);
    for row in rows.chunks_exact(sums.len()) {
        for ((sum, count), value) in sums.iter_mut().zip(counts.iter_mut()).zip(row) {
            let finite = value.abs() <= f32::MAX;
            *sum += if finite { *value } else { 0.0 };
            *count += if finite { 1.0 } else { 0.0 };
        }
    }
}
