//! A folder that goes with the test, and a cloud with everything.
#![allow(dead_code, clippy::unwrap_used)]

use std::path::PathBuf;

use range_io::ply::CloudFile;

/// A temporary folder.
pub struct Scratch(tempfile::TempDir);

impl Scratch {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A file that holds these bytes.
    pub fn holding(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let file = self.file(name);
        std::fs::write(&file, bytes).unwrap();
        file
    }
}

/// A cloud with a value in every column.
pub fn cloud(points: usize) -> CloudFile {
    let value = |index: usize| index as f32 * 0.37 - 5.0;
    CloudFile {
        points: (0..points).map(|i| [i as f64 * 0.1, -(i as f64) / 3.0, 1e-3 * i as f64]).collect(),
        normals: Some((0..points).map(|i| [value(i), 0.5, 1.0]).collect()),
        intensity: Some((0..points).map(value).collect()),
        sigma: Some((0..points).map(|i| if i % 3 == 0 { 0.002 } else { 0.01 }).collect()),
        flags: Some((0..points).map(|i| i as u16).collect()),
        frame: Some((0..points).map(|i| u32::MAX - i as u32).collect()),
        covariance: Some((0..points).map(|i| std::array::from_fn(|term| value(i + term))).collect()),
        ..CloudFile::default()
    }
}
