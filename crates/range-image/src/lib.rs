#![doc = include_str!("../README.md")]

mod averaging;
mod demodulation;
mod error;
mod rasters;
mod sample_checks;

pub use averaging::average::{average, average_ranges, sigma_from_repeats};
pub use averaging::fusion::{Exposure, Fusion, FusionOptions, fuse_exposures};
pub use averaging::rest::{FrameDeviation, Rest, RestOptions, RestVerdict, check_rest, check_rest_of_ranges};
pub use demodulation::alias::AliasCorrection;
pub use demodulation::demodulate::{Demodulator, demodulate};
pub use demodulation::harmonics::{HarmonicImage, HarmonicRatio, harmonic_ratio, harmonics};
pub use demodulation::polar_level::PolarChannel;
pub use demodulation::wide_registers::with_wide_registers;
pub use error::Error;
use error::Result;
pub use rasters::channel::{ComplexChannel, ComplexPixels, PolarPixels};
pub use rasters::flags::Flags;
pub use rasters::frame::{ComplexFrame, RangeFrame, RawFrame, RawView, SampleSlice, Samples};
pub use rasters::image_format::ImageFormat;
pub use rasters::modulation::{Modulation, SPEED_OF_LIGHT};
pub use rasters::noise::NoiseModel;
pub use rasters::options::DemodulationOptions;
pub use rasters::phase_level::{PhaseConvention, PhaseSense};
pub use rasters::raster::Raster;
pub use sample_checks::consistency::{
    ConsistencyOptions, ConsistencySummary, OffsetRule, PlateauOptions, RulesVerdict, SampleCheck, SaturationVerdict,
    check_samples,
};
pub use sample_checks::interference::{
    Interference, InterferenceOptions, InterferenceVerdict, check_interference, tell_interference,
};
