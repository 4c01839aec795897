//! Samples of a cloud side by side in lanes: the nearest in place and direction, by looking at all of them.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use nalgebra::{Point3, Vector3};

use super::level::Voxel;

const LANES: usize = 16;

/// Places and normals.
#[derive(Debug, Clone, Copy)]
struct Lanes {
    place: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
}

/// Places relative to one of them, in units of a radius: no scale of a cloud leaves the range of single precision.
pub(crate) struct Samples {
    pub voxels: Vec<Voxel>,
    lanes: Vec<Lanes>,
    origin: Point3<f64>,
    unit_m: f64,
}

/// Where a sample is looked for, and how much directions count.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sought {
    pub place: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Distance that counts one, metre.
    pub scale_m: f64,
    /// What a right angle between the normals counts.
    pub direction: f64,
}

impl Samples {
    pub fn new(voxels: Vec<Voxel>, unit_m: f64) -> Self {
        let origin = voxels.first().map_or(Point3::origin(), |v| v.mean);
        let lanes = voxels.chunks(LANES).map(|chunk| {
            // Places without a sample are farther than any.
            let mut lanes = Lanes { place: [[f32::MAX.sqrt() / 4.0; LANES]; 3], normal: [[0.0; LANES]; 3] };
            for (l, voxel) in chunk.iter().enumerate() {
                let place = (voxel.mean - origin) / unit_m;
                for axis in 0..3 {
                    lanes.place[axis][l] = place[axis] as f32;
                    lanes.normal[axis][l] = voxel.normal[axis] as f32;
                }
            }
            lanes
        });
        let lanes = lanes.collect();
        Self { voxels, lanes, origin, unit_m }
    }

    /// The sample of least cost `distance² / scale² + direction sin²`.
    pub fn nearest(&self, sought: &[Sought]) -> Vec<usize> {
        pulp::Arch::new().dispatch(Search { samples: self, sought })
    }
}

struct Search<'a> {
    samples: &'a Samples,
    sought: &'a [Sought],
}

impl pulp::WithSimd for Search<'_> {
    type Output = Vec<usize>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Vec<usize> {
        self.sought.iter().map(|sought| self.samples.one(sought)).collect()
    }
}

impl Samples {
    #[inline(always)]
    fn one(&self, sought: &Sought) -> usize {
        let at = (sought.place - self.origin) / self.unit_m;
        let (at, normal) = ([at.x as f32, at.y as f32, at.z as f32], sought.normal.cast::<f32>());
        let near = (self.unit_m / sought.scale_m).powi(2) as f32;
        let direction = sought.direction as f32;
        let (mut least, mut chunk) = ([f32::INFINITY; LANES], [0_u32; LANES]);
        for (number, lanes) in self.lanes.iter().enumerate() {
            for l in 0..LANES {
                let [dx, dy, dz] = [0, 1, 2].map(|axis| lanes.place[axis][l] - at[axis]);
                let cosine =
                    lanes.normal[0][l] * normal.x + lanes.normal[1][l] * normal.y + lanes.normal[2][l] * normal.z;
                let cost = (dx * dx + dy * dy + dz * dz) * near + direction * (1.0 - cosine * cosine);
                let better = cost < least[l];
                least[l] = if better { cost } else { least[l] };
                chunk[l] = if better { number as u32 } else { chunk[l] };
            }
        }
        let mut best = 0;
        for l in 1..LANES {
            let earlier = (chunk[l], l) < (chunk[best], best);
            if least[l] < least[best] || (least[l] <= least[best] && earlier) {
                best = l;
            }
        }
        // NaN everywhere leaves the first.
        (chunk[best] as usize * LANES + best).min(self.voxels.len().saturating_sub(1))
    }
}
