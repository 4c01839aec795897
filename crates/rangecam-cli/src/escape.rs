//! Names and words out of files, made safe for a terminal.

use std::borrow::Cow;
use std::fmt::Write;

/// Bytes of an error that are shown: it may quote a line of a file.
const LONGEST_ERROR: usize = 16_000;

/// An error for a person, cut where it is longer than anybody reads.
pub(crate) fn error(text: &str) -> String {
    if text.len() <= LONGEST_ERROR {
        return words(text).into_owned();
    }
    let end = (0..=LONGEST_ERROR).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    format!("{} ... ({} bytes in all)", words(&text[..end]), text.len())
}

/// Words for a person: control characters, which a terminal would obey, and those that turn the direction of writing are
/// shown as `\u{1b}`; lines and tabs stay.
pub(crate) fn words(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        if is_obeyed(character) { out.extend(character.escape_unicode()) } else { out.push(character) }
    }
    Cow::Owned(out)
}

/// JSON text, in which such characters stand in strings alone; those below a blank are escaped already.
pub(crate) fn json(text: &str) -> Cow<'_, str> {
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        if is_obeyed(character) {
            // All of them lie below 0x10000. Writing to a string does not fail.
            let _ = write!(out, "\\u{:04x}", u32::from(character));
        } else {
            out.push(character);
        }
    }
    Cow::Owned(out)
}

fn is_obeyed(character: char) -> bool {
    let turns =
        matches!(character, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || (character.is_control() && !matches!(character, '\n' | '\t'))
}

#[cfg(test)]
mod tests {
    // Panics are how a test fails.
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown() {
        assert_eq!(words("S0\n\tok"), "S0\n\tok");
        assert_eq!(words("\u{1b}[2JS0\r\u{7}"), "\\u{1b}[2JS0\\u{d}\\u{7}");
        assert_eq!(words("\u{9b}2J \u{202e}ylp"), "\\u{9b}2J \\u{202e}ylp");
        assert_eq!(words("Wände, µ, 測"), "Wände, µ, 測");
        assert_eq!(words(&"é".repeat(1 << 20)).len(), 1 << 21);
        assert!(error(&"é".repeat(1 << 20)).ends_with("... (2097152 bytes in all)"));
    }

    #[test]
    fn json_stays_json() {
        let text = serde_json::to_string(&["\u{1b}[2J", "\u{9b}2J\u{7f}\u{202e}", "é"]).unwrap();
        let safe = json(&text);
        assert!(!safe.contains(is_obeyed), "{safe}");
        let back: Vec<String> = serde_json::from_str(&safe).unwrap();
        assert_eq!(back, ["\u{1b}[2J", "\u{9b}2J\u{7f}\u{202e}", "é"]);
    }
}
