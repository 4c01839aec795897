//! Whether a pattern raises the precision of walls that it was not estimated from.

use statistics::Distribution;

use super::PatternOptions;
use super::estimate::pattern_of;
use super::residuals::{Residuals, Walls};

/// What was held out in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PatternSplit {
    /// The frames of one station after the other.
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

impl HeldOutTest {
    pub(super) fn new(walls: &Walls, width: usize, options: &PatternOptions) -> Self {
        let mut sums = Sums::default();
        let mut blocks: Vec<f64> = Vec::new();
        for held in 0..walls.averaged.len() {
            let others: Vec<&Residuals> = walls
                .averaged
                .iter()
                .enumerate()
                .filter(|(wall, _)| *wall != held)
                .map(|(_, residuals)| residuals)
                .collect();
            let pattern = pattern_of(&others);
            let falls = sums.add(&walls.averaged[held], &pattern.values_m);
            add_to_blocks(&mut blocks, &falls, width, options.block);
            for (frame, _) in walls.frames.iter().zip(&walls.wall_of).filter(|(_, wall)| **wall == held) {
                sums.add_frame(frame, &pattern.values_m);
            }
        }
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
#[derive(Default)]
struct Sums {
    walls: [f64; 3],
    frames: [f64; 3],
}

impl Sums {
    /// Adds a wall; the fall of each pixel's squared residual, NaN where there is none.
    fn add(&mut self, wall: &Residuals, pattern: &[f64]) -> Vec<f64> {
        let fall = |(value, offset): (&f64, &f64)| {
            let (without, with) = (value * value, (value - offset).powi(2));
            if with.is_finite() {
                self.walls = [self.walls[0] + without, self.walls[1] + with, self.walls[2] + 1.0];
            }
            without - with
        };
        wall.values_m.iter().zip(pattern).map(fall).collect()
    }

    fn add_frame(&mut self, frame: &Residuals, pattern: &[f64]) {
        for (value, offset) in frame.values_m.iter().zip(pattern) {
            let (without, with) = (value * value, (value - offset).powi(2));
            if with.is_finite() {
                self.frames = [self.frames[0] + without, self.frames[1] + with, self.frames[2] + 1.0];
            }
        }
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
