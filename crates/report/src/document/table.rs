//! Tables with units in their heads.

/// A table: columns, and rows of cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: Vec<Vec<String>>,
}

/// What stands in the head of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    header: String,
    unit: &'static str,
    alignment: Alignment,
}

/// On which side of its column a cell stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// On the left: words.
    Left,
    /// On the right: numbers of as many decimals.
    Right,
    /// On the left where any cell of the column is words.
    ByCells,
}

impl Table {
    /// A table; a row may have fewer cells than there are columns.
    pub fn new<C: Into<Column>>(columns: impl IntoIterator<Item = C>, rows: Vec<Vec<String>>) -> Self {
        Self { columns: columns.into_iter().map(Into::into).collect(), rows }
    }

    /// Whether a column stands on the left.
    pub(crate) fn is_of_words(&self, column: usize) -> bool {
        match self.columns[column].alignment {
            Alignment::Left => true,
            Alignment::Right => false,
            Alignment::ByCells => self.rows.iter().filter_map(|row| row.get(column)).any(|cell| is_word(cell)),
        }
    }
}

impl Column {
    /// A column of words.
    pub fn words(header: impl Into<String>) -> Self {
        Self { header: header.into(), unit: "", alignment: Alignment::Left }
    }

    /// A column of numbers without a unit.
    pub fn number(header: impl Into<String>) -> Self {
        Self { header: header.into(), unit: "", alignment: Alignment::Right }
    }

    /// The same numbers in a unit, which stands in the head.
    #[must_use]
    pub fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Header with unit.
    pub(crate) fn head(&self) -> String {
        match self.unit {
            "" => self.header.clone(),
            unit => format!("{} ({unit})", self.header),
        }
    }
}

impl<T: Into<String>> From<T> for Column {
    /// A column whose cells say whether they are words or numbers with their units.
    fn from(header: T) -> Self {
        Self { header: header.into(), unit: "", alignment: Alignment::ByCells }
    }
}

/// Whether a cell is words rather than a number with its unit.
fn is_word(cell: &str) -> bool {
    let letters = cell.chars().filter(|c| c.is_alphabetic()).count();
    let digits = cell.chars().filter(char::is_ascii_digit).count();
    cell.chars().next().is_some_and(char::is_alphabetic) || letters > digits
}

/// A length in millimetres, a dash where there is none.
pub fn millimetres(length_m: Option<f64>) -> String {
    match length_m {
        Some(length) if length.is_finite() => format!("{:.2} mm", 1e3 * length),
        _ => "-".to_owned(),
    }
}

/// A number with so many decimals; one that rounds to zero has no sign: `0.0`, not `-0.0`.
pub fn rounded(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = !text.contains(|c: char| c.is_ascii_digit() && c != '0');
    match text.strip_prefix('-') {
        Some(unsigned) if is_zero && value.is_finite() => unsigned.to_owned(),
        _ => text,
    }
}
