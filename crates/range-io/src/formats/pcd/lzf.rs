//! The byte-oriented compression of `binary_compressed`: literal runs and back references of at most 264 bytes.

/// A back reference of three bytes stands for at most this many.
pub(super) const LONGEST_REFERENCE: usize = 264;

/// Appends the `length` bytes that `packed` stands for to `out`, which is empty; the error says what is wrong with it.
pub(super) fn decompress(packed: &[u8], length: usize, out: &mut Vec<u8>) -> Result<(), &'static str> {
    let mut at = 0;
    let mut next = |count: usize| {
        let bytes = packed.get(at..at + count);
        at += count;
        bytes
    };
    while let Some(&[control]) = next(1) {
        if control < 32 {
            out.extend_from_slice(next(usize::from(control) + 1).ok_or("ends within a run of bytes")?);
        } else {
            let mut run = usize::from(control >> 5) + 2;
            if run == 9 {
                run += usize::from(next(1).ok_or("ends within a reference")?[0]);
            }
            let low = next(1).ok_or("ends within a reference")?[0];
            let back = ((usize::from(control & 31) << 8) | usize::from(low)) + 1;
            let start = out.len().checked_sub(back).ok_or("refers to bytes before its begin")?;
            if out.len() + run > length {
                return Err("holds more than it promises");
            }
            // The reference may reach into what it makes.
            for index in start..start + run {
                out.push(out[index]);
            }
        }
        if out.len() > length {
            return Err("holds more than it promises");
        }
    }
    if out.len() == length { Ok(()) } else { Err("holds less than it promises") }
}

/// Whether `packed` bytes can stand for `length`.
pub(super) fn is_possible(packed: usize, length: usize) -> bool {
    // Two bytes are the shortest reference; the long ones take three.
    length <= packed.saturating_mul(LONGEST_REFERENCE)
}
