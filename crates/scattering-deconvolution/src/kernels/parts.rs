//! A point spread function taken apart into convolutions.

use fourier_transforms::num_complex::Complex;

use crate::kernels::blobs::{Blob, Kernel};
use crate::kernels::grid::{Axis, Grid};
use crate::kernels::operator::Factors;
use crate::{CompositePsf, FieldPolynomial, GaussianTerm, Ghost, GhostPlace, Psf, Result, SampledKernel};

/// Whether light is moved, `K(p - q)`, or mirrored, `K(p + q)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Orientation {
    Direct,
    Mirrored,
}

/// One convolution, with factors over the field before and after it.
pub(crate) struct Part {
    shape: Shape,
    pub(crate) orientation: Orientation,
    pub(crate) field: Option<Field>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Field {
    pub(crate) received: FieldPolynomial,
    pub(crate) sent: FieldPolynomial,
}

enum Shape {
    /// In pixels; of a mirrored part the offsets are those of `p + q`.
    Blobs(Vec<Blob>),
    Sampled(Kernel),
}

/// The parts of `psf` that scatter something, for images of `size`. The first that is direct and has no field is alone
/// in that.
pub(crate) fn parts(psf: &Psf, size: [usize; 2]) -> Result<Vec<Part>> {
    psf.validate()?;
    let plain = |shape| vec![Part { shape, orientation: Orientation::Direct, field: None }];
    Ok(match psf {
        _ if psf.is_empty() => Vec::new(),
        Psf::Gaussians(terms) => plain(Shape::Blobs(lit(terms))),
        Psf::Kernel { .. } => {
            let kernel: SampledKernel = psf.sample(size.map(|count| count.saturating_sub(1)))?;
            plain(Shape::Sampled(kernel.into()))
        }
        Psf::Composite(composite) => composite_parts(composite)?,
    })
}

fn lit(terms: &[GaussianTerm]) -> Vec<Blob> {
    terms.iter().filter(|term| term.weight > 0.0).map(Blob::from).collect()
}

fn composite_parts(composite: &CompositePsf) -> Result<Vec<Part>> {
    let (mut direct, mut mirrored) = (lit(&composite.stationary), Vec::new());
    for ghost in composite.ghosts.iter().filter(|ghost| ghost.weight > 0.0) {
        let blob = ghost_blob(ghost)?;
        match ghost.place {
            GhostPlace::Shifted(_) => direct.push(blob),
            GhostPlace::Mirrored(_) => mirrored.push(blob),
        }
    }
    let plain = [(direct, Orientation::Direct), (mirrored, Orientation::Mirrored)].into_iter();
    let plain = plain.filter(|(blobs, _)| !blobs.is_empty());
    let plain = plain.map(|(blobs, orientation)| Part { shape: Shape::Blobs(blobs), orientation, field: None });
    let fields = composite.field_terms.iter().filter(|term| term.gaussian.weight > 0.0).map(|term| Part {
        shape: Shape::Blobs(vec![Blob::from(&term.gaussian)]),
        orientation: Orientation::Direct,
        field: Some(Field { received: term.received, sent: term.sent }),
    });
    Ok(plain.chain(fields).collect())
}

fn ghost_blob(ghost: &Ghost) -> Result<Blob> {
    let offset = match ghost.place {
        GhostPlace::Shifted(offset) => offset,
        GhostPlace::Mirrored(centre) => centre.map(|value| 2.0 * value),
    };
    let weight = Complex::from_polar(ghost.weight, ghost.delay.phase(None)?);
    Ok(Blob { weight, sigma: ghost.sigma_px, offset })
}

impl Part {
    pub(crate) fn is_plain(&self) -> bool {
        self.orientation == Orientation::Direct && self.field.is_none()
    }

    /// The kernel on the nodes, narrower by what passing to the nodes and back adds. That of a mirrored part belongs to
    /// nodes in reverse order.
    pub(crate) fn kernel(&self, grid: &Grid) -> Kernel {
        let blobs = match &self.shape {
            Shape::Sampled(kernel) => return kernel.clone(),
            Shape::Blobs(blobs) => blobs,
        };
        let on_nodes = |blob: &Blob| {
            let mut blob = *blob;
            for (axis, (sigma, offset)) in grid.axes().iter().zip(blob.sigma.iter_mut().zip(&mut blob.offset)) {
                let reversed = if self.orientation == Orientation::Mirrored { axis.reversal_px() } else { 0.0 };
                *sigma = (*sigma * *sigma - axis.added_variance()).sqrt() / axis.spacing() as f64;
                *offset = (*offset - reversed) / axis.spacing() as f64;
            }
            blob
        };
        let blobs: Vec<Blob> = blobs.iter().map(on_nodes).collect();
        Kernel::of_blobs(&blobs, grid.size().map(|nodes| nodes - 1))
    }

    /// Transform between pixels at an angular frequency per pixel; of the mirrored part that of its reversed nodes.
    /// None of a sampled kernel, which lives on the pixels only.
    pub(crate) fn transform(&self, grid: &Grid, frequency: [f64; 2]) -> Option<Complex<f64>> {
        let Shape::Blobs(blobs) = &self.shape else { return None };
        let reversal = grid.axes().each_ref().map(Axis::reversal_px);
        let value = |blob: &Blob| {
            let mut blob = *blob;
            if self.orientation == Orientation::Mirrored {
                blob.offset = [0, 1].map(|axis| blob.offset[axis] - reversal[axis]);
            }
            blob.transform(frequency)
        };
        Some(blobs.iter().map(value).sum())
    }
}

impl Field {
    /// Factors at the nodes.
    pub(crate) fn factors(&self, grid: &Grid) -> Factors {
        Factors { received: on_nodes(&self.received, grid), sent: on_nodes(&self.sent, grid) }
    }

    /// Bound of what the factors make of light.
    pub(crate) fn largest(&self, grid: &Grid) -> f64 {
        let factors = self.factors(grid);
        let largest = |values: &[f32]| values.iter().fold(0.0_f32, |largest, value| largest.max(value.abs()));
        f64::from(largest(&factors.received)) * f64::from(largest(&factors.sent))
    }

    /// Mean of what the factors make of light that arrives near the place where it belongs.
    pub(crate) fn mean(&self) -> f64 {
        crate::spread::field::mean(|place| self.share(place))
    }

    /// What the factors make of light that arrives where it belongs, at normalised coordinates.
    pub(crate) fn share(&self, place: [f64; 2]) -> f64 {
        self.received.value(place) * self.sent.value(place)
    }
}

/// Values of a polynomial at the nodes, row by row. Nodes beyond the image have little of its light.
fn on_nodes(polynomial: &FieldPolynomial, grid: &Grid) -> Vec<f32> {
    let [across, down] = grid.axes();
    let [columns, rows] = grid.size();
    let value = |x: f64, y: f64| polynomial.value([x, y]) as f32;
    let rows = (0..rows).map(|row| -down.normalised(row));
    rows.flat_map(|y| (0..columns).map(move |col| value(across.normalised(col), y))).collect()
}
