//! Stations sought among what the others saw: one by itself, or those of a part of the network that little holds.

use std::cmp::Reverse;

use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use crate::error::Result;
use crate::planes::elimination::motion_of;
use crate::planes::sightings::{Gate, NOWHERE, Sighting, Wide};
use crate::surfaces::extents::Extent;
use crate::surfaces::points::StationPoints;
use crate::survey::places::{LOOSE, Places};
use icp_registration::RobustKernel;
use rigid_pose::eigen6;

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
/// Stations on either side of what little holds that tell where they began.
const NEAREST: usize = 24;
/// Standard deviations by which more points must lie on planes elsewhere, or fewer contradict: beyond chance, even if points come in
/// groups of some five. Elsewhere stations of simulated buildings that are right come to 2.1, those 4 to 14 cm off from 19 to 42; with less,
/// right ones are moved and doubted.
const SIGMAS: f64 = 5.0;
/// By which the other of the two may speak against it: as often as one time in forty by chance.
const AGAINST_IT: f64 = 2.0;
/// Points that contradict below which no place is better by so much: closer looks would only take time.
const FEWEST_AGAINST: usize = 20;
/// How many points on planes each of them outweighs where several places are better: of each eighth point contradictions are counted.
const AGAINST: f64 = 4.0;
/// Standard deviations from where it began within which a station is sought: one in a million is farther off along some axis.
const BEGUN: f64 = 5.0;

/// Stations that move as one, with how many of their points lie on what the others saw.
struct Place {
    /// Of all of them, in the world.
    motion: Isometry3<f64>,
    points: usize,
    /// By shift and turn about their middle.
    normal: Matrix6<f64>,
    right: Vector6<f64>,
}

/// A place of a single station, with the points that contradict it.
struct Judged {
    place: Place,
    against: usize,
}

impl Judged {
    fn new(sought: &Sought<'_>, place: Place, poses: &[Isometry3<f64>]) -> Self {
        Self { against: sought.against(&place.motion, poses), place }
    }

    /// More points on what others saw, less those that contradict.
    fn worth(&self) -> f64 {
        self.place.points as f64 - AGAINST * self.against as f64
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

/// Stations that move as one among what others saw.
pub(crate) struct Sought<'a> {
    places: &'a Places<'a>,
    /// Those that saw something of that, and their poses.
    stations: Vec<(usize, Isometry3<f64>)>,
    middle: Vector3<f64>,
    /// Distance at which turns count as lengths.
    radius_m: f64,
    by_others: &'a (dyn Fn(usize) -> bool + Sync),
    /// Planes about them that others saw. Their own, at the wrong place beside the right ones, would keep the points to themselves.
    wide: Wide,
    /// The points of a single station; otherwise those of each.
    points: Option<StationPoints>,
}

impl<'a> Sought<'a> {
    pub(crate) fn new(
        places: &'a Places<'a>,
        stations: &[usize],
        poses: &[Isometry3<f64>],
        by_others: &'a (dyn Fn(usize) -> bool + Sync),
    ) -> Self {
        let beside = |station: &&usize| stations.len() == 1 || places.seen(**station).any(by_others);
        let stations: Vec<(usize, Isometry3<f64>)> =
            stations.iter().filter(beside).map(|station| (*station, poses[*station])).collect();
        let n = stations.len().max(1) as f64;
        let middle = stations.iter().fold(Vector3::zeros(), |sum, (_, pose)| sum + pose.translation.vector / n);
        let apart = stations.iter().map(|(_, pose)| (pose.translation.vector - middle).norm_squared() / n).sum::<f64>();
        let radius_m = (apart + places.network.hold_m.powi(2)).sqrt();
        let around = stations.iter().map(|(station, pose)| places.around(*station, pose, radius_m));
        let around = around.reduce(|a, b| a.joined(&b)).unwrap_or_else(|| Extent::of(std::iter::empty()));
        let planes = &places.adjusted.shared_planes;
        let of_others = |plane: usize| planes[plane].tiles.numbers().any(by_others);
        Self {
            places,
            middle,
            radius_m,
            by_others,
            wide: places.wide.within(&around, of_others),
            stations,
            points: None,
        }
    }

    /// One station. Where it saw more of a plane than the others did, those points tell nothing: anywhere else along the plane more of them
    /// would lie on what the others saw.
    pub(crate) fn of_one(
        places: &'a Places<'a>,
        station: usize,
        poses: &[Isometry3<f64>],
        by_others: &'a (dyn Fn(usize) -> bool + Sync),
    ) -> Self {
        let mut this = Self::new(places, &[station], poses, by_others);
        let mut points = places.points[station].clone();
        let gate = Gate { kernel: RobustKernel::Tukey, slack_m: 0.0, stride: 1, parameters: 0 };
        let sighting = Sighting::new(&points, &poses[station], &places.adjusted.shared_planes, gate);
        let (_, tiles) = sighting.sums_and_tiles(&this.wide, &places.members[station]);
        for (sigma, tile) in points.sigma.iter_mut().zip(tiles) {
            if tile != NOWHERE && !by_others(tile as usize) {
                *sigma = f64::NAN;
            }
        }
        this.points = Some(points);
        this
    }

    /// Where a single station fits better than now.
    pub(crate) fn better(&self, poses: &[Isometry3<f64>]) -> Result<Option<Isometry3<f64>>> {
        let now = Judged::new(self, self.at(&Isometry3::identity(), 0.0, 1), poses);
        let all = self.points.iter().flat_map(|points| &points.sigma).filter(|sigma| !sigma.is_nan()).count();
        let others = self.others(now.against >= FEWEST_AGAINST, poses)?;
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
        let [(station, pose)] = self.stations.as_slice() else { return 0 };
        self.places.looked_through.contradictions(*station, &(motion * pose), poses)
    }

    /// Whether a station that is there may have begun where it did.
    fn may_have_begun(&self, motion: &Isometry3<f64>) -> bool {
        let off = |(station, pose): &(usize, Isometry3<f64>)| {
            let begun = &self.places.start[*station];
            ((motion * pose).translation.vector - begun.translation.vector).norm()
        };
        self.stations.iter().all(|own| off(own) <= BEGUN * self.places.known_m)
    }

    /// The motion of a part that little holds to where its stations began, on average, as against those beside it: shared planes tell
    /// from there. `None` where it is there.
    pub(crate) fn as_begun(
        &self,
        part: &[usize],
        placed: &[usize],
        poses: &[Isometry3<f64>],
    ) -> Result<Option<Isometry3<f64>>> {
        if self.stations.is_empty() || placed.is_empty() {
            return Ok(None);
        }
        let slide = self.weakest(&self.at(&Isometry3::identity(), 0.0, 1).normal)?;
        let shift = Vector3::new(slide[0], slide[1], slide[2]);
        let began = |stations: &[usize]| {
            let apart = |station: &usize| (poses[*station].translation.vector - self.middle).norm_squared();
            let mut near = stations.to_vec();
            near.sort_by(|a, b| apart(a).total_cmp(&apart(b)).then(a.cmp(b)));
            near.truncate(NEAREST);
            let place = |poses: &[Isometry3<f64>], station: &usize| poses[*station].translation.vector;
            let off = |station: &usize| place(self.places.start, station) - place(poses, station);
            near.iter().map(off).sum::<Vector3<f64>>() / near.len() as f64
        };
        // What turns more than it slides stays.
        let back_m = shift.dot(&(began(part) - began(placed))) / shift.norm_squared().max(0.5);
        Ok((back_m.abs() > LOOSE * self.places.size_m).then(|| self.motion(&(slide * back_m))))
    }

    /// The motion by shift and turn about the middle.
    fn motion(&self, step: &Vector6<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
        let shift = Vector3::new(step[0], step[1], step[2]);
        Isometry3::from_parts((shift + self.middle - turn * self.middle).into(), turn)
    }

    /// The motion that the points tell least, turns as lengths at the radius.
    fn weakest(&self, normal: &Matrix6<f64>) -> Result<Vector6<f64>> {
        let scale = Vector6::from_fn(|k, _| if k < 3 { 1.0 } else { 1.0 / self.radius_m });
        let scaled = Matrix6::from_fn(|r, c| normal[(r, c)] * scale[r] * scale[c]);
        let (values, vectors) = eigen6(&scaled, "the normal equations of stations among others")?;
        Ok(vectors.column(values.imin()).component_mul(&scale))
    }

    /// The points of the stations moved so, which may be off by some length.
    fn at(&self, motion: &Isometry3<f64>, slack_m: f64, stride: usize) -> Place {
        let planes = &self.places.adjusted.shared_planes;
        let gate = Gate { kernel: RobustKernel::Tukey, slack_m, stride, parameters: 0 };
        let mut place = Place { motion: *motion, points: 0, normal: Matrix6::zeros(), right: Vector6::zeros() };
        for (station, pose) in &self.stations {
            let pose = motion * pose;
            let points = self.points.as_ref().unwrap_or(&self.places.points[*station]);
            let members = &self.places.members[*station];
            let sums = Sighting::new(points, &pose, planes, gate).sums(&self.wide, members);
            let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
            for slot in (0..sums.tiles()).filter(|slot| (self.by_others)(sums.tile(*slot))) {
                let Some(own) = sums.at(slot) else { continue };
                let plane = planes.partition_point(|plane| plane.tiles.first <= sums.tile(slot)) - 1;
                let motion = motion_of(&planes[plane], &pose);
                normal += motion * Matrix3::from_fn(|i, j| own.product(i, j)) * motion.transpose();
                right += motion * Vector3::from_fn(|i, _| own.right(i));
                place.points += sums.count(slot);
            }
            let by = self.tangent(&pose);
            place.normal += by.transpose() * normal * by;
            place.right += by.transpose() * right;
        }
        place
    }

    /// How the tangent of a pose follows shift and turn about the middle.
    fn tangent(&self, pose: &Isometry3<f64>) -> Matrix6<f64> {
        let mut by = Matrix6::identity();
        by.fixed_view_mut::<3, 3>(0, 3).copy_from(&(self.middle - pose.translation.vector).cross_matrix());
        by.fixed_view_mut::<3, 3>(3, 3).copy_from(&pose.rotation.inverse().to_rotation_matrix().into_inner());
        by
    }

    /// The stations moved onto the planes.
    fn refined(&self, from: &Isometry3<f64>) -> Place {
        let hold_m = self.places.size_m / 2.0;
        let mut motion = *from;
        for _ in 0..STEPS {
            let Place { mut normal, right, .. } = self.at(&motion, OFF * self.places.size_m, 1);
            (0..6).for_each(|k| normal[(k, k)] += if k < 3 { hold_m } else { hold_m / self.radius_m }.powi(-2));
            let Some(factor) = normal.cholesky() else { break };
            motion = self.motion(&-factor.solve(&right)) * motion;
        }
        self.at(&motion, 0.0, 1)
    }
}
