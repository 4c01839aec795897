#![doc = include_str!("../README.md")]

mod alias;
mod average;
mod beat;
mod channel;
mod chi_squared;
mod consistency;
mod demodulate;
mod error;
mod flags;
mod frame;
mod fusion;
mod fusion_bias;
mod harmonics;
mod image_format;
mod interference;
mod mean_flags;
mod modulation;
mod noise;
mod options;
mod phase_level;
mod plateau;
mod polar;
mod polar_level;
mod raster;
mod rest;
mod rest_pixel;
mod rules_loop;
mod sample_rules;
mod samples;
mod weights;
mod wide;
mod wide_registers;

pub use alias::AliasCorrection;
pub use average::{average, average_ranges, sigma_from_repeats};
pub use channel::ComplexChannel;
pub use chi_squared::chi_squared_upper_quantile;
pub use consistency::{
    ConsistencyOptions, ConsistencySummary, OffsetRule, PlateauOptions, RulesVerdict, SampleCheck, SaturationVerdict,
    check_samples,
};
pub use demodulate::{Demodulator, demodulate};
pub use error::{Error, Result};
pub use flags::Flags;
pub use frame::{ComplexFrame, RangeFrame, RawFrame, Samples};
pub use fusion::{Exposure, Fusion, FusionOptions, fuse_exposures};
pub use harmonics::{HarmonicImage, HarmonicRatio, harmonic_ratio, harmonics};
pub use image_format::ImageFormat;
pub use interference::{Interference, InterferenceOptions, InterferenceVerdict, check_interference, tell_interference};
pub use modulation::{Modulation, SPEED_OF_LIGHT};
pub use noise::NoiseModel;
pub use options::DemodulationOptions;
pub use phase_level::{PhaseConvention, PhaseSense};
pub use polar_level::PolarChannel;
pub use raster::Raster;
pub use rest::{FrameDeviation, Rest, RestOptions, RestVerdict, check_rest, check_rest_of_ranges};
pub use wide_registers::with_wide_registers;
