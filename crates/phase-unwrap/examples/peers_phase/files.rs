//! Planes in files.

use std::error::Error;
use std::path::Path;

use range_image::Raster;

use crate::{Outcome, Size};

pub fn write(folder: &str, name: &str, plane: &Raster<f32>) -> Outcome {
    save(folder, name, plane.as_slice().iter().flat_map(|value| value.to_ne_bytes()).collect())
}

pub fn write_counts(folder: &str, name: &str, plane: &Raster<i32>) -> Outcome {
    save(folder, name, plane.as_slice().iter().flat_map(|value| value.to_ne_bytes()).collect())
}

fn save(folder: &str, name: &str, bytes: Vec<u8>) -> Outcome {
    std::fs::create_dir_all(folder)?;
    Ok(std::fs::write(Path::new(folder).join(name), bytes)?)
}

pub fn read(folder: &str, name: &str, [width, height]: Size) -> Result<Raster<f32>, Box<dyn Error>> {
    let path = Path::new(folder).join(name);
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let values = bytes.as_chunks::<4>().0.iter().map(|&bytes| f32::from_ne_bytes(bytes)).collect();
    Ok(Raster::from_vec(width, height, values)?)
}
