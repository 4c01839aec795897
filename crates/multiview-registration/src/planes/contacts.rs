//! Where the patches of two stations meet, and what each pair in contact observes.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use crate::surfaces::patches::Surface;

/// How far beside a patch its partner may be, in patches: half the diagonal of a cell. Farther ones would be partners
/// from beyond the rim.
pub(crate) const BESIDE: f64 = 0.75;

/// Two patches that show the same piece of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    pub source: u32,
    pub target: u32,
}

/// How partners are looked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// How far apart partners may be across their surface, metre.
    pub across_m: f64,
    /// Smallest cosine of the angle between their normals.
    pub cosine: f64,
}

/// Cosine while stations may be turned (37 degrees). Once they are in place it is that of one plane: patches across a crease,
/// whose normals lie between those of two walls, would say where a wall ends.
pub(crate) const TURNED: f64 = 0.8;

impl Reach {
    /// How far apart the centres of partners may be, metre, patches being of this size.
    pub(crate) fn farthest_m(&self, size_m: f64) -> f64 {
        self.across_m.hypot(BESIDE * size_m)
    }
}

/// The partners of the patches of one station (`asking`) among those of another, `to_asked` being
/// `asked_from_asking`: pairs of indices. The nearest patch is one, or there is none.
pub(crate) fn partners(asking: &Surface, asked: &Surface, to_asked: &Isometry3<f64>, reach: Reach) -> Vec<(u32, u32)> {
    let rotation = to_asked.rotation.to_rotation_matrix().into_inner();
    let beside_m = BESIDE * asking.size_m.max(asked.size_m);
    let farthest_m = reach.farthest_m(asking.size_m.max(asked.size_m));
    let signed = asking.oriented && asked.oriented;
    let mut found = Vec::new();
    for (index, patch) in asking.patches.iter().enumerate() {
        let centre = rotation * patch.centre.coords + to_asked.translation.vector;
        if !asked.extent.is_near(&centre, farthest_m) {
            continue;
        }
        let nearest = asked.tree.any_nearest(&[centre.x, centre.y, centre.z]).index;
        let other = &asked.patches[nearest];
        let apart = centre - other.centre.coords;
        let across = other.normal.dot(&apart);
        let cosine = other.normal.dot(&(rotation * patch.normal));
        if across.abs() <= reach.across_m
            && apart.norm_squared() - across * across <= beside_m * beside_m
            && if signed { cosine >= reach.cosine } else { cosine.abs() >= reach.cosine }
        {
            found.push((index as u32, nearest as u32));
        }
    }
    found
}

/// What a contact observes: the distance of the two patches along their common normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observed {
    /// Distance, metre.
    pub residual: f64,
    /// Its derivative by the tangent of `target_from_source`.
    pub jacobian: Vector6<f64>,
    /// Common normal, target frame.
    pub normal: Vector3<f64>,
    /// Variance of the residual, metre².
    pub variance: f64,
    /// Variance of the common normal, radian².
    pub normal_variance: f64,
}

/// Evaluates a contact. The common normal is the mean of both: half as uncertain as one, and exact on round surfaces.
pub(crate) fn observe(
    source: &Surface,
    target: &Surface,
    contact: Contact,
    target_from_source: &Isometry3<f64>,
) -> Observed {
    let (from, to) = (&source.patches[contact.source as usize], &target.patches[contact.target as usize]);
    let turned = target_from_source.rotation * from.normal;
    let sum = if turned.dot(&to.normal) < 0.0 { to.normal - turned } else { to.normal + turned };
    // Partners enclose less than 90 degrees: the sum is never short.
    let normal = sum / sum.norm();
    let apart = target_from_source * from.centre - to.centre;
    let residual = normal.dot(&apart);
    let along = (apart.norm_squared() - residual * residual).max(0.0);
    let normal_variance = (from.normal_variance + to.normal_variance) / 4.0;
    Observed {
        residual,
        jacobian: along_direction(&from.centre.coords, target_from_source, &normal),
        normal,
        variance: from.variance + to.variance + along * normal_variance,
        normal_variance,
    }
}

/// Derivative of `direction · (R p + t)` by the tangent `[dt, dtheta]`.
fn along_direction(
    point: &Vector3<f64>,
    target_from_source: &Isometry3<f64>,
    direction: &Vector3<f64>,
) -> Vector6<f64> {
    let turn = point.cross(&(target_from_source.rotation.inverse() * direction));
    Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z)
}

/// Information that noise of the common normal imitates at unit weight: on one wall, normals that scatter seem to say
/// something about sliding.
pub(crate) fn imitated(
    source: &Surface,
    contact: Contact,
    observed: &Observed,
    target_from_source: &Isometry3<f64>,
) -> Matrix6<f64> {
    let point = &source.patches[contact.source as usize].centre.coords;
    let mut sum = Matrix6::zeros();
    let (right, up) = crate::surfaces::patches::axes(&observed.normal);
    for direction in [right, up] {
        let jacobian = along_direction(point, target_from_source, &direction);
        sum += jacobian * jacobian.transpose() * observed.normal_variance;
    }
    sum
}

#[cfg(test)]
#[path = "../../tests/inside/contacts.rs"]
mod tests;
