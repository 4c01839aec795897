use range_image::Raster;

use crate::{Error, Result, Unwrapped};

/// How one frequency is unwrapped in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpatialOptions {
    /// Largest wrap count that a pixel may get: the scene ends before `(maximum_wraps + 1) * U`. Default: 2.
    pub maximum_wraps: u16,
    /// Confidence from which a wrap count is called sure. It decides [`Island::offset_known`](crate::Island). Default:
    /// 0.6.
    pub minimum_confidence: f32,
    /// Standard deviation of each part of the complex image, in amplitude units; the phase then has the standard
    /// deviation `noise / amplitude`. `None`, the default: estimated from the image itself.
    pub amplitude_noise: Option<f32>,
    /// What is known about amplitude as a function of range. Default: that of [`AlbedoPrior`].
    pub albedo: AlbedoPrior,
    /// What makes a link dear. Default: [`EdgeWeight::SecondDifferences`].
    pub edge_weight: EdgeWeight,
    /// How columns and rows end: `[left and right, top and bottom]`. Default: both [`Boundary::Open`].
    pub boundaries: [Boundary; 2],
    /// Where the rays go. With it, the angle of incidence is taken out of the amplitudes, and walls and floors count as
    /// evidence by being plane; without it only amplitude and continuity decide. Default: `None`.
    pub geometry: Option<ImageGeometry>,
}

/// The camera as a central projection, good to a few pixels; lens distortion does not matter here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageGeometry {
    /// Principal distance in pixels (principal distance over pixel pitch).
    pub principal_distance_px: f32,
    /// Column and row of the principal point.
    pub principal_point_px: [f32; 2],
}

impl Default for SpatialOptions {
    fn default() -> Self {
        Self {
            maximum_wraps: 2,
            minimum_confidence: 0.6,
            amplitude_noise: None,
            albedo: AlbedoPrior::default(),
            edge_weight: EdgeWeight::default(),
            boundaries: [Boundary::Open; 2],
            geometry: None,
        }
    }
}

/// What makes a link of the spanning tree dear; the cost of a link is the sum of its two pixels' costs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum EdgeWeight {
    /// Second differences of the phase around the pixel, rad^2, plus their expectation of `24 sigma^2` where the
    /// standard deviation is given or follows from the amplitude: for scenes with jumps.
    #[default]
    SecondDifferences,
    /// `24 sigma^2` alone: the variance of the step between two pixels, in the same scale. For smooth scenes whose noise
    /// differs from place to place; needs a standard deviation or an amplitude.
    Noise,
}

/// How an axis of the image ends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Boundary {
    /// The image has a border.
    #[default]
    Open,
    /// The last pixel is the first one's neighbour, as the columns of a full panorama are.
    Cyclic,
}

/// The inverse square law: `amplitude * range^2 = constant * albedo * cos(incidence)`.
///
/// The logarithm of the right side scatters around that of its typical value: most surfaces by a two-sided exponential
/// density of the scales below, some are dark materials far below, and some (retro-reflectors, glints) obey no albedo. So
/// a surface that is off is unlikely but not excluded, and costs a bounded amount.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlbedoPrior {
    /// Amplitude of a typical surface (albedo about 0.6, seen straight on) at a range of one ambiguity interval.
    /// `None`: estimated together with the wrap counts, which needs a scene with some spread in range.
    pub typical_amplitude_at_interval: Option<f32>,
    /// Scale (natural logarithm) on the dark side: dark materials and grazing incidence.
    pub dark_scale: f32,
    /// Scale (natural logarithm) on the bright side.
    pub bright_scale: f32,
}

impl Default for AlbedoPrior {
    fn default() -> Self {
        Self { typical_amplitude_at_interval: None, dark_scale: 0.7, bright_scale: 0.4 }
    }
}

/// Wrap counts that are known beforehand.
#[derive(Debug, Clone, Copy, Default)]
pub enum KnownWraps<'a> {
    /// None is known.
    #[default]
    Nothing,
    /// At single pixels.
    Seeds(&'a [Seed]),
    /// A raster of the image's size; `None` where unknown.
    Raster(&'a Raster<Option<i32>>),
    /// The frame before. Its counts hold where the range changed by less than half an ambiguity interval; where the
    /// phase passed zero meanwhile the count moves with it.
    Previous {
        /// Wrapped phase of the frame before, radians.
        phase: &'a Raster<f32>,
        /// Its counts.
        unwrapped: &'a Unwrapped,
        /// Only pixels of at least this confidence are taken as known.
        minimum_confidence: f32,
    },
}

/// A pixel whose wrap count is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seed {
    /// Column.
    pub col: usize,
    /// Row.
    pub row: usize,
    /// Wrap count.
    pub wraps: i32,
}

/// The largest `maximum_wraps`: counts beyond are no range camera's.
const WRAPS_LIMIT: u16 = 64;

impl SpatialOptions {
    /// Fails where an option lies outside its domain.
    pub fn validate(&self) -> Result<()> {
        let albedo = &self.albedo;
        let positive = [
            ("dark_scale", albedo.dark_scale),
            ("bright_scale", albedo.bright_scale),
            ("amplitude_noise", self.amplitude_noise.unwrap_or(1.0)),
            ("typical_amplitude_at_interval", albedo.typical_amplitude_at_interval.unwrap_or(1.0)),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfDomain { name, value: value.into(), expected: "positive and finite" });
            }
        }
        if let Some(geometry) = self.geometry {
            geometry.validate()?;
        }
        if !(0.0..1.0).contains(&self.minimum_confidence) {
            let value = self.minimum_confidence.into();
            return Err(Error::OutOfDomain { name: "minimum_confidence", value, expected: "in [0, 1)" });
        }
        if self.maximum_wraps > WRAPS_LIMIT {
            let value = self.maximum_wraps.into();
            return Err(Error::OutOfDomain { name: "maximum_wraps", value, expected: "at most 64" });
        }
        Ok(())
    }
}

impl ImageGeometry {
    fn validate(&self) -> Result<()> {
        let [col, row] = self.principal_point_px;
        let distance = self.principal_distance_px;
        if !(distance.is_finite() && distance > 0.0) {
            let value = distance.into();
            return Err(Error::OutOfDomain { name: "principal_distance_px", value, expected: "positive and finite" });
        }
        if !(col.is_finite() && row.is_finite()) {
            let value = if col.is_finite() { row } else { col }.into();
            return Err(Error::OutOfDomain { name: "principal_point_px", value, expected: "finite" });
        }
        Ok(())
    }
}
