//! Sets of frames with the poses that come with them.

use nalgebra::Isometry3;
use projective_registration::OrganisedFrame;

use crate::depth_frames::{Sequence, dense_kitchen, living_room};
use crate::sr4000;

/// Frames, their points where they are of a camera, and where they stood.
pub struct Set {
    pub name: String,
    pub frames: Vec<OrganisedFrame>,
    pub sequence: Option<Sequence>,
    pub reference: Vec<Isometry3<f64>>,
}

/// First frame, step and number of the sets of a half. The reference jumps by 36 mm between frames 121 and 122.
const FIRST: [[usize; 3]; 7] =
    [[0, 10, 12], [130, 10, 12], [0, 5, 5], [100, 5, 5], [150, 5, 5], [0, 10, 7], [180, 10, 7]];
const SECOND: [[usize; 3]; 8] =
    [[250, 10, 12], [300, 10, 12], [380, 10, 12], [250, 5, 5], [300, 5, 5], [420, 5, 5], [260, 10, 7], [400, 10, 7]];
/// Sets of 16 frames 30 apart reach over both halves, and over the jump or beside it.
const LONG: [usize; 2] = [20, 45];

/// The sets of `first`, `second` (half) or `others`.
pub fn of(part: &str) -> Vec<Set> {
    match part {
        "first" => FIRST.iter().filter_map(kitchen).collect(),
        "second" => SECOND.iter().filter_map(kitchen).collect(),
        _ => LONG.iter().filter_map(|first| kitchen(&[*first, 30, 16])).chain(room()).chain(boxes()).collect(),
    }
}

fn kitchen(&[first, step, count]: &[usize; 3]) -> Option<Set> {
    let sequence = dense_kitchen((0..count).map(|k| first + k * step))?;
    Some(set(format!("kitchen {first}, {count} frames {step} apart"), sequence))
}

fn room() -> Option<Set> {
    Some(set("living room, 5 frames".to_owned(), living_room()?))
}

/// Two stations of an SR4000; planes through floor, side wall and back wall say how they lie.
fn boxes() -> Option<Set> {
    let frames = sr4000::stations()?;
    let reference = vec![Isometry3::identity(), Isometry3::translation(-0.009, 0.045, -0.309)];
    Some(Set { name: "SR4000, 2 stations".to_owned(), frames: frames.to_vec(), sequence: None, reference })
}

fn set(name: String, sequence: Sequence) -> Set {
    let frame = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap();
    let frames = sequence.frames.iter().map(|f| frame(&f.points)).collect();
    let reference = sequence.frames.iter().map(|f| f.world_from_camera).collect();
    Set { name, frames, reference, sequence: Some(sequence) }
}
