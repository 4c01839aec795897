//! Work of keyframes that is spread over the frames behind them, so that no frame waits for all of it.

use std::collections::VecDeque;

use crate::map::surfaces::SurfaceMap;
use crate::stream::keyframes::Keyframes;
use crate::stream::register::register;
use crate::stream::tracker::Tracker;
use pose_graph::{Edge, Relation};
use projective_registration::OrganisedFrame;
use rigid_pose::Uncertain;

/// Nodes that a frame brings into the map for each keyframe that waits for it: half a millisecond; a keyframe of 640 x 480 pixels takes nine
/// frames.
const NODES: usize = 4096;

/// Loops of a keyframe that are still sought.
#[derive(Debug, Clone)]
struct Loops {
    /// Number of the keyframe.
    keyframe: usize,
    /// Numbers of those that it is to be registered with, the last one first.
    left: Vec<usize>,
    /// Numbers of those that it fits, and how it was registered.
    found: Vec<(usize, Relation)>,
}

/// Where the newest keyframe's frame is, with all that registering it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Source {
    #[default]
    Current,
    Previous,
    Kept,
}

/// A keyframe that was taken out, on its way to the map.
#[derive(Debug, Clone)]
struct Leaving {
    frame: OrganisedFrame,
    pose: Uncertain,
    /// Nodes that are in the map.
    done: usize,
}

/// What is still to be done.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spread {
    loops: Option<Loops>,
    source: Source,
    kept: Option<OrganisedFrame>,
    leaving: VecDeque<Leaving>,
}

impl Spread {
    /// A keyframe at its pose in the world that is to be brought into the map.
    pub(crate) fn leave(&mut self, frame: OrganisedFrame, pose: &Uncertain) {
        self.leaving.push_back(Leaving { frame, pose: *pose, done: 0 });
    }

    /// Nothing waits for the map any more.
    pub(crate) fn forget_leaving(&mut self) {
        self.leaving.clear();
    }

    /// Brings a part of what waits into the map, more where more waits.
    pub(crate) fn bring_in(&mut self, map: &mut SurfaceMap) {
        let mut nodes = NODES * self.leaving.len();
        while let Some(first) = self.leaving.front_mut()
            && nodes > 0
        {
            let end = first.frame.nodes().min(first.done + nodes);
            map.add_nodes(&first.frame, &first.pose, first.done..end);
            nodes -= end - first.done;
            first.done = end;
            if end < first.frame.nodes() {
                return;
            }
            self.leaving.pop_front();
        }
    }

    /// Brings all that waits into a map.
    pub(crate) fn bring_all_into(&self, map: &mut SurfaceMap) {
        for Leaving { frame, pose, done } in &self.leaving {
            map.add_nodes(frame, pose, *done..frame.nodes());
        }
    }
}

impl Tracker {
    /// Ends a frame with a part of what those before have left to do: at most one registration.
    pub(crate) fn go_on(&mut self) {
        if let Some(map) = &mut self.seen_before {
            self.spread.bring_in(map);
        }
        if self.spread.source == Source::Previous {
            // The memory of the frame before would be used again by the next one.
            match &mut self.spread.kept {
                Some(kept) => std::mem::swap(kept, &mut self.previous),
                None => self.spread.kept = Some(self.previous.clone()),
            }
            self.spread.source = Source::Kept;
        }
        if self.spread.source == Source::Kept {
            self.seek_one();
        }
        std::mem::swap(&mut self.current, &mut self.previous);
        if self.spread.source == Source::Current {
            self.spread.source = Source::Previous;
        }
    }

    /// Seeks loops of the newest keyframe, which is the current frame, with others: at once, or one of them in each of the frames to come.
    pub(crate) fn seek_loops(&mut self, new: usize, others: impl DoubleEndedIterator<Item = usize>) {
        // A keyframe that follows too soon does not take the loops of the one before away.
        self.seek_all();
        let left: Vec<usize> = others.map(|k| self.keyframes.list[k].number).rev().collect();
        if left.is_empty() {
            return;
        }
        let keyframe = self.keyframes.list[new].number;
        self.spread.loops = Some(Loops { keyframe, left, found: Vec::new() });
        self.spread.source = Source::Current;
        if !self.is_beside() {
            self.seek_all();
        }
    }

    fn seek_all(&mut self) {
        while self.spread.loops.is_some() {
            self.seek_one();
        }
    }

    /// Registers the keyframe with the next one; behind the last one the loops that were found are closed.
    fn seek_one(&mut self) {
        let Some(Loops { keyframe, mut left, mut found }) = self.spread.loops.take() else { return };
        // Either may have been taken out.
        let Some(new) = self.keyframes.index(keyframe) else { return };
        if let Some(number) = left.pop()
            && let Some(k) = self.keyframes.index(number)
            && let Some(relation) = self.seek(k, new)
        {
            found.push((number, relation));
        }
        if !left.is_empty() {
            self.spread.loops = Some(Loops { keyframe, left, found });
            return;
        }
        // Half of the errors are the frame's, which all have in common: n with the variance (1 + 1/n)/2 of their mean.
        let alike = (found.len() as f64).midpoint(1.0);
        let (keyframes, graph) = (&self.keyframes.list, &mut self.keyframes.graph);
        let index = |number: usize| keyframes.iter().position(|k| k.number == number);
        let edges = found
            .into_iter()
            .filter_map(|(number, a_from_b)| index(number).map(|a| Edge { a, b: new, a_from_b, alike }));
        graph.take(edges);
        self.adjust();
    }

    /// The registration of the newest keyframe with keyframe `k`, if it fits the path.
    fn seek(&mut self, k: usize, new: usize) -> Option<Relation> {
        let Keyframes { list, graph, .. } = &self.keyframes;
        let source = match self.spread.source {
            Source::Current => &self.current,
            Source::Previous => &self.previous,
            Source::Kept => self.spread.kept.as_ref()?,
        };
        let guess = graph.relative(k, new);
        let measured = register(&mut self.aligner, source, &list[k].frame, &guess, &graph.field).ok()?;
        let relation = measured.relation();
        let fits = || graph.fits(&Edge { a: k, b: new, a_from_b: relation, alike: 1.0 });
        (measured.is_sound() && fits()).then_some(relation)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::map::options::MapOptions;
    use nalgebra::Isometry3;
    use projective_registration::Projection;
    use std::sync::Arc;

    #[test]
    fn a_map_made_by_parts_is_that_made_at_once() {
        let projection = Arc::new(Projection::pinhole(160, 120, [150.0; 2], [79.5, 59.5]).unwrap());
        let frame = |distance: f64| {
            let points: Vec<[f64; 3]> = (0_usize..160 * 120)
                .map(|k| [(k % 160) as f64 - 79.5, 59.5 - (k / 160) as f64, -150.0].map(|c| c * distance / 150.0))
                .collect();
            OrganisedFrame::new(&projection, &points, Some(&vec![0.01; 160 * 120])).unwrap()
        };
        let mut spread = Spread::default();
        for k in 0..3 {
            let pose = Isometry3::translation(0.1 * f64::from(k), 0.0, 0.0);
            spread.leave(frame(2.0 + 0.3 * f64::from(k)), &Uncertain::exact(pose));
        }
        let map = || SurfaceMap::new(MapOptions::default()).unwrap();
        let (mut at_once, mut by_parts) = (map(), map());
        spread.bring_all_into(&mut at_once);
        let mut frames = 0;
        while !spread.leaving.is_empty() {
            spread.bring_in(&mut by_parts);
            let mut whole = by_parts.clone();
            spread.bring_all_into(&mut whole);
            assert_eq!(whole.cloud(), at_once.cloud(), "what waits belongs to the map");
            frames += 1;
        }
        assert!(frames > 3 && !at_once.is_empty(), "{frames}");
        assert_eq!(by_parts.cloud(), at_once.cloud());
    }
}
