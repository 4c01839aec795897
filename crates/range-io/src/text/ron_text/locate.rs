//! Where in a RON text a field stands, and which field stands at a place.
//!
//! The text is walked through once, with the open brackets alone in memory: paths are built for what is asked for only, so
//! that a text of many values or brackets costs no more than its length.

use std::fmt::Write;

/// Line and column, from 1.
pub(super) type Place = (usize, usize);

/// More brackets than ron itself enters (128): what lies deeper is read by nobody.
const DEEPEST: usize = 256;

/// Place and path of the field that a parser was at between two places: the value that begins there (behind blanks), or
/// the last one before.
pub(super) fn field_between(text: &str, start: Place, end: Place) -> (Place, String) {
    let mut last = None;
    let mut walk = Walk::new(text);
    let mut number = 0_usize;
    while let Some(seen) = walk.next() {
        let Seen::Value(place) = seen else { continue };
        if (start..=end).contains(&place) {
            return (place, walk.path());
        }
        if place > end {
            break;
        }
        if place < start {
            last = Some(number);
        }
        number += 1;
    }
    (start, last.map(|number| path_of_value(text, number)).unwrap_or_default())
}

/// Path of the value with this number.
fn path_of_value(text: &str, number: usize) -> String {
    let mut walk = Walk::new(text);
    let mut values = 0_usize;
    while let Some(seen) = walk.next() {
        if matches!(seen, Seen::Value(_)) {
            if values == number {
                return walk.path();
            }
            values += 1;
        }
    }
    String::new()
}

/// Path of a field of the innermost group around a place, whether it is there or not.
pub(super) fn field_of_group(text: &str, place: Place, field: &str) -> String {
    let mut walk = Walk::new(text);
    // The innermost group around a place is the first to close behind it that has begun before it.
    while let Some(seen) = walk.next() {
        if let Seen::End { start, end } = seen
            && (start..=end).contains(&place)
        {
            let group = walk.path();
            return if group.is_empty() { field.to_owned() } else { format!("{group}.{field}") };
        }
    }
    field.to_owned()
}

/// Line and column of a field's value; of the longest part of its path that there is, if it is missing.
#[cfg(any(feature = "survey", feature = "calibration"))]
pub(super) fn place_of(text: &str, path: &str) -> Place {
    let mut best: Option<(usize, Place)> = None;
    let mut walk = Walk::new(text);
    walk.wanted = path;
    while let Some(seen) = walk.next() {
        let Seen::Value(place) = seen else { continue };
        if let Some(length) = walk.matched()
            && best.is_none_or(|(longest, _)| length > longest)
        {
            best = Some((length, place));
            if length == path.len() {
                break;
            }
        }
    }
    best.map_or((1, 1), |(_, place)| place)
}

enum Seen {
    /// A value begins; [`Walk::path`] is its path.
    Value(Place),
    /// The group whose value began at `start` is closed; [`Walk::path`] is its path.
    End { start: Place, end: Place },
}

/// An open bracket.
struct Group {
    index: usize,
    key: Option<String>,
    /// Where its value begins: at its name, if it has one.
    start: Place,
    /// `Some(` adds nothing to the path.
    transparent: bool,
    /// Whether the path of the group itself is empty.
    at_root: bool,
    /// How much of the wanted path the path of the group itself is; `None` where it is another.
    matched: Option<usize>,
}

impl Group {
    fn adds_nothing(&self) -> bool {
        self.key.is_none() && self.transparent
    }
}

/// Walks through a text value by value.
struct Walk<'a> {
    cursor: Cursor<'a>,
    groups: Vec<Group>,
    /// A bracket whose value has been shown; what stands in it comes next.
    opened: Option<Group>,
    /// The word before a bracket, and its place: the name of a variant or structure, whose value has been shown already.
    name: Option<(String, Place)>,
    /// The path that is looked for.
    wanted: &'a str,
}

impl<'a> Walk<'a> {
    fn new(text: &'a str) -> Self {
        let root = Group { index: 0, key: None, start: (1, 1), transparent: true, at_root: true, matched: Some(0) };
        let cursor = Cursor { characters: text.chars().peekable(), place: (1, 1) };
        Self { cursor, groups: vec![root], opened: None, name: None, wanted: "" }
    }

    /// Path of the value at hand.
    fn path(&self) -> String {
        let mut path = String::new();
        for group in &self.groups {
            match &group.key {
                Some(key) => {
                    if !path.is_empty() {
                        path.push('.');
                    }
                    path.push_str(key);
                }
                None if group.transparent => {}
                None => {
                    // Writing to a string does not fail.
                    let _ = write!(path, "[{}]", group.index);
                }
            }
        }
        path
    }

    fn at_root(&self) -> bool {
        self.groups.last().is_none_or(|group| group.at_root && group.adds_nothing())
    }

    /// How much of the wanted path the path of the value at hand is; `None` where it is another.
    fn matched(&self) -> Option<usize> {
        let group = self.groups.last()?;
        let before = group.matched?;
        let rest = &self.wanted[before..];
        let rest = match &group.key {
            Some(key) => {
                let rest = if before == 0 { rest } else { rest.strip_prefix('.')? };
                rest.strip_prefix(key.as_str())?
            }
            None if group.transparent => rest,
            None => rest.strip_prefix(&format!("[{}]", group.index))?,
        };
        let length = self.wanted.len() - rest.len();
        // A path ends where a part of it does.
        (length == 0 || rest.is_empty() || rest.starts_with(['.', '['])).then_some(length)
    }

    /// The group that a bracket opens, whose value began at `start`.
    fn group(&self, bracket: char, start: Place, name: Option<&str>) -> Group {
        let at_root = self.at_root();
        let transparent = name == Some("Some") || (bracket == '(' && at_root);
        Group { index: 0, key: None, start, transparent, at_root, matched: self.matched() }
    }

    fn next(&mut self) -> Option<Seen> {
        self.groups.extend(self.opened.take());
        while self.groups.len() <= DEEPEST {
            let place = self.cursor.place;
            let character = self.cursor.next()?;
            if character.is_whitespace() {
                continue;
            }
            let name = self.name.take();
            match character {
                '/' => self.cursor.comment(),
                '#' => self.cursor.attribute(),
                '(' | '[' | '{' => {
                    let Some((name, start)) = name else {
                        self.opened = Some(self.group(character, place, None));
                        return Some(Seen::Value(place));
                    };
                    self.groups.push(self.group(character, start, Some(&name)));
                }
                ')' | ']' | '}' => {
                    let start = self.groups.pop()?.start;
                    return (!self.groups.is_empty()).then_some(Seen::End { start, end: place });
                }
                ',' => {
                    let group = self.groups.last_mut()?;
                    group.index += 1;
                    group.key = None;
                }
                ':' => {}
                first => {
                    let word = if first == '"' { self.cursor.string() } else { self.cursor.word(first) };
                    if self.cursor.is_key() {
                        self.groups.last_mut()?.key = Some(word);
                    } else {
                        self.name = Some((word, place));
                        return Some(Seen::Value(place));
                    }
                }
            }
        }
        None
    }
}

struct Cursor<'a> {
    characters: std::iter::Peekable<std::str::Chars<'a>>,
    place: Place,
}

impl Cursor<'_> {
    fn next(&mut self) -> Option<char> {
        let character = self.characters.next()?;
        self.place = if character == '\n' { (self.place.0 + 1, 1) } else { (self.place.0, self.place.1 + 1) };
        Some(character)
    }

    fn peek(&mut self) -> Option<char> {
        self.characters.peek().copied()
    }

    fn skip_while(&mut self, keep: impl Fn(char) -> bool) {
        while self.peek().is_some_and(&keep) {
            self.next();
        }
    }

    /// Behind an opening quote.
    fn string(&mut self) -> String {
        let mut text = String::new();
        while let Some(character) = self.next() {
            match character {
                '"' => break,
                '\\' => text.extend(self.next()),
                other => text.push(other),
            }
        }
        text
    }

    /// Behind the mark of `#![enable(..)]`, which a value may follow in the same line.
    fn attribute(&mut self) {
        if self.peek() == Some('!') {
            self.skip_while(|c| c != ']');
            self.next();
        }
    }

    /// Behind a slash.
    fn comment(&mut self) {
        if self.peek() == Some('*') {
            let mut last = ' ';
            while let Some(character) = self.next() {
                if (last, character) == ('*', '/') {
                    break;
                }
                last = character;
            }
        } else {
            self.skip_while(|c| c != '\n');
        }
    }

    fn word(&mut self, first: char) -> String {
        let mut word = String::from(first);
        while let Some(character) = self.peek().filter(|&c| c.is_alphanumeric() || "_.+-".contains(c)) {
            word.push(character);
            self.next();
        }
        word
    }

    fn is_key(&mut self) -> bool {
        self.skip_while(char::is_whitespace);
        self.peek() == Some(':')
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/locate.rs"]
mod tests;
