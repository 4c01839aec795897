//! What all pixels of repeated frames share: phase and amplitude of each frame, and the beat with another camera.

use crate::ComplexChannel;

/// Pixels that the shared part is estimated from, at most.
const MOST_PIXELS: usize = 4096;

/// A pixel counts with the square of its deviation up to so many times its expectation.
const HELD_BACK: f64 = 3.0;

/// Rounds in which the frames' own phases and amplitudes and the plane of the beat are told apart.
const ROUNDS: usize = 4;

/// Steps of the iteration for the plane; one that stands out settles in a few, and one that does not means nothing.
const STEPS: usize = 30;

/// Values of a pixel in all frames, in its standard deviations.
pub(crate) struct Deviation {
    /// Mean over the frames.
    mean: [f64; 2],
    /// Values less their mean, real and imaginary parts in turn.
    parts: Vec<f64>,
}

impl Deviation {
    /// `None` unless all values and a standard deviation are known.
    pub(crate) fn of(channels: &[&ComplexChannel], pixel: usize) -> Option<Self> {
        let count = channels.len() as f64;
        let (mut parts, mut mean, mut variance) = (Vec::with_capacity(2 * channels.len()), [0.0; 2], 0.0);
        for channel in channels {
            let [re, im, sigma] =
                [&channel.real, &channel.imaginary, &channel.sigma].map(|plane| f64::from(plane.as_slice()[pixel]));
            parts.extend([re, im]);
            mean = [mean[0] + re / count, mean[1] + im / count];
            variance += sigma * sigma / count;
        }
        if !(mean[0].is_finite() && mean[1].is_finite() && variance > 0.0 && variance.is_finite()) {
            return None;
        }
        let sigma = variance.sqrt();
        for value in parts.as_chunks_mut::<2>().0 {
            *value = [(value[0] - mean[0]) / sigma, (value[1] - mean[1]) / sigma];
        }
        Some(Self { mean: mean.map(|part| part / sigma), parts })
    }

    /// Ratio of signal to noise.
    pub(crate) fn snr(&self) -> f64 {
        self.mean[0].hypot(self.mean[1])
    }

    /// Without the relative amplitude and the phase that each frame has in common.
    fn without(&self, common: &[[f64; 2]]) -> Vec<f64> {
        let [re, im] = self.mean;
        let values = self.parts.as_chunks::<2>().0.iter().zip(common);
        values
            .flat_map(|([x, y], [along, across])| [x - along * re + across * im, y - along * im - across * re])
            .collect()
    }
}

/// Squares of parts of a deviation.
pub(crate) struct Parts {
    /// In the plane, beside what the frames have in common.
    pub(crate) own: f64,
    /// In the plane, with that: a beat that is alike in all pixels looks as if the frames had it in common.
    pub(crate) with_common: f64,
    /// Neither in the plane nor in common.
    pub(crate) beside: f64,
}

/// What all pixels share.
pub(crate) struct Beat {
    /// Relative amplitude and phase of each frame.
    common: Vec<[f64; 2]>,
    /// Two orthonormal vectors over the frames, real and imaginary parts in turn.
    plane: [Vec<f64>; 2],
}

impl Beat {
    /// The plane that holds most of what pixels deviate beside what the frames have in common; `None` without pixels.
    pub(crate) fn of(channels: &[&ComplexChannel]) -> Option<Self> {
        let pixels = channels.first()?.real.as_slice().len();
        let step = pixels.div_ceil(MOST_PIXELS).max(1);
        let sample: Vec<Deviation> =
            (0..pixels).step_by(step).filter_map(|pixel| Deviation::of(channels, pixel)).collect();
        if sample.is_empty() {
            return None;
        }
        let nothing = vec![0.0; 2 * channels.len()];
        let mut beat = Self { common: vec![[0.0; 2]; channels.len()], plane: [nothing.clone(), nothing] };
        for _ in 0..ROUNDS {
            beat.common = beat.estimate_common(&sample);
            beat.plane = beat.estimate_plane(&sample);
        }
        Some(beat)
    }

    /// Phase and amplitude of the frames from what the plane does not hold.
    fn estimate_common(&self, sample: &[Deviation]) -> Vec<[f64; 2]> {
        let (mut sums, mut weight) = (vec![[0.0; 2]; self.common.len()], 0.0);
        for deviation in sample {
            let [re, im] = deviation.mean;
            let clean = deviation.without(&self.common);
            let along = self.plane.each_ref().map(|vector| dot(vector, &clean));
            for (frame, sum) in sums.iter_mut().enumerate() {
                let rest = |part: usize| {
                    let place = 2 * frame + part;
                    deviation.parts[place] - along[0] * self.plane[0][place] - along[1] * self.plane[1][place]
                };
                let [x, y] = [rest(0), rest(1)];
                *sum = [sum[0] + x * re + y * im, sum[1] + y * re - x * im];
            }
            weight += re * re + im * im;
        }
        sums.into_iter().map(|sum| sum.map(|part| if weight > 0.0 { part / weight } else { 0.0 })).collect()
    }

    /// The two directions of the largest second moments, by subspace iteration.
    fn estimate_plane(&self, sample: &[Deviation]) -> [Vec<f64>; 2] {
        let size = 2 * self.common.len();
        let freedom = (size - 2) as f64;
        let mut moments = vec![0.0; size * size];
        for deviation in sample {
            let clean = deviation.without(&self.common);
            let weight = (HELD_BACK * freedom / dot(&clean, &clean)).min(1.0);
            for (row, a) in moments.chunks_exact_mut(size).zip(&clean) {
                for (moment, b) in row.iter_mut().zip(&clean) {
                    *moment += weight * a * b;
                }
            }
        }
        let apply = |vector: &[f64]| -> Vec<f64> { moments.chunks_exact(size).map(|row| dot(row, vector)).collect() };
        // A start that no beat is orthogonal to by its design.
        let start = |rate: f64| -> Vec<f64> { (0..size).map(|k| (rate * (k + 1) as f64).sin()).collect() };
        let mut plane = orthonormal([start(1.0), start(2.3)]);
        for _ in 0..STEPS {
            plane = orthonormal([apply(&plane[0]), apply(&plane[1])]);
        }
        plane
    }

    /// What a pixel has in the plane and beside it.
    pub(crate) fn parts(&self, deviation: &Deviation) -> Parts {
        let in_plane = |parts: &[f64]| self.plane.iter().map(|vector| dot(vector, parts).powi(2)).sum::<f64>();
        let clean = deviation.without(&self.common);
        let own = in_plane(&clean);
        Parts { own, with_common: in_plane(&deviation.parts), beside: dot(&clean, &clean) - own }
    }

    /// Sum of the squared differences of successive frames over the sum of squares: 2 for frames that have nothing to do
    /// with each other (`[vonNeumann1941]`).
    pub(crate) fn successive_difference(&self) -> f64 {
        let [differences, squares] = self.plane.iter().fold([0.0; 2], |[differences, squares], vector| {
            let step: f64 = vector.iter().zip(&vector[2..]).map(|(a, b)| (a - b) * (a - b)).sum();
            [differences + step, squares + dot(vector, vector)]
        });
        differences / squares
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn orthonormal([first, second]: [Vec<f64>; 2]) -> [Vec<f64>; 2] {
    let first = normalised(first);
    let along = dot(&first, &second);
    let second = second.iter().zip(&first).map(|(part, first)| part - along * first).collect();
    [first, normalised(second)]
}

/// Of length one; zero stays zero.
fn normalised(mut vector: Vec<f64>) -> Vec<f64> {
    let length = dot(&vector, &vector).sqrt();
    if length > 0.0 {
        for part in &mut vector {
            *part /= length;
        }
    }
    vector
}
