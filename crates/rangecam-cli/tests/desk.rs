//! Commands one after the other in a folder of their own.

use std::path::PathBuf;
use std::process::Command;

/// A folder to work in.
pub struct Desk(tempfile::TempDir);

impl Desk {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Runs a command with paths of the desk in the places of `@name`, and returns its result.
    pub fn rangecam(&self, line: &str) -> serde_json::Value {
        let word =
            |word: &str| word.strip_prefix('@').map_or(word.to_owned(), |name| self.path(name).display().to_string());
        let arguments: Vec<String> = line.split(' ').map(word).chain(["--json".to_owned()]).collect();
        let output = Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap();
        let code = output.status.code();
        assert!(code == Some(0) || code == Some(1), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }
}
