//! The map: points in voxels, each surface of a voxel one of them.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use point_cloud::Cloud;
use projective_registration::OrganisedFrame;
use rigid_pose::Uncertain;

use crate::error::Result;
use crate::map::options::MapOptions;
use crate::map::surfel::Surfel;

/// Largest number of a voxel along an axis; what lies further away is left out.
const FURTHEST_VOXEL: f64 = 1e9;

/// Surfaces of keyframes as one cloud whose memory is bounded.
///
/// Space is cut into voxels, and what keyframes see of a surface within one is one point: the mean weighted by 1/σ². Surfaces of a voxel whose
/// normals differ by more than 45° are kept apart, so the two sides of a thin wall are, too. Noise averages out; what the poses
/// may be off by since the datum, which the points of a keyframe share and the keyframes of a path largely do, does not: it enters as the weighted mean of
/// its standard deviations. Errors of the calibration are not in it.
///
/// A map that would have more than [`MapOptions::most_points`] doubles its voxels and goes on: nothing is forgotten, but all becomes
/// coarser. The same keyframes in the same order give the same bits.
#[derive(Debug, Clone)]
pub struct SurfaceMap {
    options: MapOptions,
    voxel_m: f64,
    surfels: Vec<Surfel>,
    /// The last surfel of each voxel; only asked, never walked through.
    voxels: HashMap<[i32; 3], u32>,
    left_out: u64,
}

impl SurfaceMap {
    /// A map without surfaces.
    ///
    /// # Errors
    /// [`InputError::InvalidOption`](rigid_pose::InputError::InvalidOption).
    pub fn new(options: MapOptions) -> Result<Self> {
        options.validate()?;
        let voxel_m = options.voxel_m;
        Ok(Self { options, voxel_m, surfels: Vec::new(), voxels: HashMap::new(), left_out: 0 })
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.surfels.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.surfels.is_empty()
    }

    /// Edge of a voxel as it is now, metre: that of the options, or its double as often as the map was full.
    pub fn voxel_m(&self) -> f64 {
        self.voxel_m
    }

    /// What it was made with.
    pub fn options(&self) -> &MapOptions {
        &self.options
    }

    /// Points that have no place: not finite, without a standard deviation, or further than a thousand million voxels away.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The points with unit normals towards the cameras and standard deviations along them.
    pub fn cloud(&self) -> Cloud {
        Cloud {
            points: self.surfels.iter().map(|surfel| surfel.position).collect(),
            normals: Some(self.surfels.iter().map(Surfel::unit_normal).collect()),
            sigma: Some(self.surfels.iter().map(Surfel::sigma_m).collect()),
            ..Cloud::default()
        }
    }

    /// Adds a point of the world with its unit normal; standard deviations along the normal, metre, by noise and by the pose.
    pub fn add(&mut self, point: Point3<f64>, normal: Vector3<f64>, noise_m: f64, pose_m: f64) {
        match Surfel::new(point, normal, noise_m, pose_m) {
            Some(surfel) => self.put(surfel),
            None => self.left_out += 1,
        }
    }

    /// Adds the surfaces of some nodes of a frame at its pose.
    pub(crate) fn add_nodes(&mut self, frame: &OrganisedFrame, world_from_camera: &Uncertain, nodes: Range<usize>) {
        let Uncertain { pose, covariance } = world_from_camera;
        for (point, normal, noise_m) in frame.surface_of(nodes) {
            let pose_m = pose_sigma(pose, covariance, &point, &normal);
            self.add(pose * point, pose * normal, noise_m, pose_m);
        }
    }

    fn put(&mut self, surfel: Surfel) {
        loop {
            let Some(voxel) = self.voxel(&surfel.position) else {
                self.left_out += 1;
                return;
            };
            let mut at = self.voxels.get(&voxel).copied();
            while let Some(index) = at {
                let known = &mut self.surfels[index as usize];
                if known.is_alike(&surfel) {
                    known.join(&surfel);
                    return;
                }
                at = known.next;
            }
            if self.surfels.len() < self.options.most_points {
                let next = self.voxels.insert(voxel, self.surfels.len() as u32);
                self.surfels.push(Surfel { next, ..surfel });
                return;
            }
            self.coarsen();
        }
    }

    /// The voxel of a point; `None` where it has none.
    fn voxel(&self, point: &Point3<f64>) -> Option<[i32; 3]> {
        let voxel = point.coords.map(|value| (value / self.voxel_m).floor());
        voxel.iter().all(|value| value.abs() <= FURTHEST_VOXEL).then(|| [0, 1, 2].map(|axis| voxel[axis] as i32))
    }

    /// Doubles the voxels: eight become one, and surfaces in them join. It goes on until there is room, as all points lie in eight voxels
    /// at last, with a handful of normals each.
    fn coarsen(&mut self) {
        self.voxel_m *= 2.0;
        let surfels = std::mem::take(&mut self.surfels);
        self.voxels.clear();
        for surfel in surfels {
            self.put(Surfel { next: None, ..surfel });
        }
    }
}

/// Standard deviation along a point's normal by the pose of its camera; both in the camera's frame.
fn pose_sigma(pose: &Isometry3<f64>, covariance: &Matrix6<f64>, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let (along, about) = (pose * normal, point.coords.cross(normal));
    let derivative = Vector6::new(along.x, along.y, along.z, about.x, about.y, about.z);
    derivative.dot(&(covariance * derivative)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::float_cmp, clippy::unwrap_used)]

    use super::*;

    fn map(most_points: usize) -> SurfaceMap {
        SurfaceMap::new(MapOptions { voxel_m: 0.1, most_points }).unwrap()
    }

    #[test]
    fn the_same_surface_seen_twice_is_one_point() {
        let mut map = map(1000);
        let place = |z: f64| Point3::new(0.05, 0.05, z);
        map.add(place(0.041), Vector3::z(), 0.003, 0.004);
        map.add(place(0.049), Vector3::z(), 0.003, 0.004);
        let cloud = map.cloud();
        assert_eq!(cloud.points.len(), 1);
        assert!((cloud.points[0].z - 0.045).abs() < 1e-12);
        // Noise by √2, the poses' part not at all.
        let expected = (0.003_f64.powi(2) / 2.0 + 0.004_f64.powi(2)).sqrt();
        assert!((cloud.sigma.unwrap()[0] - expected).abs() < 1e-12);
        // Ten times the standard deviation, a hundredth of the weight.
        map.add(place(0.095), Vector3::z(), 0.05, 0.0);
        assert!((map.cloud().points[0].z - 0.0452).abs() < 1e-3 && map.len() == 1);
    }

    #[test]
    fn the_two_sides_of_a_thin_wall_and_a_corner_stay_apart() {
        let mut map = map(1000);
        for normal in [Vector3::z(), -Vector3::z(), Vector3::x(), Vector3::z(), -Vector3::z()] {
            map.add(Point3::new(0.01, 0.02, 0.03), normal, 0.01, 0.0);
        }
        assert_eq!(map.len(), 3);
    }

    #[test]
    fn what_is_no_point_is_counted() {
        let mut map = map(1000);
        map.add(Point3::new(f64::NAN, 0.0, 0.0), Vector3::z(), 0.01, 0.0);
        map.add(Point3::origin(), Vector3::z(), 0.0, 0.0);
        map.add(Point3::origin(), Vector3::z(), f64::NAN, 0.0);
        map.add(Point3::new(1e12, 0.0, 0.0), Vector3::z(), 0.01, 0.0);
        assert_eq!((map.len(), map.left_out()), (0, 4));
    }

    #[test]
    fn a_full_map_becomes_coarser_and_keeps_its_mean() {
        let (mut bounded, mut free) = (map(1000), map(100_000));
        for k in 0..10_000 {
            let (x, y) = (f64::from(k % 100) * 0.1 + 0.05, f64::from(k / 100) * 0.1 + 0.05);
            let noise_m = 0.002 + 0.001 * f64::from(k % 7);
            for map in [&mut bounded, &mut free] {
                map.add(Point3::new(x, y, 0.03 + 0.001 * x), Vector3::z(), noise_m, 0.001);
            }
        }
        assert_eq!((free.len(), free.voxel_m()), (10_000, 0.1));
        assert!(bounded.len() <= 1000 && bounded.voxel_m() == 0.4, "{} {}", bounded.len(), bounded.voxel_m());
        // The wall stays where it is: coarse points lie on it.
        for (point, sigma) in bounded.cloud().points.iter().zip(bounded.cloud().sigma.unwrap()) {
            assert!((point.z - 0.03 - 0.001 * point.x).abs() < 1e-9, "{point}");
            assert!((0.001..0.002).contains(&sigma), "{sigma}");
        }
        // Points that lie too far apart for any voxel but the largest.
        let mut few = map(1000);
        for k in 0..2000 {
            few.add(Point3::new(1e4 * f64::from(k), 0.0, 0.0), Vector3::z(), 0.01, 0.0);
        }
        assert!(few.len() <= 1000 && few.left_out() == 0);
    }

    #[test]
    fn the_part_of_the_pose_is_that_of_its_derivatives() {
        let pose = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.3, -0.2, 0.5));
        let (point, normal) = (Point3::new(0.4, -0.3, -2.0), Vector3::new(0.2, 0.1, 0.9).normalize());
        let root = Matrix6::from_fn(|row, column| 1e-3 * ((row * 6 + column) as f64 * 1.7).sin());
        let covariance = root * root.transpose();
        // Heights over the plane by steps of the pose, one after the other.
        let height = |step: &Vector6<f64>| {
            let moved = rigid_pose::step_pose(&pose, step) * point;
            (moved - pose * point).dot(&(pose * normal))
        };
        let derivative = Vector6::from_fn(|axis, _| {
            let mut step = Vector6::zeros();
            step[axis] = 1e-6;
            (height(&step) - height(&-step)) / 2e-6
        });
        let expected = derivative.dot(&(covariance * derivative)).sqrt();
        assert!((pose_sigma(&pose, &covariance, &point, &normal) - expected).abs() < 1e-9);
    }

    #[test]
    fn options_are_checked() {
        for options in [
            MapOptions { voxel_m: 0.0, ..MapOptions::default() },
            MapOptions { voxel_m: f64::NAN, ..MapOptions::default() },
            MapOptions { most_points: 999, ..MapOptions::default() },
        ] {
            assert!(SurfaceMap::new(options).is_err());
        }
    }
}
