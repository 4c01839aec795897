//! How many planes two frames share: three make a corner, and in rooms corners look alike.

use nalgebra::Isometry3;

use crate::partners::locate::with_locate;
use crate::partners::map::{Partner, Partners};
use crate::preparation::frame::OrganisedFrame;

/// Cosine of the largest angle between normals of one direction: planes through few noisy nodes scatter.
const SAME_DIRECTION: f32 = 0.9;
/// Gap between offsets beyond which planes of one direction are two, in units of the radius.
const GAP: f32 = 0.02;
/// Smallest share of all points that makes a plane.
const LEAST_SHARE: f64 = 0.03;

/// Points whose normals have one direction.
struct Bundle {
    /// Sum of the normals.
    normal: [f32; 3],
    points: Vec<[f32; 3]>,
}

impl OrganisedFrame {
    /// Number of planes on which about `most` nodes of `source`, spread over its frame, agree with this frame.
    pub fn shared_planes(&self, source: &Self, self_from_source: &Isometry3<f64>, most: usize) -> usize {
        let mut bundles: Vec<Bundle> = Vec::new();
        let each = |partner: Option<Partner>| {
            let Some(partner) = partner.filter(Partner::agrees) else { return };
            let [a, b, c, _] = self.planes[partner.node as usize];
            let normal = [a, b, c];
            let same = |bundle: &&mut Bundle| dot(&bundle.normal, &normal) > SAME_DIRECTION * length(&bundle.normal);
            match bundles.iter_mut().find(same) {
                Some(bundle) => {
                    bundle.points.push(partner.point);
                    bundle.normal.iter_mut().zip(normal).for_each(|(sum, n)| *sum += n);
                }
                None => bundles.push(Bundle { normal, points: vec![partner.point] }),
            }
        };
        let stride = source.stride_for(most);
        with_locate(self, Partners { target: self, source, pose: self_from_source, stride, each });
        let all: usize = bundles.iter().map(|bundle| bundle.points.len()).sum();
        let fewest = (LEAST_SHARE * all as f64).ceil().max(3.0) as usize;
        let gap = GAP * self.radius_m() as f32;
        bundles.iter().map(|bundle| bundle.planes(gap, fewest)).sum()
    }
}

impl Bundle {
    /// Runs of offsets without a gap.
    fn planes(&self, gap: f32, fewest: usize) -> usize {
        let length = length(&self.normal);
        let mut offsets: Vec<f32> = self.points.iter().map(|point| dot(&self.normal, point) / length).collect();
        offsets.sort_by(f32::total_cmp);
        offsets.chunk_by(|a, b| b - a <= gap).filter(|run| run.len() >= fewest).count()
    }
}

fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: &[f32; 3]) -> f32 {
    dot(a, a).sqrt()
}
