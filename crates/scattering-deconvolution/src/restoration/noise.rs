//! What restoring does to noise.

use fourier_transforms::{FftDirection, num_complex::Complex};

use crate::kernels::grid::Grid;
use crate::kernels::operator::{Factors, Operator, Term};
use crate::kernels::parts::{Field, Orientation, Part};
use crate::kernels::spectrum::Spectrum;

/// `var_out(p) = (1 - 2 q(p, p)) var(p) + sum over p' of |q(p, p')|^2 var(p')`, with `q` what is subtracted.
///
/// Where the point spread function changes over the field, `q = S (1 + H)^-1` with the mean `H`: what that neglects is of
/// second order in the share of scattered light. Light that arrives at one pixel directly and mirrored adds by variances.
pub(crate) struct Noise {
    /// `|q|^2` as an operator on variances at the nodes.
    pub(crate) squared: Operator,
    /// `q(p, p)`: what a pixel loses of itself.
    pub(crate) centre: Centre,
    /// Bound of the sum of `|q|^2` over all other pixels.
    pub(crate) surroundings: f64,
    gain: f64,
}

/// What a pixel loses of itself: the same for all, or pixel by pixel.
pub(crate) enum Centre {
    Same(f64),
    Pixels(Vec<f32>),
}

/// What one part takes off: its kernel, and its share over the field.
struct Subtracted {
    kernel: Spectrum,
    orientation: Orientation,
    field: Option<Field>,
    centre: f64,
}

impl Noise {
    pub(crate) fn new(
        parts: &[Part],
        responses: &[Spectrum],
        grid: &Grid,
        weight: impl Fn(Complex<f64>) -> Complex<f64>,
    ) -> Self {
        let subtracted = subtracted(parts, responses, grid, weight);
        let mut noise = Self {
            squared: Operator::new(Vec::new(), 0),
            centre: centre(&subtracted, grid),
            surroundings: 0.0,
            gain: 1.0,
        };
        let (mut terms, mut energy) = (Vec::new(), 0.0);
        for (index, one) in subtracted.iter().enumerate() {
            for (other_index, other) in subtracted.iter().enumerate().skip(index) {
                if one.orientation == other.orientation {
                    let pair = Pair::new(one, other, if index == other_index { 1.0 } else { 2.0 }, grid);
                    energy += pair.energy * pair.mean;
                    noise.surroundings += pair.energy.abs() * pair.largest;
                    terms.push(pair.term);
                }
            }
        }
        let centre: f64 =
            subtracted.iter().map(|part| part.centre * part.field.map_or(1.0, |field| field.mean())).sum();
        noise.gain = (1.0 - 2.0 * centre + energy).max(0.0).sqrt();
        if let Centre::Same(centre) = noise.centre {
            noise.surroundings = (noise.surroundings - centre * centre).max(0.0);
        }
        noise.squared = Operator::new(terms, grid.size().iter().product());
        noise
    }

    /// Factor of the standard deviation of noise that is the same everywhere, averaged over the field.
    pub(crate) fn gain(&self) -> f64 {
        self.gain
    }

    /// Largest of what pixels lose of themselves.
    pub(crate) fn largest_centre(&self) -> f64 {
        match &self.centre {
            Centre::Same(centre) => *centre,
            Centre::Pixels(values) => values.iter().copied().fold(0.0, |a: f64, value| a.max(f64::from(value))),
        }
    }
}

fn pixels_per_node(grid: &Grid) -> f64 {
    grid.axes().iter().map(|axis| axis.spacing() as f64).product()
}

fn subtracted(
    parts: &[Part],
    responses: &[Spectrum],
    grid: &Grid,
    weight: impl Fn(Complex<f64>) -> Complex<f64>,
) -> Vec<Subtracted> {
    let mean = crate::restoration::model::mean_spectrum(
        parts,
        responses,
        responses.first().map_or([0, 0], |response| response.size),
    );
    let weights = mean.map(weight);
    let subtract = |(part, response): (&Part, &Spectrum)| {
        let kernel = response.times(&weights).transformed(FftDirection::Inverse);
        let scale = 1.0 / (kernel.values.len() as f64 * pixels_per_node(grid));
        let at_itself = part.orientation == Orientation::Direct;
        let centre = kernel.values.first().filter(|_| at_itself).map_or(0.0, |q| q.re * scale);
        Subtracted { kernel: kernel.map(|q| q * scale), orientation: part.orientation, field: part.field, centre }
    };
    parts.iter().zip(responses).map(subtract).collect()
}

fn centre(subtracted: &[Subtracted], grid: &Grid) -> Centre {
    if subtracted.iter().all(|part| part.field.is_none()) {
        return Centre::Same(subtracted.iter().map(|part| part.centre).sum());
    }
    let share = |part: &Subtracted, place: [f64; 2]| part.centre * part.field.map_or(1.0, |field| field.share(place));
    let at = |place: [f64; 2]| subtracted.iter().map(|part| share(part, place)).sum::<f64>() as f32;
    Centre::Pixels(grid.pixel_places().map(at).collect())
}

/// A product of two kernels: `|q|^2`, or what comes of the sum of two.
struct Pair {
    term: Term,
    /// Sum of the kernel.
    energy: f64,
    /// Mean and bound of the factors over the field.
    mean: f64,
    largest: f64,
}

impl Pair {
    fn new(one: &Subtracted, other: &Subtracted, times: f64, grid: &Grid) -> Self {
        let pixels = pixels_per_node(grid);
        let products = one.kernel.values.iter().zip(&other.kernel.values);
        // On the nodes a variance stands for that of as many pixels.
        let products = products.map(|(a, b)| Complex::new(times * (a * b.conj()).re * pixels, 0.0));
        let squares = Spectrum { size: one.kernel.size, values: products.collect() };
        let energy = squares.values.iter().map(|value| value.re).sum();
        // The way to the nodes and back would make the narrow squared kernel wider: it is taken out beforehand.
        let grid_response = grid.round_trip_spectrum(squares.size).map(|value| 1.0 / value);
        let transfer = squares.transformed(FftDirection::Forward).times(&grid_response).transfer();
        let fields = [one.field, other.field];
        let factors = fields.iter().flatten().map(|field| field.factors(grid)).reduce(|a, b| a.times(&b));
        let mean =
            crate::spread::field::mean(|place| fields.iter().flatten().map(|field| field.share(place)).product());
        let largest = fields.iter().flatten().map(|field| field.largest(grid)).product();
        Self { term: Term { transfer, orientation: one.orientation, factors }, energy, mean, largest }
    }
}

impl Factors {
    fn times(self, other: &Self) -> Self {
        let product = |a: Vec<f32>, b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).collect();
        Self { received: product(self.received, &other.received), sent: product(self.sent, &other.sent) }
    }
}
