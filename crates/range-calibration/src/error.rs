use thiserror::Error;

use crate::surfaces::HeldTerm;

/// Why a calibration of ranges gave no trustworthy result.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument or option lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the argument.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A range difference that cannot be used.
    #[error("range difference {index}: {name} = {value}, expected {expected}")]
    BadDifference {
        /// Position in the list.
        index: usize,
        /// Which of its numbers.
        name: &'static str,
        /// The number.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// There are no more range differences than unknowns, so that nothing checks them.
    #[error("{differences} range differences for {unknowns} unknown parameters: too few")]
    TooFewDifferences {
        /// Number of differences.
        differences: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// Every parameter is held.
    #[error("every range term is held and no hyperbola is estimated: there is nothing to estimate")]
    NothingToEstimate,
    /// The distances and amplitudes observed cannot tell some parameters apart.
    #[error(
        "the observed ranges ({:.3} m to {:.3} m) cannot tell these parameters apart: {combination} (inflation {inflation:.0}); \
         observe more distances, over a whole ambiguity interval, and more amplitudes if there is a hyperbola, \
         or hold one of them", .range_span_m[0], .range_span_m[1]
    )]
    NotDetermined {
        /// The combinations of parameters that are not, or hardly, determined, with their weights.
        combination: String,
        /// How many times larger the deviation of the worst combination is than if its parameters did not share
        /// their effect; infinite where nothing determines it.
        inflation: f64,
        /// Smallest and largest range observed, metre.
        range_span_m: [f64; 2],
    },
    /// The captures of planes cannot tell some parameters apart.
    #[error(
        "the captures of planes cannot tell these parameters apart: {combination} (inflation {inflation:.0}); \
         give some planes together with poses, or a wider field of view and more distances, or hold one of them"
    )]
    PlanesNotDetermined {
        /// The combinations of parameters that are not, or hardly, determined, with their weights.
        combination: String,
        /// How many times larger the deviation of the worst combination is than if its parameters did not share
        /// their effect; infinite where nothing determines it.
        inflation: f64,
    },
    /// A frame shows no plane: fewer than three usable pixels, or points on a line.
    #[error("the usable pixels of `{station}` do not span a plane")]
    NoPlane {
        /// Name of the capture.
        station: String,
    },
    /// A capture names a plane that is not in the list.
    #[error("`{station}` shows plane {plane}, but there are {planes}")]
    UnknownPlane {
        /// Name of the capture.
        station: String,
        /// Position named.
        plane: usize,
        /// Number of planes.
        planes: usize,
    },
    /// A hyperbola is to be estimated together with planes.
    #[error(
        "with unknown planes a hyperbola is held, not estimated: estimate it from the differences to adjusted planes"
    )]
    HyperbolaNotHeld,
    /// A single station, which no other one sees the surfaces of.
    #[error(
        "there is one station, `{station}`: surfaces tell range terms where two stations or more see the same ones from different \
         places; take more stations, or calibrate from targets or planes"
    )]
    OneStation {
        /// Its name.
        station: String,
    },
    /// A frame without a usable pixel.
    #[error(
        "station `{station}` has no usable pixel: all of them are without a range or flagged; leave it out of the survey"
    )]
    NoPixels {
        /// Its name.
        station: String,
    },
    /// A frame whose ranges are too long to be metres.
    #[error(
        "half of the ranges of station `{station}` are beyond {median_m:.0} m, expected at most {limit_m} m: are they in millimetres? \
         Give them in metre"
    )]
    NotInMetre {
        /// Its name.
        station: String,
        /// Median of its ranges, metre if they are.
        median_m: f64,
        /// Largest median that is accepted, metre.
        limit_m: f64,
    },
    /// Surfaces seen from several stations leave a term open.
    #[error(
        "the surfaces do not determine `{term}`: its effect on the ranges is known to {:.1} mm only, {:.1} mm are asked \
         for (correlation {correlation:.2} with the {motion} of station {station}); take more stations that see corners \
         and furniture from different distances, give a prior deviation, or hold it", 1e3 * .sigma_m, 1e3 * .limit_m
    )]
    SurfacesNotDetermined {
        /// The term.
        term: String,
        /// Standard deviation of its effect on the ranges, metre.
        sigma_m: f64,
        /// Largest that is accepted, metre.
        limit_m: f64,
        /// Station whose pose it is most correlated with, counted from 0.
        station: usize,
        /// Position or attitude of that station.
        motion: &'static str,
        /// The correlation.
        correlation: f64,
    },
    /// The stations still slide along their surfaces at the end of the adjustment.
    #[error(
        "the stations did not settle in {} rounds without and {} rounds with the terms: a direction is held by too few \
         surfaces, or the lens is another camera's, or stations or their poses are exchanged; give better approximate poses, or \
         stations that see more furniture across it, and look at the lens and at which frame and pose belong to which station{}",
        .rounds[0], .rounds[1], left_open(.held)
    )]
    SurfacesNotSettled {
        /// Rounds with the known model, and with the terms as unknowns.
        rounds: [usize; 2],
        /// Terms that were held by then, as the surfaces do not determine them.
        held: Vec<HeldTerm>,
    },
    /// The stations could not be registered.
    #[error("registration, {station}: {reason}")]
    Registration {
        /// Which station, or all.
        station: String,
        /// Why.
        reason: multiview_registration::Error,
    },
    /// No hyperbola runs anywhere near the residuals.
    #[error("no start values for h1, h2, h3: {reason}")]
    NoHyperbola {
        /// What is missing.
        reason: &'static str,
    },
    /// Two stations or two targets have one name.
    #[error("two {kind}s are called `{name}`")]
    DuplicateName {
        /// Station or target.
        kind: &'static str,
        /// Name.
        name: String,
    },
    /// Something names a station, target or term that does not exist.
    #[error("{what} names {kind} `{name}`, which does not exist; there are {known}")]
    UnknownName {
        /// What names it.
        what: String,
        /// Station, target or term.
        kind: &'static str,
        /// Name, or number in the list.
        name: String,
        /// What there is.
        known: String,
    },
    /// Pixels that see a plane were not found.
    #[error(transparent)]
    Primitive(#[from] primitives::Error),
    /// The adjustment failed.
    #[error(transparent)]
    Adjust(#[from] adjust::Error),
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
    /// The estimated model is not usable, or a parameter name is unknown.
    #[error(transparent)]
    Model(#[from] error_models::Error),
    /// The frame is not valid.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// What the surfaces left open, as the end of a sentence.
fn left_open(held: &[HeldTerm]) -> String {
    let open = held.iter().filter(|term| term.sigma_m.is_finite());
    let names: Vec<String> = open.map(|term| format!("{} ({:.0} mm)", term.name, 1e3 * term.sigma_m)).collect();
    if names.is_empty() {
        return String::new();
    }
    format!("; already held, since these surfaces leave them open: {}", names.join(", "))
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
