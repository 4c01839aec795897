/// Why a stream of frames, or one of its frames, is refused. Positions are bytes from the beginning of the stream.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A field of a header with a value that means nothing.
    #[error("byte {position}: {field} is {found}, expected {expected}")]
    Field {
        /// Where the field stands.
        position: u64,
        /// The field.
        field: &'static str,
        /// What it holds.
        found: String,
        /// What it should hold.
        expected: String,
    },
    /// The stream ends within a frame.
    #[error("byte {position}: the stream ends within a frame, {missing} of its {length} bytes are missing")]
    CutOff {
        /// Where the stream ends.
        position: u64,
        /// Bytes that are missing.
        missing: u64,
        /// Bytes of the header, or of the samples, that is cut off.
        length: u64,
    },
    /// More bytes than one frame in a file that holds one.
    #[error("byte {position}: more bytes behind the frame, expected one frame a file")]
    MoreThanOne {
        /// Where the frame ends.
        position: u64,
    },
    /// Samples that the memory has no room for.
    #[error("byte {position}: no memory for {length} bytes of samples")]
    Memory {
        /// Where the samples begin.
        position: u64,
        /// Their bytes.
        length: u64,
    },
    /// The system's word.
    #[error("byte {position}: cannot be read: {source}")]
    Read {
        /// Up to where it was read.
        position: u64,
        /// Why not further.
        source: std::io::Error,
    },
}

pub(crate) type Result<T> = std::result::Result<T, FrameError>;
