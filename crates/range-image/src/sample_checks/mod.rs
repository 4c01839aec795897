//! Whether the samples of a pixel fit each other.

pub(crate) mod beat;
pub(crate) mod consistency;
pub(crate) mod interference;
pub(crate) mod plateau;
pub(crate) mod rules_loop;
pub(crate) mod sample_rules;
