//! Windows that something covers in part.
//!
//! A finger over a part of a window bends the corner that is fitted to all of it: by several standard deviations, however small the
//! part. What it covers is found by the residuals, of single pixels and as means of nine: where one is larger than chance makes
//! any of a window, the pixels about it, as far as the blur reaches, are left out and the corner is fitted to the others, until
//! what is left agrees. The worst half goes first, as a bent corner has residuals where nothing is covered, too.

use statistics::{Distribution, bonferroni};

use super::fit::{Fitted, Problem};
use super::window::{Expected, Pixel};

/// Probability at which a window that nothing covers has a residual beyond the limit.
const LEVEL: f64 = 1e-3;

/// Most fits of a window: residuals of a hundred deviations are halved in six.
const MOST_ROUNDS: usize = 12;

/// How far what covers a pixel is seen beside it, in deviations of the blur: beyond, a hundredth of a percent of it is left.
const REACH_BLURS: f64 = 3.0;

/// Values of pixels by their places in the window, NaN where there is none.
struct Places {
    least: [i32; 2],
    size: [usize; 2],
    /// Index of the pixel at a place.
    pixels: Vec<Option<usize>>,
}

fn place(pixel: &Pixel) -> [i32; 2] {
    pixel.place.map(|value| value.round() as i32)
}

impl Places {
    fn new(pixels: &[Pixel]) -> Self {
        let bound = |pick: fn(i32, i32) -> i32, start: i32| {
            pixels.iter().map(place).fold([start; 2], |bound, at| [pick(bound[0], at[0]), pick(bound[1], at[1])])
        };
        let (least, most) = (bound(i32::min, i32::MAX), bound(i32::max, i32::MIN));
        let size = [0, 1].map(|axis| usize::try_from(most[axis] - least[axis] + 1).unwrap_or(0));
        let mut places = Self { least, size, pixels: vec![None; size[0] * size[1]] };
        for (index, pixel) in pixels.iter().enumerate() {
            if let Some(at) = places.index(place(pixel)) {
                places.pixels[at] = Some(index);
            }
        }
        places
    }

    fn index(&self, at: [i32; 2]) -> Option<usize> {
        let [x, y] =
            [0, 1].map(|axis| usize::try_from(at[axis] - self.least[axis]).ok().filter(|k| *k < self.size[axis]));
        Some(y? * self.size[0] + x?)
    }

    /// Pixels within so many pixels along both axes.
    fn about(&self, at: [i32; 2], reach: i32) -> impl Iterator<Item = usize> {
        let places = (-reach..=reach).flat_map(move |y| (-reach..=reach).map(move |x| [at[0] + x, at[1] + y]));
        places.filter_map(|at| self.pixels[self.index(at)?])
    }
}

/// Largest residual of a window in deviations, of single pixels and of means of nine, over what half of all windows have at most if
/// nothing but noise disturbs them: about one, and more where real edges differ from the model.
pub(super) fn excess(problem: &Problem<'_>, fit: &Fitted, sigma: f64) -> f64 {
    let places = Places::new(problem.pixels);
    let kept = vec![true; problem.pixels.len()];
    let worst = sizes(problem, &places, fit, &kept, sigma).into_iter().fold(0.0, f64::max);
    let tests = 4.0 * problem.pixels.len() as f64;
    worst / Distribution::Normal.quantile(0.5_f64.powf(1.0 / tests))
}

/// Residuals of the pixels that are kept in deviations: each by itself, or as the mean of nine about it, whichever is larger.
fn sizes(problem: &Problem<'_>, places: &Places, fit: &Fitted, kept: &[bool], sigma: f64) -> Vec<f64> {
    let residuals = problem.residuals(fit);
    let size = |k: usize| {
        let about = places.about(place(&problem.pixels[k]), 1).filter(|&other| kept[other]);
        let (sum, count) = about.fold((0.0, 0.0_f64), |(sum, count), other| (sum + residuals[other], count + 1.0));
        residuals[k].abs().max((sum / count.sqrt()).abs()) / sigma
    };
    (0..kept.len()).map(|k| if kept[k] { size(k) } else { 0.0 }).collect()
}

/// The corner fitted to what nothing covers, from the fit to all pixels of a window; `None` where too little is left or no part of it
/// agrees. `sigma`: deviation of a residual that nothing disturbs. The fit itself where nothing is covered.
pub(super) fn without_covered(
    problem: &Problem<'_>,
    expected: &Expected,
    sign: f64,
    sigma: f64,
    whole: Fitted,
) -> Option<Fitted> {
    let places = Places::new(problem.pixels);
    // Two tests of each pixel, on both sides.
    let level = bonferroni(LEVEL, 4 * problem.pixels.len());
    let limit = Distribution::Normal.quantile(1.0 - level);
    let mut kept = vec![true; problem.pixels.len()];
    let mut fit = whole;
    for _ in 0..MOST_ROUNDS {
        let sizes = sizes(problem, &places, &fit, &kept, sigma);
        let worst = sizes.iter().copied().fold(0.0, f64::max);
        if worst <= limit {
            return Some(fit);
        }
        let cut = limit.max(0.5 * worst);
        let reach = (REACH_BLURS * fit.blur_px()).ceil() as i32;
        for k in (0..sizes.len()).filter(|&k| sizes[k] >= cut) {
            let [x, y] = place(&problem.pixels[k]);
            for other in places.about([x, y], reach) {
                let [u, v] = place(&problem.pixels[other]);
                kept[other] &= (u - x).pow(2) + (v - y).pow(2) > reach * reach;
            }
        }
        let rest: Vec<Pixel> =
            problem.pixels.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(pixel, _)| *pixel).collect();
        fit = problem.with_pixels(&rest).fit(expected, sign, Some(&fit))?;
    }
    None
}
