#![doc = include_str!("../README.md")]

#[cfg(feature = "adjust")]
#[doc(inline)]
pub use adjust;
#[cfg(feature = "atomic-output")]
#[doc(inline)]
pub use atomic_output;
#[cfg(feature = "calibration-tasks")]
#[doc(inline)]
pub use calibration_tasks;
#[cfg(feature = "camera-model")]
#[doc(inline)]
pub use camera_model;
#[cfg(feature = "dense-matrices")]
#[doc(inline)]
pub use dense_matrices;
#[cfg(feature = "error-models")]
#[doc(inline)]
pub use error_models;
#[cfg(feature = "icp-registration")]
#[doc(inline)]
pub use icp_registration;
#[cfg(feature = "multipath")]
#[doc(inline)]
pub use multipath;
#[cfg(feature = "observation-equations")]
#[doc(inline)]
pub use observation_equations;
#[cfg(feature = "orientation")]
#[doc(inline)]
pub use orientation;
#[cfg(feature = "phase-unwrap")]
#[doc(inline)]
pub use phase_unwrap;
#[cfg(feature = "pipeline")]
#[doc(inline)]
pub use pipeline;
#[cfg(feature = "range-calibration")]
#[doc(inline)]
pub use range_calibration;
#[cfg(feature = "range-image")]
#[doc(inline)]
pub use range_image;
#[cfg(feature = "range-io")]
#[doc(inline)]
pub use range_io;
#[cfg(feature = "report")]
#[doc(inline)]
pub use report;
#[cfg(feature = "scattering-deconvolution")]
#[doc(inline)]
pub use scattering_deconvolution;
#[cfg(feature = "self-calibration")]
#[doc(inline)]
pub use self_calibration;
#[cfg(feature = "simulation")]
#[doc(inline)]
pub use simulation;
#[cfg(feature = "tasks")]
#[doc(inline)]
pub use tasks;

#[cfg(feature = "primitives")]
#[doc(inline)]
pub use primitives;
#[cfg(feature = "residual-tests")]
#[doc(inline)]
pub use residual_tests;
#[cfg(feature = "sensor-noise")]
#[doc(inline)]
pub use sensor_noise;
#[cfg(feature = "statistics")]
#[doc(inline)]
pub use statistics;
#[cfg(feature = "warm-up")]
#[doc(inline)]
pub use warm_up;

// The example of the repository's README is compiled here.
#[cfg(all(doctest, feature = "range-image"))]
#[doc = include_str!("../../../README.md")]
struct ReadmeOfTheRepository;
