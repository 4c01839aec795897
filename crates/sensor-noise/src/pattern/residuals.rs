//! What the ranges of walls leave beside their planes, summed up frame by frame: by pixel for what counts as one wall.

use camera_model::Camera;
use primitives::{PrimitiveFit, PrimitiveKind, fit_whatever_shape};
use range_image::RangeFrame;
use rayon::prelude::*;

use super::mean::robust_mean;
use super::{PatternOptions, WallQuality};
use crate::{Error, Result};

/// Pixels of all walls together, about: each takes 20 bytes, and more than 200 walls of 640 x 480 pixels tell a pattern no
/// better than means of neighbouring ones do.
const MOST_PIXELS: usize = 62_000_000;

/// Walls at most, however small: an offset is then known to a sixteenth of what one wall tells, and a gross error is one of 256 values.
/// Twice as many take twice the memory and the time, which is that of twenty robust means of each pixel.
const MOST_WALLS: usize = 256;

/// Residuals of what counts as one wall: of a station, or of a frame where there is one station; of several neighbouring ones
/// where there are more than can be kept.
struct Wall {
    sums_m: Vec<f64>,
    variances: Vec<f64>,
    frames: Vec<u32>,
}

impl Wall {
    fn new(pixels: usize) -> Self {
        Self { sums_m: vec![0.0; pixels], variances: vec![0.0; pixels], frames: vec![0; pixels] }
    }

    /// Mean residual of a pixel and its variance; `None` where no frame shows the wall.
    fn mean(&self, pixel: usize) -> Option<(f64, f64)> {
        let frames = f64::from(self.frames[pixel]);
        (frames > 0.0).then(|| (self.sums_m[pixel] / frames, self.variances[pixel] / (frames * frames)))
    }
}

/// All walls.
pub(super) struct Walls {
    all: Vec<Wall>,
    /// Names of the frames' stations, and the wall that each frame belongs to.
    stations: Vec<String>,
    wall_of: Vec<usize>,
    /// Squared residuals of single frames, by pixel.
    squares: Vec<f64>,
    pub(super) quality: Vec<WallQuality>,
    /// Whether walls are stations.
    pub(super) of_stations: bool,
}

impl Walls {
    /// For frames of these stations, of so many pixels.
    pub(super) fn new(stations: Vec<String>, pixels: usize) -> Result<Self> {
        if let [] | [_] = stations.as_slice() {
            let station = stations.first().cloned().unwrap_or_default();
            return Err(Error::TooFewFrames { station, frames: stations.len(), needed: 2 });
        }
        let mut numbers = std::collections::BTreeMap::new();
        let number = |station: &String| {
            let next = numbers.len();
            *numbers.entry(station.clone()).or_insert(next)
        };
        let station_of: Vec<usize> = stations.iter().map(number).collect();
        let of_stations = numbers.len() > 1;
        let named = if of_stations { numbers.len() } else { stations.len() };
        let count = named.min((MOST_PIXELS / pixels.max(1)).clamp(2, MOST_WALLS));
        let place = |(frame, station): (usize, &usize)| if of_stations { *station } else { frame } * count / named;
        let wall_of: Vec<usize> = station_of.iter().enumerate().map(place).collect();
        let all = (0..count).map(|_| Wall::new(pixels)).collect();
        Ok(Self { all, stations, wall_of, squares: vec![0.0; pixels], quality: Vec::new(), of_stations })
    }

    /// What the walls take, byte: sums, variances and frames of each pixel (20), its squares and a pattern of it (24), and what is
    /// kept of each frame.
    pub(super) fn bytes(&self) -> u64 {
        let (pixels, walls) = (self.squares.len() as u64, self.all.len() as u64);
        pixels * (20 * walls + 24) + 300 * self.stations.len() as u64
    }

    /// Fits a plane to the next frame.
    pub(super) fn add(&mut self, frame: &RangeFrame, camera: &Camera, options: &PatternOptions) -> Result<()> {
        let number = self.quality.len();
        let (Some(station), Some(wall)) = (self.stations.get(number), self.wall_of.get(number)) else {
            let (name, value) = ("frames", number as f64 + 1.0);
            return Err(Error::OutOfDomain { name, value, expected: "as many as stations were named" });
        };
        let fit = fit_whatever_shape(frame, camera, PrimitiveKind::Plane, &options.wall)?;
        let wall = &mut self.all[*wall];
        let (mut squares, mut used) = (0.0, 0_usize);
        for pixel in fit.pixels.iter().filter(|pixel| pixel.used) {
            let index = pixel.position[1] * camera.format.width + pixel.position[0];
            let residual_m = pixel.observed_m - pixel.modelled_m;
            wall.sums_m[index] += residual_m;
            wall.variances[index] += pixel.sigma_m * pixel.sigma_m;
            wall.frames[index] += 1;
            self.squares[index] += residual_m * residual_m;
            squares += residual_m * residual_m;
            used += 1;
        }
        self.quality.push(quality(station, &fit, used, squares));
        Ok(())
    }

    pub(super) fn count(&self) -> usize {
        self.all.len()
    }

    /// Mean residual of a pixel of a wall, metre, NaN where there is none, and the number of its frames.
    pub(super) fn residual_m(&self, wall: usize, pixel: usize) -> (f64, f64) {
        let wall = &self.all[wall];
        (wall.mean(pixel).map_or(f64::NAN, |(mean, _)| mean), f64::from(wall.frames[pixel]))
    }

    /// Squared residuals of single frames, by pixel.
    pub(super) fn squares(&self) -> &[f64] {
        &self.squares
    }

    /// Robust mean over some of the walls, pixel by pixel, with its standard deviation, metre; NaN where none of them shows
    /// the pixel.
    pub(super) fn pattern(&self, takes: impl Fn(usize) -> bool + Sync) -> Vec<(f64, f64)> {
        let of_pixel = |pixel: usize| {
            let walls = self.all.iter().enumerate().filter(|(wall, _)| takes(*wall));
            let values: Vec<(f64, f64)> = walls.filter_map(|(_, wall)| wall.mean(pixel)).collect();
            robust_mean(&values).unwrap_or((f64::NAN, f64::NAN))
        };
        (0..self.squares.len()).into_par_iter().with_min_len(1024).map(of_pixel).collect()
    }
}

fn quality(station: &str, fit: &PrimitiveFit, used: usize, squares: f64) -> WallQuality {
    WallQuality {
        station: station.to_owned(),
        pixels: used,
        outlier_share: fit.outlier_share(),
        residual_rms_m: (squares / used as f64).sqrt(),
        sigma0: fit.sigma0,
        systematic_sigmas: fit.systematic_sigmas,
    }
}
