//! Lists of terms: words that stand for several (`spline8`, `polynomial3`, `surface2`), and which names there are.

use std::borrow::Cow;
use std::collections::BTreeSet;

use calibration_network::functional_model::{SINES, camera_names};
use error_models::{AmplitudeHyperbola, FurtherShape, FurtherTerms, PolynomialShape, RangeTerms, SurfaceShape};

use crate::options::ranged_stations;
use crate::{CalibrationOptions, Error, Network, NetworkError, Result};

/// Names of the signal propagation delay, which a surface replaces.
const DELAYS: [&str; 2] = ["e1", "e2"];

/// A word for the terms of a further model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    /// Periodic spline with so many knots.
    Spline(usize),
    /// Polynomial of this order in range.
    Polynomial(usize),
    /// Surface of this order over the image.
    Surface(usize),
}

impl Word {
    /// The word, or `None` for every other name.
    fn parse(name: &str) -> Option<Self> {
        let number = |word: &str| name.strip_prefix(word)?.parse().ok();
        let spline = number("spline").map(Self::Spline);
        let spline_or_polynomial = spline.or_else(|| number("polynomial").map(Self::Polynomial));
        spline_or_polynomial.or_else(|| number("surface").map(Self::Surface))
    }

    /// Whether a name belongs to the coefficients of the word.
    fn owns(self, name: &str) -> bool {
        let first = match self {
            Self::Spline(_) => 's',
            Self::Polynomial(_) => 'q',
            Self::Surface(_) => 'g',
        };
        name.strip_prefix(first).is_some_and(|rest| rest.parse::<usize>().is_ok())
    }
}

/// The network with the further terms that a list asks for in its range model, and the list in names of coefficients.
///
/// Further terms that the model has already keep their coefficients, unless a word asks for another number of them: all
/// of these are then zero, as are sines beside a spline and e1, e2 beside a surface.
///
/// # Errors
/// [`NetworkError::UnknownName`] and [`Error::ConflictingTerms`]; a number of knots or an order that no model has.
pub(crate) fn expand<'n>(
    network: &'n Network,
    names: &[String],
    options: &CalibrationOptions,
) -> Result<(Cow<'n, Network>, BTreeSet<String>)> {
    let words: Vec<(&str, Word)> = names.iter().filter_map(|name| Some((name.as_str(), Word::parse(name)?))).collect();
    let mut network = Cow::Borrowed(network);
    for &(name, word) in &words {
        let same_kind = |(_, other): &&(&str, Word)| std::mem::discriminant(other) == std::mem::discriminant(&word);
        if let Some((other, _)) = words.iter().filter(same_kind).find(|(_, other)| *other != word) {
            let reason = "a model has one of the kind";
            return Err(Error::ConflictingTerms { first: name.to_owned(), second: (*other).to_owned(), reason });
        }
        let shape = network.range_model.further.shape();
        let wanted = with_word(&network, shape, word, options)?;
        if wanted != shape {
            with_shape(network.to_mut(), &wanted)?;
        }
    }
    let known = network.range_model.parameter_names();
    let mut terms = BTreeSet::new();
    for name in names {
        if let Some(word) = Word::parse(name) {
            terms.extend(known.iter().filter(|known| word.owns(known)).cloned());
        } else {
            check_term(&network, name)?;
            terms.insert(name.clone());
        }
    }
    Ok((network, terms))
}

/// The shape with the part of a word.
fn with_word(
    network: &Network,
    mut shape: FurtherShape,
    word: Word,
    options: &CalibrationOptions,
) -> Result<FurtherShape> {
    match word {
        Word::Spline(knots) => shape.spline_knots = Some(knots),
        Word::Polynomial(order) if shape.polynomial.is_none_or(|known| known.order != order) => {
            shape.polynomial = Some(PolynomialShape { order, range_span_m: observed_span(network, options)? });
        }
        Word::Surface(order) if shape.surface.is_none_or(|known| known.order != order) => {
            let camera = &network.camera;
            let surface = SurfaceShape::over_image(order, &camera.format, camera.interior.principal_point_mm);
            shape.surface = Some(surface);
        }
        // The model has it already, with its own span.
        Word::Polynomial(_) | Word::Surface(_) => {}
    }
    Ok(shape)
}

/// Gives the range model further terms of this shape; parts that it has already keep their coefficients.
pub(crate) fn with_shape(network: &mut Network, shape: &FurtherShape) -> Result<()> {
    let before = network.range_model.further.clone();
    let kept = before.shape();
    let mut model = network.range_model.clone().with_further(shape)?;
    let FurtherTerms { spline, polynomial, surface } = before;
    if kept.spline_knots == shape.spline_knots {
        model.further.spline = spline;
    }
    if kept.polynomial == shape.polynomial {
        model.further.polynomial = polynomial;
    }
    if kept.surface == shape.surface {
        model.further.surface = surface;
    }
    model.validate()?;
    network.range_model = model;
    Ok(())
}

/// Smallest and largest range that takes part.
fn observed_span(network: &Network, options: &CalibrationOptions) -> Result<[f64; 2]> {
    let ranged = ranged_stations(network, options);
    let ranges = network.sightings.iter().filter(|seen| ranged[seen.station]).filter_map(|seen| seen.range_m);
    let [low, high] = ranges.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], r| [low.min(r), high.max(r)]);
    if low < high {
        return Ok([low, high]);
    }
    let needs = "it needs different ranges for a polynomial over them".to_owned();
    Err(Error::MethodNeeds { method: options.method.name().to_owned(), needs })
}

/// A term is one of the camera's, of the amplitude hyperbola, or one that the range model is linear in.
fn check_term(network: &Network, name: &str) -> Result<()> {
    let model = &network.range_model;
    let range = model.parameter_names();
    if camera_names().contains(&name) || AmplitudeHyperbola::NAMES.contains(&name) || range.iter().any(|n| n == name) {
        return Ok(());
    }
    let instead = |first: String, reason| {
        let second = name.to_owned();
        Err(Error::ConflictingTerms { first, second, reason })
    };
    if let Some(spline) = model.further.spline.as_ref().filter(|_| SINES.contains(&name)) {
        return instead(format!("spline{}", spline.knots()), "a spline stands instead of the sines d2 to d7");
    }
    if let Some(surface) = model.further.surface.as_ref().filter(|_| DELAYS.contains(&name)) {
        return instead(format!("surface{}", surface.shape().order), "a surface stands instead of e1 and e2");
    }
    let fixed = camera_names().into_iter().chain(RangeTerms::NAMES).chain(AmplitudeHyperbola::NAMES);
    let mut known: Vec<String> = fixed.map(str::to_owned).collect();
    known.extend(range.into_iter().filter(|name| !RangeTerms::NAMES.contains(&name.as_str())));
    known.extend(["splineN", "polynomialN", "surfaceN"].map(str::to_owned));
    let what = "the list of terms".to_owned();
    Err(NetworkError::UnknownName { what, kind: "term", name: name.to_owned(), known: known.join(" ") }.into())
}

#[cfg(test)]
mod tests {
    use super::Word;

    #[test]
    fn words_and_what_looks_like_them() {
        assert_eq!(Word::parse("spline12"), Some(Word::Spline(12)));
        assert_eq!(Word::parse("polynomial3"), Some(Word::Polynomial(3)));
        assert_eq!(Word::parse("surface2"), Some(Word::Surface(2)));
        for name in ["spline", "spline-1", "splines", "s12", "d0", "surface2.5", ""] {
            assert_eq!(Word::parse(name), None, "{name}");
        }
        assert!(Word::Spline(8).owns("s3") && !Word::Spline(8).owns("spline8") && !Word::Spline(8).owns("q1"));
    }
}
