//! Whether a pattern raises the precision of walls that it was not estimated from.

use statistics::Distribution;

use super::PatternOptions;
use super::residuals::Walls;

/// What was held out in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PatternSplit {
    /// The frames of one station after the other, or of several neighbouring ones.
    Stations,
    /// One frame after the other, all of the same wall from the same station: unevenness of that wall and whatever else
    /// belongs to the station passes for a pattern.
    Frames,
}

/// What the test says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PatternVerdict {
    /// Held-out walls become flatter, significantly and noticeably.
    RaisesPrecision,
    /// They become flatter by less than is worth having.
    TooLittle,
    /// Nothing shows that they become flatter.
    NoGain,
}

/// Residuals of held-out walls, without and with the pattern of the others taken off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldOutTest {
    /// What was held out.
    pub split: PatternSplit,
    /// In how many parts of neighbours: each by itself up to twenty.
    pub parts: usize,
    /// Root mean square over the walls' mean residuals, metre, as they are and with the pattern taken off.
    pub rms_m: [f64; 2],
    /// The same over the residuals of single frames.
    pub frame_rms_m: [f64; 2],
    /// Mean fall of the squared residuals of a block over its deviation, which is Student's t of `blocks − 1`.
    pub statistic: f64,
    /// Blocks of pixels.
    pub blocks: usize,
    /// Probability of so large a statistic without a pattern.
    pub probability: f64,
    /// What that means.
    pub verdict: PatternVerdict,
}

/// Parts that are held out in turn where there are more walls: each costs a pattern of the others.
const MOST_PARTS: usize = 20;

impl HeldOutTest {
    pub(super) fn new(walls: &Walls, width: usize, options: &PatternOptions) -> Self {
        let (count, pixels) = (walls.count(), walls.squares().len());
        let parts = count.min(MOST_PARTS);
        let part_of = |wall: usize| wall * parts / count;
        let mut sums = Sums::new(pixels);
        let mut blocks: Vec<f64> = Vec::new();
        for part in 0..parts {
            let pattern = walls.pattern(|wall| part_of(wall) != part);
            for wall in (0..count).filter(|wall| part_of(*wall) == part) {
                let falls = sums.add(walls, wall, &pattern);
                add_to_blocks(&mut blocks, &falls, width, options.block);
            }
        }
        sums.add_squares(walls.squares());
        // A block that no wall reaches says nothing.
        let blocks: Vec<f64> = blocks.into_iter().filter(|fall| fall.is_finite()).collect();
        let count = blocks.len() as f64;
        let mean = blocks.iter().sum::<f64>() / count;
        let variance = blocks.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let statistic = mean / (variance / count).sqrt();
        let probability = Distribution::StudentT { dof: count - 1.0 }.survival(statistic);
        let rms_m = Sums::rms(sums.walls);
        let significant = probability < options.significance;
        let noticeable = rms_m[1] < (1.0 - options.smallest_gain) * rms_m[0];
        let verdict = match (significant, noticeable) {
            (true, true) => PatternVerdict::RaisesPrecision,
            (true, false) => PatternVerdict::TooLittle,
            (false, _) => PatternVerdict::NoGain,
        };
        Self {
            split: if walls.of_stations { PatternSplit::Stations } else { PatternSplit::Frames },
            parts,
            rms_m,
            frame_rms_m: Sums::rms(sums.frames),
            statistic,
            blocks: blocks.len(),
            probability,
            verdict,
        }
    }
}

/// Sums of squares without and with, and counts.
struct Sums {
    walls: [f64; 3],
    frames: [f64; 3],
    /// Pixels that other walls have a pattern for.
    known: Vec<bool>,
}

impl Sums {
    fn new(pixels: usize) -> Self {
        Self { walls: [0.0; 3], frames: [0.0; 3], known: vec![false; pixels] }
    }

    /// Adds a wall; the fall of each pixel's squared residual, NaN where there is none.
    fn add(&mut self, walls: &Walls, wall: usize, pattern: &[(f64, f64)]) -> Vec<f64> {
        let fall = |(pixel, (offset, _)): (usize, &(f64, f64))| {
            let (value, frames) = walls.residual_m(wall, pixel);
            let (without, with) = (value * value, (value - offset).powi(2));
            if with.is_finite() {
                self.walls = [self.walls[0] + without, self.walls[1] + with, self.walls[2] + 1.0];
                // Σ (v − o)² = Σ v² + n o (o − 2 v̄); the first is added once for all walls.
                self.frames[1] += frames * offset * (offset - 2.0 * value);
                self.frames[2] += frames;
                self.known[pixel] = true;
            }
            without - with
        };
        pattern.iter().enumerate().map(fall).collect()
    }

    /// Adds the squares of single frames. A pixel that walls of two parts show has a pattern in each: all of its frames count.
    fn add_squares(&mut self, squares: &[f64]) {
        let sum: f64 = squares.iter().zip(&self.known).filter(|(_, known)| **known).map(|(square, _)| square).sum();
        self.frames[0] += sum;
        self.frames[1] += sum;
    }

    fn rms([without, with, count]: [f64; 3]) -> [f64; 2] {
        [without, with].map(|squares| (squares / count).sqrt())
    }
}

/// Adds the falls of one wall to the sums of the blocks; a block is NaN until a pixel of it has a value.
fn add_to_blocks(blocks: &mut Vec<f64>, falls: &[f64], width: usize, side: usize) {
    let across = width.div_ceil(side);
    let down = (falls.len() / width.max(1)).div_ceil(side);
    blocks.resize(across * down, f64::NAN);
    for (index, fall) in falls.iter().enumerate().filter(|(_, fall)| fall.is_finite()) {
        let block = &mut blocks[index / width / side * across + index % width / side];
        *block = if block.is_finite() { *block + fall } else { *fall };
    }
}

impl std::fmt::Display for PatternVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::RaisesPrecision => "the fixed pattern raises the precision of walls that it was not estimated from",
            Self::TooLittle => "the fixed pattern raises the precision by less than is worth having",
            Self::NoGain => "the fixed pattern does not raise the precision of walls that it was not estimated from",
        })
    }
}
