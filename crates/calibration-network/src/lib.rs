#![doc = include_str!("../README.md")]

mod error;
pub mod functional_model;
mod given;
pub mod precision;
pub mod start_values;
pub mod weakness;

pub use adjust;
pub use camera_model;
pub use error::Error;
pub use error_models;
pub use functional_model::Component;
pub use given::model::{
    DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, PassiveImagePoint, Sighting, Station,
};
pub use given::outside_image::OutsideImage;
pub use nalgebra;
pub use precision::{AdjustedStation, AdjustedTarget, CalibratedParameter, GroupQuality, ObservationQuality, Verdict};
pub use weakness::{SightingOptions, SimulatedStart, simulate_sightings};

use error::Result;
