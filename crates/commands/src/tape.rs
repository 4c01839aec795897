//! The state of a part of some work on its way to the whole: one function of each type writes it, reads it and joins it.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Read, Write};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bytes that values are written to, or read from and joined with what is there: counts and sums are added, lists continued,
/// single values taken over. Numbers keep all their bits. The bytes pass by: they are never in memory as a whole.
pub struct Tape {
    end: End,
    /// More was wanted than is there, or it can't be what it should be.
    torn: bool,
    /// Why something was not written.
    failed: Option<io::Error>,
}

enum End {
    Onto(Box<dyn Write>),
    Of(Box<dyn Read>),
}

impl fmt::Debug for Tape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tape").field("is_read", &self.is_read()).field("torn", &self.torn).finish_non_exhaustive()
    }
}

impl Tape {
    /// A tape to write, onto something that is best buffered.
    pub fn onto(writer: impl Write + 'static) -> Self {
        Self { end: End::Onto(Box::new(writer)), torn: false, failed: None }
    }

    /// A tape to read.
    pub fn of(reader: impl Read + 'static) -> Self {
        Self { end: End::Of(Box::new(reader)), torn: false, failed: None }
    }

    /// Whether values are read.
    pub fn is_read(&self) -> bool {
        matches!(self.end, End::Of(_))
    }

    /// Completes what is written.
    ///
    /// # Errors
    /// The first with which something was not written.
    pub fn finish(self) -> io::Result<()> {
        match (self.failed, self.end) {
            (Some(error), _) => Err(error),
            (None, End::Onto(mut writer)) => writer.flush(),
            (None, End::Of(_)) => Ok(()),
        }
    }

    /// Whether everything was read, and all of it was there.
    pub fn is_at_end(&mut self) -> bool {
        let is_over = match &mut self.end {
            End::Of(reader) => reader.read_exact(&mut [0]).is_err(),
            End::Onto(_) => true,
        };
        is_over && !self.torn
    }

    /// Bytes, as many as there are; zeros where there are no more.
    fn raw<const N: usize>(&mut self, value: [u8; N]) -> [u8; N] {
        let mut next = value;
        match &mut self.end {
            End::Onto(writer) if self.failed.is_none() => self.failed = writer.write_all(&value).err(),
            End::Onto(_) => {}
            End::Of(reader) => {
                if self.torn || reader.read_exact(&mut next).is_err() {
                    self.torn = true;
                    return [0; N];
                }
            }
        }
        next
    }

    /// Eight bytes; zero where there are no more.
    pub fn bits(&mut self, value: u64) -> u64 {
        u64::from_le_bytes(self.raw(value.to_le_bytes()))
    }

    /// A count, which is added.
    pub fn count(&mut self, value: &mut usize) {
        let other = self.bits(*value as u64) as usize;
        if self.is_read() {
            *value = value.saturating_add(other);
        }
    }

    /// A number, which is taken over.
    pub fn number(&mut self, value: &mut f64) {
        *value = f64::from_bits(self.bits(value.to_bits()));
    }

    /// A number, which is added.
    pub fn sum(&mut self, value: &mut f64) {
        let mut other = *value;
        self.number(&mut other);
        if self.is_read() {
            *value += other;
        }
    }

    /// An answer, which is taken over.
    pub fn flag(&mut self, value: &mut bool) {
        *value = self.bits(u64::from(*value)) != 0;
    }

    /// Words, which are taken over.
    pub fn text(&mut self, value: &mut String) {
        let mut bytes = std::mem::take(value).into_bytes();
        self.list(&mut bytes, || 0, |tape, byte| [*byte] = tape.raw([*byte]));
        let text = String::from_utf8(bytes);
        self.torn |= text.is_err();
        *value = text.unwrap_or_default();
    }

    /// A value that may be missing, which is taken over.
    pub fn option<T>(
        &mut self,
        value: &mut Option<T>,
        blank: impl FnOnce() -> T,
        each: impl FnOnce(&mut Self, &mut T),
    ) {
        let mut is_there = value.is_some();
        self.flag(&mut is_there);
        if self.is_read() {
            *value = is_there.then(blank);
        }
        if let Some(value) = value {
            each(self, value);
        }
    }

    /// A list, which is continued.
    pub fn list<T>(&mut self, items: &mut Vec<T>, blank: impl Fn() -> T, mut each: impl FnMut(&mut Self, &mut T)) {
        let length = self.bits(items.len() as u64);
        if !self.is_read() {
            for item in items.iter_mut() {
                each(self, item);
            }
        }
        for _ in 0..if self.is_read() { length } else { 0 } {
            let mut item = blank();
            each(self, &mut item);
            if self.torn {
                return;
            }
            items.push(item);
        }
    }

    /// Numbers, which are continued.
    pub fn numbers(&mut self, numbers: &mut Vec<f64>) {
        self.list(numbers, || 0.0, Self::number);
    }

    /// Single precision numbers, which are continued.
    pub fn short_numbers(&mut self, numbers: &mut Vec<f32>) {
        self.list(numbers, || 0.0, |tape, number| *number = f32::from_le_bytes(tape.raw(number.to_le_bytes())));
    }

    /// Sums by name, which are added name by name.
    pub fn sums(&mut self, sums: &mut BTreeMap<String, f64>) {
        let mut rows: Vec<(String, f64)> = Vec::new();
        if !self.is_read() {
            rows.extend(std::mem::take(sums));
        }
        let blank = || (String::new(), 0.0);
        self.list(&mut rows, blank, |tape, (name, value)| {
            tape.text(name);
            tape.number(value);
        });
        for (name, value) in rows {
            *sums.entry(name).or_default() += value;
        }
    }

    /// Values without numbers that lose bits in words, which are continued.
    pub fn records<T: Serialize + DeserializeOwned>(&mut self, records: &mut Vec<T>) {
        let mut text = if self.is_read() { String::new() } else { serde_json::to_string(records).unwrap_or_default() };
        self.text(&mut text);
        if self.is_read() {
            let more: Result<Vec<T>, _> = serde_json::from_str(&text);
            self.torn |= more.is_err();
            records.extend(more.unwrap_or_default());
        }
    }
}
