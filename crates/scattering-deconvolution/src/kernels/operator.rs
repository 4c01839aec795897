//! Scattering on the nodes of a grid: a sum of convolutions with factors over the field.

use fourier_transforms::num_complex::Complex;

use crate::kernels::convolution::{Convolver, Transfer};
use crate::kernels::parts::Orientation;

/// A linear operator on images of one size.
pub(crate) struct Operator {
    terms: Vec<Term>,
    light: Vec<Complex<f32>>,
    sum: Vec<Complex<f32>>,
}

/// `received · (kernel * (sent · image))`, the image perhaps mirrored.
pub(crate) struct Term {
    pub(crate) transfer: Transfer,
    pub(crate) orientation: Orientation,
    pub(crate) factors: Option<Factors>,
}

/// Factors of a term at each node.
pub(crate) struct Factors {
    pub(crate) received: Vec<f32>,
    pub(crate) sent: Vec<f32>,
}

impl Operator {
    /// For images of so many values.
    pub(crate) fn new(terms: Vec<Term>, values: usize) -> Self {
        let plain = matches!(&terms[..], [term] if term.is_plain());
        let zeros = vec![Complex::new(0.0, 0.0); if plain { 0 } else { values }];
        Self { terms, light: zeros.clone(), sum: zeros }
    }

    /// The only term, where it is the same for all pixels.
    pub(crate) fn plain(&self) -> Option<&Transfer> {
        match &self.terms[..] {
            [term] if term.is_plain() => Some(&term.transfer),
            _ => None,
        }
    }

    /// Puts the scattered light into the image.
    pub(crate) fn apply(&mut self, convolver: &mut Convolver, image: &mut [Complex<f32>]) {
        if let Some(transfer) = self.plain() {
            convolver.apply(image, transfer);
            return;
        }
        let Self { terms, light, sum } = self;
        sum.fill(Complex::new(0.0, 0.0));
        for term in terms {
            light.copy_from_slice(image);
            if let Some(factors) = &term.factors {
                light.iter_mut().zip(&factors.sent).for_each(|(light, factor)| *light *= factor);
            }
            if term.orientation == Orientation::Mirrored {
                light.reverse();
            }
            convolver.apply(light, &term.transfer);
            match &term.factors {
                None => sum.iter_mut().zip(&*light).for_each(|(sum, light)| *sum += light),
                Some(factors) => {
                    let lights = light.iter().zip(&factors.received);
                    sum.iter_mut().zip(lights).for_each(|(sum, (light, factor))| *sum += light * factor);
                }
            }
        }
        image.copy_from_slice(sum);
    }
}

impl Term {
    fn is_plain(&self) -> bool {
        self.orientation == Orientation::Direct && self.factors.is_none()
    }
}
