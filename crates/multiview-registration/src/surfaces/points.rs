//! The points of a station for the last rounds: all of them, also those beside edges that have no normal.
//!
//! Points near the rims of furniture carry much of what tells a station where it stands along a wall: without those in
//! whose neighbourhood no normal is found, and those at the rim, stations are known a third less well. No partner is looked
//! for that would mislead: the rays tell which surface they saw, and what mixes two is far from both.

use nalgebra::{Point3, Vector3};

use crate::error::Result;
use crate::surfaces::grouping::by_cells;
use crate::surfaces::noise::NoiseLaw;
use crate::surfaces::patches::Surface;
use crate::surfaces::point_model::{PointModel, evaluated};
use point_cloud::Cloud;

/// Size of a block, patches.
const BLOCK: f64 = 2.0;
/// Part of the noise along a ray that is left across a surface seen edge-on: rays are no better known than that.
pub(crate) const EDGE_ON: f64 = 0.01;
/// Part of the size of a patch that no point is better known than.
const ROUGHNESS: f64 = 3e-4;

/// Neighbouring points.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub points: std::ops::Range<usize>,
    pub centre: Point3<f64>,
    pub radius_m: f64,
}

/// The usable points of a station, block by block.
#[derive(Debug, Clone)]
pub(crate) struct StationPoints {
    /// In the station's frame.
    pub points: Vec<Point3<f64>>,
    /// Standard deviation of each along its ray, or across its surface where there are no rays; NaN: not used.
    pub sigma: Vec<f64>,
    /// Whether the station saw the points along rays from its origin.
    pub along_rays: bool,
    /// Variance that no point falls below: no surface is plane, metre².
    pub floor: f64,
    /// Index of each in the cloud.
    pub cloud_index: Vec<u32>,
    /// Where a point of the cloud is here; `u32::MAX`: nowhere.
    pub slot_of: Vec<u32>,
    pub blocks: Vec<Block>,
    /// Derivatives by the shared parameters, one entry a parameter for each point.
    pub derivatives: Vec<[f64; 3]>,
}

impl StationPoints {
    pub(crate) fn new(cloud: &Cloud, surface: &Surface) -> Self {
        let cells = by_cells(cloud, |_| true, BLOCK * surface.size_m);
        let cloud_index: Vec<u32> = cells.iter().map(|cell| cell.1).collect();
        let mut starts = vec![0];
        starts.extend((1..cells.len()).filter(|&i| cells[i].0 != cells[i - 1].0));
        starts.push(cells.len());
        let empty = Block { points: 0..0, centre: Point3::origin(), radius_m: 0.0 };
        let blocks = starts.windows(2).map(|ends| Block { points: ends[0]..ends[1], ..empty.clone() }).collect();
        let sigma = if surface.oriented { along_rays(cloud, surface) } else { across_patches(cloud.len(), surface) };
        let mut slot_of = vec![u32::MAX; cloud.len()];
        for (slot, &index) in cloud_index.iter().enumerate() {
            slot_of[index as usize] = slot as u32;
        }
        let mut points = Self {
            points: Vec::new(),
            sigma: cloud_index.iter().map(|&i| sigma[i as usize]).collect(),
            along_rays: surface.oriented,
            floor: (ROUGHNESS * surface.size_m).powi(2),
            cloud_index,
            slot_of,
            blocks,
            derivatives: Vec::new(),
        };
        points.place(&cloud.points);
        points
    }

    /// Puts the points of the cloud where they are now.
    pub(crate) fn place(&mut self, cloud: &[Point3<f64>]) {
        self.points = self.cloud_index.iter().map(|&i| cloud[i as usize]).collect();
        for block in &mut self.blocks {
            let own = &self.points[block.points.clone()];
            let mean = own.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords) / own.len().max(1) as f64;
            block.centre = mean.into();
            block.radius_m = own.iter().map(|p| (p.coords - mean).norm_squared()).fold(0.0, f64::max).sqrt();
        }
    }

    /// Puts the points where a model has them.
    pub(crate) fn follow(
        &mut self,
        model: &dyn PointModel,
        station: usize,
        count: usize,
        parameters: &[f64],
    ) -> Result<()> {
        let (cloud, derivatives) = evaluated(model, station, count, parameters)?;
        let of = |&index: &u32| index as usize * parameters.len()..(index as usize + 1) * parameters.len();
        self.derivatives = self.cloud_index.iter().flat_map(|index| &derivatives[of(index)]).copied().collect();
        self.place(&cloud);
        Ok(())
    }

    /// The cloud with its points where they are now.
    pub(crate) fn modelled(&self, cloud: &Cloud) -> Cloud {
        let mut cloud = cloud.clone();
        for (point, &index) in self.points.iter().zip(&self.cloud_index) {
            cloud.points[index as usize] = *point;
        }
        cloud
    }

    /// Variance across a surface whose normal has this cosine with the ray, metre².
    pub(crate) fn variance(&self, point: usize, cosine: f64) -> f64 {
        let square = self.sigma[point] * self.sigma[point];
        self.floor + if self.along_rays { square * (cosine * cosine + EDGE_ON) } else { square }
    }
}

/// Standard deviation of each point along its ray: what is said of it as the patches scale it, or what they tell.
fn along_rays(cloud: &Cloud, surface: &Surface) -> Vec<f64> {
    let ranges = cloud.points.iter().map(|point| point.coords.norm());
    if let Some(said) = &cloud.sigma {
        let law = NoiseLaw::scaling(said, surface);
        return ranges.zip(said).map(|(range, sigma)| sigma * law.factor(range)).collect();
    }
    let law = NoiseLaw::by_range(cloud.len(), surface);
    ranges.map(|range| law.factor(range)).collect()
}

/// Standard deviation of each point across its patch; NaN for those in none.
fn across_patches(count: usize, surface: &Surface) -> Vec<f64> {
    let mut sigma = vec![f64::NAN; count];
    for (index, patch) in surface.patches.iter().enumerate() {
        for &point in surface.points_of(index) {
            sigma[point as usize] = patch.point_variance.sqrt();
        }
    }
    sigma
}
