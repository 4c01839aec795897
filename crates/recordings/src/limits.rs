//! How much of a recording is believed and held in memory.
//!
//! Beside these, nothing is allocated that the file's own length does not account for: a number in a header counts for no
//! more than the bytes behind it can hold.

/// Bytes of one message, and of one chunk before and after it is expanded: an image of 8192 x 8192 pixels with 16 bytes
/// each. Recorders write chunks of some megabytes.
pub const LARGEST_RECORD: u64 = 1 << 30;

/// Streams of a recording: what a 16-bit number can count, which is what MCAP's channels have.
pub const MOST_STREAMS: usize = 1 << 16;

/// Attachments of a recording that are kept.
pub const MOST_ATTACHMENTS: usize = 1024;

/// Bytes of an attachment that is kept; a factory calibration has some ten thousand.
pub const LARGEST_ATTACHMENT: u64 = 1 << 24;

/// Bytes of all attachments that are kept.
pub const LARGEST_ATTACHMENTS: u64 = 1 << 27;

/// Properties of a recording (tags, metadata) that are kept.
pub const MOST_PROPERTIES: usize = 4096;

/// Bytes of a name, a tag or the value of one that is kept.
pub const LONGEST_TEXT: usize = 1 << 16;

/// Faults that are kept in words; further ones are counted.
pub const MOST_FAULTS: usize = 100;

/// Columns times rows of an image: 8192 x 8192, sixteen times the largest range camera's.
pub const MOST_PIXELS: u64 = 1 << 26;
