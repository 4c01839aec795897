//! Frames that do not belong to the others.

use projective_registration::OrganisedFrame;

use crate::depth_frames::{dense_kitchen, living_room};
use crate::sets::Set;

/// What takes the place of one frame.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Intruder {
    None,
    /// Of another room.
    Foreign,
    /// The frame with left and right exchanged.
    Mirrored,
    /// The frame with ranges 5 % too long.
    Scaled,
}

impl Intruder {
    pub const ALL: [Self; 4] = [Self::None, Self::Foreign, Self::Mirrored, Self::Scaled];

    pub fn name(self) -> &'static str {
        match self {
            Self::None => "-",
            Self::Foreign => "foreign",
            Self::Mirrored => "mirrored",
            Self::Scaled => "scaled",
        }
    }

    /// Puts it in the place of a frame of the set; returns that place.
    pub fn put(self, set: &Set, frames: &mut [OrganisedFrame], at: usize) -> Option<usize> {
        let sequence = set.sequence.as_ref()?;
        let own = &sequence.frames[at].points;
        let frame = match self {
            Self::None => return None,
            Self::Foreign if set.name.starts_with("living") => {
                let other = dense_kitchen(std::iter::once(300))?;
                OrganisedFrame::new(&other.projection, &other.frames[0].points, None)
            }
            Self::Foreign => {
                let other = living_room()?;
                OrganisedFrame::new(&other.projection, &other.frames[0].points, None)
            }
            Self::Mirrored => {
                // The axis of the kitchen's camera is on a pixel, that of the living room's between two.
                let (width, last) =
                    (sequence.projection.width(), if set.name.starts_with("living") { 639 } else { 640 });
                let mirrored = |k: usize| {
                    let col = last - k % width;
                    if col < width { own[k / width * width + col] } else { [f64::NAN; 3] }
                };
                let points: Vec<[f64; 3]> = (0..own.len()).map(mirrored).map(|[x, y, z]| [-x, y, z]).collect();
                OrganisedFrame::new(&sequence.projection, &points, None)
            }
            Self::Scaled => {
                let points: Vec<[f64; 3]> = own.iter().map(|p| p.map(|v| 1.05 * v)).collect();
                OrganisedFrame::new(&sequence.projection, &points, None)
            }
        };
        frames[at] = frame.unwrap();
        Some(at)
    }
}
