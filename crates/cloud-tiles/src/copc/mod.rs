//! The file: LAS 1.4 with packed chunks of one node each, and where each of them lies.
//!
//! After the specification of COPC 1.0 and of LAS 1.4 (revision 15).

mod head;
mod writer;

pub(crate) use writer::CopcWriter;
