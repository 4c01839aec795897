//! What all pixels of repeated frames share: phase and amplitude of each frame, and the beat with another camera.

use crate::ComplexChannel;

/// Pixels that the shared part is estimated from, at most, and their values in all frames: a beat that is there stands out
/// the more in each pixel, the more frames there are.
const MOST_PIXELS: usize = 4096;
const MOST_VALUES: usize = 128 * MOST_PIXELS;

/// A pixel counts with the square of its deviation up to so many times its expectation. A choice; without it a few
/// pixels that moved make the beat.
const HELD_BACK: f64 = 3.0;

/// Rounds in which the frames' own phases and amplitudes and the plane of the beat are told apart.
const ROUNDS: usize = 4;

/// Steps of the iteration for the plane; one that stands out settles in a few, and one that does not means nothing.
const STEPS: usize = 30;

/// Values of a pixel in all frames, in its standard deviations.
#[derive(Default)]
pub(crate) struct Deviation {
    /// Mean over the frames.
    mean: [f64; 2],
    /// Real and imaginary parts less their mean, frame by frame.
    parts: Vec<[f64; 2]>,
}

impl Deviation {
    /// Takes over the values of a pixel; `false` unless all values and a standard deviation are known.
    pub(crate) fn set(&mut self, channels: &[&ComplexChannel], pixel: usize) -> bool {
        let count = channels.len() as f64;
        let (mut mean, mut variance) = ([0.0; 2], 0.0);
        self.parts.clear();
        for channel in channels {
            let [re, im, sigma] =
                [&channel.real, &channel.imaginary, &channel.sigma].map(|plane| f64::from(plane.as_slice()[pixel]));
            self.parts.push([re, im]);
            mean = [mean[0] + re / count, mean[1] + im / count];
            variance += sigma * sigma / count;
        }
        if !(mean[0].is_finite() && mean[1].is_finite() && variance > 0.0 && variance.is_finite()) {
            return false;
        }
        let sigma = variance.sqrt();
        for value in &mut self.parts {
            *value = [(value[0] - mean[0]) / sigma, (value[1] - mean[1]) / sigma];
        }
        self.mean = mean.map(|part| part / sigma);
        true
    }

    /// Ratio of signal to noise.
    pub(crate) fn snr(&self) -> f64 {
        self.mean[0].hypot(self.mean[1])
    }

    /// Without the relative amplitude and the phase that each frame has in common.
    fn without<'a>(&'a self, common: &'a [[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + 'a {
        let [re, im] = self.mean;
        let one = move |([x, y], [along, across]): (&[f64; 2], &[f64; 2])| {
            [x - along * re + across * im, y - along * im - across * re]
        };
        self.parts.iter().zip(common).map(one)
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

/// Real and imaginary part for each frame, two times.
type Plane = [Vec<[f64; 2]>; 2];

/// What all pixels share.
pub(crate) struct Beat {
    /// Relative amplitude and phase of each frame.
    common: Vec<[f64; 2]>,
    /// Two orthonormal vectors over the frames, real and imaginary parts.
    plane: Plane,
}

impl Beat {
    /// The plane that holds most of what pixels deviate beside what the frames have in common; `None` without pixels.
    pub(crate) fn of(channels: &[&ComplexChannel]) -> Option<Self> {
        let pixels = channels.first()?.real.as_slice().len();
        let most = (MOST_VALUES / channels.len()).clamp(1, MOST_PIXELS);
        let step = pixels.div_ceil(most).max(1);
        let known = |pixel: usize| {
            let mut deviation = Deviation::default();
            deviation.set(channels, pixel).then_some(deviation)
        };
        let sample: Vec<Deviation> = (0..pixels).step_by(step).filter_map(known).collect();
        if sample.is_empty() {
            return None;
        }
        let nothing = vec![[0.0; 2]; channels.len()];
        let mut beat = Self { common: nothing.clone(), plane: [nothing.clone(), nothing] };
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
            let [first, second] = self.plane.each_ref().map(|vector| dot(vector, deviation.without(&self.common)));
            for (frame, sum) in sums.iter_mut().enumerate() {
                let [a, b] = [self.plane[0][frame], self.plane[1][frame]];
                let [x, y] = [0, 1].map(|part| deviation.parts[frame][part] - first * a[part] - second * b[part]);
                *sum = [sum[0] + x * re + y * im, sum[1] + y * re - x * im];
            }
            weight += re * re + im * im;
        }
        sums.into_iter().map(|sum| sum.map(|part| if weight > 0.0 { part / weight } else { 0.0 })).collect()
    }

    /// The two directions of the largest second moments, by subspace iteration. The matrix of the moments is never made:
    /// it grows with the square of the number of frames.
    fn estimate_plane(&self, sample: &[Deviation]) -> Plane {
        let frames = self.common.len();
        let freedom = (2 * frames - 2) as f64;
        let mut rows: Vec<[f64; 2]> = Vec::with_capacity(sample.len() * frames);
        for deviation in sample {
            let start = rows.len();
            rows.extend(deviation.without(&self.common));
            let row = &mut rows[start..];
            let scale = (HELD_BACK * freedom / dot(row, row.iter().copied())).min(1.0).sqrt();
            for value in row {
                *value = value.map(|part| scale * part);
            }
        }
        let apply = |vector: &[[f64; 2]]| {
            let mut sum = vec![[0.0; 2]; frames];
            for row in rows.chunks_exact(frames) {
                let share = dot(row, vector.iter().copied());
                for (sum, value) in sum.iter_mut().zip(row) {
                    *sum = [sum[0] + share * value[0], sum[1] + share * value[1]];
                }
            }
            sum
        };
        // A start that no beat is orthogonal to by its design.
        let start = |rate: f64| -> Vec<[f64; 2]> {
            (0..frames).map(|frame| [1, 2].map(|part| (rate * (2 * frame + part) as f64).sin())).collect()
        };
        let mut plane = orthonormal([start(1.0), start(2.3)]);
        for _ in 0..STEPS {
            plane = orthonormal([apply(&plane[0]), apply(&plane[1])]);
        }
        plane
    }

    /// What a pixel has in the plane and beside it.
    pub(crate) fn parts(&self, deviation: &Deviation) -> Parts {
        let clean = || deviation.without(&self.common);
        let [own, with_common] = self.plane.iter().fold([0.0; 2], |[own, all], vector| {
            [own + dot(vector, clean()).powi(2), all + dot(vector, deviation.parts.iter().copied()).powi(2)]
        });
        let square: f64 = clean().map(|[x, y]| x * x + y * y).sum();
        Parts { own, with_common, beside: square - own }
    }

    /// Sum of the squared differences of successive frames over the sum of squares: 2 for frames that have nothing to do
    /// with each other (`[vonNeumann1941]`).
    pub(crate) fn successive_difference(&self) -> f64 {
        let [differences, squares] = self.plane.iter().fold([0.0; 2], |[differences, squares], vector| {
            let step = |pair: &[[f64; 2]]| (pair[0][0] - pair[1][0]).powi(2) + (pair[0][1] - pair[1][1]).powi(2);
            let step: f64 = vector.windows(2).map(step).sum();
            [differences + step, squares + dot(vector, vector.iter().copied())]
        });
        differences / squares
    }
}

fn dot(a: &[[f64; 2]], b: impl Iterator<Item = [f64; 2]>) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum()
}

fn orthonormal([first, second]: Plane) -> Plane {
    let first = normalised(first);
    let along = dot(&first, second.iter().copied());
    let less = |(part, first): (&[f64; 2], &[f64; 2])| [part[0] - along * first[0], part[1] - along * first[1]];
    let second = second.iter().zip(&first).map(less).collect();
    [first, normalised(second)]
}

/// Of length one; zero stays zero.
fn normalised(mut vector: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let length = dot(&vector, vector.iter().copied()).sqrt();
    if length > 0.0 {
        for part in &mut vector {
            *part = part.map(|value| value / length);
        }
    }
    vector
}
