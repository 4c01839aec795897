//! Folders of one crate lean on each other one way: no circle of modules across folders.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Folder of a crate's sources, by their names from `src` on, and what it leans on beside it.
type Arrows = BTreeMap<Vec<String>, BTreeSet<Vec<String>>>;

/// Circles among the folders of a crate. `sources`: files from `src` on (`a/b.rs`), and their text.
pub(crate) fn complaints(name: &str, sources: &[(String, String)]) -> Vec<String> {
    let folders: BTreeSet<Vec<String>> = sources.iter().flat_map(|(path, _)| folders_of(path)).collect();
    let mut arrows = Arrows::new();
    for (path, text) in sources {
        let own = module_of(path);
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        for used in uses(code, &own) {
            let common = own.iter().zip(&used).take_while(|(a, b)| a == b).count();
            let side = |module: &[String]| module.get(..=common).map(<[String]>::to_vec);
            let (Some(from), Some(to)) = (side(&own), side(&used)) else { continue };
            if folders.contains(&from) && folders.contains(&to) && from != to {
                arrows.entry(from).or_default().insert(to);
            }
        }
    }
    circles(&arrows).into_iter().map(|circle| format!("crates/{name}: {circle} lean on each other")).collect()
}

/// The folders that a file lies in.
fn folders_of(path: &str) -> Vec<Vec<String>> {
    let parts: Vec<String> = path.split('/').map(str::to_owned).collect();
    (1..parts.len()).map(|count| parts[..count].to_vec()).collect()
}

/// The module that a file is.
fn module_of(path: &str) -> Vec<String> {
    let mut parts: Vec<String> = path.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
    if matches!(parts.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        parts.pop();
    }
    parts
}

/// Modules of the same crate that code names.
fn uses(code: &str, own: &[String]) -> Vec<Vec<String>> {
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let text: String = lines.collect::<Vec<_>>().join(" ");
    let mut found = Vec::new();
    for (start, first) in [("crate::", Vec::new()), ("super::", own[..own.len().saturating_sub(1)].to_vec())] {
        for rest in text.split(start).skip(1) {
            paths(rest, &first, &mut found);
        }
    }
    found
}

/// Paths at the beginning of a text, those in braces each.
fn paths(text: &str, first: &[String], found: &mut Vec<Vec<String>>) {
    let mut module = first.to_vec();
    let mut rest = text;
    loop {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (word, behind) = rest.split_at(end);
        if word.is_empty() {
            break;
        }
        module.push(word.to_owned());
        found.push(module.clone());
        let Some(next) = behind.strip_prefix("::") else { break };
        if let Some(list) = next.strip_prefix('{') {
            let end = closing(list);
            for part in parts(&list[..end]) {
                paths(part.trim(), &module, found);
            }
            break;
        }
        rest = next;
    }
    if let Some(list) = text.strip_prefix('{') {
        let end = closing(list);
        for part in parts(&list[..end]) {
            paths(part.trim(), first, found);
        }
    }
}

/// Where the brace that was opened before the text closes.
fn closing(text: &str) -> usize {
    let mut depth = 1_usize;
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at;
        }
    }
    text.len()
}

/// A list's parts at its outermost level.
fn parts(list: &str) -> Vec<&str> {
    let (mut found, mut depth, mut start) = (Vec::new(), 0_usize, 0);
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                found.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    found.push(&list[start..]);
    found
}

/// Pairs of folders each of which is reached from the other.
fn circles(arrows: &Arrows) -> Vec<String> {
    let reached = |from: &Vec<String>| {
        let (mut found, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(at) = open.pop() {
            for next in arrows.get(at).into_iter().flatten() {
                if found.insert(next) {
                    open.push(next);
                }
            }
        }
        found
    };
    let all: BTreeMap<&Vec<String>, BTreeSet<&Vec<String>>> = arrows.keys().map(|from| (from, reached(from))).collect();
    let both = |a: &Vec<String>, b: &Vec<String>| all.get(b).is_some_and(|reached| reached.contains(a));
    let pairs = all.iter().flat_map(|(a, reached)| reached.iter().map(move |b| (*a, *b)));
    pairs.filter(|(a, b)| a < b && both(a, b)).map(|(a, b)| format!("{} and {}", a.join("/"), b.join("/"))).collect()
}

/// The sources of a crate, as [`complaints`] takes them, from all texts of the repository.
pub(crate) fn of_crate(root: &Path, folder: &Path, texts: &[(String, String)]) -> Vec<(String, String)> {
    let start = folder.strip_prefix(root).unwrap_or(folder).join("src").display().to_string() + "/";
    texts.iter().filter_map(|(path, text)| Some((path.strip_prefix(&start)?.to_owned(), text.clone()))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_that_lean_on_each_other_are_named() {
        let source = |path: &str, text: &str| (path.to_owned(), text.to_owned());
        let one_way = vec![source("a/x.rs", "use crate::b::y::Y;"), source("b/y.rs", "use super::z::Z;")];
        assert!(complaints("k", &one_way).is_empty());
        let both = vec![source("a/x.rs", "use crate::b::y::Y;"), source("b/y.rs", "use crate::{c::C, a::{x::X}};")];
        assert_eq!(complaints("k", &both), ["crates/k: a and b lean on each other"]);
        let through = vec![
            source("a/x.rs", "fn f() { crate::b::y::g() }"),
            source("b/y.rs", "// use crate::a::x;\nuse crate::c::z::Z;"),
            source("c/z.rs", "use super::super::a::x::X; use crate::a::x::X;"),
        ];
        assert_eq!(complaints("k", &through).len(), 3);
    }
}
