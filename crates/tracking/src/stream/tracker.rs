//! The tracker: one call a frame.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6};

use crate::error::{Error, Result};
use crate::map::surfaces::SurfaceMap;
use crate::motion_model::motion::{MotionPrior, diagonal};
use crate::motion_model::prediction::{Grounds, Last, Prediction};
use crate::motion_model::velocity::Velocity;
use crate::options::TrackerOptions;
use crate::stream::beside::Beside;
use crate::stream::keyframes::Keyframes;
use crate::stream::locate::{Fix, Measured};
use crate::stream::spread::Spread;
use crate::tracked::{LossReason, TrackedPose, TrackingState};
use point_cloud::Cloud;
use pose_graph::Relation;
use projective_registration::{
    AbsorbScratch, ByField, FieldMatrix, FrameAligner, FrameAlignmentOptions, Influence, OrganisedFrame, Projection,
    SharedError,
};
use rigid_pose::{InputError, Uncertain};

/// Smallest fraction of the nodes of a frame that must have a plane: below, it is blank.
const FEWEST_PLANES: f64 = 0.03;

/// Tracks a stream of organised frames of one camera.
///
/// Memory is allocated for keyframes and for the list of poses; a frame that makes no keyframe allocates nothing, or a list of a
/// few numbers where it looks for another keyframe. The same frames give the same bits for any number of threads.
#[derive(Debug, Clone)]
pub struct Tracker {
    pub(crate) options: TrackerOptions,
    pub(crate) aligner: FrameAligner,
    pub(crate) current: OrganisedFrame,
    pub(crate) previous: OrganisedFrame,
    pub(crate) keyframes: Keyframes,
    /// Of the sensor, as the registrations of keyframes tell it.
    pub(crate) shared: SharedError,
    pub(crate) last: Option<Last>,
    trajectory: Vec<TrackedPose>,
    /// What keyframes that are no more have seen.
    pub(crate) seen_before: Option<SurfaceMap>,
    scratch: AbsorbScratch,
    pub(crate) beside: Beside,
    pub(crate) spread: Spread,
}

/// All that one frame gave.
struct Seen {
    measured: Measured,
    fix: Fix,
    prediction: Prediction,
}

impl Tracker {
    /// A tracker of frames of one camera.
    ///
    /// # Errors
    /// [`InputError::InvalidOption`], [`InputError::NonFinite`] for the options.
    pub fn new(projection: &Arc<Projection>, options: TrackerOptions) -> Result<Self> {
        options.validate()?;
        let nothing = vec![[f64::NAN; 3]; projection.width() * projection.height()];
        let mut alignment = options.alignment.clone();
        alignment.search = false;
        let blank = OrganisedFrame::new(projection, &nothing, None)?;
        Ok(Self {
            shared: alignment.shared_error.unwrap_or_default(),
            aligner: FrameAligner::new(alignment)?,
            current: blank.clone(),
            previous: blank,
            options,
            keyframes: Keyframes::default(),
            last: None,
            trajectory: Vec::new(),
            seen_before: None,
            scratch: AbsorbScratch::default(),
            beside: Beside::default(),
            spread: Spread::default(),
        })
    }

    /// Takes the next frame: one point a pixel, row by row, camera frame, metre, NaN where there is no range; `sigma`:
    /// standard deviation of the ranges, metre. `prior`: the motion since the frame before, where something else has
    /// measured it.
    ///
    /// A frame that cannot be tracked is no error: its state says so, and later frames are sought again.
    ///
    /// # Errors
    /// [`Error::NotAscending`] where the time is not later than that of the frame before, [`InputError::Numerical`] for a
    /// prior that is not finite or whose covariance is not positive definite, [`Error::Frames`] for
    /// frames of another camera. Nothing has changed then.
    pub fn track<T: Copy + Into<f64> + Sync>(
        &mut self,
        timestamp_s: f64,
        points: &[[T; 3]],
        sigma: Option<&[f32]>,
        prior: Option<&MotionPrior>,
    ) -> Result<TrackedPose> {
        let before = self.trajectory.last().map_or(f64::NEG_INFINITY, |pose| pose.timestamp_s);
        if !timestamp_s.is_finite() || timestamp_s <= before {
            return Err(Error::NotAscending { what: "times of the frames", index: self.trajectory.len() });
        }
        if prior.is_some_and(|prior| !prior.is_sound()) {
            return Err(InputError::Numerical {
                what: "the motion prior",
                why: "its covariance is not positive definite",
            }
            .into());
        }
        self.current.update(points, sigma)?;
        let pose = match self.last.take() {
            None => self.start(timestamp_s),
            Some(last) => self.follow(timestamp_s, &last, prior),
        };
        self.go_on();
        self.trajectory.push(pose);
        Ok(pose)
    }

    /// Forgets the poses of all frames but the last: for streams without end, which keep what they need of them. The list of
    /// poses takes no memory then, and keyframes are bounded by the options.
    pub fn forget_poses(&mut self) {
        let kept = self.trajectory.len().min(1);
        self.trajectory.drain(..self.trajectory.len() - kept);
    }

    /// The poses of all frames as they were when they were tracked, as far as they were not forgotten.
    pub fn trajectory(&self) -> &[TrackedPose] {
        &self.trajectory
    }

    /// The poses of the same frames as they are known now: closed loops have moved the keyframes they hang on. Covariances
    /// are those of the time of tracking.
    pub fn adjusted_trajectory(&self) -> Vec<TrackedPose> {
        let adjusted = |pose: &TrackedPose| match self.world_from_keyframe(pose.keyframe) {
            Some(world) => TrackedPose { world_from_camera: world * pose.keyframe_from_camera, ..*pose },
            None => *pose,
        };
        self.trajectory.iter().map(adjusted).collect()
    }

    /// Where the keyframe of a [`TrackedPose::keyframe`] stands now, also one that was taken out: who keeps
    /// [`TrackedPose::keyframe_from_camera`] of poses that were [forgotten](Self::forget_poses) knows them adjusted. The way leads over
    /// the keyframes that took its place, one after the other: of many poses, ask once a keyframe.
    pub fn world_from_keyframe(&self, number: usize) -> Option<Isometry3<f64>> {
        self.keyframes.world_from(number)
    }

    /// The map: the planes of all keyframes as points with normals and standard deviations, in the world's frame. Where
    /// keyframes overlap, surfaces come several times.
    pub fn map(&self) -> Cloud {
        self.keyframes.cloud()
    }

    /// Keeps what keyframes see beyond their number: those that are taken out leave their surfaces in this map, which may hold
    /// others already.
    pub fn keep_map(&mut self, map: SurfaceMap) {
        self.seen_before = Some(map);
        self.spread.forget_leaving();
    }

    /// The map with each surface once: what [`keep_map`](Self::keep_map) holds, and the surfaces of all keyframes where they lie now.
    /// `None` without `keep_map`.
    pub fn surface_map(&self) -> Option<SurfaceMap> {
        let mut map = self.seen_before.clone()?;
        self.spread.bring_all_into(&mut map);
        for (k, keyframe) in self.keyframes.list.iter().enumerate() {
            map.add_nodes(&keyframe.frame, &self.keyframes.pose(k), 0..keyframe.frame.nodes());
        }
        Some(map)
    }

    /// Number of keyframes in the map.
    pub fn keyframes(&self) -> usize {
        self.keyframes.list.len()
    }

    /// Registrations between keyframes that were observed; more than keyframes less one where loops were closed.
    pub fn registrations(&self) -> usize {
        self.keyframes.graph.edges.len()
    }

    /// The systematic error of the sensor that all frames share, as the registrations of keyframes tell it. The covariances
    /// of poses rest on it: on its being smooth over the frame, and on what loops may tell of it: a quarter of its variance.
    pub fn shared_error(&self) -> &SharedError {
        &self.shared
    }

    fn start(&mut self, timestamp_s: f64) -> TrackedPose {
        let pose = Uncertain::exact(self.options.world_from_first);
        let blank = self.current.filled() < FEWEST_PLANES;
        let state = if blank { TrackingState::Lost(LossReason::TooFewPoints) } else { TrackingState::Started };
        if !blank {
            self.set_weakest_motion();
            self.keyframes.start(&self.current, &pose.pose);
            self.keyframes.graph.set_shared_error(&self.shared);
            self.last = Some(Last {
                timestamp_s,
                keyframe: 0,
                own: Uncertain::exact(Isometry3::identity()),
                by_field: ByField::zeros(),
                shared: Matrix6::zeros(),
                velocity: None,
                interval_s: f64::INFINITY,
                disturbance: None,
                carried: 0,
                informed: true,
                lost_frames: 0,
            });
        }
        TrackedPose {
            timestamp_s,
            world_from_camera: pose.pose,
            covariance: if blank { Matrix6::identity() } else { pose.covariance },
            state,
            keyframe: 0,
            keyframe_from_camera: Isometry3::identity(),
            overlap: if blank { 0.0 } else { 1.0 },
            rms_m: 0.0,
            measured_motion: None,
        }
    }

    /// Sets from which standard deviation on motions are undetermined, where the options leave that to the frames.
    fn set_weakest_motion(&mut self) {
        let mut alignment = self.aligner.options().clone();
        if self.options.alignment.max_motion_sigma_m.is_none() {
            alignment.max_motion_sigma_m =
                Some(FrameAlignmentOptions::OPEN_IN_A_GRAPH * self.current.radius_m().max(f64::MIN_POSITIVE));
        }
        if let Ok(aligner) = FrameAligner::new(alignment) {
            self.aligner = aligner;
        }
    }

    fn follow(&mut self, timestamp_s: f64, last: &Last, prior: Option<&MotionPrior>) -> TrackedPose {
        self.count_beside();
        let prediction = last.predict(timestamp_s, prior);
        match self.locate(last, &prediction) {
            Ok((measured, fix)) => self.found(timestamp_s, last, &Seen { measured, fix, prediction }),
            Err(reason) => self.lost(timestamp_s, last, &prediction, reason),
        }
    }

    fn locate(&mut self, last: &Last, prediction: &Prediction) -> std::result::Result<(Measured, Fix), LossReason> {
        if self.current.filled() < FEWEST_PLANES {
            return Err(LossReason::TooFewPoints);
        }
        let near = self.near(last, prediction).and_then(|measured| self.placed(&measured, last, prediction));
        let near = near.or_else(|reason| {
            let measured = self.try_previous(last, prediction).filter(Measured::is_sound).ok_or(reason)?;
            let measured = self.keep_previous(last, &measured);
            self.placed(&measured, last, prediction)
        });
        let found = match &near {
            // Where the velocity bears it out, what contradicts moves by itself.
            Ok((measured, fix)) if measured.agrees() || fix.borne_out => return near,
            // What contradicts is still better than nothing, unless some other keyframe fits.
            Ok(_) => {
                let ranked = self.ranked();
                self.alike(&ranked)
            }
            // It lies on the reference, with a motion open: the camera is not elsewhere.
            Err(LossReason::Undetermined) if last.lost_frames == 0 => None,
            Err(_) => self.wide(last.lost_frames),
        };
        found.map_or(near, |measured| Ok((measured, Fix::unexpected(&measured))))
    }

    /// A registration weighed against the prediction.
    fn placed(
        &self,
        measured: &Measured,
        last: &Last,
        prediction: &Prediction,
    ) -> std::result::Result<(Measured, Fix), LossReason> {
        let predicted = prediction.seen_from(&self.keyframes.graph.relative(measured.keyframe, last.keyframe));
        self.fixed(measured, &predicted, last.lost_frames)
    }

    fn found(&mut self, timestamp_s: f64, last: &Last, seen: &Seen) -> TrackedPose {
        let Seen { measured, fix, prediction } = seen;
        self.end_beside();
        let (keyframe, own) = (measured.keyframe, fix.own);
        let between = self.keyframes.graph.relative(keyframe, last.keyframe);
        let before = Uncertain::exact(between).then(&last.own);
        let (half, seconds) = (measured.own(), timestamp_s - last.timestamp_s);
        let follows = last.lost_frames == 0 && fix.expected;
        let measured_motion = follows.then(|| {
            let motion = half.inverse().then(&before);
            MotionPrior { current_from_previous: motion.pose, covariance: motion.covariance }
        });
        let learns = last.lost_frames == 0 && measured.determined;
        let disturbance = if learns {
            let motion = before.pose.inverse() * half.pose;
            last.disturbed_by(timestamp_s, &prediction.seen_from(&between), &half, &motion)
        } else {
            last.disturbance
        };
        let from_poses = || Velocity::between(&before, &own, seconds, disturbance.unwrap_or_default());
        let velocity = fix.velocity.or_else(|| follows.then(from_poses));
        let shared = if measured.determined { measured.shared() } else { last.shared };
        let total = Uncertain { covariance: own.covariance + shared, ..own };
        let own_relation = Relation { random: total, by_field: measured.by_field() };
        let field = self.field_covariance(measured.influence.as_ref());
        let world = self.keyframes.graph.from(keyframe, &own_relation).total(&field);
        if measured.determined {
            // Planes of the keyframe move to the weighted mean of all frames that saw them.
            self.keyframes.list[keyframe].frame.absorb(&self.current, &measured.aligned, &mut self.scratch);
        }
        let pose = TrackedPose {
            timestamp_s,
            world_from_camera: world.pose,
            covariance: world.covariance,
            state: if follows { TrackingState::Tracked } else { TrackingState::Relocalised },
            keyframe: self.keyframes.list[keyframe].number,
            keyframe_from_camera: own.pose,
            overlap: measured.agreement.overlap(),
            rms_m: measured.rms_m,
            measured_motion,
        };
        self.last = Some(Last {
            timestamp_s,
            keyframe,
            own,
            by_field: measured.by_field(),
            shared,
            velocity,
            interval_s: seconds,
            disturbance,
            carried: if measured.determined { 0 } else { last.carried + 1 },
            informed: true,
            lost_frames: 0,
        });
        if pose.overlap < self.options.keyframe_overlap {
            self.change_reference(&own_relation, measured.influence.as_ref());
        }
        self.thin();
        pose
    }

    fn lost(&mut self, timestamp_s: f64, last: &Last, prediction: &Prediction, reason: LossReason) -> TrackedPose {
        let total = Uncertain { covariance: prediction.own.covariance + last.shared, ..prediction.own };
        let relation = Relation { random: total, by_field: last.by_field };
        let world = self.keyframes.graph.from(last.keyframe, &relation).total(&self.keyframes.graph.covariance);
        let radius = self.keyframes.list[last.keyframe].frame.radius_m();
        let unknown = diagonal([radius * radius, 1.0]);
        let informed = prediction.grounds != Grounds::Nothing;
        self.last = Some(Last {
            timestamp_s,
            own: prediction.own,
            velocity: prediction.velocity,
            informed,
            lost_frames: last.lost_frames + 1,
            ..last.clone()
        });
        TrackedPose {
            timestamp_s,
            world_from_camera: world.pose,
            covariance: if informed { world.covariance } else { world.covariance + unknown },
            state: TrackingState::Lost(reason),
            keyframe: self.keyframes.list[last.keyframe].number,
            keyframe_from_camera: prediction.own.pose,
            overlap: 0.0,
            rms_m: 0.0,
            measured_motion: None,
        }
    }

    /// Covariance of the field of the shared error: until a loop has told more, as the registrations of keyframes and
    /// that of this frame show it.
    fn field_covariance(&self, influence: Option<&Influence>) -> FieldMatrix {
        let graph = &self.keyframes.graph;
        match influence {
            Some(influence) if !graph.closed && self.options.alignment.shared_error.is_none() => {
                let mut shared = self.shared;
                shared.learn(influence);
                shared.of_field()
            }
            _ => graph.covariance,
        }
    }

    /// Takes out keyframes beyond the number allowed.
    fn thin(&mut self) {
        let Some(last) = &mut self.last else { return };
        while self.keyframes.list.len() > self.options.max_keyframes {
            let newest = self.keyframes.list.len() - 1;
            let Some((gone, keyframe, pose)) = self.keyframes.thin([last.keyframe, newest]) else { return };
            if self.seen_before.is_some() {
                self.spread.leave(keyframe.frame, &pose);
            }
            last.keyframe -= usize::from(last.keyframe > gone);
        }
    }
}
