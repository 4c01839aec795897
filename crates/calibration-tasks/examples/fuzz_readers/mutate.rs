//! Small and large damage to a file.

use super::chance::Chance;

/// Numbers at which sizes, signs and kinds of numbers turn over.
const WORDS: &[&str] = &[
    "0",
    "-1",
    "1",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "4611686018427387905",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "1e9",
    "1e308",
    "-1e308",
    "1e-320",
    "1e999",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "0.5",
    "-0.0",
    "\"\"",
    "()",
    "[]",
    "None",
    "true",
    "",
];

const NUMBERS: &[u64] = &[
    0,
    1,
    2,
    7,
    127,
    128,
    255,
    256,
    4095,
    32_767,
    32_768,
    65_535,
    65_536,
    1 << 24,
    i32::MAX as u64,
    1 << 31,
    u32::MAX as u64,
    1 << 32,
    1 << 40,
    (1 << 62) + 1,
    i64::MAX as u64,
    1 << 63,
    u64::MAX - 1,
    u64::MAX,
];

/// Files do not grow beyond this.
const LONGEST: usize = 1 << 18;

/// A damaged copy of a file; `other` is another file of the kind.
pub fn mutated(sound: &[u8], other: &[u8], text: bool, chance: &mut Chance) -> Vec<u8> {
    let mut bytes = sound.to_vec();
    for _ in 0..=chance.below(4) {
        // Files of other formats have headers of text, too.
        let kinds = if text || chance.below(2) == 0 { 14 } else { 8 };
        damage(&mut bytes, other, chance.below(kinds), chance);
        bytes.truncate(LONGEST);
    }
    bytes
}

fn damage(bytes: &mut Vec<u8>, other: &[u8], kind: usize, chance: &mut Chance) {
    let at = chance.below(bytes.len());
    let end = (at + 1 + chance.below(64)).min(bytes.len());
    match kind {
        0 if !bytes.is_empty() => bytes[at] ^= 1 << chance.below(8),
        1 if !bytes.is_empty() => bytes[at] = chance.next() as u8,
        2 => bytes.truncate(at),
        3 | 4 => put_number(bytes, at, chance),
        5 => drop(bytes.drain(at.min(end)..end)),
        6 => {
            let from = chance.below(other.len());
            let piece = &other[from..(from + chance.below(256)).min(other.len())];
            drop(bytes.splice(at..end, piece.iter().copied()));
        }
        7 => repeat(bytes, at..end, chance),
        8..=10 => put_word(bytes, at, chance),
        11 => {
            let lines = line_around(bytes, at);
            if chance.below(2) == 0 { drop(bytes.drain(lines)) } else { repeat(bytes, lines, chance) }
        }
        12 => {
            let bracket = chance.one_of(&["[", "(", "{", "Some(", "/*", "\"", "[[1,", "(a:"]).copied().unwrap_or("[");
            let brackets = bracket.repeat(1 << chance.below(14));
            drop(bytes.splice(at..at, brackets.into_bytes()));
        }
        _ => {
            let odd: &[&[u8]] =
                &[b"\xff", b"\xe4", b"\0", b"\x1b[2J", b"\r", b"\n\n", "\u{feff}".as_bytes(), b"#", b",,"];
            if let Some(odd) = chance.one_of(odd) {
                drop(bytes.splice(at..at, odd.iter().copied()));
            }
        }
    }
}

/// A piece many times.
fn repeat(bytes: &mut Vec<u8>, range: std::ops::Range<usize>, chance: &mut Chance) {
    let piece = bytes.get(range.clone()).unwrap_or_default().to_vec();
    let times = (1 << chance.below(12)).min(LONGEST / piece.len().max(1));
    drop(bytes.splice(range.end..range.end, piece.repeat(times)));
}

/// A number of one to eight bytes in either order.
fn put_number(bytes: &mut [u8], at: usize, chance: &mut Chance) {
    let number = chance.one_of(NUMBERS).copied().unwrap_or(0);
    let size = 1 << chance.below(4);
    let little = number.to_le_bytes();
    let big = number.to_be_bytes();
    let digits = if chance.below(2) == 0 { &little[..size] } else { &big[8 - size..] };
    for (byte, digit) in bytes.iter_mut().skip(at).zip(digits) {
        *byte = *digit;
    }
}

/// Another word in place of the number that stands at a place or behind it.
fn put_word(bytes: &mut Vec<u8>, at: usize, chance: &mut Chance) {
    let is_digit = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+');
    let Some(start) = bytes.iter().skip(at).position(is_digit).map(|offset| at + offset) else { return };
    let length = bytes[start..].iter().position(|byte| !is_digit(byte)).unwrap_or(bytes.len() - start);
    let word = chance.one_of(WORDS).copied().unwrap_or("0");
    drop(bytes.splice(start..start + length, word.bytes()));
}

fn line_around(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let start = bytes[..at].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let end = bytes[at..].iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |end| at + end + 1);
    start..end
}

/// The polynomial of PNG and zip.
pub const CRC_32: u32 = 0xedb8_8320;
/// The one of Castagnoli, of E57.
const CRC_32C: u32 = 0x82f6_3b78;

/// Puts checksums right, without which readers look no further.
pub fn with_checksums(target: &str, bytes: &mut [u8]) {
    match target {
        "e57" => {
            for page in bytes.chunks_exact_mut(1024) {
                let (data, checksum) = page.split_at_mut(1020);
                checksum.copy_from_slice(&crc(data, CRC_32C).to_be_bytes());
            }
        }
        "png" => {
            let mut at = 8;
            while let Some(length) = bytes.get(at..at + 4) {
                let length = length.iter().fold(0_usize, |length, byte| length << 8 | usize::from(*byte));
                let Some(end) = length.checked_add(at + 8).filter(|end| end + 4 <= bytes.len()) else { return };
                let checksum = crc(&bytes[at + 4..end], CRC_32).to_be_bytes();
                bytes[end..end + 4].copy_from_slice(&checksum);
                at = end + 4;
            }
        }
        _ => {}
    }
}

/// A checksum of 32 bits with a reflected polynomial.
pub fn crc(bytes: &[u8], polynomial: u32) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ polynomial } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc)))
}
