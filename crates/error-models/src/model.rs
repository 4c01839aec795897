/// Range terms of Eq. 14 for one modulation frequency.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct RangeTerms {
    /// Rangefinder offset, metre.
    pub d0: f64,
    /// Periodic terms d2..d7, metre: sine and cosine at wavelengths U, U/2, U/4.
    pub periodic: [f64; 6],
    /// Signal propagation delay along x, metre per millimetre.
    pub e1: f64,
    /// Signal propagation delay along y, metre per millimetre.
    pub e2: f64,
}

/// Amplitude-related range error (Eq. 15) with the amplitude span it was fitted in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct AmplitudeHyperbola {
    /// Coefficient h1.
    pub h1: f64,
    /// Coefficient h2.
    pub h2: f64,
    /// Coefficient h3.
    pub h3: f64,
    /// Smallest and largest amplitude of the fit.
    pub amplitude_span: [f64; 2],
}

/// All range terms of one modulation frequency at one integration time.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RangeErrorModel {
    /// Ambiguity interval U of the frequency the terms belong to, metre.
    pub ambiguity_interval_m: f64,
    /// Eq. 14.
    #[cfg_attr(feature = "serde", serde(default))]
    pub terms: RangeTerms,
    /// Eq. 15; `None` where no amplitude-related error is modelled.
    #[cfg_attr(feature = "serde", serde(default))]
    pub hyperbola: Option<AmplitudeHyperbola>,
    /// Ranges the model was fitted in, metre; `None` where it holds everywhere.
    #[cfg_attr(feature = "serde", serde(default))]
    pub range_span_m: Option<[f64; 2]>,
}

/// A per-pixel range offset in metre, subtracted after the other terms (fixed pattern, Sect. 4.5).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FixedPattern {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row-major offsets, metre.
    pub offset_m: Vec<f32>,
}

/// Models keyed by integration time (Sect. 4.6), ascending.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ModelSet {
    /// `(integration_time_s, models of all frequencies)`.
    pub entries: Vec<(f64, Vec<RangeErrorModel>)>,
}
