//! What the amplitudes of a segment say about its offset: the inverse square law as a cost for each label.

use std::f32::consts::TAU;

use crate::absolute::planes::log_cosine;
use crate::image::known::Known;
use crate::image::surface::Surface;
use crate::tree::forest::Forest;
use crate::tree::grid::Grid;
use crate::{AlbedoPrior, ImageGeometry};

/// Quantiles kept of each segment's log albedos. More follow its spread more finely and cost time in proportion.
const QUANTILES: usize = 5;
/// Pixels sampled of a segment. The quantiles are then known to a sixteenth; more cost time.
const SAMPLES: u32 = 64;
/// Cost, in nats, of a segment with ranges that would be negative or beyond the largest count. Tuned on the rooms of
/// `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to 12): a smaller cost shifts scenes by a cycle where albedo is
/// undecided, a larger one lets wrong steps at a border decide.
const OUT_OF_SPAN: f32 = 8.0;
/// Share of such pixels at which the cost is full: fewer can be wrong steps inside the segment. Tuned on the rooms of
/// `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to 12).
const OUT_OF_SPAN_SHARE: f32 = 0.2;

/// Logarithm of a typical cosine of incidence, where the slope is not known. It is that of 45 degrees. Another value
/// moves pixels of unknown slope against the others.
const TYPICAL_LOG_COSINE: f32 = -0.35;
/// Logarithm of the smallest cosine that is taken off: beyond 84 degrees slopes and albedo laws fail.
const LOWEST_LOG_COSINE: f32 = -2.3;

/// Share of dark materials among surfaces, and the scale of their log albedos below the typical one: black cloth has
/// -2.5. Tuned on the rooms of `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to 12): with none, a dark board is put
/// a cycle behind its place; with more, far walls pass for dark ones.
const DARK_SHARE: f32 = 0.12;
const DARK_SCALE: f32 = 2.0;
/// Share of what obeys no albedo (retro-reflectors, glints, mixed pixels), spread evenly over this many nats: however
/// many surfaces are off, each costs no more than that, so the constant that fits most of them wins. Tuned on the rooms
/// of `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to 12).
const OUTLIER_SHARE: f32 = 0.08;
const OUTLIER_SPAN: f32 = 6.0;
/// Prior for short ranges, nats a wrap: light falls off, so what is seen at all is rather near. Tuned on the rooms of
/// `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to 12): with less, undecided segments drift to far counts, with
/// more, far ones come near.
const NEARNESS: f32 = 0.85;
/// Log albedos of one segment that differ by more say nothing more: it holds several materials. That is a factor of
/// seven, less than between white and black.
const LARGEST_SPREAD: f32 = 2.0;
/// Pixels of the image for which the sizes in [`segment_weight`] hold; they grow with the image, as noise shatters a dark
/// surface into more pieces where it has more pixels.
const REFERENCE_PIXELS: f32 = 176.0 * 144.0;

/// The angle of incidence of every pixel as slope and camera give it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Incidence<'a> {
    pub grid: &'a Grid,
    pub geometry: &'a ImageGeometry,
    pub slope: &'a [[f32; 2]],
}

impl Incidence<'_> {
    fn log_cosine(&self, pixel: usize, range: f32) -> f32 {
        let slope = self.slope[pixel];
        if slope[0].is_nan() || slope[1].is_nan() {
            return TYPICAL_LOG_COSINE;
        }
        let (col, row) = (pixel % self.grid.stride, pixel / self.grid.stride);
        let image = |padded: usize, point: f32| (padded as f32 - 1.0 - point) / self.geometry.principal_distance_px;
        let [x, y] = [image(col, self.geometry.principal_point_px[0]), image(row, self.geometry.principal_point_px[1])];
        log_cosine(x, y, range, slope).max(LOWEST_LOG_COSINE)
    }
}

/// Per segment and label: quantiles of `ln(amplitude * range^2)`, range in ambiguity intervals.
#[derive(Debug, Default)]
pub(crate) struct Brightness {
    pub labels: usize,
    /// `[segment][label][quantile]`; NaN where no pixel of the segment allows the label or has an amplitude.
    quantiles: Vec<f32>,
    /// `[segment][label]`: costs that do not depend on the constant.
    fixed: Vec<f32>,
    weight: Vec<f32>,
    /// Sampled pixels, segment after segment, and where those of each begin.
    pixel: Vec<u32>,
    first: Vec<u32>,
    /// For each segment: pixels to pass over until the next sample, and its place.
    wait: Vec<[u32; 2]>,
    scratch: Vec<f32>,
}

impl Brightness {
    /// Samples every segment and sorts its log albedos for every label.
    pub fn measure(
        &mut self,
        surface: &Surface,
        forest: &Forest,
        pixels: &[u32],
        incidence: Option<Incidence<'_>>,
        maximum_wraps: u16,
    ) {
        self.labels = usize::from(maximum_wraps) + 1;
        self.sample(forest, pixels);
        self.weight.clear();
        let scale = (pixels.iter().sum::<u32>() as f32 / REFERENCE_PIXELS).max(1.0);
        self.weight.extend(pixels.iter().map(|&n| segment_weight(n as f32 / scale)));
        self.quantiles.clear();
        self.fixed.clear();
        for segment in 0..pixels.len() {
            for label in 0..self.labels {
                self.measure_label(surface, forest, segment, label as i32, incidence, i32::from(maximum_wraps));
            }
        }
    }

    fn sample(&mut self, forest: &Forest, pixels: &[u32]) {
        let stride = |pixels: u32| pixels.div_ceil(SAMPLES).max(1);
        self.first.clear();
        self.wait.clear();
        let mut end = 0;
        for &pixels in pixels {
            self.first.push(end);
            self.wait.push([0, end]);
            end += pixels.div_ceil(stride(pixels));
        }
        self.first.push(end);
        self.pixel.clear();
        self.pixel.resize(end as usize, 0);
        for (pixel, &label) in forest.label.iter().enumerate() {
            let Some([wait, place]) = self.wait.get_mut(label as usize) else { continue };
            if *wait == 0 {
                self.pixel[*place as usize] = pixel as u32;
                (*wait, *place) = (stride(pixels[label as usize]), *place + 1);
            }
            *wait -= 1;
        }
    }

    /// Where the samples of a segment stand.
    fn samples(&self, segment: usize) -> std::ops::Range<usize> {
        self.first[segment] as usize..self.first[segment + 1] as usize
    }

    fn measure_label(
        &mut self,
        surface: &Surface,
        forest: &Forest,
        segment: usize,
        label: i32,
        incidence: Option<Incidence<'_>>,
        maximum: i32,
    ) {
        self.scratch.clear();
        let mut outside = 0.0;
        let samples = self.samples(segment);
        for &pixel in &self.pixel[samples.clone()] {
            let pixel = pixel as usize;
            let count = forest.wraps[pixel] + label;
            if !(0..=maximum).contains(&count) {
                outside += 1.0;
                continue;
            }
            let range = (surface.phase[pixel] / TAU + count as f32).max(0.01);
            let cosine = incidence.map_or(0.0, |incidence| incidence.log_cosine(pixel, range));
            let log_albedo = surface.log_amplitude[pixel] + 2.0 * range.ln() - cosine;
            if !log_albedo.is_nan() {
                self.scratch.push(log_albedo);
            }
        }
        self.scratch.sort_unstable_by(f32::total_cmp);
        let n = self.scratch.len();
        for q in 0..QUANTILES {
            // The middle of each fifth.
            let at = (2 * q + 1) * n / (2 * QUANTILES);
            self.quantiles.push(self.scratch.get(at).copied().unwrap_or(f32::NAN));
        }
        let share = outside / samples.len().max(1) as f32;
        self.fixed.push(self.weight[segment].max(1.0) * OUT_OF_SPAN * (share / OUT_OF_SPAN_SHARE).min(1.0));
    }

    /// Adds costs that do not depend on the constant, `[segment][label]`.
    pub fn add_costs(&mut self, costs: &[f32]) {
        for (sum, cost) in self.fixed.iter_mut().zip(costs) {
            *sum += cost;
        }
    }

    /// Adds what known counts say.
    pub fn add_known(&mut self, forest: &Forest, known: &Known) {
        let segments = self.weight.len();
        let mut votes = vec![0_u32; segments * self.labels];
        let mut total = vec![0_u32; segments];
        for &(pixel, wraps) in &known.pixels {
            let segment = forest.label[pixel] as usize;
            total[segment] += 1;
            if let Ok(label) = usize::try_from(wraps - forest.wraps[pixel])
                && label < self.labels
            {
                votes[segment * self.labels + label] += 1;
            }
        }
        for (index, cost) in self.fixed.iter_mut().enumerate() {
            let total = total[index / self.labels];
            if total > 0 {
                *cost += known.nats * (1.0 - votes[index] as f32 / total as f32);
            }
        }
    }

    /// Appends the cost of each label of a segment, nats, for a logarithm of the constant.
    pub fn add_costs_of(&self, segment: usize, log_constant: f32, albedo: &AlbedoPrior, costs: &mut Vec<f32>) {
        let (weight, at) = (self.weight[segment], segment * self.labels..(segment + 1) * self.labels);
        let quantiles = self.quantiles[QUANTILES * at.start..QUANTILES * at.end].chunks_exact(QUANTILES);
        for (label, (quantiles, fixed)) in quantiles.zip(&self.fixed[at]).enumerate() {
            // The logarithm of a product instead of a sum of logarithms: five factors between 0.02 and 1.2.
            let mean = -quantiles.iter().map(|q| relative_density(q - log_constant, albedo)).product::<f32>().ln();
            let nearness = NEARNESS * label as f32;
            // A wrong count bends the brightness of a slanted surface, whatever its albedo.
            let spread = (quantiles[QUANTILES - 1] - quantiles[0]).min(LARGEST_SPREAD);
            // Without amplitudes there is no opinion.
            let mean = if mean.is_nan() { 0.0 } else { mean / QUANTILES as f32 + nearness + spread };
            costs.push(weight * mean + fixed);
        }
    }

    /// How many independent draws from the albedo prior a segment is counted for.
    pub fn weight(&self, segment: usize) -> f32 {
        self.weight[segment]
    }

    /// The part of a cost, as [`Brightness::costs`] gives it, that comes from the albedo.
    pub fn albedo_part(&self, segment: usize, label: usize, cost: f32) -> f32 {
        cost - self.fixed[segment * self.labels + label]
    }

    /// Smallest and largest log albedo of any label, `None` where there is no amplitude.
    pub fn span(&self) -> Option<(f32, f32)> {
        let known = self.quantiles.iter().filter(|q| !q.is_nan());
        let span = known.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &q| (low.min(q), high.max(q)));
        (span.0 <= span.1).then_some(span)
    }
}

/// How many independent draws from the albedo prior a segment of n pixels is worth: its pixels share a material.
fn segment_weight(n: f32) -> f32 {
    n / (n + 12.0) * (1.0 + 0.5 * (1.0 + n / 200.0).ln())
}

/// Prior density of a log albedo `x` off its typical value, over the largest of common surfaces: these, dark materials, and what
/// obeys no albedo.
fn relative_density(x: f32, albedo: &AlbedoPrior) -> f32 {
    let common = (1.0 - DARK_SHARE - OUTLIER_SHARE) / (albedo.dark_scale + albedo.bright_scale);
    let anything = OUTLIER_SHARE / OUTLIER_SPAN;
    let density = if x < 0.0 {
        common * (x / albedo.dark_scale).exp() + DARK_SHARE / DARK_SCALE * (x / DARK_SCALE).exp()
    } else {
        common * (-x / albedo.bright_scale).exp()
    };
    (density + anything) / common
}
