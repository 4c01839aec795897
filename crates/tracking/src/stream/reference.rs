//! Which keyframe the next frames are registered with.

use nalgebra::{Isometry3, Matrix6};

use crate::stream::locate::Measured;
use crate::stream::tracker::Tracker;
use pose_graph::Edge;
use pose_graph::Relation;
use projective_registration::{ByField, Influence};
use rigid_pose::Uncertain;
use rigid_pose::step_pose;

impl Tracker {
    /// Another keyframe that sees more of the frame becomes the reference; where there is none, the frame becomes one.
    pub(crate) fn change_reference(&mut self, reference_from_camera: &Relation, influence: Option<&Influence>) {
        let Some(reference) = self.last.as_ref().map(|last| last.keyframe) else { return };
        let (others, pose) = (|k: usize| k != reference, reference_from_camera.pose());
        let candidates = self.keyframes.candidates(&self.current, reference, pose, others);
        if let Some(&(overlap, k)) = candidates.first()
            && overlap >= self.options.keyframe_overlap
            && let Some(measured) = self.closing(k, reference, reference_from_camera)
        {
            self.refer_to(k, Some(&measured));
            self.adjust();
            return;
        }
        let new = self.keyframes.add(&self.current, reference, reference_from_camera);
        self.refer_to(new, None);
        if let Some(influence) = influence {
            self.learn(influence);
        }
        self.close_loops(new);
        self.adjust();
    }

    /// Takes the registration of a keyframe into what is known of the shared error.
    fn learn(&mut self, influence: &Influence) {
        if self.options.alignment.shared_error.is_none() {
            self.shared.learn(influence);
            self.keyframes.graph.set_shared_error(&self.shared);
        }
    }

    /// Adjusts the keyframes where a loop has been closed.
    pub(crate) fn adjust(&mut self) {
        let change = self.keyframes.graph.adjust_if_closed();
        if let Some(last) = &mut self.last {
            last.own.pose = step_pose(&last.own.pose, &(last.by_field * change));
        }
    }

    /// Registers the frame with keyframe `k` as well, and so `k` with the reference; `None` where that does not fit.
    fn closing(&mut self, k: usize, reference: usize, reference_from_camera: &Relation) -> Option<Measured> {
        let guess = self.keyframes.graph.relative(k, reference) * reference_from_camera.pose();
        let measured = self.try_keyframe(k, &guess).ok().filter(|m| m.determined)?;
        if self.keyframes.graph.joined(k, reference) {
            return Some(measured);
        }
        let a_from_b = measured.relation().then(&reference_from_camera.inverse());
        self.keyframes.graph.offer(&Edge { a: k, b: reference, a_from_b, alike: 1.0 }).then_some(measured)
    }

    /// The frame is known from keyframe `k` by a registration, or is that keyframe.
    fn refer_to(&mut self, k: usize, measured: Option<&Measured>) {
        if let Some(last) = &mut self.last {
            last.keyframe = k;
            last.own = measured.map_or_else(|| Uncertain::exact(Isometry3::identity()), Measured::own);
            last.by_field = measured.map_or_else(ByField::zeros, Measured::by_field);
            last.shared = measured.map_or_else(Matrix6::zeros, Measured::shared);
            last.velocity = last.velocity.map(|velocity| velocity.at_origin());
        }
    }
}
