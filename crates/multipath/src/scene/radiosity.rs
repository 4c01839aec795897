//! Light that bounces once: from the source to a facet, from there to another, and back to the camera.

use std::f64::consts::PI;

use crate::numbers::vector::{dot, sub};
use crate::scene::patches::{Facet, Patches};

/// Light of one facet that came by way of others, relative to its direct light.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bounced {
    /// Sum of the amplitudes.
    pub ratio: f64,
    /// Error of the range, metre.
    pub error_m: f64,
}

/// All facets with the light that they send on.
pub(crate) struct Radiosity<'a> {
    patches: &'a Patches,
    /// Albedo times irradiance of each patch and of each cell, relative to a white facing surface at one metre.
    of_patches: Vec<f64>,
    of_cells: Vec<f64>,
    /// Phase of one metre of range; 0 stands for the limit of low frequencies.
    wavenumber: f64,
}

/// Sum over the facets that light one of them.
#[derive(Default)]
struct Sum {
    amplitude: f64,
    re: f64,
    im: f64,
    moment: f64,
}

impl<'a> Radiosity<'a> {
    /// `radiosity` of a facet is its albedo times its irradiance.
    pub fn new(patches: &'a Patches, wavenumber: f64, radiosity: impl Fn(&Facet) -> f64) -> Self {
        let of_patches = patches.patches.iter().map(|(facet, _)| radiosity(facet)).collect();
        let of_cells = patches.cells.iter().map(|(facet, _)| radiosity(facet)).collect();
        Self { patches, of_patches, of_cells, wavenumber }
    }

    /// What the light of all others does to a facet. The facet's own albedo cancels: it sends on both kinds of light.
    pub fn bounced_to(&self, receiver: &Facet) -> Bounced {
        let mut sum = Sum::default();
        for ((patch, cells), radiosity) in self.patches.patches.iter().zip(&self.of_patches) {
            let way = sub(&patch.centre, &receiver.centre);
            // Near by, a patch is no point: its cells are smaller ones.
            if 4.0 * patch.area_m2 > dot(&way, &way) {
                let near = self.patches.cells[cells.clone()].iter().zip(&self.of_cells[cells.clone()]);
                near.for_each(|((cell, _), radiosity)| self.add(receiver, cell, *radiosity, &mut sum));
            } else {
                self.add(receiver, patch, *radiosity, &mut sum);
            }
        }
        self.close(&sum, receiver.irradiance())
    }

    fn add(&self, receiver: &Facet, emitter: &Facet, radiosity: f64, sum: &mut Sum) {
        let way = sub(&emitter.centre, &receiver.centre);
        let (leaving, arriving) = (-dot(&emitter.normal, &way), dot(&receiver.normal, &way));
        if leaving <= 0.0 || arriving <= 0.0 {
            return;
        }
        let square = dot(&way, &way);
        let length = square.sqrt();
        // The form factor of a disc on its axis, which stays below 1 however near it is.
        let form = leaving * arriving / square * emitter.area_m2 / (PI * square + emitter.area_m2);
        let amplitude = radiosity * form;
        let detour = 0.5 * (emitter.range_m + length - receiver.range_m);
        let (sin, cos) = (self.wavenumber * detour).sin_cos();
        sum.amplitude += amplitude;
        sum.re += amplitude * cos;
        sum.im += amplitude * sin;
        sum.moment += amplitude * detour;
    }

    fn close(&self, sum: &Sum, direct: f64) -> Bounced {
        let ratio = sum.amplitude / direct;
        let error_m = if self.wavenumber > 0.0 {
            sum.im.atan2(direct + sum.re) / self.wavenumber
        } else {
            sum.moment / (direct + sum.amplitude)
        };
        Bounced { ratio, error_m }
    }
}
