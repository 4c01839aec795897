use std::fmt;

/// A direction in the space of the unknowns: parameters and how much each takes part.
///
/// Weights are free of units: each parameter is measured in the standard deviation that it would have if all others
/// were known. They are scaled so that the largest is ±1, and only those of at least 0.05 are listed, largest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// Parameter name and weight.
    pub terms: Vec<(String, f64)>,
}

/// Weights below this share of the largest are not listed.
const SMALLEST: f64 = 0.05;

impl Combination {
    /// From weights of all unknowns.
    pub(crate) fn new(weights: &[f64], names: &[String]) -> Self {
        let largest = weights.iter().fold(0.0_f64, |a, &b| if b.abs() > a.abs() { b } else { a });
        let scaled = weights.iter().zip(names).map(|(w, name)| (name.clone(), w / largest));
        let mut terms: Vec<_> = scaled.filter(|(_, w)| w.abs() >= SMALLEST).collect();
        terms.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        Self { terms }
    }

    /// A basis of the same space that is easy to read: each direction with a parameter of its own, by elimination with
    /// full pivoting.
    pub(crate) fn basis(mut directions: Vec<Vec<f64>>, names: &[String]) -> Vec<Self> {
        for index in 0..directions.len() {
            let entries = directions[index..].iter().enumerate();
            let largest = entries
                .flat_map(|(row, d)| d.iter().enumerate().map(move |(column, w)| (row, column, w.abs())))
                .fold((0, 0, 0.0), |best, next| if next.2 > best.2 { next } else { best });
            let (row, column, size) = largest;
            if size == 0.0 {
                break;
            }
            directions.swap(index, index + row);
            let pivot: Vec<f64> = directions[index].iter().map(|w| w / directions[index][column]).collect();
            for (other, direction) in directions.iter_mut().enumerate() {
                let share = if other == index { 0.0 } else { direction[column] };
                direction.iter_mut().zip(&pivot).for_each(|(w, p)| *w -= share * p);
            }
            directions[index] = pivot;
        }
        directions.iter().map(|direction| Self::new(direction, names)).collect()
    }

    pub(crate) fn list(combinations: &[Self]) -> String {
        let mut parts: Vec<String> = combinations.iter().take(7).map(ToString::to_string).collect();
        if combinations.len() > 7 {
            parts.push(format!("and {} more", combinations.len() - 7));
        }
        parts.join("; ")
    }
}

impl fmt::Display for Combination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, weight)) in self.terms.iter().take(8).enumerate() {
            match (index, *weight >= 0.0) {
                (0, true) => write!(f, "{weight:.2} {name}")?,
                (0, false) => write!(f, "-{:.2} {name}", -weight)?,
                (_, true) => write!(f, " + {weight:.2} {name}")?,
                (_, false) => write!(f, " - {:.2} {name}", -weight)?,
            }
        }
        if self.terms.len() > 8 {
            write!(f, " + {} more", self.terms.len() - 8)?;
        }
        Ok(())
    }
}
