//! Do the samples of a pixel belong to one phase? Motion and saturation break the rules that a scene at rest keeps.

use crate::demodulation::samples::Sample;
use crate::demodulation::weights::StepWeights;
use crate::sample_checks::plateau::{Highest, highest};
use crate::sample_checks::rules_loop::{Job, Purpose};
use crate::sample_checks::sample_rules::SampleRules;
use crate::{DemodulationOptions, Error, Flags, NoiseModel, Raster, RawFrame, Result, Samples};

/// Whether the samples' mean is light or should be nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum OffsetRule {
    /// The mean may be anything: light, or what is left of it in differences of two taps that are not quite alike.
    #[default]
    Free,
    /// The mean is zero: differences of two taps whose offsets were taken off. Adds the rules `S0 = -S2`, `S1 = -S3` for
    /// N = 4, and the only rule there is for N = 3. Shot noise is not known then; the dark noise applies alone.
    Zero,
}

/// When a highest value is taken for the sensor's saturation; see [`SampleCheck`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct PlateauOptions {
    /// Samples that have to share the highest value. Default: 16.
    pub least_samples: usize,
    /// How many times as many they have to be as those of any of the next seven values. Default: 8.
    pub ratio: f64,
}

impl Default for PlateauOptions {
    fn default() -> Self {
        Self { least_samples: 16, ratio: 8.0 }
    }
}

/// How samples are checked.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct ConsistencyOptions {
    /// Probability that noise alone flags a pixel at one frequency. Default: 1e-4.
    pub false_alarm_probability: f64,
    /// What the sensor itself breaks the rules by, as a part of the fundamental: unequal gains of taps, a second
    /// harmonic. So much is let pass on top of the noise. Default: 0.
    pub tolerance: f64,
    /// Orders of the modulation's harmonics. Where they fall in the samples is not checked. Default: empty.
    pub harmonics: Vec<usize>,
    /// What is known of the samples' mean. Default: [`OffsetRule::Free`].
    pub offset: OffsetRule,
    /// How a saturation that is not stated is looked for; `None` not at all. Default: that of [`PlateauOptions`].
    pub plateau: Option<PlateauOptions>,
}

impl Default for ConsistencyOptions {
    /// One false alarm in ten thousand, no tolerance, no harmonics, a free offset, plateaus looked for.
    fn default() -> Self {
        Self {
            false_alarm_probability: 1e-4,
            tolerance: 0.0,
            harmonics: Vec::new(),
            offset: OffsetRule::Free,
            plateau: Some(PlateauOptions::default()),
        }
    }
}

impl ConsistencyOptions {
    /// Fails on a value that means nothing.
    pub fn validate(&self) -> Result<()> {
        let require = |name, value: f64, good: bool, expected| {
            if good { Ok(()) } else { Err(Error::OutOfDomain { name, value, expected }) }
        };
        let probability = self.false_alarm_probability;
        let good = (1e-12..=0.5).contains(&probability);
        require("false_alarm_probability", probability, good, "a probability from 1e-12 to 0.5")?;
        let good = self.tolerance >= 0.0 && self.tolerance.is_finite();
        require("tolerance", self.tolerance, good, "a part of the amplitude, finite and not negative")?;
        for &order in &self.harmonics {
            require("harmonics", order as f64, order >= 2, "harmonics have orders from 2 on")?;
        }
        let Some(PlateauOptions { least_samples, ratio }) = self.plateau else { return Ok(()) };
        require("least_samples", least_samples as f64, least_samples > 0, "at least one sample")?;
        require("ratio", ratio, ratio >= 1.0 && ratio.is_finite(), "finite and at least 1")
    }
}

/// What the check of a frame found by the rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RulesVerdict {
    /// N samples say no more than offset, amplitude, phase and the harmonics named: three samples, or harmonics all over.
    NothingToCheck,
    /// The rules were applied, at each frequency of each pixel.
    Checked {
        /// Redundant samples of a pixel.
        degrees_of_freedom: usize,
        /// Pixels with samples at all frequencies, none of them saturated.
        pixels: usize,
        /// Of these, the pixels that break the rules; they were given [`Flags::MOTION`].
        inconsistent: usize,
    },
}

/// What the check of a frame found of saturation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SaturationVerdict {
    /// The saturation is stated in [`DemodulationOptions`].
    Stated,
    /// There is no sign of one, or it was not looked for.
    NotFound,
    /// Samples are cut off: the highest sample, and the lowest one where taps are subtracted; raw units.
    Plateau {
        /// The highest value.
        highest: Option<f64>,
        /// The lowest value.
        lowest: Option<f64>,
    },
}

/// Result of [`SampleCheck::check`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConsistencySummary {
    /// What the rules say.
    pub rules: RulesVerdict,
    /// Where the sensor saturates.
    pub saturation: SaturationVerdict,
    /// Pixels with a saturated sample; they were given [`Flags::SATURATED`].
    pub saturated: usize,
}

/// The check of samples against each other, prepared for frames of N phase steps.
///
/// **Rules.** Samples of a scene at rest hold offset, fundamental and harmonics. Whatever else they hold is noise: for
/// N = 4 `S0 + S2 = S1 + S3`, in general the `N - 3` dimensions beside offset and fundamental, less those of the
/// harmonics named. Its squared length over the variance of a sample, `s B + d^2`, is compared with the quantile of the
/// chi-squared distribution that noise exceeds with `false_alarm_probability`; that samples of a pixel differ in
/// variance is allowed for (`[Buckley1988]`). A pixel beyond it gets [`Flags::MOTION`] (`[Hansard2013]`).
///
/// What this cannot see: a motion that leaves the sums alone. For N = 4 there is one rule, and a phase that drifts by
/// `delta` from the first sample to the last makes `(S0 - S1 + S2 - S3) / 2`, whose deviation is that of a sample,
/// `A delta (sin phi - cos phi) / 3`: nothing near phases of 45 and 225 degrees. Nor does it tell motion from flickering
/// light or from a sensor whose taps are unequal; the latter is what `tolerance` is for.
///
/// **Saturation** that is stated flags samples at or above it. One that is not stated is found where the highest value
/// of the frame is shared by many samples, and by many more than any of the next seven values; and where at least a
/// quarter of its pixels cannot be anything but cut off. These break the rules; or have the value three times, which a
/// sine has at most twice a period; or, where taps are subtracted and both ends are cut off, which keeps the rules, have
/// both the highest and the lowest value, in more than one of the steps over the frame. Pixels with a sample at the
/// plateau get [`Flags::SATURATED`] and are not said to move.
///
/// What this cannot see: fewer samples than `least_samples`; samples that are cut off by no more than the noise; a
/// saturation that differs from pixel to pixel, as after a correction for each pixel or an average over frames; for
/// three samples, one that does not take all three.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleCheck {
    rules: SampleRules,
    /// With the dark noise alone, for differences of taps.
    rules_of_differences: SampleRules,
    phase_steps: usize,
    known_noise: [bool; 2],
    demodulation: DemodulationOptions,
    plateau: Option<PlateauOptions>,
}

impl SampleCheck {
    /// Prepares the check of frames with `phase_steps` samples a frequency. Scale, saturation and noise are those of the
    /// demodulation.
    pub fn new(phase_steps: usize, demodulation: &DemodulationOptions, options: &ConsistencyOptions) -> Result<Self> {
        demodulation.validate()?;
        options.validate()?;
        if !(3..=256).contains(&phase_steps) {
            let expected = "offset, amplitude and phase need at least 3 phase steps; more than 256 are not checked";
            return Err(Error::OutOfDomain { name: "phase_steps", value: phase_steps as f64, expected });
        }
        let dark_alone = NoiseModel { shot_variance_per_unit: 0.0, ..demodulation.noise };
        let rules = |noise: &NoiseModel| SampleRules::new(phase_steps, demodulation.raw_scale, noise, options);
        let stands_in = |noise: &NoiseModel| noise.is_known() || options.tolerance > 0.0;
        let of_light = if options.offset == OffsetRule::Zero { &dark_alone } else { &demodulation.noise };
        Ok(Self {
            rules: rules(of_light),
            rules_of_differences: rules(&dark_alone),
            phase_steps,
            known_noise: [stands_in(of_light), stands_in(&dark_alone)],
            demodulation: demodulation.clone(),
            plateau: options.plateau,
        })
    }

    /// Redundant samples of a pixel; zero where there is nothing to check.
    pub fn degrees_of_freedom(&self) -> usize {
        self.rules.components
    }

    /// Checks a frame and adds to the flags of its pixels. Nothing is allocated.
    ///
    /// Fails where the frame has another number of phase steps or the flags another size; and, unless there is nothing
    /// to check, where neither noise nor tolerance are known: what breaks a rule cannot be told then.
    pub fn check(&self, frame: &RawFrame, flags: &mut Raster<Flags>) -> Result<ConsistencySummary> {
        self.require(frame, flags)?;
        Ok(match frame.samples() {
            Samples::F32(samples) => self.run(&self.rules, samples, flags),
            Samples::U16(samples) => self.run(&self.rules, samples, flags),
            Samples::I16(samples) => self.run(&self.rules_of_differences, samples, flags),
        })
    }

    fn require(&self, frame: &RawFrame, flags: &Raster<Flags>) -> Result<()> {
        if frame.phase_steps() != self.phase_steps {
            let expected = "the number of phase steps that the check was prepared for";
            return Err(Error::OutOfDomain { name: "phase_steps", value: frame.phase_steps() as f64, expected });
        }
        if (frame.width(), frame.height()) != (flags.width(), flags.height()) {
            return Err(Error::SizeMismatch {
                what: "flags",
                width: frame.width(),
                height: frame.height(),
                found_width: flags.width(),
                found_height: flags.height(),
            });
        }
        let known = self.known_noise[usize::from(matches!(frame.samples(), Samples::I16(_)))];
        if self.rules.components == 0 || known {
            return Ok(());
        }
        let expected = "without a noise model that applies to these samples, or a tolerance, no rule can be tested";
        Err(Error::OutOfDomain { name: "noise", value: 0.0, expected })
    }

    fn run<S: Sample>(&self, rules: &SampleRules, samples: &[S], flags: &mut Raster<Flags>) -> ConsistencySummary {
        let weights = StepWeights::new(self.phase_steps, &self.demodulation);
        let mut job = Job {
            rules,
            weights: weights.groups(),
            steps: self.phase_steps,
            // No number is at or above NaN.
            saturation: self.demodulation.saturation.map_or(f32::NAN, |value| value as f32),
            plateau: [f32::NAN; 2],
        };
        let saturation = if self.demodulation.saturation.is_some() {
            SaturationVerdict::Stated
        } else {
            self.look_for_plateau(&mut job, samples, flags)
        };
        let found = job.run(Purpose::Flag, samples, flags.as_mut_slice());
        let checked = RulesVerdict::Checked {
            degrees_of_freedom: rules.components,
            pixels: found.checked,
            inconsistent: found.inconsistent,
        };
        let rules = if rules.components == 0 { RulesVerdict::NothingToCheck } else { checked };
        ConsistencySummary { rules, saturation, saturated: found.saturated }
    }

    /// Gives the job the plateaus that there are.
    fn look_for_plateau<S: Sample>(
        &self,
        job: &mut Job<'_>,
        samples: &[S],
        flags: &mut Raster<Flags>,
    ) -> SaturationVerdict {
        let Some(options) = &self.plateau else { return SaturationVerdict::NotFound };
        let spikes = highest(samples).map(|values: Highest| values.spike(options));
        if spikes == [None, None] {
            return SaturationVerdict::NotFound;
        }
        job.plateau = [spikes[0].unwrap_or(f32::NAN), spikes[1].map_or(f32::NAN, |value| -value)];
        let found = job.run(Purpose::Count, samples, flags.as_mut_slice());
        let at_both_ends = if found.steps.count_ones() > 1 { found.at_both_ends } else { 0 };
        let evident = found.evident + at_both_ends;
        if evident == 0 || 4 * evident < found.saturated {
            job.plateau = [f32::NAN; 2];
            return SaturationVerdict::NotFound;
        }
        SaturationVerdict::Plateau {
            highest: spikes[0].map(f64::from),
            lowest: spikes[1].map(|value| -f64::from(value)),
        }
    }
}

/// Checks one frame; see [`SampleCheck`], which is for streams of frames.
pub fn check_samples(
    frame: &RawFrame,
    demodulation: &DemodulationOptions,
    options: &ConsistencyOptions,
    flags: &mut Raster<Flags>,
) -> Result<ConsistencySummary> {
    SampleCheck::new(frame.phase_steps(), demodulation, options)?.check(frame, flags)
}
