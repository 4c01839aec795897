//! The stages of a frame from samples to corrected points, with buffers that are used again.

mod scene;

use rangecam::imaging::camera_model::{Camera, InteriorOrientation, LensDistortion, OrganisedCloud, RayTable};
use rangecam::imaging::error_models::{AmplitudeHyperbola, FurtherTerms, RangeErrorModel, RangeTerms, correct_frame};
use rangecam::imaging::phase_unwrap::{
    KnownWraps, MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper, SpatialOptions, Unwrapped, Unwrapper,
};
use rangecam::imaging::range_image::{
    ComplexFrame, DemodulationOptions, Demodulator, Flags, ImageFormat, Modulation, RangeFrame, Raster, RawFrame,
};
use rangecam::imaging::scattering_deconvolution::{RestorationOptions, Restorer};

pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A stage of a frame.
pub type Stage = fn(&mut Frame) -> Result<(), Failure>;

/// How the missing whole cycles are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unwrapping {
    /// One frequency, the spanning tree alone: relative counts.
    Relative,
    /// One frequency with amplitudes: absolute counts.
    Absolute,
    /// Two frequencies.
    TwoFrequencies,
}

impl Unwrapping {
    pub const ALL: [(Self, &'static str); 3] = [
        (Self::Relative, "spatial, relative"),
        (Self::Absolute, "spatial, absolute by amplitude"),
        (Self::TwoFrequencies, "two frequencies"),
    ];

    fn modulations(self) -> Result<Vec<Modulation>, Failure> {
        let frequencies: &[f64] = if self == Self::TwoFrequencies { &[70e6, 60e6] } else { &[30e6] };
        Ok(frequencies.iter().map(|&frequency| Modulation::new(frequency)).collect::<Result<_, _>>()?)
    }
}

/// Camera, calibration and buffers for frames of one scene.
pub struct Frame {
    unwrapping: Unwrapping,
    format: ImageFormat,
    principal_point_mm: [f64; 2],
    raw: RawFrame,
    demodulator: Demodulator,
    complex: ComplexFrame,
    restorer: Restorer,
    phases: Vec<Raster<f32>>,
    sigmas: Vec<Raster<f32>>,
    unwrapper: Unwrapper,
    unwrapped: Unwrapped,
    multi_unwrapper: Option<MultiUnwrapper>,
    multi: MultiUnwrapped,
    ranges: RangeFrame,
    model: RangeErrorModel,
    table: RayTable,
    pub cloud: OrganisedCloud,
}

impl Frame {
    pub fn new(width: usize, height: usize, unwrapping: Unwrapping) -> Result<Self, Failure> {
        let format = ImageFormat::new(width, height, [6.4 / width as f64; 2])?;
        let modulations = unwrapping.modulations()?;
        let principal_point_mm = [0.05, -0.03];
        let interior = InteriorOrientation { principal_point_mm, principal_distance_mm: 6.0 };
        let lens = LensDistortion { k1: -2e-3, k2: 2e-5, p1: 1e-4, p2: -5e-5, ..LensDistortion::default() };
        let plane = Raster::filled(width, height, 0.0);
        let interval = modulations.first().map_or(1.0, Modulation::ambiguity_interval_m);
        let options = DemodulationOptions {
            noise: scene::NOISE,
            saturation: Some(65_535.0),
            low_amplitude: Some(10.0),
            ..DemodulationOptions::default()
        };
        Ok(Self {
            unwrapping,
            format,
            principal_point_mm,
            raw: scene::raw_frame(&format, &modulations)?,
            demodulator: Demodulator::new(&options)?,
            complex: ComplexFrame::empty(),
            restorer: Restorer::new(&scene::psf(), width, height, &RestorationOptions::default())?,
            phases: vec![plane.clone(); modulations.len()],
            sigmas: vec![plane.clone(); modulations.len()],
            unwrapper: Unwrapper::new(SpatialOptions::default())?,
            unwrapped: Unwrapped::default(),
            multi_unwrapper: multi_unwrapper(&modulations)?,
            multi: MultiUnwrapped::default(),
            ranges: RangeFrame {
                range: plane.clone(),
                sigma: plane.clone(),
                amplitude: plane,
                flags: Raster::filled(width, height, Flags::empty()),
            },
            model: model(interval),
            table: RayTable::new(&Camera::new(format, interior, lens)?)?,
            cloud: OrganisedCloud::default(),
        })
    }

    /// The stages in their order.
    pub const STAGES: [(&'static str, Stage); 6] = [
        ("Demodulate", Self::demodulate),
        ("Deconvolve", Self::deconvolve),
        ("phase, amplitude, sigma", Self::derive),
        ("Unwrap", Self::unwrap),
        ("CorrectRange", Self::correct),
        ("PointCloud", Self::back_project),
    ];

    fn demodulate(&mut self) -> Result<(), Failure> {
        Ok(self.demodulator.demodulate_into(&self.raw, &mut self.complex)?)
    }

    fn deconvolve(&mut self) -> Result<(), Failure> {
        for channel in &mut self.complex.channels {
            self.restorer.restore(channel)?;
        }
        Ok(())
    }

    fn derive(&mut self) -> Result<(), Failure> {
        let planes = self.phases.iter_mut().zip(&mut self.sigmas);
        for (channel, (phase, sigma)) in self.complex.channels.iter().zip(planes) {
            channel.phase_and_amplitude_into(phase, &mut self.ranges.amplitude)?;
            if self.multi_unwrapper.is_some() {
                channel.sigma_phase_into(sigma)?;
            } else {
                channel.sigma_range_into(&mut self.ranges.sigma)?;
            }
        }
        Ok(())
    }

    fn unwrap(&mut self) -> Result<(), Failure> {
        let RangeFrame { range, sigma, amplitude, flags } = &mut self.ranges;
        flags.as_mut_slice().copy_from_slice(self.complex.flags.as_slice());
        let guide = (self.unwrapping == Unwrapping::Absolute).then_some(&*amplitude);
        if let Some(unwrapper) = &mut self.multi_unwrapper {
            unwrapper.unwrap_into(&self.phases, Some(&self.sigmas), None, &mut self.multi)?;
            std::mem::swap(range, &mut self.multi.range);
            std::mem::swap(sigma, &mut self.multi.sigma);
            return Ok(());
        }
        let phase = self.phases.first().ok_or("no frequency")?;
        self.unwrapper.unwrap_into(phase, guide, None, KnownWraps::Nothing, &mut self.unwrapped)?;
        let metres =
            self.complex.channels.first().map_or(1.0, |channel| channel.modulation.range_from_phase(1.0)) as f32;
        let given = phase.as_slice().iter().zip(self.unwrapped.wraps.as_slice());
        for (range, (phase, wraps)) in range.as_mut_slice().iter_mut().zip(given) {
            *range = metres * (phase + std::f32::consts::TAU * *wraps as f32);
        }
        Ok(())
    }

    fn correct(&mut self) -> Result<(), Failure> {
        correct_frame(&mut self.ranges, &self.model, &self.format, self.principal_point_mm, None)?;
        Ok(())
    }

    fn back_project(&mut self) -> Result<(), Failure> {
        Ok(self.table.back_project_into(&self.ranges, &mut self.cloud)?)
    }

    /// All stages.
    pub fn run(&mut self) -> Result<(), Failure> {
        Self::STAGES.iter().try_for_each(|(_, stage)| stage(self))
    }

    /// Part of the pixels whose range is right to 0.3 m.
    pub fn right(&self) -> f64 {
        let width = self.format.width;
        let ranges = self.cloud.points.iter().map(|[x, y, z]| (x * x + y * y + z * z).sqrt());
        let right = ranges.enumerate().filter(|(pixel, range)| {
            (range - scene::true_range(&self.format, pixel % width, pixel / width)).abs() < 0.3
        });
        right.count() as f64 / self.cloud.points.len().max(1) as f64
    }
}

/// For several frequencies.
fn multi_unwrapper(modulations: &[Modulation]) -> Result<Option<MultiUnwrapper>, Failure> {
    if modulations.len() < 2 {
        return Ok(None);
    }
    let options = MultiFrequencyOptions { maximum_range_m: Some(10.0), ..MultiFrequencyOptions::default() };
    Ok(Some(MultiUnwrapper::new(modulations, options)?))
}

/// Offset, periodic terms, signal propagation delay and hyperbola of a few centimetres.
fn model(ambiguity_interval_m: f64) -> RangeErrorModel {
    let terms = RangeTerms { d0: 0.012, periodic: [0.004, -0.003, 0.002, 0.001, -0.002, 0.003], e1: 5e-4, e2: -3e-4 };
    let hyperbola = AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [5.0, 20_000.0] };
    RangeErrorModel {
        ambiguity_interval_m,
        terms,
        hyperbola: Some(hyperbola),
        range_span_m: Some([0.1, 20.0]),
        further: FurtherTerms::default(),
    }
}
