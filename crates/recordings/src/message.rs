//! One message of a recording.

use crate::payload::Payload;

/// A message with its time and what it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Index of its stream in [`Recording::streams`](crate::Recording::streams).
    pub stream: usize,
    /// When it was recorded, nanosecond on the clock of the recording.
    pub logged_ns: i64,
    /// When what it holds was measured, where the message says so.
    pub stamp_ns: Option<i64>,
    /// What it holds.
    pub payload: Payload,
}

impl Message {
    /// When what it holds was measured; where the message does not say so, when it was recorded.
    pub fn time_ns(&self) -> i64 {
        self.stamp_ns.unwrap_or(self.logged_ns)
    }
}
