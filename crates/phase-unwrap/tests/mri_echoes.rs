//! Measured phases of three MRI echoes, in the ratio 1 : 2 : 3: unwrapped alone, they must agree.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::float_cmp)]

use std::f32::consts::{PI, TAU};
use std::path::Path;

use phase_unwrap::{SpatialOptions, unwrap_spatial};
use range_image::Raster;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/mri_romeo/small");

/// Stored values of a little-endian NIfTI-1 file of f32 with its first four dimensions; the scale is left off, since
/// the stored phases are radians already.
fn read_nifti(path: &Path) -> ([usize; 4], Vec<f32>) {
    let bytes = std::fs::read(path).unwrap();
    let short = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!((short(0), short(70)), (348, 16), "NIfTI-1 header and data type f32");
    let size = [1, 2, 3, 4].map(|axis| short(40 + 2 * axis) as usize);
    let start = float(108) as usize;
    let values = (0..size.iter().product()).map(|index| float(start + 4 * index)).collect();
    (size, values)
}

#[test]
fn echoes_two_and_three_are_multiples_of_the_first() {
    let folder = Path::new(FOLDER);
    if !folder.exists() {
        println!("skipped: no captures at {FOLDER}");
        return;
    }
    let ([width, height, slices, _], phase) = read_nifti(&folder.join("Phase.nii"));
    let (_, magnitude) = read_nifti(&folder.join("Mag.nii"));
    let (mut agree, mut pixels) = ([0.0; 2], 0.0);
    for slice in 0..slices {
        let plane = |data: &[f32], echo: usize| {
            let first = (echo * slices + slice) * width * height;
            Raster::from_vec(width, height, data[first..first + width * height].to_vec()).unwrap()
        };
        // The head: voxels of at least 30 % of the brightest; air has no phase.
        let bright = plane(&magnitude, 0);
        let limit = 0.3 * bright.as_slice().iter().copied().fold(0.0, f32::max);
        let mask = bright.map(|&value| value > limit);
        if mask.as_slice().iter().filter(|used| **used).count() < 200 {
            continue;
        }
        let unwrapped: Vec<Raster<f32>> = (0..3)
            .map(|echo| {
                let wrapped = plane(&phase, echo).map(|&value| value.rem_euclid(TAU).min(TAU));
                let found = unwrap_spatial(&wrapped, None, Some(&mask), &SpatialOptions::default()).unwrap();
                // Only the largest island is compared: counts of different islands are free of each other.
                let largest = (0..found.islands.len()).max_by_key(|&i| found.islands[i].pixels).unwrap() as u32 + 1;
                Raster::from_fn(width, height, |col, row| {
                    let value = wrapped[(col, row)] + TAU * found.wraps[(col, row)] as f32;
                    if found.island[(col, row)] == largest { value } else { f32::NAN }
                })
            })
            .collect();
        for (echo, agree) in [2, 3].into_iter().zip(&mut agree) {
            // The echoes' own offsets and whole cycles are free: the median takes them off.
            let difference =
                |index: usize| unwrapped[echo - 1].as_slice()[index] - echo as f32 * unwrapped[0].as_slice()[index];
            let mut known: Vec<f32> = (0..width * height).map(difference).filter(|d| d.is_finite()).collect();
            let middle = known.len() / 2;
            let median = *known.select_nth_unstable_by(middle, f32::total_cmp).1;
            // Within half a cycle: the right count; noise of echo 1 counts threefold in echo 3.
            *agree += known.iter().filter(|d| (**d - median).abs() < PI).count() as f64;
            pixels += if echo == 2 { known.len() as f64 } else { 0.0 };
        }
    }
    let share = agree.map(|agree| agree / pixels);
    println!("{pixels} voxels; echo 2 agrees on {:.4}, echo 3 on {:.4}", share[0], share[1]);
    assert!(pixels > 10_000.0);
    assert!(share[0] > 0.99 && share[1] > 0.98, "{share:?}");
}
