//! Registration of organised frames as stations: pairs by projection, and one graph of their poses.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Matrix6};

use crate::agreement::alignments::{Overlap, PairAlignment, RefusedPair, best_partners};
use crate::agreement::loops::{LoopClosure, reached};
use crate::agreement::placement::{PairAgreement, Placements};
use crate::error::{Error, Result};
use crate::pairs_of_frames::frame_graph::FrameGraph;
use crate::pairs_of_frames::frame_pairs::{Candidate, FramePair, Frames, Guess};
use crate::pairs_of_frames::frame_scale::scaled;
use crate::relative_pose::check_poses;
use crate::survey::registration::Start;
use projective_registration::{Agreement, FrameAlignmentOptions, OrganisedFrame, SharedError};
use rigid_pose::InputError;

/// By how much surfaces may stand apart at start poses, share of the depth: poses that err by 5 cm and 2 degrees an axis move them by some
/// 0.05 against each other at 2 m. Larger ones only try more pairs.
const START_ERROR: f32 = 0.15;
/// Pairs of a frame that are tried, those with the most overlap.
const PARTNERS: usize = 6;
/// Where the order is known, frames after each that it is tried with, and placed ones, the nearest, that it is sought from without a guess.
const NEAREST: usize = 2;
/// Rounds in which the graph tells further pairs, and in which pairs that do not fit it go and those that fit again come back: two
/// were enough on all frames tried.
pub(crate) const ROUNDS: usize = 4;

/// A frame that was placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedFrame {
    /// Its pose.
    pub world_from_frame: Isometry3<f64>,
    /// Covariance in the tangent `[dt world axes (m), dtheta frame axes (rad)]`; zero for the datum.
    pub covariance: Matrix6<f64>,
}

/// A frame that was not placed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnplacedFrame {
    /// Its index.
    pub frame: usize,
    /// Why, in words that stand after its name and a colon.
    pub reason: String,
}

/// A pair that alone joins frames with the others: if it is wrong, nothing shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UncheckedPair {
    /// The frames of the pair.
    pub target: usize,
    /// See `target`.
    pub source: usize,
    /// The frames that it joins with the others, on its side that holds fewer.
    pub frames: Vec<usize>,
}

/// All frames in one coordinate system, but for those that do not belong there.
#[derive(Debug, Clone)]
pub struct FrameRegistration {
    /// One a frame, in their order; `None`: `unplaced` says why.
    pub frames: Vec<Option<PlacedFrame>>,
    /// The frame that is held: the first one of the largest part that agrees.
    pub datum: usize,
    /// Frames without a pose.
    pub unplaced: Vec<UnplacedFrame>,
    /// The pairs that the poses come from, each with its covariance from the pair alone.
    pub pairs: Vec<PairAlignment>,
    /// Pairs that were tried and not trusted, or contradict the others.
    pub refused: Vec<RefusedPair>,
    /// How loops of pairs close.
    pub loops: Vec<LoopClosure>,
    /// Pairs that lie in no loop.
    pub unchecked: Vec<UncheckedPair>,
    /// What is seen from the placed frames agrees so; indices of `placements.stations` are those of the frames.
    pub placements: Placements,
    /// The systematic error that the frames share, as the pairs tell it.
    pub shared_error: SharedError,
    /// By how much pairs scatter beyond their covariances, as a factor of variances; 1 or more. The covariances contain it.
    pub variance_factor: f64,
}

/// Brings organised frames of many stations into one coordinate system.
///
/// Pairs are aligned by projection: those that should overlap at the start, or follow each other, then those that the poses
/// found so far predict. Trusted pairs, each with random and shared errors apart, form one graph, from which pairs that
/// contradict it at the 99.9 % level are left out. Frames that no trusted pair leads to, whose ranges have another scale,
/// or that contradict what the others see are not placed but named. `progress(done, total)` is told the rounds.
///
/// # Errors
/// [`InputError::Empty`], [`InputError::LengthMismatch`], [`InputError::NonFinite`], [`InputError::InvalidOption`] for the input;
/// [`Error::UnconnectedStations`] where no two frames belong together.
pub fn register_frames(
    frames: &[OrganisedFrame],
    start: Start<'_>,
    options: &FrameAlignmentOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<FrameRegistration> {
    if frames.is_empty() {
        return Err(InputError::Empty { what: "the list of frames" }.into());
    }
    if let Start::Poses(poses) = start {
        check_poses("poses of the frames", frames.len(), poses)?;
    }
    let mut survey = Survey::new(frames, start, options);
    let graph = survey.run(progress)?;
    survey.result(&graph)
}

/// What is known so far.
struct Survey<'a> {
    frames: Frames<'a>,
    start: Start<'a>,
    known: Option<SharedError>,
    pairs: Vec<FramePair>,
    refused: Vec<RefusedPair>,
    /// Pairs that were tried where the graph saw them, or without a guess.
    tried: BTreeSet<(usize, usize)>,
    /// Frames that do not belong to the others.
    out: Vec<UnplacedFrame>,
    placements: Placements,
}

impl<'a> Survey<'a> {
    fn new(frames: &'a [OrganisedFrame], start: Start<'a>, options: &'a FrameAlignmentOptions) -> Self {
        Self {
            frames: Frames::new(frames, options),
            start,
            known: options.shared_error,
            pairs: Vec::new(),
            refused: Vec::new(),
            tried: BTreeSet::new(),
            out: Vec::new(),
            placements: Placements::default(),
        }
    }

    fn count(&self) -> usize {
        self.frames.all.len()
    }

    /// Tries pairs until the graph tells no more of them.
    fn run(&mut self, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<FrameGraph> {
        self.try_pairs(&self.first())?;
        let mut graph = self.graph();
        for round in 0..ROUNDS {
            progress(round, ROUNDS);
            let mut candidates = self.predicted(&graph);
            if candidates.is_empty() {
                candidates = self.sought(&graph);
            }
            self.tried.extend(candidates.iter().map(|pair| (pair.target, pair.source)));
            if candidates.is_empty() {
                break;
            }
            self.try_pairs(&candidates)?;
            graph = self.graph();
        }
        while self.leave_out_doubtful(&graph) {
            graph = self.graph();
        }
        progress(ROUNDS, ROUNDS);
        Ok(graph)
    }

    fn try_pairs(&mut self, candidates: &[Candidate]) -> Result<()> {
        let (pairs, refused) = self.frames.aligned(candidates)?;
        self.refused.retain(|old| !candidates.iter().any(|new| (new.target, new.source) == (old.target, old.source)));
        self.pairs.extend(pairs);
        self.refused.extend(refused);
        Ok(())
    }

    /// The graph of the pairs between frames that belong together.
    fn graph(&mut self) -> FrameGraph {
        for (frame, scale) in scaled(self.count(), &self.pairs, &self.shared_error()) {
            if !self.is_out(frame) {
                let reason = format!("its ranges are {scale:.3} times those of the other frames");
                self.out.push(UnplacedFrame { frame, reason });
            }
        }
        FrameGraph::new(self.count(), &self.sound(), &self.shared_error())
    }

    /// As it was given, or as the pairs tell it.
    fn shared_error(&self) -> SharedError {
        let mut shared = SharedError::none();
        self.pairs.iter().filter(|pair| self.is_sound(pair)).for_each(|pair| shared.learn(&pair.influence));
        self.known.unwrap_or(shared)
    }

    fn is_out(&self, frame: usize) -> bool {
        self.out.iter().any(|out| out.frame == frame)
    }

    fn is_sound(&self, pair: &FramePair) -> bool {
        !self.is_out(pair.alignment.target) && !self.is_out(pair.alignment.source)
    }

    /// The pairs of frames that belong together.
    fn sound(&self) -> Vec<FramePair> {
        self.pairs.iter().filter(|pair| self.is_sound(pair)).cloned().collect()
    }

    /// Pairs that the start tells.
    fn first(&self) -> Vec<Candidate> {
        match self.start {
            Start::Poses(poses) => {
                // Their errors hide up to half of what two frames share.
                let near = (START_ERROR, Agreement::LEAST_OVERLAP / 2.0);
                self.overlapping(near, Guess::Around, |a, b| Some(poses[a].inverse() * poses[b]))
            }
            _ => (0..self.count())
                .flat_map(|target| (1..=NEAREST).map(move |step| (target, target + step)))
                .filter(|(_, source)| *source < self.count())
                .map(|(target, source)| Candidate { target, source, guess: Guess::Around(Isometry3::identity()) })
                .collect(),
        }
    }

    /// Pairs that should overlap by the poses found so far, and were not yet trusted there.
    fn predicted(&self, graph: &FrameGraph) -> Vec<Candidate> {
        let open = |a: usize, b: usize| {
            let pose = graph.relative(a, b)?;
            let tried = self.tried.contains(&(a, b)) || self.pairs.iter().any(|pair| pair.joins(a, b));
            (!tried).then_some(pose)
        };
        self.overlapping((Agreement::LARGEST_ERROR, Agreement::LEAST_OVERLAP), Guess::Near, open)
    }

    /// For each frame the pairs with the most overlap, at poses `a_from_b`, where surfaces lie within an error, a part of the depth, on
    /// the least share of the frame.
    fn overlapping(
        &self,
        (error, least): (f32, f64),
        guess: fn(Isometry3<f64>) -> Guess,
        pose: impl Fn(usize, usize) -> Option<Isometry3<f64>>,
    ) -> Vec<Candidate> {
        let frames = self.frames.all;
        let mut found = Vec::new();
        for target in 0..self.count() {
            for source in target + 1..self.count() {
                let Some(pose) = pose(target, source) else { continue };
                let fraction = frames[target].nearness(&frames[source], &pose, Agreement::NODES / 4, error);
                found.push(Overlap { source, target, fraction });
            }
        }
        let chosen = best_partners(&found, self.count(), least, PARTNERS).into_iter();
        let candidate = |(target, source)| Some(Candidate { target, source, guess: guess(pose(target, source)?) });
        chosen.filter_map(candidate).collect()
    }

    /// Frames that are not placed yet with placed ones near them in order, without a guess; each pair once.
    fn sought(&self, graph: &FrameGraph) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        for frame in (0..self.count()).filter(|frame| graph.index(*frame).is_none() && !self.is_out(*frame)) {
            let mut placed: Vec<usize> = graph.members.iter().copied().filter(|other| *other != frame).collect();
            placed.sort_by_key(|other| (other.abs_diff(frame), *other));
            if self.start != Start::Nothing {
                placed.truncate(NEAREST);
            }
            let pairs = placed.into_iter().map(|other| (frame.min(other), frame.max(other)));
            let pairs = pairs.filter(|pair| !self.tried.contains(pair));
            candidates.extend(pairs.map(|(target, source)| Candidate { target, source, guess: Guess::Features }));
        }
        candidates
    }

    /// Takes out the placed frames that what the others see contradicts; whether there are any.
    fn leave_out_doubtful(&mut self, graph: &FrameGraph) -> bool {
        self.placements = Placements::of(self.count(), self.agreements(graph));
        let doubtful: Vec<UnplacedFrame> = self
            .placements
            .doubtful()
            .map(|frame| {
                let found = &self.placements.stations[frame];
                let reason = format!(
                    "{:.0} % of what it and the others see in common contradicts, {:.0} times what is usual",
                    100.0 * found.share(),
                    found.times_usual.unwrap_or(f64::NAN)
                );
                UnplacedFrame { frame, reason }
            })
            .collect();
        let any = !doubtful.is_empty();
        self.out.extend(doubtful);
        any
    }

    /// What each two placed frames see of each other.
    fn agreements(&self, graph: &FrameGraph) -> Vec<PairAgreement> {
        let frames = self.frames.all;
        let mut found = Vec::new();
        for target in 0..self.count() {
            for source in target + 1..self.count() {
                let Some(pose) = graph.relative(target, source) else { continue };
                let both = [
                    frames[target].agreement(&frames[source], &pose, Agreement::NODES),
                    frames[source].agreement(&frames[target], &pose.inverse(), Agreement::NODES),
                ];
                let agreeing = both.iter().map(|a| a.agreeing).sum();
                let contradicting = both.iter().map(|a| a.contradicting).sum();
                if agreeing + contradicting > 0 {
                    found.push(PairAgreement { target, source, agreeing, contradicting });
                }
            }
        }
        found
    }

    fn result(mut self, graph: &FrameGraph) -> Result<FrameRegistration> {
        let (datum, shared_error) = (graph.members[0], self.shared_error());
        let sound = self.sound();
        let (used, wrong): (Vec<_>, Vec<_>) = sound.iter().zip(&graph.fits).partition(|(_, fits)| **fits);
        let placed = |pair: &PairAlignment| [pair.target, pair.source].iter().all(|k| graph.index(*k).is_some());
        let wrong = wrong.iter().map(|(pair, _)| &pair.alignment).filter(|pair| placed(pair));
        self.refused.extend(wrong.map(|&PairAlignment { target, source, .. }| {
            let reason = "contradicts the loops that the other pairs close".to_owned();
            RefusedPair { target, source, reason }
        }));
        let lost = |frame: &usize| graph.index(*frame).is_none() && !self.is_out(*frame);
        let lost: Vec<UnplacedFrame> =
            (0..self.count()).filter(lost).map(|frame| UnplacedFrame { frame, reason: self.why(frame) }).collect();
        self.out.extend(lost);
        self.out.sort_by_key(|out| out.frame);
        if graph.members.len() < 2 && self.count() > 1 {
            let (stations, reasons) = self.out.into_iter().map(|out| (out.frame, out.reason)).unzip();
            return Err(Error::UnconnectedStations { stations, to: datum, reasons });
        }
        let held = match self.start {
            Start::Poses(poses) => poses[datum],
            _ => Isometry3::identity(),
        };
        let placed = |frame: usize| {
            let (pose, covariance) = graph.pose(frame)?;
            let mut turn = Matrix6::identity();
            turn.fixed_view_mut::<3, 3>(0, 0).copy_from(held.rotation.to_rotation_matrix().matrix());
            Some(PlacedFrame { world_from_frame: held * pose, covariance: turn * covariance * turn.transpose() })
        };
        let used: Vec<PairAlignment> = used.iter().map(|(pair, _)| pair.with_shared(&shared_error)).collect();
        Ok(FrameRegistration {
            frames: (0..self.count()).map(placed).collect(),
            datum,
            unchecked: unchecked(&used, datum),
            pairs: used,
            unplaced: self.out,
            refused: self.refused,
            loops: graph.loops.clone(),
            placements: self.placements,
            shared_error,
            variance_factor: graph.factor(),
        })
    }

    /// Why no pair leads to a frame: what most of those tried had against them.
    fn why(&self, frame: usize) -> String {
        let joined = self.pairs.iter().filter(|pair| pair.alignment.target == frame || pair.alignment.source == frame);
        let mut with: Vec<usize> = joined.map(|p| p.alignment.target + p.alignment.source - frame).collect();
        with.sort_unstable();
        if !with.is_empty() {
            return format!("it is joined only with others that nothing joins with the rest (numbers {with:?} from 0)");
        }
        let own: Vec<&RefusedPair> =
            self.refused.iter().filter(|pair| pair.target == frame || pair.source == frame).collect();
        match own.last() {
            Some(last) => format!("none of {} pairs with it can be trusted; the last: {}", own.len(), last.reason),
            None => "it should overlap with none of the others".to_owned(),
        }
    }
}

/// The pairs without which frames would not be joined with the datum.
fn unchecked(pairs: &[PairAlignment], datum: usize) -> Vec<UncheckedPair> {
    let ends: Vec<(usize, usize)> = pairs.iter().map(|pair| (pair.target, pair.source)).collect();
    let all = reached(&ends, datum);
    let without = |k: usize| {
        let left = reached(&[&ends[..k], &ends[k + 1..]].concat(), datum);
        let cut: BTreeSet<usize> = all.difference(&left).copied().collect();
        let fewer = if cut.len() > left.len() { &left } else { &cut };
        let frames = fewer.iter().copied().collect();
        let (target, source) = ends[k];
        (!cut.is_empty()).then_some(UncheckedPair { target, source, frames })
    };
    (0..ends.len()).filter_map(without).collect()
}
