//! Two frames of a corner and a box, and the motion between them: `cargo run -p projective-registration --example two_frames`.

#![allow(clippy::print_stdout)]

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use projective_registration::{FrameAlignmentOptions, OrganisedFrame, Projection, align_frames};

/// Columns and rows of the camera, and its principal distance in pixels.
const SIZE: [usize; 2] = [88, 72];
const FOCAL_PX: f64 = 76.0;

/// The points of one frame, row by row, in the camera's axes (x right, y up, looking along -z), metre: a wall in front, one
/// on the right, the floor, and the lid of a box. Frames of a real camera come from a `camera_model::RayTable`.
fn seen_from(world_from_camera: &Isometry3<f64>) -> Vec<[f64; 3]> {
    let pixel = |index: usize| {
        let (col, row) = ((index % SIZE[0]) as f64, (index / SIZE[0]) as f64);
        let ray = Vector3::new((col - 43.5) / FOCAL_PX, (35.5 - row) / FOCAL_PX, -1.0);
        let (eye, along) = (world_from_camera.translation.vector, world_from_camera.rotation * ray);
        let to = |normal: Vector3<f64>, at: f64| {
            Some((at - normal.dot(&eye)) / normal.dot(&along)).filter(|depth| *depth > 0.0)
        };
        let walls = [to(Vector3::z(), -3.0), to(Vector3::x(), 1.2), to(Vector3::y(), -0.9)];
        let lid = to(Vector3::z(), -2.2).filter(|depth| (eye + along * *depth).xy().norm() < 0.4);
        let depth = walls.into_iter().chain([lid]).flatten().fold(f64::INFINITY, f64::min);
        (ray * depth).into()
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The projection is that of the camera; frames of one camera share it.
    let projection = Arc::new(Projection::pinhole(SIZE[0], SIZE[1], [FOCAL_PX; 2], [43.5, 35.5])?);
    let moved = Isometry3::new(Vector3::new(0.05, -0.02, 0.03), Vector3::new(0.0, 0.03, -0.01));
    let target = OrganisedFrame::new(&projection, &seen_from(&Isometry3::identity()), None)?;
    let source = OrganisedFrame::new(&projection, &seen_from(&moved), None)?;

    // The guess says that the camera stood still.
    let found = align_frames(&source, &target, &Isometry3::identity(), &FrameAlignmentOptions::default())?;

    let difference = found.target_from_source.translation.vector - moved.translation.vector;
    let angle = found.target_from_source.rotation.angle_to(&moved.rotation);
    println!("moved by {:.3} m, found to {:.2} mm", moved.translation.vector.norm(), 1e3 * difference.norm());
    println!("turned by {:.3} rad, found to {:.2} mrad", moved.rotation.angle(), 1e3 * angle);
    Ok(())
}
