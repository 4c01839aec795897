//! The words of a ring.

use crate::error::{Error, Result};

/// Fewest and most sectors of a ring: with more, sectors of a disc of five pixels are less than two pixels wide.
const BITS: [usize; 2] = [6, 20];

/// The code of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Code {
    /// Its number among [`codes`] of as many sectors.
    pub id: usize,
    /// Its sectors, clockwise as seen from the front; bit k stands for sector k and is set where the sector has the colour of the
    /// disc. No turned ring has a smaller word.
    pub word: u32,
    /// Number of sectors.
    pub bits: usize,
}

/// Its name: `R017`.
impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "R{:03}", self.id)
    }
}

impl Code {
    /// Whether a sector has the colour of the disc.
    pub fn is_set(&self, sector: usize) -> bool {
        self.bits > 0 && self.word >> (sector % self.bits) & 1 == 1
    }
}

/// All codes of rings with so many sectors (6 to 20): half of the sectors are set (of an odd number the smaller half), and of all
/// turned rings the smallest word counts, which no turn maps to itself (so that a ring has a direction) and which is smaller than all
/// turns of its mirror image. 12 sectors have 29 codes, 14 have 113, 16 have 368.
///
/// What covers sectors by one colour, however many and wherever they are, only takes away set ones or only adds some: the number of
/// set sectors is then another, and the ring is none. To make another code, sectors must be lost and others gained. A ring in a
/// mirror is no code either.
///
/// # Errors
/// [`Error::Invalid`] for another number of sectors.
///
/// ```
/// let codes = targets::codes(14)?;
/// assert!(codes.len() == 113 && codes.iter().all(|code| code.word.count_ones() == 7));
/// # Ok::<(), targets::Error>(())
/// ```
pub fn codes(bits: usize) -> Result<Vec<Code>> {
    if !(BITS[0]..=BITS[1]).contains(&bits) {
        let expected = "a ring has 6 to 20 sectors";
        return Err(Error::Invalid { name: "bits", value: bits as f64, expected });
    }
    let all = (1_u32 << bits) - 1;
    let words = (1..all).filter(|word| word.count_ones() as usize == bits / 2 && is_code(*word, bits));
    Ok(words.enumerate().map(|(id, word)| Code { id, word, bits }).collect())
}

/// Whether a word is smaller than all its turns and those of its mirror image.
fn is_code(word: u32, bits: usize) -> bool {
    (1..bits).all(|by| word < turned(word, bits, by)) && word < mirrored(word, bits)
}

fn turned(word: u32, bits: usize, by: usize) -> u32 {
    ((word >> by) | (word << (bits - by))) & ((1 << bits) - 1)
}

/// The smallest word among the turns of the mirror image.
pub(super) fn mirrored(word: u32, bits: usize) -> u32 {
    smallest_turn(word.reverse_bits() >> (u32::BITS as usize - bits), bits).0
}

/// The smallest word among the turned ones, and by how many sectors the word begins before it.
pub(super) fn smallest_turn(word: u32, bits: usize) -> (u32, usize) {
    (0..bits).map(|by| (turned(word, bits, by), by)).min().unwrap_or((word, 0))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_covers_sectors_by_one_colour_makes_no_other_code() {
        for bits in [6, 9, 14] {
            let codes = codes(bits).unwrap();
            for (k, a) in codes.iter().enumerate() {
                assert_eq!(a.id, k);
                let mirror = a.word.reverse_bits() >> (32 - bits);
                for by in 0..bits {
                    let [own, mirror] = [a.word, mirror].map(|word| turned(word, bits, by));
                    assert!(codes.iter().all(|b| b.word != mirror));
                    // Other codes and, as a ring has a direction, the same one turned.
                    for b in codes.iter().filter(|b| b.id != k || by > 0) {
                        assert!(own & !b.word != 0 && b.word & !own != 0);
                    }
                }
            }
        }
        assert_eq!([12, 14, 16].map(|bits| codes(bits).unwrap().len()), [29, 113, 368]);
        assert!(codes(5).is_err() && codes(21).is_err());
    }

    #[test]
    fn a_turn_is_undone() {
        assert_eq!(smallest_turn(0b110_000, 6), (0b11, 4));
        assert_eq!(smallest_turn(0b100_001, 6), (0b11, 5));
    }
}
