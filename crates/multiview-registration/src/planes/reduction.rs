//! All contacts of a pair of stations, reduced to at most six observations (and one for each shared parameter).
//!
//! With the contacts linearised at `target_from_source = T`, their weighted squares are `xᵀ A x + 2 gᵀ x + c` in
//! `x = [pose_difference(T, target_from_source), θ − θ₀]`. With `A = V Λ Vᵀ` the same function, but for a constant, is
//! the sum of squares of the rows `√λ vᵀ x + vᵀ g / √λ`. That is exact: the adjustment of all stations has the minimum
//! that thousands of single observations would give it, at the price of six a pair.

use nalgebra::{DMatrix, DVector, Isometry3, SymmetricEigen};
use rigid_pose::InputError;

use crate::error::Result;
use crate::planes::contacts::{Contact, Observed, imitated, observe};
use crate::surfaces::patches::Surface;
use icp_registration::RobustKernel;

/// While stations are still apart, what is far off keeps some weight.
const KERNEL: RobustKernel = RobustKernel::Huber;
/// Information below this share of the largest is rounding.
const ROUNDING: f64 = 1e-10;
/// Share of a direction's information that noisy normals may have imitated; beyond, the direction is left open. What
/// they imitate below that is taken off: it would say that the stations are where they are.
const LARGEST_IMITATION: f64 = 0.5;

/// Two stations with the places where they meet.
#[derive(Debug, Clone)]
pub(crate) struct PairContacts {
    pub target: usize,
    pub source: usize,
    pub contacts: Vec<Contact>,
}

/// Surfaces at the present values of the shared parameters, with the derivatives of the patches' centres (one entry a
/// parameter for each patch, empty without parameters).
#[derive(Debug, Clone)]
pub(crate) struct Scene<'a> {
    pub surfaces: Vec<&'a Surface>,
    pub derivatives: &'a [Vec<[f64; 3]>],
    pub parameters: usize,
}

/// A linearised contact: whitened residual, derivative by `x`, weight.
struct Row {
    residual: f64,
    jacobian: DVector<f64>,
    weight: f64,
}

impl Scene<'_> {
    fn observed(&self, pair_contacts: &PairContacts, contact: Contact, pose: &Isometry3<f64>) -> Observed {
        observe(self.surfaces[pair_contacts.source], self.surfaces[pair_contacts.target], contact, pose)
    }

    /// `scale`: standard deviation of a whitened residual.
    fn row(
        &self,
        pair_contacts: &PairContacts,
        contact: Contact,
        pose: &Isometry3<f64>,
        scale: f64,
    ) -> (Row, Observed) {
        let observed = self.observed(pair_contacts, contact, pose);
        let sigma = observed.variance.sqrt();
        let mut jacobian = DVector::zeros(6 + self.parameters);
        jacobian.fixed_rows_mut::<6>(0).copy_from(&(observed.jacobian / sigma));
        for k in 0..self.parameters {
            let of = |station: usize, patch: u32| {
                nalgebra::Vector3::from(self.derivatives[station][patch as usize * self.parameters + k])
            };
            let moved =
                pose.rotation * of(pair_contacts.source, contact.source) - of(pair_contacts.target, contact.target);
            jacobian[6 + k] = observed.normal.dot(&moved) / sigma;
        }
        let residual = observed.residual / sigma;
        let weight = KERNEL.weight(residual / scale);
        (Row { residual, jacobian, weight }, observed)
    }

    pub(crate) fn whitened_residual(
        &self,
        pair_contacts: &PairContacts,
        contact: Contact,
        pose: &Isometry3<f64>,
    ) -> f64 {
        let observed = self.observed(pair_contacts, contact, pose);
        observed.residual / observed.variance.sqrt()
    }
}

/// The observations that a pair is reduced to.
#[derive(Debug, Clone)]
pub(crate) struct Reduced {
    /// One row `√λ vᵀ` an observation.
    pub rows: DMatrix<f64>,
    /// `vᵀ g / √λ`.
    pub right: DVector<f64>,
    /// Where the contacts were linearised.
    pub pose: Isometry3<f64>,
}

/// Reduces the contacts of a pair at `pose`.
pub(crate) fn reduce(
    scene: &Scene<'_>,
    pair_contacts: &PairContacts,
    pose: &Isometry3<f64>,
    scale: f64,
) -> Result<Reduced> {
    let n = 6 + scene.parameters;
    let (mut information, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut imitation = DMatrix::zeros(n, n);
    for &contact in &pair_contacts.contacts {
        let (row, observed) = scene.row(pair_contacts, contact, pose, scale);
        information.ger(row.weight, &row.jacobian, &row.jacobian, 1.0);
        gradient.axpy(row.weight * row.residual, &row.jacobian, 1.0);
        let noise = imitated(scene.surfaces[pair_contacts.source], contact, &observed, pose) / observed.variance;
        let mut corner = imitation.fixed_view_mut::<6, 6>(0, 0);
        corner += noise * row.weight;
    }
    let (rows, right) =
        observations(&information, &gradient, &imitation, scene.surfaces[pair_contacts.source].radius_m)?;
    Ok(Reduced { rows, right, pose: *pose })
}

fn observations(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    imitation: &DMatrix<f64>,
    radius_m: f64,
) -> Result<(DMatrix<f64>, DVector<f64>)> {
    let n = gradient.len();
    let trace: f64 = (0..3).map(|k| information[(k, k)]).sum();
    // Rotations as lengths at the radius; parameters in units in which they carry as much as a translation.
    let scale = DVector::from_fn(n, |k, _| match k {
        0..3 => 1.0,
        3..6 => 1.0 / radius_m,
        _ if information[(k, k)] > 0.0 => (trace / 3.0 / information[(k, k)]).sqrt(),
        _ => 1.0,
    });
    let scaled = |m: &DMatrix<f64>| DMatrix::from_fn(n, n, |r, c| 0.5 * (m[(r, c)] + m[(c, r)]) * scale[r] * scale[c]);
    let (information, imitation) = (scaled(information), scaled(imitation));
    let failed = |why| InputError::Numerical { what: "the normal equations of a pair of stations", why };
    if information.iter().chain(gradient.iter()).any(|v| !v.is_finite()) {
        return Err(failed("they are not finite").into());
    }
    let eigen = SymmetricEigen::try_new(information, 1e-15, 10_000).ok_or(failed("no eigenvalues were found"))?;
    let largest = eigen.eigenvalues.max();
    let known: Vec<(usize, f64)> = (0..n)
        .filter_map(|k| {
            let (value, vector) = (eigen.eigenvalues[k], eigen.eigenvectors.column(k));
            let share = vector.dot(&(&imitation * vector)) / value;
            (value > ROUNDING * largest && share <= LARGEST_IMITATION).then(|| (k, (value * (1.0 - share)).sqrt()))
        })
        .collect();
    let vector = |k: usize, c: usize| eigen.eigenvectors[(c, k)];
    let rows = DMatrix::from_fn(known.len(), n, |r, c| known[r].1 * vector(known[r].0, c) / scale[c]);
    let right = DVector::from_fn(known.len(), |r, _| {
        (0..n).map(|c| vector(known[r].0, c) * scale[c] * gradient[c]).sum::<f64>() / known[r].1
    });
    Ok((rows, right))
}
