//! Frames made ready for registration by projection.
#![allow(dead_code)]

use std::sync::Arc;

use projective_registration::{OrganisedFrame, Projection};

use crate::common::Pinhole;

pub fn pinhole(camera: &Pinhole) -> Arc<Projection> {
    let centre = [(camera.width as f64 - 1.0) / 2.0, (camera.height as f64 - 1.0) / 2.0];
    Arc::new(Projection::pinhole(camera.width, camera.height, [camera.focal_px; 2], centre).unwrap())
}

pub fn prepared(projection: &Arc<Projection>, frame: &(Vec<[f64; 3]>, Vec<f32>)) -> OrganisedFrame {
    OrganisedFrame::new(projection, &frame.0, Some(&frame.1)).unwrap()
}
