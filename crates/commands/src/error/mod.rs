use std::path::PathBuf;

use serde::Serialize;
use thiserror::Error;

use crate::destination::{RefusalFile, json};
use crate::memory::Amount;
use crate::verdict::Failure;

pub(crate) mod drift;
pub(crate) mod failure;

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
    /// A stage that the survey or the calibration gives no ground for.
    #[error("stage {stage}, {view}: {message}")]
    Unfit {
        /// The stage.
        stage: &'static str,
        /// Station or frame.
        view: String,
        /// What is missing or does not belong together.
        message: String,
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
    /// A figure that could not be packed.
    #[error(transparent)]
    Report(#[from] report::Error),
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
    /// An estimation that was asked for with options or inputs that do not allow it.
    #[error("{what}: {source}")]
    Estimate {
        /// What was to be estimated.
        what: &'static str,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Inputs, measured or planned, that do not determine what was asked for.
    #[error("refused: {source}{}", written.as_ref().map_or_else(String::new, |file| format!("; {file}")))]
    Refused {
        /// The text of the refusal's file, with the diagnosis and without parameters.
        summary: String,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
        /// The file; `None` where nothing is written.
        written: Option<RefusalFile>,
    },
    /// The output was made from the same inputs with the same options by the same program, and is left as it is.
    #[error("{}: made from the same inputs, options and program: left as it is", out.display())]
    AlreadyDone {
        /// The output folder.
        out: PathBuf,
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
    /// Two results that have no place in common.
    #[error("compare: {0}")]
    NothingInCommon(String),
    /// Surfaces that no alignment brings together.
    #[error("register: {0}")]
    Register(String),
    /// Inputs or options that a command can't work with.
    #[error("{command}: {message}")]
    Request {
        /// The command.
        command: &'static str,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// Work that does not fit into the memory that is allowed.
    #[error(
        "{work}: needs {needed} of memory, and {allowed} are allowed (--memory): allow --memory {needed}, or take smaller parts"
    )]
    Memory {
        /// The work.
        work: String,
        /// What it takes at least.
        needed: Amount,
        /// What is allowed.
        allowed: Amount,
    },
    /// A cloud that can't be written in tiles.
    #[error("tiles: {0}")]
    Tiles(#[from] cloud_tiles::Error),
    /// A name that can't stand for a folder.
    #[error("{}: `{field}` is {value:?}, {reason}", path.display())]
    Name {
        /// The file that has it.
        path: PathBuf,
        /// The field.
        field: &'static str,
        /// The name.
        value: String,
        /// What is wrong with it, and what was expected.
        reason: &'static str,
    },
}

/// Result with this crate's [`Error`](enum@Error).
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Wraps what a stage says of one view.
    pub fn stage<E>(stage: &'static str, view: &str) -> impl FnOnce(E) -> Self
    where
        E: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        move |source| Self::Stage { stage, view: view.to_owned(), source: source.into() }
    }

    /// A stage that the survey or the calibration gives no ground for.
    pub fn unfit(stage: &'static str, view: &str, message: impl Into<String>) -> Self {
        Self::Unfit { stage, view: view.to_owned(), message: message.into() }
    }

    /// What a registration says of the things that `what` names: a finding, or a slip in what was asked for.
    pub fn registration(what: &str, error: &(dyn std::error::Error + 'static)) -> Self {
        let message = format!("{what}: {error}");
        match failure::of_source(error) {
            Failure::Usage => Self::Request { command: "register", message },
            _ => Self::Register(message),
        }
    }

    /// What a comparison says of the things that `what` names: a finding, or a slip in what was asked for.
    pub fn comparison(what: &str, error: &(dyn std::error::Error + 'static)) -> Self {
        let message = format!("{what}: {error}");
        match failure::of_source(error) {
            Failure::Usage => Self::Compare(message),
            _ => Self::NothingInCommon(message),
        }
    }

    /// Why there is no calibration: a finding, with its summary, or a slip in what was asked for.
    pub fn not_calibrated(source: self_calibration::Error, summary: &impl Serialize) -> Result<Self> {
        if failure::of_estimation(&source) != Failure::Refused {
            return Ok(Self::Calibrate(source));
        }
        Ok(Self::Refused { summary: json(summary)?, source: source.into(), written: None })
    }

    /// What an estimation from a survey says: a finding, of which a summary is written, or a slip in what was asked for.
    pub fn estimation<E>(what: &'static str, survey: &std::path::Path) -> impl Fn(E) -> Self
    where
        E: std::error::Error + Send + Sync + 'static,
    {
        let survey = survey.display().to_string();
        move |error| {
            let summary = serde_json::json!({"survey": survey, "refused": error.to_string()});
            let source: Box<dyn std::error::Error + Send + Sync> = error.into();
            match failure::of_source(source.as_ref()) {
                Failure::Refused => Self::Refused { summary: format!("{summary:#}"), source, written: None },
                _ => Self::Estimate { what, source },
            }
        }
    }
}

impl From<atomic_output::Error> for Error {
    fn from(error: atomic_output::Error) -> Self {
        Self::File(error.into())
    }
}
