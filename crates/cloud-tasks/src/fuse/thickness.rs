//! How far points lie off the surfaces that they belong to, against what their noise gives.

use fusion::Fused;
use nalgebra::Point3;
use point_uncertainty::PointErrors;
use statistics::{Distribution, robust_standard_deviation};

use super::input::Usable;
use super::summary::ThicknessSummary;

/// Points of a fused point from which its own scatter is taken: with fewer, the mean takes most of it.
const LEAST_POINTS: usize = 3;
/// Deviations that stand for all: their mean probability is then right to 1 %.
const MOST_DEVIATIONS: usize = 10_000;
/// Halvings until the median of a mixture is as exact as its numbers.
const HALVINGS: usize = 60;

/// Heights are taken from the mean of those of the same fused point, at which they cost a degree of freedom. `None` where no
/// fused point has points enough.
pub(crate) fn thickness(usable: &Usable<'_>, moved: &[Point3<f64>], fused: &Fused) -> Option<ThicknessSummary> {
    let mut members: Vec<(u32, usize)> =
        fused.surfel_of_point.iter().enumerate().filter_map(|(at, surfel)| Some(((*surfel)?, at))).collect();
    members.sort_unstable();
    let (mut before, mut after, mut noise, mut own) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for group in members.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() >= LEAST_POINTS) {
        let surfel = &fused.surfels[group[0].0 as usize];
        let heights = |points: &[Point3<f64>]| -> Vec<f64> {
            group.iter().map(|(_, at)| surfel.normal.dot(&(points[*at] - surfel.position))).collect()
        };
        before.extend(centred(&heights(&usable.points)));
        after.extend(centred(&heights(moved)));
        for (_, at) in group {
            let variance = surfel.normal.dot(&(usable.noise(*at) * surfel.normal)).max(0.0);
            let shift = usable.sensor(*at).map_or(0.0, |(_, shift)| shift.dot(&surfel.normal));
            noise.push(variance.sqrt());
            own.push((variance + shift * shift).sqrt());
        }
    }
    (!before.is_empty()).then(|| ThicknessSummary {
        before_m: robust_standard_deviation(&before),
        after_m: robust_standard_deviation(&after),
        noise_m: spread_of_mixture(&noise),
        noise_and_sensor_m: spread_of_mixture(&own),
        points: before.len(),
    })
}

/// Heights over their mean, scaled to what they would scatter over the true one.
fn centred(heights: &[f64]) -> impl Iterator<Item = f64> {
    let count = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / count;
    let factor = (count / (count - 1.0)).sqrt();
    heights.iter().map(move |height| (height - mean) * factor)
}

/// Robust standard deviation of values of which each is drawn with its own deviation.
fn spread_of_mixture(deviations: &[f64]) -> f64 {
    let step = deviations.len().div_ceil(MOST_DEVIATIONS).max(1);
    let few: Vec<f64> = deviations.iter().copied().step_by(step).filter(|deviation| *deviation > 0.0).collect();
    let within = |limit: f64| {
        let inside = few.iter().map(|deviation| 2.0 * Distribution::Normal.cumulative(limit / deviation) - 1.0);
        inside.sum::<f64>() / few.len().max(1) as f64
    };
    let quarter = Distribution::Normal.quantile(0.75);
    let (mut low, mut high) = (0.0, few.iter().copied().fold(0.0, f64::max));
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if within(middle) < 0.5 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high / quarter
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixture_of_equal_deviations_has_theirs() {
        assert!((spread_of_mixture(&[0.003; 7]) - 0.003).abs() < 1e-9);
        let mixed = spread_of_mixture(&[0.001, 0.003]);
        assert!((0.001..0.003).contains(&mixed), "{mixed}");
    }

    #[test]
    fn three_heights_keep_their_variance() {
        let centred: Vec<f64> = centred(&[1.0, 2.0, 3.0]).collect();
        // The unbiased variance of 1, 2, 3 is one: that of the scaled heights, over three.
        assert!((centred.iter().map(|height| height * height).sum::<f64>() / 3.0 - 1.0).abs() < 1e-12);
    }
}
