//! Documents as text and as pages.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used, missing_docs)]

mod documents;
mod figures;
