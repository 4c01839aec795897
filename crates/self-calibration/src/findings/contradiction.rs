//! Why a network contradicts itself, by name.

use std::fmt;

/// Logarithm of odds beyond which their number says nothing more.
const CERTAIN: f64 = 1000.0;

/// What a network that contradicts itself shows.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Contradiction {
    /// At which step the calibration found no end, or no result to trust.
    pub stage: &'static str,
    /// What explains it; empty where nothing in the catalogue of causes does.
    pub causes: Vec<Cause>,
    /// The observed value that contradicts most, where one could be found.
    pub worst: Option<WorstValue>,
    /// The parameter that does not settle, where the adjustment found no end.
    pub parameter: Option<String>,
}

/// An explanation of a contradiction: with it applied, the observations agree.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Cause {
    /// What kind of cause, for programs.
    pub kind: CauseKind,
    /// The station that it concerns; `None`: all of them.
    pub station: Option<String>,
    /// Names of the targets, stations or terms that it concerns; empty where it concerns all.
    pub names: Vec<String>,
    /// What is wrong, in words.
    pub words: String,
    /// What to do.
    pub remedy: &'static str,
    /// Natural logarithm of how many times more likely the observations are with it; errors have long tails.
    pub log_odds: f64,
}

/// Kinds of causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum CauseKind {
    /// Ranges in another unit than metres.
    RangeUnit,
    /// Depths, perpendicular to the image, given for ranges.
    DepthForRange,
    /// Ranges a whole number of ambiguity intervals off.
    WholeIntervals,
    /// Columns and rows of image points exchanged.
    ColumnsExchanged,
    /// Rows counted from the bottom, or columns from the right: a mirrored image.
    Mirrored,
    /// Each observation of a station has the name of its neighbour.
    LabelsShifted,
    /// Two targets of a station have each other's names.
    LabelsExchanged,
    /// The principal distance and the pixel pitch are not in one unit.
    PrincipalDistanceUnit,
    /// Coordinates of targets in another unit than metres.
    CoordinateUnit,
    /// Axes of the targets' coordinates exchanged or reversed.
    CoordinateAxes,
    /// Standard deviations in another unit.
    SigmaUnit,
    /// Attitudes of known stations in another unit than degrees.
    AngleUnit,
    /// A known target or station is not where it is said to be.
    Misplaced,
    /// Two known targets or stations have each other's places.
    PlacesExchanged,
    /// The same observations under two names of stations.
    DuplicateStation,
    /// The modulation frequency is another than that given, or that the ranges were computed with.
    ModulationFrequency,
    /// The pixel pitch is another than that given.
    PixelPitch,
    /// Terms that the camera has are held at their start values.
    MissingTerms,
}

impl CauseKind {
    /// Whether it leaves image points and the targets that they belong to as they are.
    pub(crate) fn is_of_ranges(self) -> bool {
        matches!(self, Self::RangeUnit | Self::DepthForRange | Self::WholeIntervals | Self::ModulationFrequency)
    }
}

/// One observed value.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct WorstValue {
    /// Position of the sighting in the network.
    pub sighting: usize,
    /// Station.
    pub station: String,
    /// Target.
    pub target: String,
    /// `image point` or `range`.
    pub component: &'static str,
    /// Observed value with its unit.
    pub observed: String,
    /// Observed minus modelled value, with its unit.
    pub residual: String,
    /// File and line, where whoever read it from a file has filled them in.
    pub place: Option<String>,
}

/// Causes that a message tells; all are in [`Contradiction::causes`].
const TOLD: usize = 4;

impl Contradiction {
    /// A contradiction of which nothing more is known yet.
    pub(crate) fn new(stage: &'static str) -> Self {
        Self { stage, causes: Vec::new(), worst: None, parameter: None }
    }

    /// Whether all of a kind of input is wrong, as in another unit: the input is to be changed, not the network.
    pub fn is_wrong_input(&self) -> bool {
        !self.causes.is_empty() && self.causes.iter().all(|cause| cause.station.is_none())
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let odds = self.log_odds.min(CERTAIN);
        let more = if self.log_odds > CERTAIN { "more than " } else { "" };
        write!(f, "{} (odds {more}e^{odds:.0} to 1); {}", self.words, self.remedy)
    }
}

impl fmt::Display for WorstValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { station, target, component, observed, residual, place, .. } = self;
        write!(f, "the {component} of target `{target}` from station `{station}` ({observed}) is off by {residual}")?;
        place.as_ref().map_or(Ok(()), |place| write!(f, " ({place})"))
    }
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the observations contradict each other ({})", self.stage)?;
        for (index, cause) in self.causes.iter().enumerate().take(TOLD) {
            f.write_str(if index == 0 { ": " } else { "; " })?;
            cause.fmt(f)?;
        }
        if self.causes.len() > TOLD {
            write!(f, "; and {} more causes of such kinds", self.causes.len() - TOLD)?;
        }
        if self.causes.is_empty() {
            f.write_str(", and no known cause explains it")?;
            if let Some(worst) = &self.worst {
                write!(f, "; most of all, {worst}")?;
            }
            if let Some(parameter) = &self.parameter {
                write!(f, "; {parameter} does not settle")?;
            }
            f.write_str("; check names and values there, or leave that station out")?;
        }
        Ok(())
    }
}
