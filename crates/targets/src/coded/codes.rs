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

/// All codes of rings with so many sectors (6 to 20): of all turned rings the smallest word, which no turn maps to itself (so that a
/// ring has a direction), and an even number of sectors set. Two words of even parity differ in two sectors at least, turned or not, so that one sector that is read wrongly is
/// noticed. 12 sectors have 165 codes.
///
/// # Errors
/// [`Error::Invalid`] for another number of sectors.
///
/// ```
/// let codes = targets::codes(12)?;
/// assert!(codes[0].word == 0b11 && codes.iter().all(|code| code.word.count_ones() % 2 == 0));
/// # Ok::<(), targets::Error>(())
/// ```
pub fn codes(bits: usize) -> Result<Vec<Code>> {
    if !(BITS[0]..=BITS[1]).contains(&bits) {
        let expected = "a ring has 6 to 20 sectors";
        return Err(Error::Invalid { name: "bits", value: bits as f64, expected });
    }
    let all = (1_u32 << bits) - 1;
    let words = (1..all).filter(|word| word.count_ones() % 2 == 0 && is_code(*word, bits));
    Ok(words.enumerate().map(|(id, word)| Code { id, word, bits }).collect())
}

/// Whether a word is smaller than all its turns.
fn is_code(word: u32, bits: usize) -> bool {
    let mask = (1_u32 << bits) - 1;
    (1..bits).all(|by| word < ((word >> by) | (word << (bits - by))) & mask)
}

/// The smallest word among the turned ones, and by how many sectors the word begins before it.
pub(super) fn smallest_turn(word: u32, bits: usize) -> (u32, usize) {
    let all = (1_u32 << bits) - 1;
    let turned = |by: usize| ((word >> by) | (word << (bits - by))) & all;
    (0..bits).map(|by| (if by == 0 { word & all } else { turned(by) }, by)).min().unwrap_or((word, 0))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn words_differ_in_two_sectors_however_they_are_turned() {
        for bits in [6, 9, 12] {
            let codes = codes(bits).unwrap();
            for (k, a) in codes.iter().enumerate() {
                assert_eq!(a.id, k);
                for b in &codes[k + 1..] {
                    let turned = (0..bits).map(|by| (b.word >> by | b.word << (bits - by)) & ((1 << bits) - 1));
                    assert!(turned.into_iter().all(|turned| (turned ^ a.word).count_ones() >= 2));
                }
            }
        }
        assert_eq!(codes(12).unwrap().len(), 165);
        assert!(codes(5).is_err() && codes(21).is_err());
    }

    #[test]
    fn a_turn_is_undone() {
        assert_eq!(smallest_turn(0b110_000, 6), (0b11, 4));
        assert_eq!(smallest_turn(0b100_001, 6), (0b11, 5));
    }
}
