//! Digests of what was read, so that a result can be held against its inputs.

use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::{Error, Result};

/// One file that was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputDigest {
    /// The file, by the name under which it was read.
    pub file: String,
    /// Its length.
    pub bytes: u64,
    /// Its SHA-256, 64 hexadecimal digits.
    pub sha256: String,
}

impl InputDigest {
    /// Reads a file, in pieces.
    ///
    /// # Errors
    /// [`Error::Access`] and those of opening it.
    pub fn of(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let (mut file, bytes) = range_io::open(path)?;
        let mut hasher = Sha256::new();
        let mut buffer = vec![0; 1 << 16];
        loop {
            let read = file.read(&mut buffer).map_err(|source| Error::Access { path: path.to_owned(), source })?;
            if read == 0 {
                break;
            }
            hasher.update(&buffer[..read]);
        }
        Ok(Self { file: path.display().to_string(), bytes, sha256: format!("{:x}", hasher.finalize()) })
    }
}
