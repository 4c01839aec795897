//! A cloud prepared for alignment without a guess.

use nalgebra::{Isometry3, Point3, Vector3};
use rigid_pose::InputError;

use crate::description::descriptors::DescriptorTable;
use crate::description::features::Features;
use crate::description::fpfh::{fpfh, subtract};
use crate::description::labels::Labels;
use crate::description::reduced::Reduced;
use crate::description::rsd::{SurfaceRadii, radii, rsd};
use crate::options::{CoarseOptions, SurfaceDescriptors, Viewpoint};

use crate::description::surface::Normals;
use crate::description::surroundings::Surroundings;
use crate::description::view::View;
use crate::error::Result;
use point_cloud::Cloud;

/// Fewest averaged points.
pub(crate) const LEAST_POINTS: usize = 10;
/// Points that a pose is judged by.
const SAMPLES: usize = 1500;

/// A point about a cloud's middle and the unit normal of the surface there; a normal of NaN is unknown.
pub(crate) type Place = [[f32; 3]; 2];

/// Places about a cloud's middle with descriptors of one kind.
#[derive(Debug, Clone)]
pub(crate) struct FeatureSet {
    pub(crate) places: Vec<Place>,
    pub(crate) descriptors: DescriptorTable,
}

/// A cloud averaged in voxels with normals, descriptors and what is needed to judge a pose; made once and aligned with
/// many others.
#[derive(Debug, Clone)]
pub struct FeatureCloud {
    pub(crate) reduced: Reduced,
    pub(crate) normals: Normals,
    surroundings: Surroundings,
    descriptor_radius: f32,
    /// Root mean square distance of the averaged points from their middle, metre.
    pub radius_m: f64,
    viewpoint: Viewpoint,
    /// One set for each kind of descriptor, in the order of [`SurfaceDescriptors`], and what was added.
    pub(crate) surface_features: Vec<FeatureSet>,
    pub(crate) added: Vec<FeatureSet>,
    /// Points with a normal that a pose is judged by, half of them features.
    pub(crate) sample: Vec<u32>,
    /// Cells of one and of two voxels.
    pub(crate) labels: [Labels; 2],
    pub(crate) view: Option<View>,
}

impl FeatureCloud {
    /// Averages the cloud in voxels, fits normals and computes the descriptors.
    ///
    /// Normals of the cloud are used for their side only where there is no viewpoint; points at its rim are left out.
    ///
    /// # Errors
    /// [`InputError::Empty`], [`InputError::NonFinite`], [`InputError::LengthMismatch`], [`InputError::NotPositive`] for the cloud,
    /// [`InputError::InvalidOption`], [`InputError::TooFewPoints`] where fewer than 10 voxels are occupied.
    pub fn new(cloud: &Cloud, options: &CoarseOptions) -> Result<Self> {
        options.validate()?;
        cloud.validate("the cloud")?;
        Self::of_reduced(Reduced::new(cloud, options.voxel_m)?, options, options.viewpoint)
    }

    fn of_reduced(mut reduced: Reduced, options: &CoarseOptions, viewpoint: Viewpoint) -> Result<Self> {
        if reduced.len() < LEAST_POINTS {
            let found = reduced.len();
            return Err(InputError::TooFewPoints { what: "occupied voxels", found, needed: LEAST_POINTS }.into());
        }
        let voxel = reduced.voxel_m as f32;
        let radius = options.descriptor_radius_voxels as f32 * voxel;
        let surroundings = Surroundings::sort_and_list(&mut reduced, radius);
        let normals = Normals::new(&reduced, &surroundings, viewpoint);
        let surface_features = surface_features(&reduced, &normals, &surroundings, radius, options);
        // Cells of two voxels hold some four points of a surface: every second one leaves none without.
        let labels = [1, 2].map(|cells| {
            let is_usable = |i: usize| i.is_multiple_of(cells) && !normals.vectors[i][0].is_nan();
            Labels::new(&reduced.points, is_usable, cells as f32 * voxel)
        });
        let eye = viewpoint.about(&reduced.middle).map(|eye| eye.cast::<f32>().into());
        let view = eye.map(|eye| View::new(&reduced.points, eye, 1.6 * voxel, 2.0 * voxel));
        let sample = sample(&normals);
        let squares: f64 = reduced.points.iter().flatten().map(|c| f64::from(*c).powi(2)).sum();
        let radius_m = (squares / reduced.len() as f64).sqrt();
        Ok(Self {
            reduced,
            normals,
            surroundings,
            descriptor_radius: radius,
            radius_m,
            viewpoint,
            surface_features,
            added: Vec::new(),
            sample,
            labels,
            view,
        })
    }

    /// Adds features that were found by other means, for example [`crate::amplitude_features`]; their points are in the
    /// cloud's frame. In an alignment, the n-th features added to both clouds are matched with each other.
    #[must_use]
    pub fn with_features(mut self, features: Features) -> Self {
        let place = |point: &Point3<f64>| {
            let point: [f32; 3] = (point.coords - self.reduced.middle).cast::<f32>().into();
            let near = self.labels[0].near(point).filter(|_| self.normals.sided);
            [point, near.map_or([f32::NAN; 3], |near| self.normals.vectors[near])]
        };
        let places = features.points.iter().map(place).collect();
        self.added.push(FeatureSet { places, descriptors: features.table });
        self
    }

    /// The same cloud with no more than [`crate::agreement`] and [`crate::evidence`] look at: a third of the memory, for those who keep
    /// hundreds. It cannot be aligned any more.
    #[must_use]
    pub fn for_judging(mut self) -> Self {
        self.surroundings = Surroundings::default();
        self.surface_features = Vec::new();
        self.labels[1] = Labels::new(&[], |_| false, 1.0);
        self
    }

    /// Edge of the voxels, metre.
    pub fn voxel_m(&self) -> f64 {
        self.reduced.voxel_m
    }

    /// Averaged points, metre, in the cloud's frame.
    pub fn points(&self) -> Vec<Point3<f64>> {
        (0..self.reduced.len()).map(|i| self.reduced.point(i)).collect()
    }

    /// Unit normals of the averaged points, NaN where there is none.
    pub fn normals(&self) -> Vec<Vector3<f64>> {
        self.normals.vectors.iter().map(|n| Vector3::from(n.map(f64::from))).collect()
    }

    /// Radii of the surface about an averaged point `[Marton2010]`; `None` where it has no normal or no neighbours.
    pub fn surface_radii(&self, index: usize) -> Option<SurfaceRadii> {
        let known = self.normals.vectors.get(index).is_some_and(|n| !n[0].is_nan());
        known.then(|| radii(&self.normals, &self.surroundings, self.descriptor_radius, index)).flatten()
    }

    /// The same cloud in coarser voxels.
    pub(crate) fn coarsened(&self, voxel_m: f64, options: &CoarseOptions) -> Result<Self> {
        let mut cloud = Cloud::new(self.points());
        cloud.normals = Some(self.normals());
        let mut coarse = Self::of_reduced(Reduced::new(&cloud, Some(voxel_m))?, options, self.viewpoint)?;
        let moved: [f32; 3] = (coarse.reduced.middle - self.reduced.middle).cast::<f32>().into();
        coarse.added.clone_from(&self.added);
        for [point, _] in coarse.added.iter_mut().flat_map(|set| &mut set.places) {
            *point = subtract(*point, moved);
        }
        Ok(coarse)
    }

    /// Pose between the clouds' frames from the one between their middles.
    pub(crate) fn between_frames(&self, source: &Self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let translation = pose.translation.vector + self.reduced.middle - pose.rotation * source.reduced.middle;
        Isometry3::from_parts(translation.into(), pose.rotation)
    }
}

fn surface_features(
    reduced: &Reduced,
    normals: &Normals,
    surroundings: &Surroundings,
    radius: f32,
    options: &CoarseOptions,
) -> Vec<FeatureSet> {
    let (with_fpfh, with_rsd) = match options.descriptors {
        SurfaceDescriptors::Fpfh => (true, false),
        SurfaceDescriptors::Rsd => (false, true),
        SurfaceDescriptors::FpfhAndRsd => (true, true),
        SurfaceDescriptors::None => (false, false),
    };
    let tables = [
        with_fpfh.then(|| fpfh(&reduced.points, normals, surroundings)),
        with_rsd.then(|| rsd(normals, surroundings, radius)),
    ];
    let chosen = |table: DescriptorTable| {
        let indices = table.most_distinctive(options.max_features);
        let place = |&i: &u32| [reduced.points[i as usize], normals.vectors[i as usize]];
        FeatureSet { places: indices.iter().map(place).collect(), descriptors: table.selected(&indices) }
    };
    tables.into_iter().flatten().map(chosen).collect()
}

/// Points with a normal, evenly over the cloud.
fn sample(normals: &Normals) -> Vec<u32> {
    let usable: Vec<u32> =
        (0..normals.vectors.len()).filter(|&i| !normals.vectors[i][0].is_nan()).map(|i| i as u32).collect();
    usable.iter().copied().step_by(usable.len().div_ceil(SAMPLES).max(1)).collect()
}
