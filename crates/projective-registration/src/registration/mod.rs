//! Two frames brought together, and whether that can be trusted.

pub(crate) mod aligner;
pub(crate) mod apart;
pub(crate) mod consistency;
pub(crate) mod misfit;
pub(crate) mod outlines;
pub(crate) mod places;
pub(crate) mod products;
pub(crate) mod quality;
pub(crate) mod search;
pub(crate) mod settling;
