//! Drawn pictures of targets, seen straight on.

use std::path::Path;

use png::{BitDepth, ColorType, Encoder};
use target_tasks::targets::{CodedOptions, codes};

const SIZE: [usize; 2] = [640, 480];

/// Writes the picture of `is_bright(col, row)`, the mean over each pixel.
fn write(path: &Path, is_bright: impl Fn(f64, f64) -> bool) {
    let part = |col: usize, row: usize| {
        let at = |k: usize| (k as f64 + 0.5) / 4.0 - 0.5;
        let bright = (0..16).filter(|k| is_bright(col as f64 + at(k % 4), row as f64 + at(k / 4))).count();
        (20 + 13 * bright + (col * 7 + row * 13) % 3) as u8
    };
    let bytes: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(|k| part(k % SIZE[0], k / SIZE[0])).collect();
    let mut encoder = Encoder::new(std::fs::File::create(path).unwrap(), SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

/// A checkerboard of 9 x 6 inner corners on white.
pub fn write_board(path: &Path) {
    write(path, |col, row| {
        let (i, j) = (((col - 120.0) / 40.0).floor(), ((row - 100.0) / 40.0).floor());
        let inside = (0.0..10.0).contains(&i) && (0.0..7.0).contains(&j);
        !(inside && (i + j) % 2.0 == 0.0)
    });
}

/// Twelve coded rings.
pub fn write_rings(path: &Path) {
    let all = codes(CodedOptions::default().bits).unwrap();
    write(path, |col, row| {
        let (i, j) = ((col / 160.0).floor().clamp(0.0, 3.0), (row / 160.0).floor().clamp(0.0, 2.0));
        let (x, y) = (col - 160.0 * i - 80.0, row - 160.0 * j - 80.0);
        let parts = x.hypot(y) / 14.0;
        let sector = y.atan2(x).rem_euclid(std::f64::consts::TAU) * 14.0 / std::f64::consts::TAU;
        let code = all[(4.0 * j + i) as usize];
        parts < 1.0 || ((2.0..3.0).contains(&parts) && code.is_set(sector as usize))
    });
}
