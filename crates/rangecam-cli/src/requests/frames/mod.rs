//! Arguments of what works on frames as a camera delivers them.

pub(crate) mod convert_arguments;
pub(crate) mod explain_arguments;
pub(crate) mod live_arguments;
