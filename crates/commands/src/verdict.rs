//! How a command ended, and what is doubtful about its result: what the exit code, `summary.json`, the terminal and the
//! report all say from one source.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// How a command that has a result ended. What failed instead is an [`Error`](enum@crate::Error) with its
/// [`Failure`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Done, and nothing speaks against the result.
    #[default]
    Done,
    /// Done, but something should be looked at first: see [`Judged::doubts`].
    Doubtful,
    /// A part was refused by what the data show; what stands without it was written.
    Partial,
}

/// Why a command has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// The inputs are in order, but do not show what was asked for.
    Refused,
    /// Wrong input or usage: the same command fails again until one of them is changed.
    Usage,
    /// The machine failed (disk full, memory, a file locked): the same command is worth another try.
    Machine,
}

/// One reason not to trust a result before it was looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Doubt {
    /// What kind of doubt, for programs.
    pub kind: DoubtKind,
    /// The station, frame, pair or file that it concerns; `None`: all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subject: Option<String>,
    /// What was seen, with its value, and what to do; one line.
    pub words: String,
}

/// Kinds of doubts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DoubtKind {
    /// An alignment that did not settle, overlaps too little, or is held by too little.
    Alignment,
    /// A station that is probably in the wrong place.
    Placement,
    /// Frames without a pose.
    LostFrames,
    /// Frames of a stream that came faster than they were processed.
    DroppedFrames,
    /// A drift that is not what it seems.
    Drift,
    /// A stage that was refused; what stands without it was written.
    Refused,
    /// A modulation frequency that no camera of this kind has.
    Modulation,
    /// Lengths that are probably not in the unit in which they are read.
    Units,
    /// Ranges that are read as depths, or depths as ranges.
    RangeOrDepth,
    /// A value that stands for "not measured" and is read as a distance.
    InvalidValues,
    /// A phase that falls with range where it should grow.
    PhaseSense,
    /// Frames that hold one and the same value.
    DeadFrames,
    /// Frames of a station that are those of another one.
    RepeatedFrames,
    /// Frames that cannot be read.
    UnreadableFrames,
    /// Targets that were looked for and not found, or that have no range.
    MissingTargets,
    /// A calibration that does not fit the survey.
    Calibration,
    /// Much that lies outside the span in which the calibration holds.
    OutsideSpan,
    /// Ranges beyond the longest one stated.
    BeyondMaximum,
    /// A station most of whose pixels are flagged.
    MostlyFlagged,
    /// A result without points.
    NoPoints,
    /// A station whose place or attitude is hardly known.
    UncertainPose,
    /// A station that was found elsewhere than it was said to stand.
    DisplacedStation,
    /// Random errors that do not follow the model that was fitted to them.
    Noise,
    /// Whole ambiguity intervals that nothing tells.
    Wraps,
    /// Light from outside the field of view that the lens scatters into it.
    OutsideLight,
    /// Observations that contradict each other, or scatter otherwise than stated.
    Contradiction,
    /// Observations left out of a calibration that it does not predict.
    Prediction,
}

impl Doubt {
    /// A doubt about all of the input.
    pub fn new(kind: DoubtKind, words: impl Into<String>) -> Self {
        Self { kind, subject: None, words: words.into() }
    }

    /// A doubt about one station, frame, pair or file.
    pub fn about(kind: DoubtKind, subject: impl Into<String>, words: impl Into<String>) -> Self {
        Self { kind, subject: Some(subject.into()), words: words.into() }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.subject {
            Some(subject) => write!(f, "{subject}: {}", self.words),
            None => f.write_str(&self.words),
        }
    }
}

/// What stands beside a station's pose in `stations.csv`: all that speaks against it.
pub fn words_about(doubts: &[Doubt], station: &str) -> Option<String> {
    let about = doubts.iter().filter(|doubt| doubt.subject.as_deref() == Some(station));
    about.map(|doubt| doubt.words.clone()).reduce(|all, words| format!("{all}; {words}"))
}

/// The same for all stations that there are doubts about: of a hundred thousand each may have one.
pub fn words_by_subject(doubts: &[Doubt]) -> BTreeMap<&str, String> {
    let mut all: BTreeMap<&str, String> = BTreeMap::new();
    for (subject, doubt) in doubts.iter().filter_map(|doubt| Some((doubt.subject.as_deref()?, doubt))) {
        let words = all.entry(subject).or_default();
        words.push_str(if words.is_empty() { "" } else { "; " });
        words.push_str(&doubt.words);
    }
    all
}

/// A command's result that can be judged.
pub trait Judged {
    /// What speaks against the result; none by default.
    fn doubts(&self) -> &[Doubt] {
        &[]
    }

    /// How the command ended: doubtful where there is a doubt.
    fn verdict(&self) -> Verdict {
        if self.doubts().is_empty() { Verdict::Done } else { Verdict::Doubtful }
    }
}
