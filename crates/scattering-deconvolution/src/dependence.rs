//! Pixels whose correction depends strongly on light that is not known.

use rustfft::num_complex::Complex;

use crate::mask::Mask;
use crate::work::Work;

impl Work {
    /// Notes pixels that pixels put aside have given more light, by what counted as theirs, than `limit` times what the
    /// pixel has left.
    pub(crate) fn find_dependent(&mut self, real: &[f32], imaginary: &[f32], mask: &mut Mask, limit: f64) {
        if mask.kept() == 0 || limit.is_infinite() {
            return;
        }
        self.spare.fill(Complex::new(0.0, 0.0));
        for (pixel, light) in mask.lights() {
            self.grid.deposit(pixel, light, &mut self.spare);
        }
        self.model.scatter.apply(&mut self.convolver, &mut self.spare);
        self.spare.iter_mut().for_each(|light| *light = Complex::new(light.norm(), 0.0));
        let [plane, zeros] = &mut self.variance;
        for plane in [&mut *plane, &mut *zeros] {
            plane.clear();
            plane.resize(real.len(), 0.0);
        }
        self.grid.add_interpolated(&self.spare, 1.0, plane, zeros);
        let limit = (limit * limit) as f32;
        mask.note_dependent(real.len(), |pixel| {
            let own = real[pixel] * real[pixel] + imaginary[pixel] * imaginary[pixel];
            plane[pixel] * plane[pixel] > limit * own
        });
    }
}
