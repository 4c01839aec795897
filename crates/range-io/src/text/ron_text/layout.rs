//! Line breaks for RON that was written without any.

const LONGEST_LINE: usize = 110;

enum Item {
    /// A number, word or string with its key, or the key of the group that follows.
    Text(String),
    /// Key or name before the bracket, opening bracket, members.
    Group(String, char, Vec<Item>),
}

/// Breaks compact RON: what fits one line stays on one, members of what does not get lines of their own, and plain numbers fill lines.
pub(super) fn in_lines(compact: &str) -> String {
    let mut characters = compact.chars().peekable();
    let mut out = String::new();
    for item in members(&mut characters) {
        write(&item, 0, &mut out);
        out.push('\n');
    }
    out
}

fn members(characters: &mut std::iter::Peekable<std::str::Chars>) -> Vec<Item> {
    let mut items = Vec::new();
    let mut text = String::new();
    while let Some(character) = characters.next() {
        match character {
            '(' | '[' | '{' => {
                items.push(Item::Group(std::mem::take(&mut text), character, members(characters)));
            }
            ')' | ']' | '}' => break,
            ',' => {
                if !text.is_empty() {
                    items.push(Item::Text(std::mem::take(&mut text)));
                }
            }
            ':' => text += ": ",
            '"' => {
                text.push('"');
                quote(characters, &mut text);
            }
            other => text.push(other),
        }
    }
    if !text.is_empty() {
        items.push(Item::Text(text));
    }
    items
}

/// Copies a string with its closing quote.
fn quote(characters: &mut std::iter::Peekable<std::str::Chars>, text: &mut String) {
    while let Some(character) = characters.next() {
        text.push(character);
        match character {
            '"' => return,
            '\\' => text.extend(characters.next()),
            _ => {}
        }
    }
}

fn closing(opening: char) -> char {
    match opening {
        '(' => ')',
        '[' => ']',
        _ => '}',
    }
}

fn width(item: &Item) -> usize {
    match item {
        Item::Text(text) => text.len(),
        Item::Group(key, _, members) => key.len() + 2 + members.iter().map(|m| width(m) + 2).sum::<usize>(),
    }
}

fn write(item: &Item, indent: usize, out: &mut String) {
    let (key, opening, members) = match item {
        Item::Text(text) => return out.push_str(text),
        Item::Group(key, opening, members) => (key, *opening, members),
    };
    out.push_str(key);
    out.push(opening);
    if indent + width(item) <= LONGEST_LINE {
        for (index, member) in members.iter().enumerate() {
            out.push_str(if index == 0 { "" } else { ", " });
            write(member, indent, out);
        }
    } else {
        write_broken(members, indent + 4, out);
        new_line(indent, out);
    }
    out.push(closing(opening));
}

fn write_broken(members: &[Item], indent: usize, out: &mut String) {
    let plain = members.iter().all(|member| matches!(member, Item::Text(text) if !text.contains(':')));
    let mut column = LONGEST_LINE;
    for member in members {
        let length = width(member) + 2;
        if plain && column + length <= LONGEST_LINE {
            out.push(' ');
            column += length;
        } else {
            new_line(indent, out);
            column = indent + length;
        }
        write(member, indent, out);
        out.push(',');
    }
}

fn new_line(indent: usize, out: &mut String) {
    out.push('\n');
    out.extend(std::iter::repeat_n(' ', indent));
}

#[cfg(test)]
#[path = "../../../tests/unit/layout.rs"]
mod tests;
