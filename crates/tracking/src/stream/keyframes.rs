//! The keyframes: pieces of the map and a graph of their poses.

use std::sync::Arc;

use nalgebra::Isometry3;

use global_registration::FeatureCloud;
use point_cloud::Cloud;
use pose_graph::Graph;
use pose_graph::Relation;
use projective_registration::{Agreement, OrganisedFrame};
use rigid_pose::Uncertain;

/// Fields of the thumbnails.
pub(crate) const THUMBNAIL: [usize; 2] = [16, 12];
/// Keyframes that a frame is tried with where its own is not enough, those that should see most of the same, or look most like it.
pub(crate) const CANDIDATES: usize = 4;

/// A frame that others are registered with.
#[derive(Debug, Clone)]
pub(crate) struct Keyframe {
    pub(crate) number: usize,
    pub(crate) frame: OrganisedFrame,
    pub(crate) thumbnail: Vec<f32>,
    /// For alignment without a guess; made when first needed.
    pub(crate) features: Option<Arc<FeatureCloud>>,
}

impl Keyframe {
    /// Its features, or the cloud that they are made from.
    pub(crate) fn features(&self) -> (Option<Arc<FeatureCloud>>, Option<Cloud>) {
        (self.features.clone(), self.features.is_none().then(|| self.frame.to_cloud()))
    }
}

/// Where a keyframe number leads to.
#[derive(Debug, Clone, Copy)]
enum Anchor {
    Kept,
    /// Taken out; its pose in the frame of another.
    Joined {
        to: usize,
        to_from_this: Isometry3<f64>,
    },
}

/// All keyframes and how they lie to each other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Keyframes {
    pub(crate) list: Vec<Keyframe>,
    pub(crate) graph: Graph,
    anchors: Vec<Anchor>,
}

impl Keyframes {
    pub(crate) fn start(&mut self, frame: &OrganisedFrame, world_from_keyframe: &Isometry3<f64>) {
        self.push(frame);
        self.graph.poses.push(Relation::exact(*world_from_keyframe));
    }

    /// A new keyframe at a pose measured from keyframe `from`; returns its index.
    pub(crate) fn add(&mut self, frame: &OrganisedFrame, from: usize, from_from_new: &Relation) -> usize {
        self.push(frame);
        self.graph.add(from, from_from_new)
    }

    fn push(&mut self, frame: &OrganisedFrame) {
        let thumbnail = frame.thumbnail(THUMBNAIL[0], THUMBNAIL[1]);
        let frame = frame.as_target();
        self.list.push(Keyframe { number: self.anchors.len(), frame, thumbnail, features: None });
        self.anchors.push(Anchor::Kept);
    }

    /// A few keyframes among `tried` with the fraction of the frame that may lie on their surfaces at a pose given from keyframe `from`;
    /// best first.
    pub(crate) fn candidates(
        &self,
        current: &OrganisedFrame,
        from: usize,
        from_from_camera: &Isometry3<f64>,
        tried: impl Fn(usize) -> bool,
    ) -> Vec<(f64, usize)> {
        let all = (0..self.list.len()).filter(|k| tried(*k));
        let mut found: Vec<(f64, usize, Isometry3<f64>)> =
            all.map(|k| (0.0, k, self.graph.relative(k, from) * from_from_camera)).collect();
        // Few points tell which ones are worth more.
        for most in [Agreement::NODES / 32, Agreement::NODES / 4] {
            for (share, k, pose) in &mut found {
                *share = self.list[*k].frame.nearness(current, pose, most, Agreement::LARGEST_ERROR);
            }
            found.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
            found.truncate(CANDIDATES);
        }
        found.into_iter().map(|(overlap, k, _)| (overlap, k)).collect()
    }

    /// Takes out the keyframe that is nearest to another one, neither the first nor `spared`; returns its index, and it
    /// with its pose in the world.
    pub(crate) fn thin(&mut self, spared: [usize; 2]) -> Option<(usize, Keyframe, Uncertain)> {
        let gap = |k: usize| {
            let others = (0..self.list.len()).filter(|l| *l != k);
            let distance = |l: usize| {
                let motion = self.graph.relative(k, l);
                motion.translation.vector.norm() / self.list[k].frame.radius_m() + motion.rotation.angle()
            };
            others.map(distance).fold(f64::INFINITY, f64::min)
        };
        let free = (1..self.list.len()).filter(|k| !spared.contains(k)).map(|k| (gap(k), k));
        let (_, k) = free.min_by(|x, y| x.0.total_cmp(&y.0))?;
        let pose = self.pose(k);
        let (hub, k_from_hub) = self.graph.remove(k)?;
        let joined = Anchor::Joined { to: self.list[hub].number, to_from_this: k_from_hub.pose().inverse() };
        self.anchors[self.list[k].number] = joined;
        Some((k, self.list.remove(k), pose))
    }

    /// Where a keyframe of this number stands in the list, if it is kept.
    pub(crate) fn index(&self, number: usize) -> Option<usize> {
        self.list.iter().position(|keyframe| keyframe.number == number)
    }

    /// Pose of a keyframe in the world.
    pub(crate) fn pose(&self, k: usize) -> Uncertain {
        self.graph.poses[k].total(&self.graph.covariance)
    }

    /// All surfaces in the world's frame.
    pub(crate) fn cloud(&self) -> Cloud {
        let (mut points, mut normals, mut sigmas) = (Vec::new(), Vec::new(), Vec::new());
        for (keyframe, pose) in self.list.iter().zip(&self.graph.poses) {
            for (point, normal, sigma) in keyframe.frame.surface() {
                points.push(pose.pose() * point);
                normals.push(pose.pose() * normal);
                sigmas.push(sigma);
            }
        }
        Cloud { points, normals: Some(normals), sigma: Some(sigmas), ..Cloud::default() }
    }

    /// Present world pose of a keyframe by its number, also of one that was taken out.
    pub(crate) fn world_from(&self, number: usize) -> Option<Isometry3<f64>> {
        let (mut number, mut chain) = (number, Isometry3::identity());
        // Each step leads to a keyframe that was kept longer, so there are at most as many as keyframes.
        for _ in 0..=self.anchors.len() {
            match self.anchors.get(number)? {
                Anchor::Kept => {
                    let k = self.index(number)?;
                    return Some(self.graph.poses[k].pose() * chain);
                }
                Anchor::Joined { to, to_from_this } => {
                    chain = to_from_this * chain;
                    number = *to;
                }
            }
        }
        None
    }
}
