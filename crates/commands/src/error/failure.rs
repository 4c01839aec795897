//! What kind of failure an error is: which errors are findings of the data, and which are slips in what was asked for.
//!
//! An error of a numeric crate is a finding where it follows from what was measured; options outside their domain, planes
//! of different sizes and models that do not belong to the frames are slips.

use std::error::Error as StdError;
use std::io::ErrorKind;

use crate::error::Error;
use crate::error::drift::DriftError;
use crate::verdict::Failure;

impl Error {
    /// What kind of failure it is: what an engine that runs the command should do next.
    pub fn failure(&self) -> Failure {
        match self {
            Self::File(source) => of_file(source),
            Self::Access { source, .. } | Self::Tiles(cloud_tiles::Error::Io { source, .. }) => of_system(source),
            Self::Stage { source, .. } | Self::Estimate { source, .. } => of_source(source.as_ref()),
            Self::Calibrate(source) => of_estimation(source),
            Self::Refused { .. } | Self::Register(_) | Self::NothingInCommon(_) => Failure::Refused,
            // A figure is drawn from results that are there already: what fails then is memory or disk.
            Self::Report(_) | Self::Figure { .. } => Failure::Machine,
            Self::Survey { .. }
            | Self::Camera(_)
            | Self::Incompatible(_)
            | Self::RuledOut { .. }
            | Self::Order { .. }
            | Self::Needs { .. }
            | Self::Unfit { .. }
            | Self::Request { .. }
            | Self::Memory { .. }
            | Self::Tiles(_)
            | Self::Name { .. }
            // No failure; who asks all the same is told not to try again.
            | Self::AlreadyDone { .. }
            | Self::Scene { .. }
            | Self::Compare(_)
            | Self::Diff(_)
            | Self::Explain(_) => Failure::Usage,
        }
    }
}

fn of_file(error: &range_io::Error) -> Failure {
    match error {
        range_io::Error::Io { source, .. } => of_system(source),
        range_io::Error::NothingMeasured { .. } => Failure::Refused,
        _ => Failure::Usage,
    }
}

/// What the operating system refuses is either a wrong name or a machine in trouble.
fn of_system(source: &std::io::Error) -> Failure {
    match source.kind() {
        ErrorKind::NotFound
        | ErrorKind::PermissionDenied
        | ErrorKind::IsADirectory
        | ErrorKind::NotADirectory
        | ErrorKind::InvalidInput
        | ErrorKind::InvalidData
        | ErrorKind::InvalidFilename
        | ErrorKind::ReadOnlyFilesystem
        | ErrorKind::UnexpectedEof
        | ErrorKind::Unsupported => Failure::Usage,
        _ => Failure::Machine,
    }
}

/// An error of another crate behind one of this crate. What is not known is a finding of the data: words that a stage has
/// for what it saw.
pub(crate) fn of_source(source: &(dyn StdError + 'static)) -> Failure {
    use phase_unwrap::Error as Unwrap;
    use scattering_deconvolution::Error as Scattering;
    let slip = |is_slip: bool| if is_slip { Failure::Usage } else { Failure::Refused };
    let known = [
        source.downcast_ref::<Error>().map(Error::failure),
        source.downcast_ref::<range_io::Error>().map(of_file),
        source.downcast_ref::<std::io::Error>().map(of_system),
        source.downcast_ref::<self_calibration::Error>().map(of_estimation),
        source.downcast_ref::<point_cloud::Error>().map(|error| slip(error.is_misuse())),
        source.downcast_ref::<icp_registration::Error>().map(|error| slip(error.is_misuse())),
        source.downcast_ref::<projective_registration::Error>().map(|error| slip(error.is_misuse())),
        source.downcast_ref::<multiview_registration::Error>().map(|error| slip(error.is_misuse())),
        source.downcast_ref::<tracking::Error>().map(|error| slip(error.is_misuse())),
        source.downcast_ref::<range_calibration::Error>().map(of_ranges),
        source.downcast_ref::<sensor_noise::Error>().map(of_noise),
        source.downcast_ref::<primitives::Error>().map(of_primitive),
        source.downcast_ref::<residual_tests::Error>().map(|error| {
            use residual_tests::Error as Cause;
            slip(!matches!(error, Cause::TooFewResiduals { .. } | Cause::Model(_)))
        }),
        source.downcast_ref::<warm_up::DriftError>().map(of_drift_estimation),
        source.downcast_ref::<DriftError>().map(|error| slip(!matches!(error, DriftError::Reference { .. }))),
        source
            .downcast_ref::<multipath::Error>()
            .map(|error| slip(!matches!(error, multipath::Error::TooFewPixels { .. }))),
        source
            .downcast_ref::<Scattering>()
            .map(|error| slip(!matches!(error, Scattering::NotConverged { .. } | Scattering::Adjustment(_)))),
        source.downcast_ref::<Unwrap>().map(|error| {
            slip(!matches!(
                error,
                Unwrap::AllMasked { .. } | Unwrap::TooManyResidues { .. } | Unwrap::NotOptimal { .. }
            ))
        }),
        source.downcast_ref::<range_image::Error>().map(|_| Failure::Usage),
        source.downcast_ref::<error_models::Error>().map(|_| Failure::Usage),
        source.downcast_ref::<camera_model::Error>().map(|_| Failure::Usage),
    ];
    known.into_iter().flatten().next().unwrap_or(Failure::Refused)
}

pub(crate) fn of_estimation(error: &self_calibration::Error) -> Failure {
    use self_calibration::{Error as Cause, NetworkError};
    match error {
        Cause::ConflictingTerms { .. }
        | Cause::MethodNeeds { .. }
        | Cause::Network(
            NetworkError::OutOfDomain { .. }
            | NetworkError::DuplicateName { .. }
            | NetworkError::BadNetworkValue { .. }
            | NetworkError::UnknownName { .. }
            | NetworkError::Datum { .. }
            | NetworkError::OutsideImage(_)
            | NetworkError::Camera(_),
        ) => Failure::Usage,
        // All of a column is wrong: a slip in the input, not a finding about the network.
        Cause::Contradiction(found) if found.is_wrong_input() => Failure::Usage,
        Cause::Ranges(error) => of_ranges(error),
        _ => Failure::Refused,
    }
}

fn of_ranges(error: &range_calibration::Error) -> Failure {
    use range_calibration::Error as Cause;
    match error {
        Cause::OutOfDomain { .. }
        | Cause::BadDifference { .. }
        | Cause::NothingToEstimate
        | Cause::UnknownPlane { .. }
        | Cause::HyperbolaNotHeld
        | Cause::DuplicateName { .. }
        | Cause::UnknownName { .. }
        | Cause::Camera(_)
        | Cause::Image(_) => Failure::Usage,
        Cause::Primitive(error) => of_primitive(error),
        Cause::Registration { reason, .. } => of_source(reason),
        _ => Failure::Refused,
    }
}

fn of_noise(error: &sensor_noise::Error) -> Failure {
    use sensor_noise::Error as Cause;
    match error {
        Cause::OutOfDomain { .. } | Cause::FramesDiffer { .. } | Cause::NoAmplitudes { .. } | Cause::Image(_) => {
            Failure::Usage
        }
        Cause::Primitive(error) => of_primitive(error),
        _ => Failure::Refused,
    }
}

fn of_primitive(error: &primitives::Error) -> Failure {
    use primitives::Error as Cause;
    match error {
        Cause::OutOfDomain { .. } | Cause::Camera(_) | Cause::Image(_) => Failure::Usage,
        _ => Failure::Refused,
    }
}

fn of_drift_estimation(error: &warm_up::DriftError) -> Failure {
    use warm_up::DriftError as Cause;
    match error {
        Cause::OutOfDomain { .. }
        | Cause::BadSample { .. }
        | Cause::NotAscending { .. }
        | Cause::MissingTemperature { .. } => Failure::Usage,
        _ => Failure::Refused,
    }
}
