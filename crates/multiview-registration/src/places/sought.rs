//! A station sought among what the others saw.

use std::cmp::Reverse;

use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3, Vector6};

use crate::adjustment::known::SIGMAS;
use crate::error::Result;
use crate::places::search::{Places, RAY_STRIDE};
use crate::planes::elimination::motion_of;
use crate::planes::sightings::{Gate, NOWHERE, Sighting, Wide};
use crate::surfaces::points::StationPoints;
use rigid_pose::{eigen6, product_jacobians};

/// Steps of a slide, patches.
const STEP: f64 = 0.25;
/// Of so many points one tells which slides are worth refining: those that keep this share of what lies on planes now, and at most
/// so many.
const STRIDE: usize = 4;
const KEPT: f64 = 0.97;
const REFINED: usize = 3;
/// Steps onto the planes, each with points given to them anew, and what poses may be off before the last, patches.
const STEPS: usize = 4;
const OFF: f64 = 0.1;
/// Deviations by which the other of the two may speak against it: as often as one time in forty by chance. Half and twice change nothing.
pub(crate) const AGAINST_IT: f64 = 2.0;

/// A place of the station, with how many of its points lie on what the others saw.
struct Place {
    /// In the world.
    motion: Isometry3<f64>,
    points: usize,
    /// By shift and turn about where it is now.
    normal: Matrix6<f64>,
    right: Vector6<f64>,
}

/// A place, with the points that contradict it.
struct Judged {
    place: Place,
    against: usize,
}

impl Judged {
    fn new(sought: &Sought<'_>, place: Place, poses: &[Isometry3<f64>]) -> Self {
        Self { against: sought.against(&place.motion, poses), place }
    }

    /// Points on what others saw, less those that contradict, of which one in so many was counted.
    fn worth(&self) -> f64 {
        self.place.points as f64 - (RAY_STRIDE * self.against) as f64
    }

    /// By how many standard deviations more points of the station lie on what others saw than at another place, and fewer contradict.
    fn over(&self, other: &Self, all: usize) -> (f64, f64) {
        let over =
            |more: usize, less: usize, either: usize| (more as f64 - less as f64) / (either.max(1) as f64).sqrt();
        let (own, others) = (self.place.points, other.place.points);
        // So many may be explained by one of the two places alone.
        let either = (2 * all).saturating_sub(own + others);
        (over(own, others, either), over(other.against, self.against, self.against + other.against))
    }

    fn explains_more(&self, other: &Self, all: usize) -> bool {
        let (more, fewer) = self.over(other, all);
        more > SIGMAS && fewer > -AGAINST_IT
    }

    /// That is told whatever is known of where the station began.
    fn contradicts_less(&self, other: &Self, all: usize) -> bool {
        let (more, fewer) = self.over(other, all);
        fewer > SIGMAS && more > -AGAINST_IT
    }
}

/// A station among what others saw.
pub(crate) struct Sought<'a> {
    places: &'a Places<'a>,
    station: usize,
    pose: Isometry3<f64>,
    by_others: &'a (dyn Fn(usize) -> bool + Sync),
    /// Planes about it that others saw. Its own, at the wrong place beside the right ones, would keep the points to themselves.
    wide: Wide,
    points: StationPoints,
}

impl<'a> Sought<'a> {
    /// Where the station saw more of a plane than the others did, those points tell nothing: anywhere else along the plane more of them
    /// would lie on what the others saw.
    pub(crate) fn new(
        places: &'a Places<'a>,
        station: usize,
        poses: &[Isometry3<f64>],
        by_others: &'a (dyn Fn(usize) -> bool + Sync),
    ) -> Self {
        let (planes, pose) = (&places.adjusted.shared_planes, poses[station]);
        let of_others = |plane: usize| planes[plane].tiles.numbers().any(by_others);
        let wide = places.wide.only(of_others);
        let mut points = places.points[station].clone();
        let gate = Gate { slack_m: 0.0, stride: 1, parameters: 0 };
        let sighting = Sighting::new(&points, &pose, planes, gate);
        let (_, tiles) = sighting.sums_and_tiles(&wide, &places.members[station]);
        for (sigma, tile) in points.sigma.iter_mut().zip(tiles) {
            if tile != NOWHERE && !by_others(tile as usize) {
                *sigma = f64::NAN;
            }
        }
        Self { places, station, pose, by_others, wide, points }
    }

    /// Where a single station fits better than now.
    pub(crate) fn better(&self, poses: &[Isometry3<f64>]) -> Result<Option<Isometry3<f64>>> {
        let now = Judged::new(self, self.at(&Isometry3::identity(), 0.0, 1), poses);
        let all = self.points.sigma.iter().filter(|sigma| !sigma.is_nan()).count();
        // Of fewer, even a place without any would not be told by so many deviations.
        let is_contradicted = now.against as f64 > SIGMAS.powi(2);
        let others = self.others(is_contradicted, poses)?;
        let better = others.into_iter().map(|place| Judged::new(self, place, poses)).filter(|other| {
            let may_be = self.may_have_begun(&other.place.motion);
            other.contradicts_less(&now, all) || (may_be && other.explains_more(&now, all))
        });
        let best = better.reduce(|a, b| if b.worth() > a.worth() { b } else { a });
        Ok(best.map(|best| best.place.motion))
    }

    /// Places along what its points tell least that deserve a closer look.
    fn others(&self, is_contradicted: bool, poses: &[Isometry3<f64>]) -> Result<Vec<Place>> {
        let none = Isometry3::identity();
        let rough = self.at(&none, 0.0, STRIDE);
        let slide = self.weakest(&rough.normal)?;
        let step_m = STEP * self.places.size_m;
        let steps = (self.places.reach_m / step_m).ceil() as i32;
        let slides = (-steps..=steps).filter(|step| *step != 0);
        let motions = slides.map(|step| self.motion(&(slide * (f64::from(step) * step_m))));
        let wanted = motions.filter(|motion| is_contradicted || self.may_have_begun(motion));
        let mut others: Vec<Place> = wanted.map(|motion| self.at(&motion, 0.0, STRIDE)).collect();
        others.retain(|place| place.points as f64 > KEPT * rough.points as f64);
        // Stable: of equal ones the first.
        others.sort_by_key(|place| Reverse(place.points));
        let mut from: Vec<Isometry3<f64>> = others.iter().take(REFINED).map(|place| place.motion).collect();
        let mut slid = Vec::new();
        if is_contradicted {
            others.sort_by_cached_key(|place| self.against(&place.motion, poses));
            slid.extend(others.iter().take(REFINED).map(|place| place.motion));
        }
        // Among planes that hold still the station may leave what held it where it is.
        from.extend(slid.iter().chain([&none]));
        // Planes that are met at the wrong place draw a station there even from a slide that hardly anything contradicts.
        let refined = from.iter().map(|motion| self.refined(motion));
        Ok(refined.chain(slid.iter().map(|motion| self.at(motion, 0.0, 1))).collect())
    }

    /// Points that contradict where a single station is after a motion.
    fn against(&self, motion: &Isometry3<f64>, poses: &[Isometry3<f64>]) -> usize {
        self.places.looked_through.contradictions(self.station, &(motion * self.pose), poses)
    }

    /// Whether a station that is there may have begun where it did.
    fn may_have_begun(&self, motion: &Isometry3<f64>) -> bool {
        let begun = &self.places.start[self.station];
        let off_m = ((motion * self.pose).translation.vector - begun.translation.vector).norm();
        off_m <= SIGMAS * self.places.known_m
    }

    /// The motion by shift and turn about where it is now.
    fn motion(&self, step: &Vector6<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
        let shift = Vector3::new(step[0], step[1], step[2]);
        let middle = self.pose.translation.vector;
        Isometry3::from_parts((shift + middle - turn * middle).into(), turn)
    }

    /// The motion that the points tell least, turns as lengths at the radius.
    fn weakest(&self, normal: &Matrix6<f64>) -> Result<Vector6<f64>> {
        let scale = Vector6::from_fn(|k, _| if k < 3 { 1.0 } else { 1.0 / self.places.network.hold_m });
        let scaled = Matrix6::from_fn(|r, c| normal[(r, c)] * scale[r] * scale[c]);
        let (values, vectors) = eigen6(&scaled, "the normal equations of stations among others")?;
        Ok(vectors.column(values.imin()).component_mul(&scale))
    }

    /// The points of the station moved so, which may be off by some length.
    fn at(&self, motion: &Isometry3<f64>, slack_m: f64, stride: usize) -> Place {
        let planes = &self.places.adjusted.shared_planes;
        let gate = Gate { slack_m, stride, parameters: 0 };
        let pose = motion * self.pose;
        let sums =
            Sighting::new(&self.points, &pose, planes, gate).sums(&self.wide, &self.places.members[self.station]);
        let (mut points, mut normal, mut right) = (0, Matrix6::zeros(), Vector6::zeros());
        for slot in (0..sums.tiles()).filter(|slot| (self.by_others)(sums.tile(*slot))) {
            let Some(own) = sums.at(slot) else { continue };
            let plane = planes.partition_point(|plane| plane.tiles.first <= sums.tile(slot)) - 1;
            let motion = motion_of(&planes[plane], &pose);
            normal += motion * own.products(0, 0) * motion.transpose();
            right += motion * own.rights(0);
            points += sums.count(slot);
        }
        let by = self.tangent(&pose);
        Place { motion: *motion, points, normal: by.transpose() * normal * by, right: by.transpose() * right }
    }

    /// How the tangent of a pose follows shift and turn about where the station is now.
    fn tangent(&self, pose: &Isometry3<f64>) -> Matrix6<f64> {
        let apart = pose.translation.vector - self.pose.translation.vector;
        product_jacobians(&Isometry3::identity(), &Isometry3::from_parts(apart.into(), pose.rotation)).0
    }

    /// The station moved onto the planes.
    fn refined(&self, from: &Isometry3<f64>) -> Place {
        let hold_m = self.places.size_m / 2.0;
        let mut motion = *from;
        for _ in 0..STEPS {
            let Place { mut normal, right, .. } = self.at(&motion, OFF * self.places.size_m, 1);
            for k in 0..6 {
                let own_m = if k < 3 { hold_m } else { hold_m / self.places.network.hold_m };
                normal[(k, k)] += own_m.powi(-2);
            }
            let Some(factor) = normal.cholesky() else { break };
            motion = self.motion(&-factor.solve(&right)) * motion;
        }
        self.at(&motion, 0.0, 1)
    }
}
