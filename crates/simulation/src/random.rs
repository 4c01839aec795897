//! Random generators that depend on where they are used, not on which thread uses them.

use rand::SeedableRng;
use rand_pcg::Pcg64;

/// Mixes a further number into a key (the finaliser of `SplitMix64`, a bijection of 64 bits).
pub(crate) fn mix(key: u64, number: u64) -> u64 {
    let mut z = key.rotate_left(17).wrapping_add(number).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The generator of one row of one sample plane of one frame.
pub(crate) fn row_generator(seed: u64, frame: usize, row: usize) -> Pcg64 {
    Pcg64::seed_from_u64(mix(mix(mix(seed, 0), frame as u64), row as u64))
}
