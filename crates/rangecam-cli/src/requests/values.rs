//! Values as they are typed: a number that means nothing is refused where it stands.

use std::str::FromStr;

/// A finite number.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    number(text, |_| true, "a finite number")
}

/// A finite number above zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    number(text, |value| value > 0.0, "a positive number")
}

/// A finite number, zero or above.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |value| value >= 0.0, "a number that is not negative")
}

/// A whole number above zero.
pub(crate) fn at_least_one(text: &str) -> Result<usize, String> {
    text.trim().parse().ok().filter(|number| *number > 0).ok_or_else(|| "expected a whole number from 1".to_owned())
}

/// A part of a whole.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    number(text, |value| (0.0..=1.0).contains(&value), "a part from 0 to 1")
}

fn number(text: &str, holds: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite() && holds(*value));
    value.ok_or_else(|| format!("expected {expected}"))
}

/// Three finite numbers between commas.
pub(crate) fn lengths(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, String> = text.split(',').map(finite).collect();
    numbers?.try_into().map_err(|_| "expected three numbers between commas".to_owned())
}

/// `auto`, or names between commas or blanks.
pub(crate) fn terms(text: &str) -> Result<Terms, String> {
    if text.trim() == "auto" {
        return Ok(Terms(None));
    }
    let mut names: Vec<String> = Vec::new();
    for name in text.split([',', ' ']).map(str::trim).filter(|name| !name.is_empty()) {
        if names.iter().any(|earlier| earlier == name) {
            return Err(format!("`{name}` is given twice"));
        }
        names.push(name.to_owned());
    }
    if names.is_empty() {
        Err("expected names of terms, such as c,d0, or `auto`".to_owned())
    } else {
        Ok(Terms(Some(names)))
    }
}

/// Names of terms; `None`: chosen by the command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Terms(pub(crate) Option<Vec<String>>);

/// A name that is not empty, and that a page or a terminal can show.
pub(crate) fn name(text: &str) -> Result<String, String> {
    let name = text.trim();
    let good = !name.is_empty() && !name.contains(char::is_control);
    if good { Ok(name.to_owned()) } else { Err("expected a name without control characters".to_owned()) }
}

/// Whole numbers between commas.
pub(crate) fn whole<const N: usize>(text: &str) -> Option<[usize; N]> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(|word| usize::from_str(word.trim())).collect();
    numbers.ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_can_be_shown() {
        assert_eq!(name(" A. Name ").as_deref(), Ok("A. Name"));
        for bad in ["", "  ", "A\u{1b}[31m", "A\nB"] {
            assert!(name(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn numbers_that_mean_nothing_are_refused() {
        for text in ["nan", "NaN", "inf", "-inf", "1e999", "", "x", "-1"] {
            assert!(not_negative(text).is_err() && positive(text).is_err() && share(text).is_err(), "{text}");
        }
        assert!(positive("0").is_err() && share("1.01").is_err() && finite("inf").is_err());
        assert_eq!((not_negative("0"), share("1"), finite("-2.5")), (Ok(0.0), Ok(1.0), Ok(-2.5)));
    }

    #[test]
    fn lengths_are_three() {
        assert_eq!(lengths("0.1,-2, 3"), Ok([0.1, -2.0, 3.0]));
        assert!(["", "1,2", "1,2,3,4", "1,nan,2"].iter().all(|text| lengths(text).is_err()));
    }

    #[test]
    fn terms_are_auto_or_names() {
        assert_eq!(terms(" auto "), Ok(Terms(None)));
        assert_eq!(terms("c,d0 k1"), Ok(Terms(Some(["c", "d0", "k1"].map(str::to_owned).to_vec()))));
        assert!(terms("").is_err() && terms(" , ").is_err() && terms("c,d0,c").is_err());
    }
}
