//! The target of a registration: its tree, normals and scale, made once.

use nalgebra::{Isometry3, Vector3};
use statistics::ranked;

use crate::error::Result;
use crate::icp::{IcpOptions, Registration};
use crate::parts::TargetSurface;
use crate::result::IcpResult;
use point_cloud::Cloud;
use point_cloud::NeighbourTree;
use point_cloud::{UnorganisedNormalOptions, normals_with_tree};
use rigid_pose::Centred;

/// Points from which a typical distance is taken, and the share of those with a partner.
pub(crate) const SAMPLES: usize = 2000;

/// A cloud prepared as target.
#[derive(Debug)]
pub struct IcpTarget {
    pub(crate) cloud: Cloud,
    pub(crate) tree: NeighbourTree,
    /// Given normals, or those of the nearest neighbours.
    pub(crate) normals: Vec<Vector3<f64>>,
    pub(crate) spacing_m: f64,
    pub(crate) radius_m: f64,
}

impl IcpTarget {
    /// Builds the tree; where the cloud has no normals they are fitted to the 20 nearest neighbours.
    ///
    /// # Errors
    /// [`crate::Error::Cloud`] for a cloud that is empty or holds what cannot be used.
    pub fn new(cloud: Cloud) -> Result<Self> {
        cloud.validate("the target cloud")?;
        let tree = NeighbourTree::new(&cloud.points)?;
        let normals = match &cloud.normals {
            Some(normals) => normals.clone(),
            None => normals_with_tree(&cloud.points, &tree, &UnorganisedNormalOptions::default())?,
        };
        let spacing_m = spacing(&cloud, &tree)?;
        let radius_m = Centred::about(cloud.points.iter().map(|p| p.coords), 0.0).radius_m;
        Ok(Self { cloud, tree, normals, spacing_m, radius_m })
    }

    /// The cloud itself.
    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// The points' tree.
    pub fn tree(&self) -> &NeighbourTree {
        &self.tree
    }

    /// The normals in use, NaN where a point has none.
    pub fn normals(&self) -> &[Vector3<f64>] {
        &self.normals
    }

    /// 90 % quantile of the distance of a point to its nearest neighbour, metre.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// Aligns a source with this target: see [`crate::align`].
    pub fn align(&self, source: &Cloud, guess: &Isometry3<f64>, options: &IcpOptions) -> Result<IcpResult> {
        Registration::with_options(self, options).align(source, guess)
    }

    /// What the parts are shown of it.
    pub fn surface(&self) -> TargetSurface<'_> {
        let (radius_m, spacing_m) = (self.radius_m, self.spacing_m);
        TargetSurface { cloud: Some(&self.cloud), radius_m, spacing_m, exact_normals: false }
    }
}

fn spacing(cloud: &Cloud, tree: &NeighbourTree) -> Result<f64> {
    let stride = cloud.len().div_ceil(SAMPLES);
    let mut distances = Vec::with_capacity(SAMPLES);
    for point in cloud.points.iter().step_by(stride) {
        distances.extend(tree.k_nearest(point, 2)?.get(1).map(|n| n.distance_m));
    }
    // A single point has no spacing.
    Ok(ranked(&mut distances, 0.9).max(0.0))
}
