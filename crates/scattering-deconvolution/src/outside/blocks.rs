//! Means of dark pixels over blocks, and what explains them.

use range_image::ComplexChannel;
use rustfft::num_complex::Complex;

/// Blocks along the longer side of an image.
const BLOCKS: usize = 32;
/// Smallest side of a block.
const MIN_SIDE: usize = 4;
/// Share of a block's pixels that must be dark for its mean to count.
const MIN_DARK: f64 = 0.125;
/// Part of what the nuisances explain of a template beyond which it says nothing of its own.
const MIN_OWN: f64 = 1e-3;

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
    /// Mean of its dark pixels and their number; none where they are too few.
    dark: Option<(Complex<f64>, f64)>,
    index: [usize; 2],
}

/// What the best template explains.
pub(super) struct Fit {
    /// Which template.
    pub(super) template: usize,
    /// Its factor.
    pub(super) light: Complex<f64>,
    /// Share of the squares that it leaves of what the nuisances left.
    pub(super) unexplained: f64,
    /// Blocks, fewer where neighbours are wrong alike.
    pub(super) independent_blocks: f64,
}

impl Blocks {
    pub(super) fn new(size: [usize; 2]) -> Self {
        Self { size, side: size[0].max(size[1]).div_ceil(BLOCKS).max(MIN_SIDE) }
    }

    pub(super) fn of_image(&self, channel: &ComplexChannel, is_dark: impl Fn(usize, f32) -> bool) -> Vec<Block> {
        let counts = self.size.map(|count| count.div_ceil(self.side));
        let indices = (0..counts[1]).flat_map(|row| (0..counts[0]).map(move |col| [col, row]));
        indices.map(|index| self.block(index, channel, &is_dark)).collect()
    }

    fn block(&self, index: [usize; 2], channel: &ComplexChannel, is_dark: impl Fn(usize, f32) -> bool) -> Block {
        let first = index.map(|index| index * self.side);
        let end = [0, 1].map(|axis| (first[axis] + self.side).min(self.size[axis]));
        let (mut light, mut dark, mut count) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0), 0.0);
        for row in first[1]..end[1] {
            for pixel in row * self.size[0] + first[0]..row * self.size[0] + end[0] {
                let (re, im) = (channel.real.as_slice()[pixel], channel.imaginary.as_slice()[pixel]);
                if re.is_finite() && im.is_finite() {
                    let value = Complex::new(f64::from(re), f64::from(im));
                    light += value;
                    if is_dark(pixel, re.hypot(im)) {
                        dark += value;
                        count += 1.0;
                    }
                }
            }
        }
        let size = [0, 1].map(|axis| (end[axis] - first[axis]) as f64);
        let enough = count >= (MIN_DARK * size[0] * size[1]).max(1.0);
        Block {
            place: [0, 1].map(|axis| (first[axis] + end[axis]) as f64 / 2.0 - 0.5),
            size,
            light,
            dark: enough.then(|| (dark / count, count)),
            index,
        }
    }
}

/// Explains the dark means by a constant, the light from inside and the best of the templates; none where no template can
/// be told from the first two.
pub(super) fn fit(blocks: &[Block], inside: &[Complex<f64>], templates: &[Vec<f64>]) -> Option<Fit> {
    let used: Vec<usize> = (0..blocks.len()).filter(|&index| blocks[index].dark.is_some()).collect();
    let (mut means, weights): (Vec<_>, Vec<_>) = blocks.iter().filter_map(|block| block.dark).unzip();
    let ones = vec![Complex::new(1.0, 0.0); used.len()];
    let mut inner: Vec<Complex<f64>> = used.iter().map(|&index| inside[index]).collect();
    take_off(&ones, &mut inner, &weights);
    let without_nuisances = |values: &mut Vec<Complex<f64>>| {
        take_off(&ones, values, &weights);
        take_off(&inner, values, &weights);
    };
    without_nuisances(&mut means);
    let total = squares(&means, &weights);
    let own = |template: &Vec<f64>| {
        let mut own: Vec<Complex<f64>> = used.iter().map(|&index| Complex::new(template[index], 0.0)).collect();
        let before = squares(&own, &weights);
        without_nuisances(&mut own);
        (squares(&own, &weights) > MIN_OWN * before).then_some(own)
    };
    let owns: Vec<_> =
        templates.iter().enumerate().filter_map(|(index, template)| Some((index, own(template)?))).collect();
    let explain = |(template, own): &(usize, Vec<Complex<f64>>)| {
        let mut left = means.clone();
        let light = take_off(own, &mut left, &weights);
        (*template, light, squares(&left, &weights))
    };
    let (template, light, left) =
        owns.iter().map(explain).min_by(|a, b| a.2.total_cmp(&b.2)).filter(|_| total > 0.0)?;
    let unexplained = (left / total).clamp(0.0, 1.0);
    let rest = without_all(means.clone(), owns.into_iter().map(|(_, own)| own), &weights);
    Some(Fit { template, light, unexplained, independent_blocks: independent(blocks, &used, &rest, &weights) })
}

/// What no combination of the templates explains: neighbours that are still alike are so for reasons of the scene.
fn without_all(
    mut values: Vec<Complex<f64>>,
    templates: impl Iterator<Item = Vec<Complex<f64>>>,
    weights: &[f64],
) -> Vec<Complex<f64>> {
    let mut bases: Vec<Vec<Complex<f64>>> = Vec::new();
    for mut template in templates {
        let before = squares(&template, weights);
        for basis in &bases {
            take_off(basis, &mut template, weights);
        }
        if squares(&template, weights) > MIN_OWN * before {
            take_off(&template, &mut values, weights);
            bases.push(template);
        }
    }
    values
}

fn squares(values: &[Complex<f64>], weights: &[f64]) -> f64 {
    values.iter().zip(weights).map(|(value, weight)| weight * value.norm_sqr()).sum()
}

/// Takes the multiple of `part` off the values that makes them smallest, and gives the factor.
fn take_off(part: &[Complex<f64>], values: &mut [Complex<f64>], weights: &[f64]) -> Complex<f64> {
    let product: Complex<f64> =
        part.iter().zip(&*values).zip(weights).map(|((a, b), weight)| a.conj() * b * weight).sum();
    let size = squares(part, weights);
    if size <= 0.0 {
        return Complex::new(0.0, 0.0);
    }
    let factor = product / size;
    values.iter_mut().zip(part).for_each(|(value, part)| *value -= part * factor);
    factor
}

/// Number of blocks, times `((1 - r) / (1 + r))²` with the correlation r of what is left in neighbours.
fn independent(blocks: &[Block], used: &[usize], left: &[Complex<f64>], weights: &[f64]) -> f64 {
    let scaled = |at: usize| left[at] * weights[at].sqrt();
    let place = |index: [usize; 2]| {
        used.binary_search_by_key(&[index[1], index[0]], |&at| [blocks[at].index[1], blocks[at].index[0]]).ok()
    };
    let (mut product, mut size, mut pairs) = (0.0, 0.0, 0.0);
    for (at, &block) in used.iter().enumerate() {
        let [col, row] = blocks[block].index;
        for other in [place([col + 1, row]), place([col, row + 1])].into_iter().flatten() {
            product += (scaled(at) * scaled(other).conj()).re;
            size += f64::midpoint(scaled(at).norm_sqr(), scaled(other).norm_sqr());
            pairs += 1.0;
        }
    }
    let correlation = if size > 0.0 && pairs > 0.0 { (product / size).clamp(0.0, 1.0) } else { 0.0 };
    used.len() as f64 * ((1.0 - correlation) / (1.0 + correlation)).powi(2)
}
