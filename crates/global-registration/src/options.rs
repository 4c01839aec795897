//! What can be chosen in an alignment without a guess.

use nalgebra::{Point3, Vector3};
use rigid_pose::{require_option, require_points};

use crate::error::Result;

/// From where a cloud was seen: the side that its normals point to, and what space was looked through.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Viewpoint {
    /// The origin of the cloud's frame, as in camera and scanner frames.
    #[default]
    Origin,
    /// A point in the cloud's frame, metre.
    At(Point3<f64>),
    /// Unknown or several: normals that come with the cloud keep their side, others have none, and the verification
    /// knows nothing about free space.
    Unknown,
}

impl Viewpoint {
    /// The viewpoint relative to a cloud's middle, where there is one.
    pub(crate) fn about(self, middle: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Origin => Some(-middle),
            Self::At(point) => Some(point.coords - middle),
            Self::Unknown => None,
        }
    }
}

/// Descriptors that are computed from the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum SurfaceDescriptors {
    /// Fast point feature histograms `[Rusu2009]`.
    #[default]
    Fpfh,
    /// Histograms behind the radius-based surface descriptor `[Marton2010]`.
    Rsd,
    /// Both; their correspondences are merged.
    FpfhAndRsd,
    /// None: only features added by [`super::FeatureCloud::with_features`].
    None,
}

/// What neighbouring points err by together, of the distance between two surfaces: what is left of a sensor's distortion, its
/// delays, its scale.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SharedError {
    /// Standard deviation, metre.
    pub sigma_m: f64,
    /// Distance of points at which their correlation has fallen to 1/e, metre.
    pub length_m: f64,
}

/// Options of an alignment without a guess. The defaults carry no scale.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarseOptions {
    /// Edge of the voxels that the cloud is averaged in, metre; every other length is a multiple of it. `None`, the
    /// default: about 1/30 of the median distance from the cloud's middle, but no finer than its points.
    pub voxel_m: Option<f64>,
    /// From where the cloud was seen. Default: the origin of its frame.
    pub viewpoint: Viewpoint,
    /// Descriptors computed from the surface. Default FPFH.
    pub descriptors: SurfaceDescriptors,
    /// Radius of the neighbourhood a descriptor is made from, voxels. Default 5.
    pub descriptor_radius_voxels: f64,
    /// Most points that are matched, those whose descriptors differ most from the cloud's mean. Default 1200.
    pub max_features: usize,
    /// Distance up to which a correspondence agrees with a pose, voxels. Default 1.5.
    pub tolerance_voxels: f64,
    /// Different poses that are refined and verified. Default 8.
    pub max_hypotheses: usize,
    /// Smallest fraction of the smaller cloud that must have a partner. Default 0.3.
    pub min_overlap: f64,
    /// The error that neighbouring points share. `None`, the default: as the residuals of a pose tell it.
    pub shared_error: Option<SharedError>,
    /// Level of the tests: a pose is refused where its contradictions would be exceeded by a right one with less than this
    /// probability ([`super::CoarseAlignment::consistency`]), or where another pose fits as well with more
    /// ([`super::CoarseAlignment::rival`]). Default 0.05.
    pub level: f64,
    /// Smallest fraction of points on both clouds that lie inside what encloses them (see
    /// [`super::CoarseAlignment::inside`]). Default 0.008: corners of empty rooms are taken for each other. 0 accepts
    /// them. Clouds whose normals have no side always pass.
    pub min_inside: f64,
    /// Smallest probability that the pose is known ([`super::CoarseAlignment::determined`]). Default 0.95. 0 lets features decide
    /// where surfaces cannot.
    pub min_determined: f64,
}

impl Default for CoarseOptions {
    fn default() -> Self {
        Self {
            voxel_m: None,
            viewpoint: Viewpoint::Origin,
            descriptors: SurfaceDescriptors::Fpfh,
            descriptor_radius_voxels: 5.0,
            max_features: 1200,
            tolerance_voxels: 1.5,
            max_hypotheses: 8,
            min_overlap: 0.3,
            shared_error: None,
            level: 0.05,
            min_inside: 0.008,
            min_determined: 0.95,
        }
    }
}

impl CoarseOptions {
    pub(super) fn validate(&self) -> Result<()> {
        let lengths = [
            ("voxel_m", self.voxel_m.unwrap_or(1.0), f64::MAX, "positive and finite"),
            ("descriptor_radius_voxels", self.descriptor_radius_voxels, 20.0, "above 0 and at most 20"),
            ("tolerance_voxels", self.tolerance_voxels, 10.0, "above 0 and at most 10"),
            ("level", self.level, 1.0, "above 0 and at most 1"),
            ("length_m", self.shared_error.map_or(1.0, |shared| shared.length_m), f64::MAX, "positive and finite"),
        ];
        for (name, value, largest, domain) in lengths {
            require_option(name, value, domain, |value| value > 0.0 && value <= largest)?;
        }
        for (name, value) in [
            ("min_overlap", self.min_overlap),
            ("min_inside", self.min_inside),
            ("min_determined", self.min_determined),
        ] {
            require_option(name, value, "between 0 and 1", |value| (0.0..=1.0).contains(&value))?;
        }
        let counts = [
            ("max_features", self.max_features, 10, 50_000, "between 10 and 50 000"),
            ("max_hypotheses", self.max_hypotheses, 1, 10_000, "between 1 and 10 000"),
        ];
        for (name, value, least, most, domain) in counts {
            require_option(name, value as f64, domain, |_| (least..=most).contains(&value))?;
        }
        let sigma_m = self.shared_error.map_or(0.0, |shared| shared.sigma_m);
        require_option("sigma_m", sigma_m, "finite and not negative", |sigma| sigma >= 0.0 && sigma.is_finite())?;
        if let Viewpoint::At(point) = self.viewpoint {
            require_points("viewpoint", &[point])?;
        }
        Ok(())
    }
}
