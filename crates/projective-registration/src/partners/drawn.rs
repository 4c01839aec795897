//! Frames for tests, drawn by the depth in each direction.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use crate::{OrganisedFrame, Projection};

const SIZE: [usize; 2] = [160, 120];
const FOCAL_PX: f64 = 150.0;

/// What a pinhole camera sees whose point at `depth(u, v)` in front of it lies in the direction `(u, v, -1)`.
pub(crate) fn drawn(depth: impl Fn(f64, f64) -> f64) -> OrganisedFrame {
    let centre_px = SIZE.map(|side| (side as f64 - 1.0) / 2.0);
    let points: Vec<[f64; 3]> = (0..SIZE[0] * SIZE[1])
        .map(|k| {
            let u = ((k % SIZE[0]) as f64 - centre_px[0]) / FOCAL_PX;
            let v = (centre_px[1] - (k / SIZE[0]) as f64) / FOCAL_PX;
            let depth = depth(u, v);
            [u * depth, v * depth, -depth]
        })
        .collect();
    let projection = Arc::new(Projection::pinhole(SIZE[0], SIZE[1], [FOCAL_PX; 2], centre_px).unwrap());
    OrganisedFrame::new(&projection, &points, None).unwrap()
}
