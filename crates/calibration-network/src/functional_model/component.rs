//! Kinds of observed values.

/// What was observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Component {
    /// Column of an image point, pixel.
    Col,
    /// Row of an image point, pixel.
    Row,
    /// Range, metre.
    Range,
    /// Column in the passive camera, pixel.
    PassiveCol,
    /// Row in the passive camera, pixel.
    PassiveRow,
    /// Known distance, metre.
    Distance,
    /// Control coordinate or pose component, metre or radian.
    Control,
    /// What cameras show of a term that the automatic choice estimates: zero, in the unit of the term.
    Term,
}

impl Component {
    /// Name of the group of such values.
    pub fn name(self) -> &'static str {
        match self {
            Self::Col => "col",
            Self::Row => "row",
            Self::Range => "range",
            Self::PassiveCol => "passive_col",
            Self::PassiveRow => "passive_row",
            Self::Distance => "distance",
            Self::Control => "control",
            Self::Term => "term",
        }
    }
}
