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
    /// Terms beyond Eqs. 14 and 15.
    #[cfg_attr(feature = "serde", serde(default))]
    pub further: FurtherTerms,
}

/// Range terms beyond Eqs. 14 and 15, each of them optional.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct FurtherTerms {
    /// Periodic spline, **instead** of the sines d2..d7, which are zero beside it.
    pub spline: Option<PeriodicSpline>,
    /// Polynomial in range.
    pub polynomial: Option<RangePolynomial>,
    /// Surface over the image, **instead** of e1 and e2, which are zero beside it.
    pub surface: Option<ImageSurface>,
}

/// Periodic error as a cubic B-spline over one ambiguity interval, with knots at `0, U/n, 2U/n, ..` (`[deBoor1978]`).
///
/// `Δρ = Σ s_k B_k(ρ)`, `B_k` centred on knot k. The sum of the n coefficients is zero, so that the mean of the spline
/// is and d0 keeps its meaning; the last coefficient follows from the others and is not kept.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct PeriodicSpline {
    /// Coefficients `s0..s{n-2}`, metre; one fewer than there are knots.
    pub coefficients: Vec<f64>,
}

/// `Δρ = Σ q_k P_k(t)`, `P_k` the Legendre polynomial of order k and t from -1 to 1 over the span.
///
/// It has mean zero over the span, so that d0 keeps its meaning. The model says nothing of ranges outside the span.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RangePolynomial {
    /// Ranges it is made for, metre.
    pub range_span_m: [f64; 2],
    /// Coefficients `q1..`, metre, up to order 8.
    pub coefficients: Vec<f64>,
}

/// `Δρ = Σ g_ij P_i(s) P_j(t)`, `P` Legendre polynomials, s and t from -1 to 1 over the spans of x and y, for all i and j
/// with `1 ≤ i + j ≤ n`.
///
/// Its mean over the spans is zero, so that d0 keeps its meaning. An image point outside the spans is flagged as such
/// and gets the value of the nearest edge.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ImageSurface {
    /// Image coordinates x from the principal point it is made for, millimetre.
    pub x_span_mm: [f64; 2],
    /// Image coordinates y from the principal point it is made for, millimetre.
    pub y_span_mm: [f64; 2],
    /// Coefficients `g10, g01, g20, g11, g02, g30, ..`, metre, up to order 6.
    pub coefficients: Vec<f64>,
}

/// Which further terms a model has, without their coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct FurtherShape {
    /// Knots of a periodic spline.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub spline_knots: Option<usize>,
    /// A polynomial in range.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub polynomial: Option<PolynomialShape>,
    /// A surface over the image.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub surface: Option<SurfaceShape>,
}

/// Order and span of a [`RangePolynomial`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct PolynomialShape {
    /// Highest order, 1 to 8.
    pub order: usize,
    /// Ranges it is made for, metre.
    pub range_span_m: [f64; 2],
}

/// Order and spans of an [`ImageSurface`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SurfaceShape {
    /// Highest sum of the orders in x and y, 1 to 6.
    pub order: usize,
    /// Image coordinates x from the principal point it is made for, millimetre.
    pub x_span_mm: [f64; 2],
    /// Image coordinates y from the principal point it is made for, millimetre.
    pub y_span_mm: [f64; 2],
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
    /// Their standard deviations, metre, NaN for a pixel whose offset is not known (and is then zero); empty where no
    /// offset's is known.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub sigma_m: Vec<f32>,
}

/// Models keyed by integration time (Sect. 4.6), ascending.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ModelSet {
    /// `(integration_time_s, models of all frequencies)`.
    pub entries: Vec<(f64, Vec<RangeErrorModel>)>,
}
