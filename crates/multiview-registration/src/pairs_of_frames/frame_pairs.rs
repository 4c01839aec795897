//! Two frames brought together by projection, and whether that can be trusted.

use std::sync::OnceLock;

use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::agreement::alignments::{PairAlignment, RefusedPair};
use crate::error::Result;
use global_registration::{CoarseOptions, FeatureCloud, align_without_guess};
use icp_registration::{IcpResult, StopReason};
use projective_registration::{Agreement, FrameAligner, FrameAlignmentOptions, Influence, OrganisedFrame, SharedError};
use rigid_pose::symmetrised;

/// Two frames that may see the same.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    pub target: usize,
    pub source: usize,
    pub guess: Guess,
}

/// Where an alignment starts, `target_from_source`.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Guess {
    /// Near the pose.
    Near(Isometry3<f64>),
    /// From the pose, and a search around it.
    Around(Isometry3<f64>),
    /// Where features tell.
    Features,
}

/// Two frames brought together; the covariance is of what is random.
#[derive(Debug, Clone)]
pub(crate) struct FramePair {
    pub alignment: PairAlignment,
    pub influence: Influence,
}

impl FramePair {
    pub(crate) fn joins(&self, a: usize, b: usize) -> bool {
        let PairAlignment { target, source, .. } = self.alignment;
        (target, source) == (a, b) || (target, source) == (b, a)
    }

    /// The alignment with the covariance of all its errors.
    pub(crate) fn with_shared(&self, shared: &SharedError) -> PairAlignment {
        let mut alignment = self.alignment.clone();
        let covariance = alignment.result.covariance + shared.covariance(&self.influence.pose);
        alignment.result.covariance = symmetrised(&covariance);
        alignment
    }
}

/// All frames, and what was made of them.
pub(crate) struct Frames<'a> {
    pub all: &'a [OrganisedFrame],
    options: FrameAlignmentOptions,
    features: Vec<OnceLock<Option<FeatureCloud>>>,
}

impl<'a> Frames<'a> {
    pub(crate) fn new(frames: &'a [OrganisedFrame], options: &FrameAlignmentOptions) -> Self {
        let radius_m = frames.iter().map(OrganisedFrame::radius_m).fold(0.0, f64::max);
        let open = (FrameAlignmentOptions::OPEN_IN_A_GRAPH * radius_m).max(f64::MIN_POSITIVE);
        let max_motion_sigma_m = options.max_motion_sigma_m.or(Some(open));
        let options = FrameAlignmentOptions { max_motion_sigma_m, ..options.clone() };
        Self { all: frames, options, features: frames.iter().map(|_| OnceLock::new()).collect() }
    }

    /// The pairs that can be trusted, and the others with the reason; in the order of the candidates.
    pub(crate) fn aligned(&self, candidates: &[Candidate]) -> Result<(Vec<FramePair>, Vec<RefusedPair>)> {
        let near = FrameAligner::new(FrameAlignmentOptions { search: false, ..self.options.clone() })?;
        let aligners = (near, FrameAligner::new(self.options.clone())?);
        let each = |(near, wide): &mut (FrameAligner, FrameAligner), candidate: &Candidate| {
            let Candidate { target, source, .. } = *candidate;
            let aligner = if matches!(candidate.guess, Guess::Near(_)) { near } else { wide };
            self.align(aligner, candidate).map_err(|reason| RefusedPair { target, source, reason })
        };
        let found: Vec<_> = candidates.par_iter().map_init(|| aligners.clone(), each).collect();
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
            Guess::Near(pose) | Guess::Around(pose) => pose,
            Guess::Features => self.guess(target, source)?,
        };
        let (onto, moved) = (&self.all[target], &self.all[source]);
        let (result, influence) = aligner.align_apart(moved, onto, &guess).map_err(|error| error.to_string())?;
        if !result.is_trustworthy() {
            return Err(distrust(&result));
        }
        let pose = result.target_from_source;
        let both =
            [onto.agreement(moved, &pose, Agreement::NODES), moved.agreement(onto, &pose.inverse(), Agreement::NODES)];
        let consent = both[0].consent().min(both[1].consent());
        if consent < Agreement::LEAST_CONSENT {
            return Err(format!("{:.0} % of what both see contradicts", 100.0 * (1.0 - consent)));
        }
        let overlap = both[0].overlap().min(both[1].overlap());
        if overlap < Agreement::LEAST_OVERLAP {
            return Err(format!("only {:.0} % of what one sees agrees with the other", 100.0 * overlap));
        }
        let influence = influence.filter(|_| result.covariance.cholesky().is_some());
        let influence = influence.ok_or("what they share does not determine the pose")?;
        Ok(FramePair { alignment: PairAlignment { target, source, result }, influence })
    }

    /// Where features say that the source may be.
    fn guess(&self, target: usize, source: usize) -> std::result::Result<Isometry3<f64>, String> {
        let options = CoarseOptions::default();
        let features = |k: usize| {
            let made = || FeatureCloud::new(&self.all[k].to_cloud(), &options).ok();
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
