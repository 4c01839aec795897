//! What can be chosen in an alignment without a guess.

use nalgebra::Point3;

use crate::error::{Error, Result};

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

/// How correspondences that belong together are found among the many that do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Estimator {
    /// Cliques of the graph of mutually consistent correspondences `[Yang2021]`, `[Zhang2023]`.
    #[default]
    ConsistencyGraph,
    /// Random samples of three correspondences `[FischlerBolles1981]`.
    Ransac {
        /// Samples drawn.
        samples: usize,
    },
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
    /// How the correspondences are sifted. Default: consistency graph.
    pub estimator: Estimator,
    /// Distance up to which a correspondence agrees with a pose, voxels. Default 1.5.
    pub tolerance_voxels: f64,
    /// Different poses that are refined and verified. Default 8.
    pub max_hypotheses: usize,
    /// Fewest correspondences that agree with the pose. Default 8: what decides are surfaces and free space.
    pub min_inliers: usize,
    /// Smallest fraction of the smaller cloud that must have a partner. Default 0.3.
    pub min_overlap: f64,
    /// Smallest fraction of the points in the other cloud's view that must lie on its surface. Default 0.96; 0.04
    /// less where two fifths of a cloud have a partner and a tenth of the points lie inside what encloses the scene.
    pub min_agreement: f64,
    /// Largest fraction of points in space that the other camera looked through (see
    /// [`super::CoarseAlignment::contradiction`]). Default 0.016: at the right pose there are hardly any.
    pub max_contradiction: f64,
    /// Smallest fraction of points on both clouds that lie inside what encloses them (see
    /// [`super::CoarseAlignment::inside`]). Default 0.008: corners of empty rooms are taken for each other. 0 accepts
    /// them. Clouds whose normals have no side always pass.
    pub min_inside: f64,
    /// Smallest share of the evidence that is lost where the pose slides along what is determined least (see
    /// [`super::CoarseAlignment::determined`]). Default 0.15. 0 lets features decide where surfaces cannot.
    pub min_determined: f64,
    /// Largest evidence for the best different pose, as a fraction of the winner's. Default 0.9.
    pub max_rival: f64,
    /// Start of the random numbers. Default: 1.
    pub seed: u64,
}

impl Default for CoarseOptions {
    fn default() -> Self {
        Self {
            voxel_m: None,
            viewpoint: Viewpoint::Origin,
            descriptors: SurfaceDescriptors::Fpfh,
            descriptor_radius_voxels: 5.0,
            max_features: 1200,
            estimator: Estimator::ConsistencyGraph,
            tolerance_voxels: 1.5,
            max_hypotheses: 8,
            min_inliers: 8,
            min_overlap: 0.3,
            min_agreement: 0.96,
            max_contradiction: 0.016,
            min_inside: 0.008,
            min_determined: 0.15,
            max_rival: 0.9,
            seed: 1,
        }
    }
}

impl CoarseOptions {
    pub(super) fn validate(&self) -> Result<()> {
        let lengths = [
            ("voxel_m", self.voxel_m.unwrap_or(1.0), f64::MAX, "positive and finite"),
            ("descriptor_radius_voxels", self.descriptor_radius_voxels, 20.0, "above 0 and at most 20"),
            ("tolerance_voxels", self.tolerance_voxels, 10.0, "above 0 and at most 10"),
            ("max_rival", self.max_rival, 1.0, "above 0 and at most 1"),
        ];
        for (name, value, largest, domain) in lengths {
            if !(value > 0.0 && value <= largest) {
                return Err(Error::InvalidOption { name, value, domain });
            }
        }
        for (name, value) in [
            ("min_overlap", self.min_overlap),
            ("min_agreement", self.min_agreement),
            ("max_contradiction", self.max_contradiction),
            ("min_inside", self.min_inside),
            ("min_determined", self.min_determined),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::InvalidOption { name, value, domain: "between 0 and 1" });
            }
        }
        let counts = [
            ("max_features", self.max_features, 10, 50_000, "between 10 and 50 000"),
            ("max_hypotheses", self.max_hypotheses, 1, 10_000, "between 1 and 10 000"),
            ("min_inliers", self.min_inliers, 3, usize::MAX, "3 or more"),
        ];
        for (name, value, least, most, domain) in counts {
            if !(least..=most).contains(&value) {
                return Err(Error::InvalidOption { name, value: value as f64, domain });
            }
        }
        if let Viewpoint::At(point) = self.viewpoint {
            point_cloud::check_points("viewpoint", &[point])?;
        }
        match self.estimator {
            Estimator::Ransac { samples: 0 } => {
                Err(Error::InvalidOption { name: "samples", value: 0.0, domain: "1 or more" })
            }
            _ => Ok(()),
        }
    }
}
