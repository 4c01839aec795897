//! Propagation of noise through a restoration.

use range_image::with_wide_registers;
use rayon::prelude::*;

use crate::kernels::lanes::finite_extremes;
use crate::restoration::mask::Mask;
use crate::restoration::noise::Centre;
use crate::restoration::work::Work;

/// Share of a variance below which what other pixels add is left out: 0.05 % of sigma.
const NEGLIGIBLE: f64 = 1e-3;
/// Pixels that one task takes; smaller tasks cost more to hand out than to do.
const CHUNK: usize = 1 << 15;

impl Work {
    /// Turns the standard deviations of the observed image into those of the restored one, in place.
    ///
    /// The noise of pixels is independent before and correlated afterwards; sigma is that of each pixel by itself.
    /// Pixels put aside keep their sigma and, as filled or clipped values, bring no noise to others. NaN stays NaN.
    pub(crate) fn propagate_sigma(&mut self, sigma: &mut [f32], mask: &Mask) {
        let extremes = extremes(sigma);
        if extremes[1] <= 0.0 {
            return;
        }
        self.kept_sigma.clear();
        self.kept_sigma.extend(mask.pixels().map(|pixel| sigma[pixel]));
        if self.is_own_noise(extremes) {
            scale(sigma, &self.model.noise.centre);
        } else {
            self.scatter_variance(sigma, mask);
            add(sigma, &self.model.noise.centre, &self.variance[0]);
        }
        mask.pixels().zip(&self.kept_sigma).for_each(|(pixel, value)| sigma[pixel] = *value);
    }

    /// Factor of all sigmas, where nothing is put aside and it is the same for all pixels.
    pub(crate) fn gain_of_all(&self, sigma: &[f32]) -> Option<f32> {
        match self.model.noise.centre {
            Centre::Same(centre) if self.is_own_noise(extremes(sigma)) => Some(own_gain(centre)),
            _ => None,
        }
    }

    /// Whether noise of other pixels does not count, given the least and the largest sigma.
    fn is_own_noise(&self, extremes: [f32; 2]) -> bool {
        let [least, most] = extremes.map(|value| f64::from(value).powi(2));
        let noise = &self.model.noise;
        let own = (1.0 - noise.largest_centre()).powi(2);
        noise.surroundings * most <= NEGLIGIBLE * own * least
    }

    /// Puts `q^2 * var` into the first variance plane.
    fn scatter_variance(&mut self, sigma: &[f32], mask: &Mask) {
        let [plane, zeros] = &mut self.variance;
        zeros.clear();
        zeros.resize(sigma.len(), 0.0);
        plane.clear();
        plane.extend(sigma.iter().map(|value| if value.is_finite() { value * value } else { 0.0 }));
        for pixel in mask.pixels() {
            plane[pixel] = 0.0;
        }
        self.grid.restrict(plane, zeros, &mut self.spare);
        self.model.noise.squared.apply(&mut self.convolver, &mut self.spare);
        plane.fill(0.0);
        self.grid.add_interpolated(&self.spare, 1.0, plane, zeros);
    }
}

/// Smallest and largest sigma that is known.
fn extremes(sigma: &[f32]) -> [f32; 2] {
    let extremes = sigma.par_chunks(CHUNK).map(|sigma| {
        with_wide_registers(
            #[inline(always)]
            || finite_extremes(sigma),
        )
    });
    extremes.reduce(|| [f32::INFINITY, 0.0], |a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// What a pixel keeps of its own noise.
fn own_gain(centre: f64) -> f32 {
    (1.0 - centre).abs() as f32
}

/// What each pixel keeps of its own noise, where that of the others does not count.
fn scale(sigma: &mut [f32], centre: &Centre) {
    match centre {
        Centre::Same(centre) => {
            let gain = own_gain(*centre);
            sigma.par_chunks_mut(CHUNK).for_each(|sigma| sigma.iter_mut().for_each(|value| *value *= gain));
        }
        Centre::Pixels(centres) => {
            sigma.iter_mut().zip(centres).for_each(|(value, centre)| *value *= (1.0 - centre).abs());
        }
    }
}

/// Variances of the own noise and of that of all pixels, which the own is among.
fn add(sigma: &mut [f32], centre: &Centre, added: &[f32]) {
    let total = |value: f32, centre: f64, added: f32| {
        let own = (1.0 - 2.0 * centre).max(0.0) * f64::from(value).powi(2);
        (own + f64::from(added.max(0.0))).sqrt() as f32
    };
    let values = sigma.iter_mut().zip(added);
    match centre {
        Centre::Same(centre) => values.for_each(|(value, added)| *value = total(*value, *centre, *added)),
        Centre::Pixels(centres) => {
            values.zip(centres).for_each(|((value, added), centre)| *value = total(*value, f64::from(*centre), *added));
        }
    }
}
