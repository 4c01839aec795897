//! The fields of a message, one after the other.

use super::Layout;

/// Walks through the bytes of a message; what is wrong is said in words that name the field.
pub(super) struct Fields<'a> {
    bytes: &'a [u8],
    at: usize,
    aligned: bool,
    big_endian: bool,
}

type Read<T> = Result<T, String>;

impl<'a> Fields<'a> {
    /// The fields behind what says how they are laid out.
    pub fn new(bytes: &'a [u8], layout: Layout) -> Read<Self> {
        match layout {
            Layout::Ros1 => Ok(Self { bytes, at: 0, aligned: false, big_endian: false }),
            Layout::Cdr => {
                let (head, bytes) = bytes.split_at_checked(4).ok_or("is shorter than the head of its encoding")?;
                let big_endian = match (head[0], head[1]) {
                    (0, 0) => true,
                    (0, 1) => false,
                    (high, low) => {
                        return Err(format!("is encoded as {high:02x}{low:02x}, expected plain CDR (0000, 0001)"));
                    }
                };
                Ok(Self { bytes, at: 0, aligned: true, big_endian })
            }
        }
    }

    pub fn is_ros1(&self) -> bool {
        !self.aligned
    }

    fn array<const N: usize>(&mut self, field: &str) -> Read<[u8; N]> {
        if self.aligned {
            self.at = self.at.next_multiple_of(N);
        }
        let found = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<N>());
        let found = found.ok_or_else(|| format!("ends before its field `{field}`"))?;
        self.at += N;
        let mut value = *found;
        if self.big_endian {
            value.reverse();
        }
        Ok(value)
    }

    pub fn u8(&mut self, field: &str) -> Read<u8> {
        Ok(self.array::<1>(field)?[0])
    }

    pub fn u32(&mut self, field: &str) -> Read<u32> {
        Ok(u32::from_le_bytes(self.array(field)?))
    }

    pub fn f64(&mut self, field: &str) -> Read<f64> {
        Ok(f64::from_le_bytes(self.array(field)?))
    }

    pub fn f64s<const N: usize>(&mut self, field: &str) -> Read<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    pub fn list_f64(&mut self, field: &str) -> Read<Vec<f64>> {
        let count = self.u32(field)? as usize;
        if count > self.bytes.len().saturating_sub(self.at) / 8 {
            return Err(format!("promises {count} values in its field `{field}`, more than it has bytes for"));
        }
        (0..count).map(|_| self.f64(field)).collect()
    }

    /// Bytes behind their number.
    pub fn bytes(&mut self, field: &str) -> Read<&'a [u8]> {
        let count = self.u32(field)? as usize;
        let left = self.bytes.len().saturating_sub(self.at);
        let found = self.bytes.get(self.at..).and_then(|rest| rest.get(..count));
        let found = found.ok_or_else(|| format!("promises {count} bytes in its field `{field}`, {left} are left"))?;
        self.at += count;
        Ok(found)
    }

    /// A text; in CDR with a zero at its end.
    pub fn text(&mut self, field: &str) -> Read<String> {
        let bytes = self.bytes(field)?;
        Ok(String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned())
    }
}
