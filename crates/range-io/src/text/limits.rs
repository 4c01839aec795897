//! How much of a file is believed and read: all limits of the readers in one place (the table in `docs/formats.md`).
//!
//! Beside these, nothing is allocated that the file's own length does not account for: a number in a header counts for no
//! more than the bytes behind it can hold.

/// Columns times rows of an image: 8192 x 8192, sixteen times the largest range camera's.
pub const MOST_PIXELS: usize = 1 << 26;

/// Modulation frequencies of a survey; cameras have up to nine.
pub const MOST_FREQUENCIES: usize = 64;

/// Phase steps of a survey; cameras have three to sixteen.
pub const MOST_PHASE_STEPS: usize = 1024;

/// Bytes of a RON or JSON file: a calibration with an offset and a deviation for each of eight million pixels.
pub const LONGEST_RON: u64 = 1 << 28;

/// Bytes of a table, a trajectory or another text that is held in memory: a day of an inertial unit at 100 Hz.
pub const LONGEST_TEXT: u64 = 1 << 30;

/// Rows of a table: an hour of an inertial unit at 2 kHz. A row takes about 250 bytes of memory.
pub const MOST_ROWS: usize = 1 << 23;

/// Bytes of a VTK file, which is read as a whole.
pub const LONGEST_VTK: u64 = 1 << 32;

/// Bytes of a line of a point list or of a header. A line of numbers has some hundred.
pub const LONGEST_LINE: u64 = 1 << 16;

/// Lines of the header of a point cloud.
pub const MOST_HEADER_LINES: usize = 10_000;

/// Bytes of one point of a PCD file: more than any descriptor fills.
pub const LONGEST_POINT: usize = 1 << 20;

/// Bytes of the header of an array (`.npy`); numpy's own take 118.
pub const LONGEST_ARRAY_HEADER: usize = 1 << 16;

/// Bytes that deflate makes of one: it codes at most 258 bytes in two bits.
pub const LARGEST_DEFLATION: u64 = 1032;

/// Tracks of a recording; an Azure Kinect writes four.
pub const MOST_TRACKS: usize = 256;

/// Attachments of a recording.
pub const MOST_ATTACHMENTS: usize = 1024;

/// Bytes of an attachment that is read; a factory calibration has some ten thousand.
pub const LONGEST_ATTACHMENT: u64 = 1 << 24;

/// Images of a recording: six days at 30 Hz.
pub const MOST_IMAGES: usize = 1 << 24;

/// Scans of an E57 file.
pub const MOST_SCANS: usize = 1 << 16;

/// Parameters of one list in a calibration: its terms are some tens, a periodic spline has a few hundred knots at most.
pub const MOST_PARAMETERS: usize = 10_000;
