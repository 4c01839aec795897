use std::path::PathBuf;

use thiserror::Error;

use crate::verdict::Failure;

/// Why a pipeline could not be read, started or finished.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A survey, calibration or result file.
    #[error(transparent)]
    File(#[from] range_io::Error),
    /// A file that can't be read or written.
    #[error("{}: {source}", path.display())]
    Access {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The survey has nothing to work on.
    #[error("{}: {message}", path.display())]
    Survey {
        /// The survey's file or folder.
        path: PathBuf,
        /// What is missing.
        message: String,
    },
    /// The camera or calibration can't be used for this survey.
    #[error("camera: {0}")]
    Camera(String),
    /// A calibration of another camera than the survey's, or of another mode of it.
    #[error("calibration and survey do not fit: {0}")]
    Incompatible(String),
    /// A stage that needs what the input level does not have.
    #[error("stage {stage} is ruled out: it needs level `{needs}`, but the survey's frames are at level `{level}`")]
    RuledOut {
        /// The stage.
        stage: &'static str,
        /// The level it needs.
        needs: &'static str,
        /// The level at hand.
        level: &'static str,
    },
    /// A stage listed too early or too late.
    #[error("stage {stage} can't come after stage {after}: the order is {order}")]
    Order {
        /// The stage.
        stage: &'static str,
        /// The stage before it.
        after: &'static str,
        /// The order of all stages.
        order: String,
    },
    /// A stage whose input another stage should have made.
    #[error("stage {stage} needs stage {needs} before it")]
    Needs {
        /// The stage.
        stage: &'static str,
        /// The stage it needs.
        needs: &'static str,
    },
    /// A stage that failed on one view.
    #[error("stage {stage}, {view}: {source}")]
    Stage {
        /// The stage.
        stage: &'static str,
        /// Station or frame.
        view: String,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A scene that can't be simulated.
    #[error("{}: {source}", path.display())]
    Scene {
        /// The scene's file.
        path: PathBuf,
        /// Why.
        source: simulation::Error,
    },
    /// A figure that could not be drawn.
    #[error("report: figure {figure}: {message}")]
    Figure {
        /// Which figure.
        figure: String,
        /// Why.
        message: String,
    },
    /// A calibration that cannot be done as it was asked for.
    #[error("calibrate: {0}")]
    Calibrate(#[source] self_calibration::Error),
    /// A survey, measured or planned, that does not determine what was asked for; its summary was written.
    #[error("refused: {source}")]
    Refused {
        /// The text of `summary.json`, with the diagnosis and without parameters.
        summary: String,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Two things to be compared do not belong together.
    #[error("compare: {0}")]
    Compare(String),
    /// Calibrations that cannot be compared.
    #[error("diff: {0}")]
    Diff(String),
    /// A pixel that cannot be explained.
    #[error("explain: {0}")]
    Explain(String),
    /// Inputs that cannot be registered, or that no alignment brings together.
    #[error("register: {0}")]
    Register(String),
}

/// Result with this crate's [`Error`](enum@Error).
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Wraps what a stage says of one view.
    pub(crate) fn stage<E>(stage: &'static str, view: &str) -> impl FnOnce(E) -> Self
    where
        E: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        move |source| Self::Stage { stage, view: view.to_owned(), source: source.into() }
    }

    /// What kind of failure it is: what an engine that runs the command should do next.
    pub fn failure(&self) -> Failure {
        match self {
            Self::File(range_io::Error::Io { source, .. }) | Self::Access { source, .. } => of_system(source),
            Self::File(range_io::Error::NothingMeasured { .. })
            | Self::Stage { .. }
            | Self::Calibrate(_)
            | Self::Refused { .. }
            | Self::Register(_) => Failure::Refused,
            // A figure is drawn from results that are there already: what fails then is memory or disk.
            Self::Figure { .. } => Failure::Machine,
            _ => Failure::Usage,
        }
    }
}

/// What the operating system refuses is either a wrong name or a machine in trouble.
fn of_system(source: &std::io::Error) -> Failure {
    use std::io::ErrorKind as Kind;
    match source.kind() {
        Kind::NotFound
        | Kind::PermissionDenied
        | Kind::IsADirectory
        | Kind::NotADirectory
        | Kind::InvalidInput
        | Kind::InvalidData
        | Kind::InvalidFilename
        | Kind::UnexpectedEof
        | Kind::Unsupported => Failure::Usage,
        _ => Failure::Machine,
    }
}
