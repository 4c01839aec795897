//! Chunks: records that were compressed together.

use std::io::Read;

#[cfg(feature = "mcap")]
use ruzstd::decoding::StreamingDecoder;

use crate::limits::LARGEST_RECORD;

/// Bytes that a Zstandard frame may refer back by, which are held beside what it becomes: those of its levels up to 19 are
/// 8 MiB.
#[cfg(feature = "mcap")]
const LARGEST_WINDOW: u64 = 1 << 25;

/// How a chunk is compressed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Lz4,
    #[cfg(feature = "mcap")]
    Zstd,
    Other(String),
}

/// What came out of a chunk: all of it, or what stands before the place where it breaks off.
pub(super) struct Expanded {
    pub bytes: Vec<u8>,
    pub fault: Option<String>,
}

/// Expands a chunk that states what it becomes. What is wrong does not take away what came before it.
pub(super) fn expand(compression: &Compression, compressed: Vec<u8>, stated: u64) -> Expanded {
    let source = compressed.as_slice();
    let (bytes, fault) = match compression {
        Compression::None => (compressed, None),
        Compression::Lz4 => drain(lz4_flex::frame::FrameDecoder::new(source), stated),
        #[cfg(feature = "mcap")]
        Compression::Zstd => match StreamingDecoder::new_with_max_window_size(source, LARGEST_WINDOW) {
            Ok(decoder) => drain(decoder, stated),
            Err(error) => (Vec::new(), Some(error.to_string())),
        },
        Compression::Other(name) => (Vec::new(), Some(format!("is compressed as `{name}`, which is not read"))),
    };
    let found = bytes.len() as u64;
    let fault = fault.or_else(|| (found != stated).then(|| format!("has {found} bytes, {stated} were stated")));
    Expanded { bytes, fault }
}

/// Everything that a decoder gives before it ends or fails, and not much more than was stated.
fn drain(mut decoder: impl Read, stated: u64) -> (Vec<u8>, Option<String>) {
    // Memory grows with what comes, not with what is stated.
    let (mut bytes, mut part) = (Vec::<u8>::new(), vec![0; 1 << 16]);
    let most = stated.min(LARGEST_RECORD);
    loop {
        match decoder.read(&mut part) {
            Ok(0) => return (bytes, None),
            Ok(count) => {
                if bytes.try_reserve(count).is_err() {
                    return (bytes, Some("is too large for this machine's memory".to_owned()));
                }
                bytes.extend_from_slice(&part[..count]);
            }
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return (bytes, Some(error.to_string())),
        }
        if bytes.len() as u64 > most {
            return (bytes, Some(format!("has more than the {most} bytes that were stated or may be")));
        }
    }
}
