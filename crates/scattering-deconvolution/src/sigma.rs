//! Propagation of noise through a restoration.

use crate::mask::Mask;
use crate::restorer::Work;

/// Share of a variance below which what other pixels add is left out: 0.05 % of sigma.
const NEGLIGIBLE: f64 = 1e-3;

impl Work {
    /// Turns the standard deviations of the observed image into those of the restored one, in place.
    ///
    /// The noise of pixels is independent before and correlated afterwards; sigma is that of each pixel by itself.
    /// Pixels put aside keep their sigma and, as filled or clipped values, bring no noise to others. NaN stays NaN.
    pub(crate) fn propagate_sigma(&mut self, sigma: &mut [f32], mask: &Mask) {
        let noise = &self.model.noise;
        let own = (1.0 - noise.centre).powi(2);
        let finite = || sigma.iter().copied().filter(|value| value.is_finite());
        let (least, most) = finite().fold((f32::INFINITY, 0.0_f32), |(a, b), value| (a.min(value), b.max(value)));
        let [least, most] = [least, most].map(|value| f64::from(value).powi(2));
        if most <= 0.0 {
            return;
        }
        let gain = if noise.surroundings * most <= NEGLIGIBLE * own * least {
            self.variance.iter_mut().for_each(Vec::clear);
            own.sqrt()
        } else {
            self.scatter_variance(sigma, mask);
            (1.0 - 2.0 * self.model.noise.centre).max(0.0).sqrt()
        };
        let surroundings = self.variance[0].iter().copied().chain(std::iter::repeat(0.0));
        let mut kept = mask.pixels().peekable();
        for (pixel, (value, added)) in sigma.iter_mut().zip(surroundings).enumerate() {
            if kept.next_if_eq(&pixel).is_none() {
                let variance = (f64::from(*value) * gain).powi(2) + f64::from(added.max(0.0));
                *value = variance.sqrt() as f32;
            }
        }
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
        self.convolver.apply(&mut self.spare, &self.model.noise.squared_kernel);
        plane.fill(0.0);
        self.grid.add_interpolated(&self.spare, 1.0, plane, zeros);
    }
}
