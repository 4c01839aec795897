//! The search over all keyframes after a loss: small images of the depth tell which one a frame resembles, and how the
//! camera has turned against it `[KleinMurray2008]`; a registration from there must then satisfy both frames.

use nalgebra::{Isometry3, UnitQuaternion};

use crate::options::Relocalisation;
use crate::stream::beside::Found;
use crate::stream::keyframes::{CANDIDATES, THUMBNAIL};
use crate::stream::locate::Measured;
use crate::stream::tracker::Tracker;
use projective_registration::thumbnail_difference;

/// Shifts of the thumbnails to each side, fields.
const SHIFTS: [isize; 2] = [5, 3];

impl Tracker {
    /// The current frame anywhere among the keyframes.
    pub(crate) fn wide(&mut self, lost_frames: usize) -> Option<Measured> {
        if self.is_beside() {
            return self.search_beside(lost_frames);
        }
        let ranked = self.ranked();
        self.alike(&ranked).or_else(|| self.without_guess(&ranked, lost_frames))
    }

    /// The current frame from the keyframes that look most like it.
    pub(crate) fn alike(&mut self, ranked: &[(f32, usize, Isometry3<f64>)]) -> Option<Measured> {
        let tried = if self.is_beside() { 1 } else { CANDIDATES };
        ranked.iter().take(tried).find_map(|(_, k, guess)| self.verified(*k, guess))
    }

    /// Tries one keyframe a frame without a guess, when everything else has failed: those that look most like the frame first, in turn.
    fn without_guess(&mut self, ranked: &[(f32, usize, Isometry3<f64>)], lost_frames: usize) -> Option<Measured> {
        if self.options.relocalisation != Relocalisation::Coarse {
            return None;
        }
        let &(_, k, _) = ranked.get(lost_frames % ranked.len().max(1))?;
        let (features, keyframe) = self.keyframes.list[k].features();
        let found = Found::new(&self.current.to_cloud(), features, keyframe);
        self.keyframes.list[k].features = found.features;
        self.verified(k, &found.keyframe_from_camera?)
    }

    /// Keyframes by the look of their thumbnails, best first, with the rotation that brings the thumbnails together.
    pub(crate) fn ranked(&self) -> Vec<(f32, usize, Isometry3<f64>)> {
        let thumbnail = self.current.thumbnail(THUMBNAIL[0], THUMBNAIL[1]);
        let mut ranked = Vec::with_capacity(self.keyframes.list.len());
        for (k, keyframe) in self.keyframes.list.iter().enumerate() {
            let mut best = (f32::INFINITY, [0, 0]);
            for down in -SHIFTS[1]..=SHIFTS[1] {
                for right in -SHIFTS[0]..=SHIFTS[0] {
                    let shift = [right, down];
                    let difference = thumbnail_difference(&keyframe.thumbnail, &thumbnail, THUMBNAIL[0], shift);
                    if difference < best.0 {
                        best = (difference, shift);
                    }
                }
            }
            ranked.push((best.0, k, self.turn(best.1)));
        }
        ranked.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        ranked
    }

    /// Rotation (keyframe from camera) under which what the camera sees lies shifted in the keyframe.
    fn turn(&self, shift: [isize; 2]) -> Isometry3<f64> {
        let middle = self.current.direction(0.5, 0.5);
        let at = |i: usize| 0.5 + shift[i] as f64 / THUMBNAIL[i] as f64;
        let turn = UnitQuaternion::rotation_between(&middle, &self.current.direction(at(0), at(1)));
        Isometry3::from_parts(nalgebra::Translation3::identity(), turn.unwrap_or_default())
    }

    /// A registration that would be believed wherever it was found.
    pub(crate) fn verified(&mut self, k: usize, guess: &Isometry3<f64>) -> Option<Measured> {
        self.try_keyframe(k, guess).ok().filter(|measured| self.stands_alone(measured))
    }
}
