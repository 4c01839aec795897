//! What the samples of a scene at rest have in common: nothing beside offset, fundamental and known harmonics.

use std::f64::consts::TAU;

use statistics::chi_squared_limit;

use crate::demodulation::weights::GROUP;
use crate::{ConsistencyOptions, NoiseModel, OffsetRule};

/// The part of N samples that has to be noise alone, in an orthonormal basis, and how large noise may make it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SampleRules {
    /// `components * groups`: the basis in groups of steps, filled up with zeros.
    pub(crate) basis: Vec<[f32; GROUP]>,
    /// Groups of steps.
    pub(crate) groups: usize,
    /// Dimension of the part.
    pub(crate) components: usize,
    /// The squared length that noise of variance 1 exceeds with the probability of a false alarm, as a polynomial in the
    /// square of the modulation of that variance.
    pub(crate) limit: [f32; 3],
    /// Variance of a sample: for each unit of the offset, and without light.
    pub(crate) shot: f32,
    pub(crate) dark: f32,
    /// Length that is let pass for each unit of amplitude.
    pub(crate) tolerance: f32,
}

impl SampleRules {
    /// The rules of `steps` samples with a noise that applies to them after the scale.
    pub(crate) fn new(steps: usize, scale: f64, noise: &NoiseModel, options: &ConsistencyOptions) -> Self {
        let bins = free_bins(steps, options);
        let components: Vec<_> = bins.iter().flat_map(|&bin| components_of(bin, steps)).collect();
        let groups = steps.div_ceil(GROUP);
        let step = |component: &Component, index: usize| {
            if index < steps { (scale * component.at(index, steps)) as f32 } else { 0.0 }
        };
        let basis = components
            .iter()
            .flat_map(|component| {
                (0..groups).map(move |group| std::array::from_fn(|place| step(component, group * GROUP + place)))
            })
            .collect();
        let pairs = neighbours(&bins, steps);
        let shot = if options.offset == OffsetRule::Zero { 0.0 } else { noise.shot_variance_per_unit };
        Self {
            basis,
            groups,
            components: components.len(),
            limit: limit(components.len() as f64, pairs, options.false_alarm_probability),
            shot: shot as f32,
            dark: (noise.dark_sigma * noise.dark_sigma) as f32,
            tolerance: (options.tolerance * (steps as f64 / 2.0).sqrt()) as f32,
        }
    }
}

/// Frequencies of the discrete Fourier transform of `steps` samples, from 0 to N/2, that a scene at rest leaves empty.
fn free_bins(steps: usize, options: &ConsistencyOptions) -> Vec<usize> {
    let taken: Vec<usize> = options.harmonics.iter().map(|order| (order % steps).min(steps - order % steps)).collect();
    let first = if options.offset == OffsetRule::Zero { 0 } else { 2 };
    (first..=steps / 2).filter(|bin| *bin != 1 && !taken.contains(bin)).collect()
}

/// One vector of the basis.
#[derive(Clone, Copy)]
struct Component {
    bin: usize,
    quarter: f64,
    length: f64,
}

impl Component {
    fn at(&self, step: usize, steps: usize) -> f64 {
        let turns = (self.bin * step % steps) as f64 / steps as f64;
        self.length * (TAU * (turns - self.quarter)).cos()
    }
}

/// Cosine and sine of a bin; of the bins 0 and N/2 the cosine alone.
fn components_of(bin: usize, steps: usize) -> Vec<Component> {
    if bin == 0 || 2 * bin == steps {
        return vec![Component { bin, quarter: 0.0, length: (1.0 / steps as f64).sqrt() }];
    }
    let length = (2.0 / steps as f64).sqrt();
    [0.0, 0.25].map(|quarter| Component { bin, quarter, length }).to_vec()
}

/// Number of pairs of two-sided bins that are next to each other, each pair in both orders counted once.
fn neighbours(bins: &[usize], steps: usize) -> usize {
    let has = |bin: usize| bins.contains(&bin.min(steps - bin));
    (0..steps).filter(|&bin| has(bin) && has((bin + 1) % steps)).count()
}

/// Three values of the limit, made a polynomial in `a^2`, `a` being the modulation of the samples' variance
/// `v (1 + a cos(phi + theta_n))`.
///
/// With `a = 0` the squared length over v is chi-squared of R degrees of freedom. Otherwise parts next to each other in
/// frequency are correlated: it is a sum of chi-squared variables with the weights l, the eigenvalues of a band matrix,
/// and `sum l = R`, `sum l^2 = R + a^2 pairs / 2`, `sum l^3 = R + 3 a^2 pairs / 2`. A chi-squared variable that was
/// stretched and shifted to the same mean, variance and skewness stands for it (`[Buckley1988]`).
fn limit(degrees: f64, pairs: usize, probability: f64) -> [f32; 3] {
    if degrees < 1.0 {
        return [f32::INFINITY, 0.0, 0.0];
    }
    let at = |square: f64| {
        let coupled = square * pairs as f64 / 2.0;
        let (second, third) = (degrees + coupled, degrees + 3.0 * coupled);
        let equivalent = second.powi(3) / third.powi(2);
        degrees + third / second * (chi_squared_limit(equivalent, probability) - equivalent)
    };
    let [none, half, full] = [0.0, 0.5, 1.0].map(at);
    [none as f32, (4.0 * half - full - 3.0 * none) as f32, (2.0 * (full + none) - 4.0 * half) as f32]
}
