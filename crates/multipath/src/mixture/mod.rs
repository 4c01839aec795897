//! Mixed pixels and the surfaces around them.

pub(crate) mod mixed;
pub(crate) mod split;
pub(crate) mod surfaces;
