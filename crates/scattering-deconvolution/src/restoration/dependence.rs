//! Pixels whose correction depends strongly on light that is not known.

use fourier_transforms::num_complex::Complex;
use range_image::with_wide_registers;

use crate::kernels::lanes::{any_exceeds, smallest_square};
use crate::restoration::mask::Mask;
use crate::restoration::work::Work;

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
        let limit = (limit * limit) as f32;
        // Interpolated light is nowhere more than that of the nodes.
        let brightest = self.spare.iter().fold(0.0_f32, |brightest, light| brightest.max(light.re));
        if brightest * brightest
            <= limit
                * with_wide_registers(
                    #[inline(always)]
                    || smallest_square(real, imaginary),
                )
        {
            return;
        }
        let width = self.grid.width();
        self.grid.visit_interpolated(&self.spare, |row, light| {
            let start = row * width;
            let [re, im] = [real, imaginary].map(|plane| &plane[start..start + width]);
            let any = with_wide_registers(
                #[inline(always)]
                || any_exceeds(light, re, im, limit),
            );
            if any {
                mask.note_dependent(start..start + width, |pixel| {
                    let col = pixel - start;
                    light[col] * light[col] > limit * (re[col] * re[col] + im[col] * im[col])
                });
            }
        });
    }
}
