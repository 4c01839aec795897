//! Squares of the image: where pixels that do not hold and contradictions gather.

/// Side of a tile, pixels: large enough that a window around it shows surfaces, small enough that two windows a frame are cheap.
pub(crate) const TILE: usize = 64;
/// Contradictions of a tile, beyond those that the tree left in it, and pixels without a count, from which on it is solved: less
/// are single pixels at edges. A choice; a larger number leaves small objects with guesses until the next refresh.
const LEAST: u32 = 24;

/// Frames until the contradictions of a tile that was solved are looked at again: where a true jump of a whole interval moves
/// through the image, they come anew with every frame. A choice, a third of a second at 30 Hz.
const PAUSE: u32 = 10;

/// Figures of all tiles.
#[derive(Debug, Default)]
pub(crate) struct Tiles {
    pub columns: usize,
    pub rows: usize,
    /// Links that contradict.
    pub contradictions: Vec<u32>,
    /// What the tree left: true jumps of a whole interval look the same.
    accepted: Vec<u32>,
    /// Pixels without a count.
    pub open: Vec<u32>,
    /// Tiles to be solved, the worst first.
    pub order: Vec<usize>,
    /// Frame in which each was solved last, so that all get their turn.
    solved: Vec<u32>,
}

impl Tiles {
    pub fn resize(&mut self, width: usize, height: usize) {
        (self.columns, self.rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let count = self.columns * self.rows;
        for plane in [&mut self.contradictions, &mut self.accepted, &mut self.open, &mut self.solved] {
            plane.clear();
            plane.resize(count, 0);
        }
        self.order.clear();
        self.order.reserve(count);
    }

    pub fn clear(&mut self) {
        self.contradictions.fill(0);
        self.open.fill(0);
    }

    /// Tile of a pixel.
    pub fn of(&self, pixel: usize, width: usize) -> usize {
        pixel / width / TILE * self.columns + pixel % width / TILE
    }

    /// Lists the tiles that have to be solved: those that waited longest first, then the worst.
    pub fn rank(&mut self, frame: u32) {
        let Self { contradictions, accepted, open, order, solved, .. } = self;
        let contradicting = |tile: usize| {
            let rested = frame >= solved[tile].saturating_add(PAUSE);
            if rested { contradictions[tile].saturating_sub(accepted[tile]) } else { 0 }
        };
        let badness = |tile: usize| open[tile].max(contradicting(tile));
        order.clear();
        order.extend((0..open.len()).filter(|&tile| badness(tile) >= LEAST));
        order.sort_unstable_by_key(|&tile| (solved[tile], std::cmp::Reverse(badness(tile)), tile));
    }

    /// Notes that a tile was solved in this frame; what contradicts in it is accepted when it was counted next.
    pub fn settle(&mut self, tile: usize, frame: u32) {
        self.solved[tile] = frame;
        self.accepted[tile] = u32::MAX;
    }

    /// Notes that the tree solved all of them.
    pub fn settle_all(&mut self) {
        self.solved.fill(0);
        // What the tree left is looked at from the next frame on.
        self.accepted.fill(u32::MAX);
    }

    /// Takes what was counted for accepted in the tiles that were solved in the frame before.
    pub fn accept(&mut self) {
        for (accepted, found) in self.accepted.iter_mut().zip(&self.contradictions) {
            // Where less is left than was accepted, less is accepted.
            *accepted = (*accepted).min(*found);
        }
    }
}
