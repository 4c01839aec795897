//! Where in a RON text a field stands, and which field stands at a place.

/// Place and path of the field that a parser was at between two places: the value that begins there (behind blanks), or
/// the last one before.
pub(super) fn field_between(text: &str, start: Place, end: Place) -> (Place, String) {
    let values = values(text);
    if let Some(value) = values.iter().find(|value| (start..=end).contains(&value.start)) {
        return (value.start, value.path.clone());
    }
    let before = values.iter().rfind(|value| value.start < start);
    (start, before.map(|value| value.path.clone()).unwrap_or_default())
}

/// Path of a field of the innermost group around a place, whether it is there or not.
pub(super) fn field_of_group(text: &str, place: Place, field: &str) -> String {
    let around = |value: &&Value| value.end.is_some_and(|end| (value.start..=end).contains(&place));
    let values = values(text);
    let group = values.iter().rfind(around).map(|value| value.path.as_str()).unwrap_or_default();
    if group.is_empty() { field.to_owned() } else { format!("{group}.{field}") }
}

/// Line and column of a field's value; of the longest part of its path that there is, if it is missing.
pub(super) fn place_of(text: &str, path: &str) -> Place {
    let values = values(text);
    let mut path = path;
    loop {
        if let Some(value) = values.iter().find(|value| value.path == path) {
            return value.start;
        }
        match path.rfind(['.', '[']) {
            Some(end) => path = &path[..end],
            None => return values.first().map_or((1, 1), |value| value.start),
        }
    }
}

/// Line and column, from 1.
pub(super) type Place = (usize, usize);

struct Value {
    path: String,
    start: Place,
    /// Place of the closing bracket; `None` for what is no group, or not closed.
    end: Option<Place>,
}

/// An open bracket.
struct Group {
    path: String,
    index: usize,
    key: Option<String>,
    /// Position of its value in the list of all.
    value: Option<usize>,
    /// `Some(` adds nothing to the path.
    transparent: bool,
}

impl Group {
    fn path_of_value(&self) -> String {
        match &self.key {
            Some(key) if self.path.is_empty() => key.clone(),
            Some(key) => format!("{}.{key}", self.path),
            None if self.transparent => self.path.clone(),
            None => format!("{}[{}]", self.path, self.index),
        }
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

/// All values in the order of the text, with the paths of their fields.
fn values(text: &str) -> Vec<Value> {
    let mut cursor = Cursor { characters: text.chars().peekable(), place: (1, 1) };
    let mut values = Vec::new();
    let mut groups = vec![Group { path: String::new(), index: 0, key: None, value: None, transparent: true }];
    // The word before a bracket: the name of a variant or structure, whose value has been noted already.
    let mut name: Option<String> = None;
    loop {
        let place = cursor.place;
        let Some(character) = cursor.next() else { break };
        let Some(group) = groups.last_mut() else { break };
        match character {
            c if c.is_whitespace() => continue,
            '/' => cursor.comment(),
            '#' => cursor.skip_while(|c| c != '\n'),
            '(' | '[' | '{' => {
                let path = group.path_of_value();
                let transparent = name.as_deref() == Some("Some") || (character == '(' && path.is_empty());
                if name.is_none() {
                    values.push(Value { path: path.clone(), start: place, end: None });
                }
                groups.push(Group { path, index: 0, key: None, value: values.len().checked_sub(1), transparent });
            }
            ')' | ']' | '}' => {
                if let Some(value) = groups.pop().and_then(|group| values.get_mut(group.value?)) {
                    value.end = Some(place);
                }
            }
            ',' => {
                group.index += 1;
                group.key = None;
            }
            ':' => {}
            first => {
                let word = if first == '"' { cursor.string() } else { cursor.word(first) };
                if cursor.is_key() {
                    group.key = Some(word);
                } else {
                    values.push(Value { path: group.path_of_value(), start: place, end: None });
                    name = Some(word);
                    continue;
                }
            }
        }
        name = None;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "#![enable(implicit_some)]\n(\n  a: 1, // b: 2\n  \"k\": Some(\"x(:\"),\n  list: [\n    (c: (1, 2)), (c: Some((3,\n      4))),\n  ],\n)\n";

    #[test]
    fn fields_are_found_at_their_places() {
        assert_eq!(place_of(TEXT, "a"), (3, 6));
        assert_eq!(place_of(TEXT, "k"), (4, 8));
        assert_eq!(place_of(TEXT, "list[0].c[1]"), (6, 13));
        assert_eq!(place_of(TEXT, "list[1].c[1]"), (7, 7));
        // What is missing is looked for at its parent.
        assert_eq!(place_of(TEXT, "list[1].d"), (6, 18));
        assert_eq!(place_of(TEXT, "z"), (2, 1));
    }

    #[test]
    fn places_tell_their_fields() {
        let field_at = |place| field_between(TEXT, place, place).1;
        assert_eq!(field_at((3, 6)), "a");
        assert_eq!(field_at((7, 7)), "list[1].c[1]");
        assert_eq!(field_at((6, 13)), "list[0].c[1]");
        assert_eq!(field_at((1, 1)), "");
        // The blanks before a value belong to it.
        assert_eq!(field_between(TEXT, (3, 5), (3, 6)), ((3, 6), "a".into()));
        assert_eq!(field_of_group(TEXT, (6, 15), "d"), "list[0].d");
        assert_eq!(field_of_group(TEXT, (9, 1), "d"), "d");
    }
}
