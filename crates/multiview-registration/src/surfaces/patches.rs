//! A station as patches of its surfaces: groups of neighbouring points on one plane, prepared once.
//!
//! What a station says about its pose is carried by some hundred small planes as well as by all its points, since the
//! plane through a patch averages the noise of its points. Patches share no points, so that their errors are
//! independent; they are all of about the same size in metres, so that those of a near and of a far station meet one to
//! one; and the nearest of several patches is not, as the nearest of several noisy points is, the one whose error
//! happens to resemble that of its partner.

use nalgebra::{Point3, Vector3};
use rigid_pose::InputError;
use statistics::upper_median;

use crate::error::Result;
use crate::surfaces::extents::Extent;
use crate::surfaces::grouping::group;
use crate::surfaces::plane_fit::{Moments, Plane, SAME_DIRECTION};
use crate::surfaces::regions::{Patches, Region};
use point_cloud::Cloud;
use point_cloud::NeighbourTree;

/// Fewest points of a patch, or tiles of a shared plane: those whose scatter about a plane says something.
pub(crate) const FEWEST_POINTS: usize = 6;
/// Neighbouring patches that may belong to the same plane: those around one in a grid, and some more.
const NEIGHBOURS: usize = 13;
/// Reach of the neighbourhood, in patches.
const REACH: f64 = 1.8;
/// Points farther from their patch than this multiple of the median distance are left out of it.
const GROSS: f64 = 5.0;
/// The same for the angle (its sine) between the normals of point and patch, and an angle that is always allowed. Half, twice and no limit at all
/// leave simulated stations as they are; of clouds of a Kinect fewer come together without a doubt, as far off as before.
const LEAN: f64 = 2.5;
const SMALLEST_LEAN: f64 = 0.6;
/// Variance of a patch, in those around it, beyond which it is no plane. Twenty points scatter by a factor of two.
const ROUGHER: f64 = 3.0;
/// Part of the patches whose normal must point to the station for signs to have a meaning.
const ORIENTED: f64 = 0.99;
/// Part of the size of a patch that its offset is not better known than: no surface is plane.
const ROUGHNESS: f64 = 1e-3;

/// One patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patch {
    pub centre: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Variance of the centre along the normal, metre².
    pub variance: f64,
    /// Variance of a point across it, metre².
    pub point_variance: f64,
    /// Variance of the normal about any axis in the plane, radian².
    pub normal_variance: f64,
}

/// The patches of a station.
#[derive(Debug)]
pub(crate) struct Surface {
    pub patches: Vec<Patch>,
    /// Of the points of each patch, about `origin`.
    pub moments: Vec<Moments>,
    /// Patches that lie on one plane, and the region of each patch.
    pub regions: Vec<Region>,
    pub region_of: Vec<Option<usize>>,
    pub origin: Vector3<f64>,
    pub tree: NeighbourTree,
    /// The points of patch i are `members[starts[i]..starts[i + 1]]`, indices into the cloud.
    pub members: Vec<u32>,
    pub starts: Vec<u32>,
    /// About the centres of the patches, in the station's frame.
    pub extent: Extent,
    /// Size of a patch, metre.
    pub size_m: f64,
    /// Root mean square distance of the patches from their centroid, metre.
    pub radius_m: f64,
    /// Whether the normals point to the station, so that their sign tells the two sides of a board apart.
    pub oriented: bool,
}

/// Groups of points, as in [`Surface`].
struct Groups {
    members: Vec<u32>,
    starts: Vec<u32>,
}

impl Groups {
    /// The groups that planes go through, with these.
    fn fitted(&self, points: &[Point3<f64>], origin: &Vector3<f64>) -> (Self, Vec<(Moments, Plane)>) {
        let mut fits = Vec::with_capacity(self.starts.len());
        let kept = self.filtered(|_, own| {
            let moments = Moments::of(points, own, origin);
            let plane = moments.plane();
            fits.extend(plane.map(|plane| (moments, plane)));
            plane.is_some()
        });
        (kept, fits)
    }

    fn filtered(&self, mut keep: impl FnMut(usize, &[u32]) -> bool) -> Self {
        let (mut members, mut starts) = (Vec::with_capacity(self.members.len()), vec![0]);
        for (index, range) in self.starts.windows(2).enumerate() {
            let own = &self.members[range[0] as usize..range[1] as usize];
            if keep(index, own) {
                members.extend_from_slice(own);
                starts.push(members.len() as u32);
            }
        }
        Self { members, starts }
    }
}

impl Surface {
    /// Groups the points of a cloud (with normals) into patches of `size_m`.
    pub(crate) fn new(cloud: &Cloud, normals: &[Vector3<f64>], size_m: f64) -> Result<Self> {
        let mut groups = Groups { members: Vec::with_capacity(cloud.len()), starts: vec![0] };
        for points in group(cloud, normals, size_m) {
            let kept = of_one_plane(cloud, normals, points, ROUGHNESS * size_m);
            if kept.len() >= FEWEST_POINTS {
                groups.members.extend(kept);
                groups.starts.push(groups.members.len() as u32);
            }
        }
        let origin = cloud.points[0].coords;
        let (groups, mut fits) = groups.fitted(&cloud.points, &origin);
        for (range, (_, plane)) in groups.starts.windows(2).zip(&mut fits) {
            let first = groups.members[range[0] as usize];
            if normals[first as usize].dot(&plane.normal) < 0.0 {
                plane.normal.neg_mut();
            }
        }
        let rough = rough(&fits, &origin)?;
        let groups = groups.filtered(|index, _| !rough[index]);
        let mut kept = rough.iter();
        fits.retain(|_| kept.next() == Some(&false));
        Self::from_fits(groups, &fits, &origin, size_m)
    }

    /// The same groups with their points elsewhere.
    pub(crate) fn refitted(&self, points: &[Point3<f64>]) -> Result<Self> {
        let groups = Groups { members: self.members.clone(), starts: self.starts.clone() };
        let origin = self.patches[0].centre.coords;
        let (groups, mut fits) = groups.fitted(points, &origin);
        for (moments, plane) in fits.iter_mut().filter(|_| self.oriented) {
            if plane.normal.dot(&(origin + moments.mean())) > 0.0 {
                plane.normal.neg_mut();
            }
        }
        Self::from_fits(groups, &fits, &origin, self.size_m)
    }

    fn from_fits(groups: Groups, fits: &[(Moments, Plane)], origin: &Vector3<f64>, size_m: f64) -> Result<Self> {
        if fits.is_empty() {
            return Err(
                InputError::TooFewPoints { what: "surfaces of a station", found: 0, needed: FEWEST_POINTS }.into()
            );
        }
        let centres = centres(fits, origin);
        let tree = NeighbourTree::new(&centres)?;
        let neighbours = neighbours(&centres, &tree, REACH * size_m)?;
        let roughness_m = ROUGHNESS * size_m;
        let (regions, region_of) =
            Patches { fits, centres: &centres, neighbours: &neighbours, roughness_m }.regions(origin);
        let patch = |index: usize| {
            let local = patch(index, fits, &centres, &neighbours[index], size_m);
            region_of[index].map_or(local, |region| in_region(local, &regions[region]))
        };
        let patches: Vec<Patch> = (0..fits.len()).map(patch).collect();
        let n = centres.len() as f64;
        let centroid = Point3::from(centres.iter().fold(Vector3::zeros(), |sum, c| sum + c.coords / n));
        let radius_m = (centres.iter().map(|c| (c - centroid).norm_squared() / n).sum::<f64>()).sqrt().max(size_m);
        let oriented = faces_origin(patches.iter().map(|patch| (&patch.centre, &patch.normal)));
        let Groups { members, starts } = groups;
        let moments = fits.iter().map(|fit| fit.0).collect();
        Ok(Self {
            patches,
            moments,
            regions,
            region_of,
            origin: *origin,
            tree,
            members,
            starts,
            extent: Extent::of(centres.iter().copied()),
            size_m,
            radius_m,
            oriented,
        })
    }

    /// Indices of the points of a patch.
    pub(crate) fn points_of(&self, patch: usize) -> &[u32] {
        &self.members[self.starts[patch] as usize..self.starts[patch + 1] as usize]
    }
}

/// Whether normals, where there are any, point to the station.
pub(crate) fn faces_origin<'a>(surface: impl Iterator<Item = (&'a Point3<f64>, &'a Vector3<f64>)>) -> bool {
    let (mut facing, mut all) = (0, 0);
    for (point, normal) in surface.filter(|(_, normal)| normal.x.is_finite()) {
        facing += u32::from(normal.dot(&point.coords) < 0.0);
        all += 1;
    }
    f64::from(facing) >= ORIENTED * f64::from(all)
}

fn centres(fits: &[(Moments, Plane)], origin: &Vector3<f64>) -> Vec<Point3<f64>> {
    fits.iter().map(|(moments, _)| Point3::from(origin + moments.mean())).collect()
}

/// Which patches scatter far more than those around them: they lie across a crease, and what a station makes of a
/// crease depends on how near it is.
fn rough(fits: &[(Moments, Plane)], origin: &Vector3<f64>) -> Result<Vec<bool>> {
    let centres = centres(fits, origin);
    if centres.is_empty() {
        return Ok(Vec::new());
    }
    let tree = NeighbourTree::new(&centres)?;
    let is_rough = |(centre, (_, plane)): (&Point3<f64>, &(Moments, Plane))| {
        let near = tree.k_nearest(centre, NEIGHBOURS)?;
        let mut around: Vec<f64> = near.iter().map(|neighbour| fits[neighbour.index].1.variance).collect();
        Ok(plane.variance > ROUGHER * upper_median(&mut around))
    };
    centres.iter().zip(fits).map(is_rough).collect()
}

/// Points of a group near its plane and with its normal: gross errors and points beside a crease, where smoothed normals
/// pass from one surface to the next, are left out.
fn of_one_plane(cloud: &Cloud, normals: &[Vector3<f64>], mut points: Vec<u32>, roughness_m: f64) -> Vec<u32> {
    for _ in 0..2 {
        let Some(&first) = points.first() else { return points };
        let origin = cloud.points[first as usize].coords;
        let moments = Moments::of(&cloud.points, &points, &origin);
        let Some(plane) = moments.plane() else { return points };
        let mean = moments.mean();
        let distance = |i: u32| plane.normal.dot(&(cloud.points[i as usize].coords - origin - mean)).abs();
        let lean = |i: u32| plane.normal.cross(&normals[i as usize]).norm();
        let median = |values: &mut dyn Iterator<Item = f64>| upper_median(&mut values.collect::<Vec<f64>>());
        let farthest_m = GROSS * median(&mut points.iter().map(|&i| distance(i))) + roughness_m;
        let largest_lean = (LEAN * median(&mut points.iter().map(|&i| lean(i)))).max(SMALLEST_LEAN);
        let before = points.len();
        points.retain(|&i| distance(i) <= farthest_m && lean(i) <= largest_lean);
        if points.len() == before {
            break;
        }
    }
    points
}

/// A patch with the normal of the plane that it shares with its neighbours: a plane three patches wide is known nine
/// times better in attitude than each of them.
fn patch(index: usize, fits: &[(Moments, Plane)], centres: &[Point3<f64>], neighbours: &[usize], size_m: f64) -> Patch {
    let (own, plane) = &fits[index];
    let mut union = *own;
    for &neighbour in neighbours {
        let (moments, other) = &fits[neighbour];
        let across = plane.normal.dot(&(centres[neighbour] - centres[index])).abs();
        let tolerance = 3.0 * (plane.variance.max(other.variance)).sqrt();
        if plane.normal.dot(&other.normal).abs() >= SAME_DIRECTION && across <= tolerance {
            union.join(moments);
        }
    }
    // Where the joint plane fits worse than its parts, the surface is curved.
    let joint = union.plane().filter(|joint| joint.variance <= 1.5 * plane.variance).unwrap_or(*plane);
    let count = if joint.variance <= 1.5 * plane.variance { union.count() } else { own.count() };
    let normal = if joint.normal.dot(&plane.normal) < 0.0 { -joint.normal } else { joint.normal };
    let floor = (ROUGHNESS * size_m).powi(2);
    Patch {
        centre: centres[index],
        normal,
        variance: joint.variance / own.count() + floor,
        point_variance: joint.variance,
        normal_variance: joint.variance / count / joint.spread,
    }
}

/// The patch with the normal of a region that it belongs to, where that is the better known one.
fn in_region(local: Patch, region: &Region) -> Patch {
    let plane = &region.plane;
    let normal_variance = plane.variance / region.moments.count() / plane.spread;
    if normal_variance >= local.normal_variance {
        return local;
    }
    let normal = if plane.normal.dot(&local.normal) < 0.0 { -plane.normal } else { plane.normal };
    Patch { normal, normal_variance, ..local }
}

/// Indices of the patches around each, itself left out.
fn neighbours(centres: &[Point3<f64>], tree: &NeighbourTree, reach_m: f64) -> Result<Vec<Vec<usize>>> {
    let of = |(index, centre): (usize, &Point3<f64>)| {
        let near = tree.k_nearest(centre, NEIGHBOURS)?;
        let others = near.iter().filter(|n| n.index != index && n.distance_m <= reach_m);
        Ok(others.map(|n| n.index).collect())
    };
    centres.iter().enumerate().map(of).collect()
}

/// Two unit vectors across a third.
pub(crate) fn axes(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let axis = match normal.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    let right = normal.cross(&axis).normalize();
    (right, normal.cross(&right))
}
