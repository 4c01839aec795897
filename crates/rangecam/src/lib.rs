#![doc = include_str!("../README.md")]

/// Statistics, rigid poses and least squares.
pub mod maths {
    #[cfg(feature = "adjust")]
    #[doc(inline)]
    pub use adjust;
    #[cfg(feature = "dense-matrices")]
    #[doc(inline)]
    pub use dense_matrices;
    #[cfg(feature = "fourier-transforms")]
    #[doc(inline)]
    pub use fourier_transforms;
    #[cfg(feature = "observation-equations")]
    #[doc(inline)]
    pub use observation_equations;
    #[cfg(feature = "rigid-pose")]
    #[doc(inline)]
    pub use rigid_pose;
    #[cfg(feature = "statistics")]
    #[doc(inline)]
    pub use statistics;
}

/// From raw samples to corrected ranges.
pub mod imaging {
    #[cfg(feature = "camera-model")]
    #[doc(inline)]
    pub use camera_model;
    #[cfg(feature = "error-models")]
    #[doc(inline)]
    pub use error_models;
    #[cfg(feature = "multipath")]
    #[doc(inline)]
    pub use multipath;
    #[cfg(feature = "phase-unwrap")]
    #[doc(inline)]
    pub use phase_unwrap;
    #[cfg(feature = "range-image")]
    #[doc(inline)]
    pub use range_image;
    #[cfg(feature = "scattering-deconvolution")]
    #[doc(inline)]
    pub use scattering_deconvolution;
}

/// Clouds, frames and streams brought into one coordinate system.
pub mod registration {
    #[cfg(feature = "global-registration")]
    #[doc(inline)]
    pub use global_registration;
    #[cfg(feature = "icp-registration")]
    #[doc(inline)]
    pub use icp_registration;
    #[cfg(feature = "inertial")]
    #[doc(inline)]
    pub use inertial;
    #[cfg(feature = "multiview-registration")]
    #[doc(inline)]
    pub use multiview_registration;
    #[cfg(feature = "point-cloud")]
    #[doc(inline)]
    pub use point_cloud;
    #[cfg(feature = "pose-graph")]
    #[doc(inline)]
    pub use pose_graph;
    #[cfg(feature = "projective-registration")]
    #[doc(inline)]
    pub use projective_registration;
    #[cfg(feature = "tracking")]
    #[doc(inline)]
    pub use tracking;
}

/// What becomes of registered points: how well they are known, and what is measured in them.
pub mod clouds {
    #[cfg(feature = "fusion")]
    #[doc(inline)]
    pub use fusion;
    #[cfg(feature = "measurement")]
    #[doc(inline)]
    pub use measurement;
    #[cfg(feature = "point-uncertainty")]
    #[doc(inline)]
    pub use point_uncertainty;
}

/// Orientation, calibration and its judgement.
pub mod calibration {
    #[cfg(feature = "calibration-network")]
    #[doc(inline)]
    pub use calibration_network;
    #[cfg(feature = "orientation")]
    #[doc(inline)]
    pub use orientation;
    #[cfg(feature = "primitives")]
    #[doc(inline)]
    pub use primitives;
    #[cfg(feature = "range-calibration")]
    #[doc(inline)]
    pub use range_calibration;
    #[cfg(feature = "residual-tests")]
    #[doc(inline)]
    pub use residual_tests;
    #[cfg(feature = "rig-calibration")]
    #[doc(inline)]
    pub use rig_calibration;
    #[cfg(feature = "self-calibration")]
    #[doc(inline)]
    pub use self_calibration;
    #[cfg(feature = "sensor-noise")]
    #[doc(inline)]
    pub use sensor_noise;
    #[cfg(feature = "stored-values")]
    #[doc(inline)]
    pub use stored_values;
    #[cfg(feature = "targets")]
    #[doc(inline)]
    pub use targets;
    #[cfg(feature = "warm-up")]
    #[doc(inline)]
    pub use warm_up;
}

/// Simulation, files, reports and whole pipelines.
pub mod application {
    #[cfg(feature = "atomic-output")]
    #[doc(inline)]
    pub use atomic_output;
    #[cfg(feature = "calibration-tasks")]
    #[doc(inline)]
    pub use calibration_tasks;
    #[cfg(feature = "cloud-tasks")]
    #[doc(inline)]
    pub use cloud_tasks;
    #[cfg(feature = "cloud-tiles")]
    #[doc(inline)]
    pub use cloud_tiles;
    #[cfg(feature = "commands")]
    #[doc(inline)]
    pub use commands;
    #[cfg(feature = "common-errors")]
    #[doc(inline)]
    pub use common_errors;
    #[cfg(feature = "live-frames")]
    #[doc(inline)]
    pub use live_frames;
    #[cfg(feature = "live-tasks")]
    #[doc(inline)]
    pub use live_tasks;
    #[cfg(feature = "orientation-tasks")]
    #[doc(inline)]
    pub use orientation_tasks;
    #[cfg(feature = "pipeline")]
    #[doc(inline)]
    pub use pipeline;
    #[cfg(feature = "range-io")]
    #[doc(inline)]
    pub use range_io;
    #[cfg(feature = "recording-tasks")]
    #[doc(inline)]
    pub use recording_tasks;
    #[cfg(feature = "recordings")]
    #[doc(inline)]
    pub use recordings;
    #[cfg(feature = "report")]
    #[doc(inline)]
    pub use report;
    #[cfg(feature = "rig-tasks")]
    #[doc(inline)]
    pub use rig_tasks;
    #[cfg(feature = "simulation")]
    #[doc(inline)]
    pub use simulation;
    #[cfg(feature = "target-tasks")]
    #[doc(inline)]
    pub use target_tasks;
    #[cfg(feature = "tasks")]
    #[doc(inline)]
    pub use tasks;
    #[cfg(feature = "workflow-tasks")]
    #[doc(inline)]
    pub use workflow_tasks;
}

// The example of the repository's README is compiled here.
#[cfg(all(doctest, feature = "range-image"))]
#[doc = include_str!("../../../README.md")]
struct ReadmeOfTheRepository;
