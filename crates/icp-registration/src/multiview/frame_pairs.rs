//! Two frames brought together by projection, and whether that can be trusted.

use std::sync::OnceLock;

use nalgebra::Isometry3;
use rayon::prelude::*;

use super::alignments::{PairAlignment, RefusedPair};
use crate::coarse::{CoarseOptions, FeatureCloud, align_without_guess};
use crate::error::Result;
use crate::icp::{IcpResult, StopReason};
use crate::organised::{FrameAligner, FrameAlignmentOptions, Influence, OrganisedFrame};
use crate::pose_graph::{Edge, Relation, Uncertain};

/// Nodes by which agreement is judged.
pub(super) const SAMPLE: usize = 2500;
/// Share of what both frames can judge that must agree, as in tracking.
const LEAST_CONSENT: f64 = 0.9;

/// Two frames that may see the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub target: usize,
    pub source: usize,
    /// Where to start, `target_from_source`; `None`: features tell.
    pub guess: Option<Isometry3<f64>>,
}

/// Two frames brought together; the covariance is of what is random.
#[derive(Debug, Clone)]
pub(super) struct FramePair {
    pub alignment: PairAlignment,
    pub influence: Influence,
}

impl FramePair {
    pub(super) fn joins(&self, a: usize, b: usize) -> bool {
        let PairAlignment { target, source, .. } = self.alignment;
        (target, source) == (a, b) || (target, source) == (b, a)
    }

    /// As an observation between two poses of a graph.
    pub(super) fn edge(&self, target: usize, source: usize) -> Edge {
        let IcpResult { target_from_source: pose, covariance, .. } = self.alignment.result;
        let random = Uncertain { pose, covariance };
        Edge { a: target, b: source, a_from_b: Relation { random, by_field: -self.influence.pose }, alike: 1.0 }
    }
}

/// All frames, and what was made of them.
pub(super) struct Frames<'a> {
    pub frames: &'a [OrganisedFrame],
    options: &'a FrameAlignmentOptions,
    features: Vec<OnceLock<Option<FeatureCloud>>>,
}

impl<'a> Frames<'a> {
    pub(super) fn new(frames: &'a [OrganisedFrame], options: &'a FrameAlignmentOptions) -> Self {
        Self { frames, options, features: frames.iter().map(|_| OnceLock::new()).collect() }
    }

    /// The pairs that can be trusted, and the others with the reason; in the order of the candidates.
    pub(super) fn aligned(&self, candidates: &[Candidate]) -> Result<(Vec<FramePair>, Vec<RefusedPair>)> {
        let aligner = FrameAligner::new(self.options.clone())?;
        let each = |aligner: &mut FrameAligner, candidate: &Candidate| {
            let Candidate { target, source, .. } = *candidate;
            self.align(aligner, candidate).map_err(|reason| RefusedPair { target, source, reason })
        };
        let found: Vec<_> = candidates.par_iter().map_init(|| aligner.clone(), each).collect();
        let (mut pairs, mut refused) = (Vec::new(), Vec::new());
        for result in found {
            match result {
                Ok(pair) => pairs.push(pair),
                Err(pair) => refused.push(pair),
            }
        }
        Ok((pairs, refused))
    }

    fn align(&self, aligner: &mut FrameAligner, candidate: &Candidate) -> std::result::Result<FramePair, String> {
        let Candidate { target, source, guess } = *candidate;
        let guess = match guess {
            Some(guess) => guess,
            None => self.guess(target, source)?,
        };
        let (onto, moved) = (&self.frames[target], &self.frames[source]);
        let (result, influence) = aligner.align_apart(moved, onto, &guess).map_err(|error| error.to_string())?;
        if !result.is_trustworthy() {
            return Err(distrust(&result));
        }
        let pose = result.target_from_source;
        let consent = [onto.agreement(moved, &pose, SAMPLE), moved.agreement(onto, &pose.inverse(), SAMPLE)]
            .map(|agreement| agreement.consent());
        let least = consent[0].min(consent[1]);
        if least < LEAST_CONSENT {
            return Err(format!("{:.0} % of what both see contradicts", 100.0 * (1.0 - least)));
        }
        let influence = influence.filter(|_| result.covariance.cholesky().is_some());
        let influence = influence.ok_or("what they share does not determine the pose")?;
        Ok(FramePair { alignment: PairAlignment { target, source, result }, influence })
    }

    /// Where features say that the source may be.
    fn guess(&self, target: usize, source: usize) -> std::result::Result<Isometry3<f64>, String> {
        let options = CoarseOptions::default();
        let features = |k: usize| {
            let made = || FeatureCloud::new(&self.frames[k].to_cloud(), &options).ok();
            self.features[k].get_or_init(made).as_ref().ok_or("too little of it holds features")
        };
        let found = align_without_guess(features(source)?, features(target)?, &options);
        found.map(|found| found.target_from_source).map_err(|error| error.to_string())
    }
}

fn distrust(result: &IcpResult) -> String {
    match result.stop {
        StopReason::Contradicted => "they contradict each other, hide too much or hardly meet".to_owned(),
        StopReason::MaxIterations => "the iterations did not settle".to_owned(),
        _ => format!("what they share leaves {} motions open", result.degenerate.len()),
    }
}
