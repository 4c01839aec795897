//! A station as patches of its surfaces: groups of neighbouring points on one plane, prepared once.
//!
//! What a station says about its pose is carried by some hundred small planes as well as by all its points, since the
//! plane through a patch averages the noise of its points. Patches share no points, so that their errors are
//! independent; they are all of about the same size in metres, so that those of a near and of a far station meet one to
//! one; and the nearest of several patches is not, as the nearest of several noisy points is, the one whose error
//! happens to resemble that of its partner.

use nalgebra::{Point3, Vector3};

use super::grouping::group;
use super::plane_fit::{Moments, Plane};
use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::kernel::quantile;
use crate::neighbours::NeighbourTree;

/// Fewest points of a patch.
const FEWEST_POINTS: usize = 6;
/// Neighbouring patches that may belong to the same plane: those around one in a grid, and some more.
const NEIGHBOURS: usize = 13;
/// Reach of the neighbourhood, in patches.
const REACH: f64 = 1.8;
/// Cosine of the largest angle between neighbours on one plane (15 degrees).
const SAME_PLANE: f64 = 0.966;
/// Points farther from their patch than this multiple of the median distance are left out of it.
const GROSS: f64 = 5.0;
/// Part of the patches whose normal must point to the station for signs to have a meaning.
const ORIENTED: f64 = 0.99;
/// Part of the size of a patch that its offset is not better known than: no surface is plane.
const ROUGHNESS: f64 = 1e-3;

/// One patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub centre: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Variance of the centre along the normal, metre².
    pub variance: f64,
    /// Variance of the normal about any axis in the plane, radian².
    pub normal_variance: f64,
}

/// The patches of a station.
#[derive(Debug)]
pub(super) struct Surface {
    pub patches: Vec<Patch>,
    pub tree: NeighbourTree,
    /// The points of patch i are `members[starts[i]..starts[i + 1]]`, indices into the cloud.
    pub members: Vec<u32>,
    pub starts: Vec<u32>,
    /// Size of a patch, metre.
    pub size_m: f64,
    /// Root mean square distance of the patches from their centroid, metre.
    pub radius_m: f64,
    /// Whether the normals point to the station, so that their sign tells the two sides of a board apart.
    pub oriented: bool,
}

impl Surface {
    /// Groups the points of a cloud (with normals) into patches of `size_m`.
    pub(super) fn new(cloud: &Cloud, normals: &[Vector3<f64>], size_m: f64) -> Result<Self> {
        let grouped = group(cloud, normals, size_m);
        let (mut members, mut starts) = (Vec::with_capacity(cloud.len()), vec![0]);
        for points in grouped {
            let kept = without_gross_errors(cloud, points, ROUGHNESS * size_m);
            if kept.len() >= FEWEST_POINTS {
                members.extend(kept);
                starts.push(members.len() as u32);
            }
        }
        Self::from_groups(&cloud.points, Some(normals), members, starts, size_m)
    }

    /// The same groups with their points elsewhere.
    pub(super) fn refitted(&self, points: &[Point3<f64>]) -> Result<Self> {
        let mut refitted = Self::from_groups(points, None, self.members.clone(), self.starts.clone(), self.size_m)?;
        if self.oriented {
            refitted.patches.iter_mut().filter(|p| p.normal.dot(&p.centre.coords) > 0.0).for_each(|p| p.normal.neg_mut());
            refitted.oriented = true;
        }
        Ok(refitted)
    }

    fn from_groups(
        points: &[Point3<f64>],
        normals: Option<&[Vector3<f64>]>,
        members: Vec<u32>,
        starts: Vec<u32>,
        size_m: f64,
    ) -> Result<Self> {
        let origin = members.first().map_or(Vector3::zeros(), |&i| points[i as usize].coords);
        let mut fits = Vec::with_capacity(starts.len());
        let (mut kept, mut kept_starts) = (Vec::with_capacity(members.len()), vec![0]);
        for range in starts.windows(2) {
            let own = &members[range[0] as usize..range[1] as usize];
            let mut moments = Moments::default();
            own.iter().for_each(|&i| moments.add(&(points[i as usize].coords - origin)));
            if let Some(mut plane) = moments.plane() {
                if normals.is_some_and(|normals| normals[own[0] as usize].dot(&plane.normal) < 0.0) {
                    plane.normal.neg_mut();
                }
                fits.push((moments, plane));
                kept.extend_from_slice(own);
                kept_starts.push(kept.len() as u32);
            }
        }
        if fits.is_empty() {
            return Err(Error::TooFewPoints { what: "surfaces of a station", found: 0, needed: FEWEST_POINTS });
        }
        let centres: Vec<Point3<f64>> = fits.iter().map(|(moments, _)| Point3::from(origin + moments.mean())).collect();
        let tree = NeighbourTree::new(&centres)?;
        let patches = (0..fits.len()).map(|i| patch(i, &fits, &centres, &tree, size_m)).collect::<Result<Vec<_>>>()?;
        let n = centres.len() as f64;
        let centroid = Point3::from(centres.iter().fold(Vector3::zeros(), |sum, c| sum + c.coords / n));
        let radius_m = (centres.iter().map(|c| (c - centroid).norm_squared() / n).sum::<f64>()).sqrt().max(size_m);
        let facing = patches.iter().filter(|p| p.normal.dot(&p.centre.coords) < 0.0).count();
        let oriented = facing as f64 >= ORIENTED * patches.len() as f64;
        Ok(Self { patches, tree, members: kept, starts: kept_starts, size_m, radius_m, oriented })
    }

    /// Indices of the points of a patch.
    pub(super) fn points_of(&self, patch: usize) -> &[u32] {
        &self.members[self.starts[patch] as usize..self.starts[patch + 1] as usize]
    }
}

/// Points whose distance from the plane of their group is no more than a few times the median one.
fn without_gross_errors(cloud: &Cloud, mut points: Vec<u32>, roughness_m: f64) -> Vec<u32> {
    for _ in 0..2 {
        let Some(&first) = points.first() else { return points };
        let origin = cloud.points[first as usize].coords;
        let mut moments = Moments::default();
        points.iter().for_each(|&i| moments.add(&(cloud.points[i as usize].coords - origin)));
        let Some(plane) = moments.plane() else { return points };
        let mean = moments.mean();
        let distance = |i: u32| plane.normal.dot(&(cloud.points[i as usize].coords - origin - mean)).abs();
        let median = quantile(&mut points.iter().map(|&i| distance(i)).collect::<Vec<f64>>(), 0.5);
        let before = points.len();
        points.retain(|&i| distance(i) <= GROSS * median + roughness_m);
        if points.len() == before {
            break;
        }
    }
    points
}

/// A patch with the normal of the plane that it shares with its neighbours: a plane three patches wide is known nine
/// times better in attitude than each of them.
fn patch(
    index: usize,
    fits: &[(Moments, Plane)],
    centres: &[Point3<f64>],
    tree: &NeighbourTree,
    size_m: f64,
) -> Result<Patch> {
    let (own, plane) = &fits[index];
    let mut union = *own;
    for neighbour in tree.k_nearest(&centres[index], NEIGHBOURS)? {
        let (moments, other) = &fits[neighbour.index];
        let apart = centres[neighbour.index] - centres[index];
        if neighbour.index == index || neighbour.distance_m > REACH * size_m {
            continue;
        }
        let across = plane.normal.dot(&apart).abs();
        let tolerance = 3.0 * (plane.variance.max(other.variance)).sqrt();
        if plane.normal.dot(&other.normal).abs() >= SAME_PLANE && across <= tolerance {
            union.join(moments);
        }
    }
    // Where the joint plane fits worse than its parts, the surface is curved.
    let joint = union.plane().filter(|joint| joint.variance <= 1.5 * plane.variance).unwrap_or(*plane);
    let count = if joint.variance <= 1.5 * plane.variance { union.count() } else { own.count() };
    let normal = if joint.normal.dot(&plane.normal) < 0.0 { -joint.normal } else { joint.normal };
    let floor = (ROUGHNESS * size_m).powi(2);
    Ok(Patch {
        centre: centres[index],
        normal,
        variance: joint.variance / own.count() + floor,
        normal_variance: joint.variance / count / joint.spread,
    })
}

/// Two unit vectors across a third.
pub(super) fn axes(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let axis = match normal.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    let right = normal.cross(&axis).normalize();
    (right, normal.cross(&right))
}
