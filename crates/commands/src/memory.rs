//! How much memory the work on a long survey may take, and how much is done at once within it.
//!
//! What a frame costs on its way is known from its size ([`FrameBytes`]), and what is kept besides does not grow with the frames, or
//! by little. So a command says beforehand what it keeps and what each frame that it reads ahead costs ([`Work`]), and is told how many
//! it may read ahead. That changes no result: what results depend on, such as how many frames are averaged together, is no matter of
//! memory, and where it does not fit, that is an error which says what is needed.
//!
//! As with what a result was made from, how much is allowed is known where arguments are read, and is kept per thread.

use std::cell::Cell;
use std::fmt;
use std::fs::read_to_string;
use std::str::FromStr;

use range_io::survey::{Level, Survey};

use crate::{Error, Result};

/// Part of the machine's memory that is taken where nothing is said.
const DEFAULT_PART: u64 = 4;
/// Of machines that do not tell their memory (all but Linux), byte.
const UNKNOWN_MACHINE: u64 = 8_000_000_000;
/// The program itself with its threads and tables, byte: a command on a survey of one small frame takes so much.
const PROGRAM: u64 = 50_000_000;

/// How much memory may be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Memory {
    bytes: u64,
    /// Whether somebody said so: the default gives way where a single unit of work needs more.
    is_stated: bool,
}

/// A text that is no amount of memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected a number with its unit (MB, GB, MiB or GiB), such as 2GB or 1.5GiB, found {found:?}: {reason}")]
pub struct MemoryError {
    found: String,
    reason: &'static str,
}

/// What work takes.
#[derive(Debug, Clone, Copy)]
pub struct Work<'a> {
    /// The work, in words.
    pub what: &'a str,
    /// What is kept, whatever is read ahead, byte.
    pub kept: u64,
    /// Each unit that is read ahead, byte.
    pub each: u64,
    /// More units than this at once are of no use.
    pub most: usize,
}

/// What a frame takes on its way, byte: upper bounds by the types of its planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameBytes {
    /// Pixels.
    pub pixels: u64,
    /// While it is read: unpacked, and as values.
    pub read: u64,
    /// As it waits for others that it is averaged with: complex images (16 bytes a pixel and frequency) or ranges, and flags.
    pub waiting: u64,
    /// In the stages: images, flags, ranges before and after, truth, points, and what the stages work with.
    pub staged: u64,
}

thread_local! {
    static BOUND: Cell<Option<Memory>> = const { Cell::new(None) };
    static KEPT: Cell<u64> = const { Cell::new(0) };
}

/// Does work within so much memory, `None` for the default.
pub fn bounded<T>(memory: Option<Memory>, work: impl FnOnce() -> T) -> T {
    let before = BOUND.replace(memory);
    let done = work();
    BOUND.set(before);
    done
}

/// Does work beside so many bytes that the caller keeps.
pub fn keeping<T>(bytes: u64, work: impl FnOnce() -> T) -> T {
    let before = KEPT.replace(KEPT.get().saturating_add(bytes));
    let done = work();
    KEPT.set(before);
    done
}

impl Memory {
    /// So many bytes, as somebody said.
    pub fn stated(bytes: u64) -> Self {
        Self { bytes, is_stated: true }
    }

    /// What the present work may take: as was said, or a quarter of the machine's.
    pub fn present() -> Self {
        BOUND.get().unwrap_or_else(|| Self { bytes: machine() / DEFAULT_PART, is_stated: false })
    }

    /// So many units of work may be read ahead, one at least.
    ///
    /// # Errors
    /// [`Error::Memory`] where one unit takes more than somebody allowed. Where nobody said anything, it is done all the same.
    pub fn at_once(self, work: &Work<'_>) -> Result<usize> {
        let kept = PROGRAM.saturating_add(KEPT.get()).saturating_add(work.kept);
        let needed = kept.saturating_add(work.each);
        if needed > self.bytes && self.is_stated {
            return Err(Error::Memory {
                work: work.what.to_owned(),
                needed: Amount(needed),
                allowed: Amount(self.bytes),
            });
        }
        let units = self.bytes.saturating_sub(kept) / work.each.max(1);
        Ok(usize::try_from(units).unwrap_or(usize::MAX).clamp(1, work.most.max(1)))
    }
}

impl FromStr for Memory {
    type Err = MemoryError;

    fn from_str(text: &str) -> std::result::Result<Self, MemoryError> {
        let refused = |reason| MemoryError { found: text.to_owned(), reason };
        let text = text.trim();
        let (number, unit) = text.split_at(text.find(char::is_alphabetic).unwrap_or(text.len()));
        let factor = match unit {
            "MB" => 1e6,
            "GB" => 1e9,
            "MiB" => f64::from(1 << 20),
            "GiB" => f64::from(1 << 30),
            "" => return Err(refused("it has no unit")),
            _ => return Err(refused("the unit is none of these")),
        };
        let number: f64 = number.trim().parse().map_err(|_| refused("what stands before the unit is no number"))?;
        let bytes = number * factor;
        // Above, bytes would not be whole numbers any more.
        if !(1.0..=2.0_f64.powi(53)).contains(&bytes) {
            return Err(refused("it is not above zero, or beyond all machines"));
        }
        Ok(Self::stated(bytes as u64))
    }
}

impl FrameBytes {
    /// Of the frames of a survey.
    pub fn of(survey: &Survey) -> Self {
        let camera = &survey.camera;
        let (pixels, frequencies) = ((camera.width * camera.height) as u64, camera.modulation_hz.len().max(1) as u64);
        let samples = 4 * frequencies * camera.phase_steps.unwrap_or(0) as u64;
        let complex = 16 * frequencies;
        let (stored, waiting) = match survey.level {
            Level::Samples => (samples, complex),
            Level::Phase => (complex, complex),
            _ => (12, 12),
        };
        // Ranges and amplitudes before and after, truth, reference; range, deviation, amplitude and flags of each frequency; point
        // with its values; two copies of ranges that changes are told by, errors in double precision, and 100 bytes of work.
        let staged = stored + complex + 24 + 14 * (frequencies + 1) + 34 + 16 + 16 + 100;
        Self { pixels, read: pixels * (2 * stored + 24), waiting: pixels * (waiting + 2), staged: pixels * staged }
    }
}

/// Bytes, for people: rounded up to what can be typed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Amount(pub u64);

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}MB", self.0.div_ceil(1_000_000))
    }
}

/// Memory of the machine, or of the part of it that the process may take, byte.
fn machine() -> u64 {
    let line = |line: &str| line.strip_prefix("MemTotal:")?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok();
    let total = read_to_string("/proc/meminfo").ok().and_then(|text| text.lines().find_map(line));
    let total = total.map_or(UNKNOWN_MACHINE, |kibibytes| 1024 * kibibytes);
    // Of a container; a group without a limit says `max`.
    let limit = read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| text.trim().parse().ok());
    limit.map_or(total, |limit: u64| limit.min(total))
}
