//! Recordings as files of a command.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use commands::{Doubt, DoubtKind, Error, Progress, Result};
use recordings::{Ending, Format, Message, Recording};

/// Bytes that tell a recording from another file.
const BEGINNING: u64 = 64;

/// Whether a file is a recording, by what it begins with.
pub fn is_recording(path: &Path) -> bool {
    let beginning = || -> std::io::Result<Vec<u8>> {
        let mut beginning = Vec::new();
        File::open(path)?.take(BEGINNING).read_to_end(&mut beginning)?;
        Ok(beginning)
    };
    let is_file = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
    is_file && (beginning().is_ok_and(|bytes| Format::of(&bytes).is_some()) || Recording::open(path).is_ok())
}

/// For `map_err` behind a call on a recording.
pub(crate) fn failed(command: &'static str, path: &Path) -> impl FnOnce(recordings::Error) -> Error {
    let path = path.to_owned();
    move |error| match error {
        recordings::Error::Io { source, .. } => Error::Access { path, source },
        other => Error::Request { command, message: other.to_string() },
    }
}

/// Steps that the progress of a pass through a recording is told in.
const STEPS: usize = 100;

/// Takes every message of a recording, and tells how far it is.
pub(crate) fn each_message(
    command: &'static str,
    work: &str,
    recording: &mut Recording,
    progress: &dyn Progress,
    mut take: impl FnMut(&Recording, Message) -> Result<()>,
) -> Result<()> {
    progress.begin(work, STEPS);
    let mut told = 0;
    loop {
        let next = recording.next_message();
        let Some(message) = next.map_err(|error| failed(command, recording.file())(error))? else { break };
        take(recording, message)?;
        let done = (recording.position() as f64 / recording.length().max(1) as f64 * STEPS as f64) as usize;
        if done > told {
            told = done;
            progress.advance(done);
        }
    }
    progress.finish();
    Ok(())
}

/// How a recording ended, in words; `None` where it is complete.
pub(crate) fn ended_badly(recording: &Recording) -> Option<String> {
    match recording.ending()? {
        Ending::Complete => None,
        Ending::CutOff { at_byte, missing_bytes, reason } => {
            let missing = missing_bytes.map_or_else(
                || "how much is missing is not known".to_owned(),
                |bytes| format!("at least {bytes} bytes are missing"),
            );
            Some(format!(
                "the recording is cut off at byte {at_byte}: {reason}; {missing}; what stands before it was read"
            ))
        }
        Ending::Damaged { at_byte, unread_bytes, reason } => Some(format!(
            "the recording is damaged at byte {at_byte}: {reason}; the last {unread_bytes} bytes were not read"
        )),
    }
}

/// What speaks against what was read of a recording.
pub(crate) fn doubts(recording: &Recording) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let doubt = |words: String| Doubt::new(DoubtKind::UnreadableFrames, words);
    doubts.extend(ended_badly(recording).map(doubt));
    if let Some(first) = recording.faults().first() {
        let count = recording.faults().len() as u64 + recording.more_faults();
        let places = if count == 1 { "place was" } else { "places were" };
        doubts.push(doubt(format!(
            "{count} {places} passed over, the first at byte {}: {}",
            first.at_byte, first.reason
        )));
    }
    doubts
}
