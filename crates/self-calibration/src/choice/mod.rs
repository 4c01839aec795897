//! Which terms are estimated.

pub(crate) mod auto_terms;
pub(crate) mod hyperbola;
pub(crate) mod selection;
pub(crate) mod term_words;
