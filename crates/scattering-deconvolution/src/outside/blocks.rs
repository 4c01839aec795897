//! Means of dark blocks, and what explains them.

use std::f64::consts::TAU;

use fourier_transforms::num_complex::Complex;
use range_image::ComplexChannel;

/// Blocks along the longer side of an image.
const BLOCKS: usize = 32;
/// Smallest side of a block.
const MIN_SIDE: usize = 4;
/// Part of what is fitted along explains of a template beyond which it says nothing of its own.
const MIN_OWN: f64 = 1e-3;
/// Part of its weight by which a point spread function may be wrong: of the light from inside, no larger multiple passes for
/// an explanation. Estimates are wrong by some percent; the bound was chosen, its sensitivity is not known.
const WRONG_WEIGHT: f64 = 0.3;

/// The division of an image into blocks.
pub(super) struct Blocks {
    size: [usize; 2],
    side: usize,
}

/// A block of pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Its middle, columns and rows in pixels.
    pub(super) place: [f64; 2],
    pub(super) size: [f64; 2],
    /// Light of all its pixels.
    pub(super) light: Complex<f64>,
    /// Mean of its pixels and their number, where all of them are dark. A mean of the dark ones among others would be wrong:
    /// where light was taken off, those are dark whose noise happened to be against it.
    dark: Option<(Complex<f64>, f64)>,
    pub(super) index: [usize; 2],
}

/// What the best template explains of the dark blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    /// Which template.
    pub(super) template: usize,
    /// Its factor.
    pub(super) light: Complex<f64>,
    /// Share of the squares that it leaves.
    left: f64,
    /// Blocks that are left independent of each other, less the factors fitted.
    pub(super) redundancy: f64,
}

impl Fit {
    /// Probability that one template explains as much of as many independent complex normal values: the share that it
    /// leaves has a beta distribution.
    pub(super) fn chance(&self) -> f64 {
        self.left.powf(self.redundancy)
    }
}

impl Blocks {
    pub(super) fn new(size: [usize; 2]) -> Self {
        Self { size, side: size[0].max(size[1]).div_ceil(BLOCKS).max(MIN_SIDE) }
    }

    /// Middles of the blocks in pixels, in the order of [`Self::of_image`].
    pub(super) fn places(&self) -> Vec<[f64; 2]> {
        self.indices().map(|index| place(self.pixels(index))).collect()
    }

    pub(super) fn of_image(&self, channel: &ComplexChannel, is_dark: impl Fn(usize, [f32; 2]) -> bool) -> Vec<Block> {
        self.indices().map(|index| self.block(index, channel, &is_dark)).collect()
    }

    /// Whether there is a block with light all of whose pixels are dark.
    pub(super) fn any_dark(&self, channel: &ComplexChannel, is_dark: impl Fn(usize, [f32; 2]) -> bool) -> bool {
        self.indices().any(|index| {
            let [first, end] = self.pixels(index);
            let rows = first[1]..end[1];
            let pixels = rows.flat_map(|row| row * self.size[0] + first[0]..row * self.size[0] + end[0]);
            let lights =
                pixels.map(|pixel| (pixel, [channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]]));
            let mut finite = lights.filter(|(_, [re, im])| re.is_finite() && im.is_finite()).peekable();
            finite.peek().is_some() && finite.all(|(pixel, light)| is_dark(pixel, light))
        })
    }

    fn indices(&self) -> impl Iterator<Item = [usize; 2]> {
        let [cols, rows] = self.size.map(|count| count.div_ceil(self.side));
        (0..rows).flat_map(move |row| (0..cols).map(move |col| [col, row]))
    }

    /// First column and row of a block, and the first beyond it.
    fn pixels(&self, index: [usize; 2]) -> [[usize; 2]; 2] {
        let first = index.map(|index| index * self.side);
        [first, [0, 1].map(|axis| (first[axis] + self.side).min(self.size[axis]))]
    }

    fn block(&self, index: [usize; 2], channel: &ComplexChannel, is_dark: impl Fn(usize, [f32; 2]) -> bool) -> Block {
        let [first, end] = self.pixels(index);
        let (mut light, mut count, mut all_dark) = (Complex::new(0.0, 0.0), 0.0, true);
        for row in first[1]..end[1] {
            for pixel in row * self.size[0] + first[0]..row * self.size[0] + end[0] {
                let (re, im) = (channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]);
                if re.is_finite() && im.is_finite() {
                    light += Complex::new(f64::from(re), f64::from(im));
                    count += 1.0;
                    all_dark &= is_dark(pixel, [re, im]);
                }
            }
        }
        let size = [0, 1].map(|axis| (end[axis] - first[axis]) as f64);
        let dark = (all_dark && count > 0.0).then(|| (light / count, count));
        Block { place: place([first, end]), size, light, dark, index }
    }
}

/// Middle of a block in pixels.
fn place([first, end]: [[usize; 2]; 2]) -> [f64; 2] {
    [0, 1].map(|axis| (first[axis] + end[axis]) as f64 / 2.0 - 0.5)
}

/// Explains the dark means by one of the templates, the one that leaves least, and by a multiple of what is fitted along;
/// none where no template can be told from that.
pub(super) fn fit(blocks: &[Block], templates: &[Vec<f64>], along: Option<&[Complex<f64>]>) -> Option<Fit> {
    let used: Vec<usize> = (0..blocks.len()).filter(|&index| blocks[index].dark.is_some()).collect();
    let (mut left, weights): (Vec<_>, Vec<_>) = blocks.iter().filter_map(|block| block.dark).unzip();
    let mut total = squares(&left, &weights);
    let along: Option<Vec<_>> = along.map(|values| used.iter().map(|&index| values[index]).collect());
    let along = along.map(|values| (squares(&values, &weights), values)).filter(|(size, _)| *size > 0.0);
    if let Some((size, along)) = &along {
        let factor = product(along, &left, &weights) / size;
        take_off(along, factor, &mut left);
        // The sum of squares is a parabola about the best factor.
        let beyond = (factor.norm() - WRONG_WEIGHT).max(0.0);
        total = squares(&left, &weights) + beyond * beyond * size;
    }
    let explain = |(index, template): (usize, &Vec<f64>)| {
        let (mut before, mut shared, mut seen) = (0.0, Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
        for (at, &block) in used.iter().enumerate() {
            let weighted = template[block] * weights[at];
            before += template[block] * weighted;
            seen += left[at] * weighted;
            if let Some((_, along)) = &along {
                shared += along[at].conj() * weighted;
            }
        }
        let shared = along.as_ref().map_or(Complex::new(0.0, 0.0), |(size, _)| shared / size);
        let size = before - along.as_ref().map_or(0.0, |(size, _)| shared.norm_sqr() * size);
        (size > MIN_OWN * before).then(|| (index, seen / size, seen.norm_sqr() / size, shared))
    };
    let best = templates.iter().enumerate().filter_map(explain).max_by(|a, b| a.2.total_cmp(&b.2));
    let (template, light, _, shared) = best.filter(|_| total > 0.0)?;
    for (at, &block) in used.iter().enumerate() {
        let own = along.as_ref().map_or(Complex::new(0.0, 0.0), |(_, along)| along[at] * shared);
        left[at] -= light * (templates[template][block] - own);
    }
    let factors = if along.is_some() { 2.0 } else { 1.0 };
    let redundancy = independent(blocks, &used, &left, &weights) - factors;
    Some(Fit { template, light, left: (squares(&left, &weights) / total).clamp(0.0, 1.0), redundancy })
}

fn product(a: &[Complex<f64>], b: &[Complex<f64>], weights: &[f64]) -> Complex<f64> {
    a.iter().zip(b).zip(weights).map(|((a, b), weight)| a.conj() * b * weight).sum()
}

fn squares(values: &[Complex<f64>], weights: &[f64]) -> f64 {
    values.iter().zip(weights).map(|(value, weight)| weight * value.norm_sqr()).sum()
}

fn take_off(part: &[Complex<f64>], factor: Complex<f64>, values: &mut [Complex<f64>]) {
    values.iter_mut().zip(part).for_each(|(value, part)| *value -= part * factor);
}

/// Number of blocks, over the number of those that are alike: the sum of the correlation of what is left over all
/// distances, in rings, up to the first at which it ends. The correlation of next neighbours alone would not do: noise
/// lowers it, however far the light of a scene reaches.
fn independent(blocks: &[Block], used: &[usize], left: &[Complex<f64>], weights: &[f64]) -> f64 {
    let correlations = (1..BLOCKS).map(|distance| (distance, correlation(blocks, used, left, weights, distance)));
    let alike = correlations.take_while(|(_, correlation)| *correlation > 0.0);
    let together: f64 = alike.map(|(distance, correlation)| TAU * distance as f64 * correlation).sum();
    used.len() as f64 / (1.0 + together)
}

/// Correlation of what is left in blocks of one row or column that are so many blocks apart.
fn correlation(blocks: &[Block], used: &[usize], left: &[Complex<f64>], weights: &[f64], distance: usize) -> f64 {
    let scaled = |at: usize| left[at] * weights[at].sqrt();
    let place = |index: [usize; 2]| {
        used.binary_search_by_key(&[index[1], index[0]], |&at| [blocks[at].index[1], blocks[at].index[0]]).ok()
    };
    let (mut product, mut size) = (0.0, 0.0);
    for (at, &block) in used.iter().enumerate() {
        let [col, row] = blocks[block].index;
        for other in [place([col + distance, row]), place([col, row + distance])].into_iter().flatten() {
            product += (scaled(at) * scaled(other).conj()).re;
            size += f64::midpoint(scaled(at).norm_sqr(), scaled(other).norm_sqr());
        }
    }
    if size > 0.0 { product / size } else { 0.0 }
}
