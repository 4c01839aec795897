//! `cargo xtask tidy`: checks of the repository itself.

mod circles;
pub(crate) mod dependencies;
mod factorisations;
mod house;
mod options;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::benchmarks;
use crate::shell::{Outcome, root};

/// A file of source code holds one idea; beyond this it holds several.
const LONGEST_FILE: usize = 400;
/// Bytes of a file: fixtures are small and made by the simulator, and the largest file that belongs here has a tenth of this.
const LARGEST_FILE: u64 = 1_000_000;

pub(crate) fn run() -> Outcome {
    println!("── tidy");
    let root = root();
    let crates = folders(&root.join("crates"))?;
    let mut complaints = dependencies::complaints(&root)?;
    complaints.extend(benchmarks::complaints(&root)?);
    for folder in &crates {
        complaints.extend(missing_parts(folder));
        complaints.extend(tests_left_out(folder)?);
        complaints.extend(tests_switched_off(folder)?);
        complaints.extend(house::complaints(folder)?);
    }
    let files = files_below(&root)?;
    complaints.extend(files.iter().filter_map(|path| too_large(&root, path)));
    let is_source = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "rs" || ending == "md");
    let sources: Vec<&PathBuf> = files.iter().filter(is_source).collect();
    let keys = bibliography_keys(&read(&root.join("docs/bibliography.md"))?);
    let mut texts = Vec::new();
    for path in sources {
        let text = read(path)?;
        let shown = path.strip_prefix(&root).unwrap_or(path).display().to_string();
        complaints.extend(
            unknown_keys(&text, &keys)
                .into_iter()
                .map(|key| format!("{shown}: [{key}] is not in docs/bibliography.md")),
        );
        let lines = text.lines().count();
        if path.extension().is_some_and(|ending| ending == "rs") && lines > LONGEST_FILE {
            complaints.push(format!("{shown}: {lines} lines, at most {LONGEST_FILE}"));
        }
        texts.push((shown, text));
    }
    complaints.extend(factorisations::complaints(&root, &texts));
    complaints.extend(options::complaints(&texts));
    for folder in &crates {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        complaints.extend(circles::complaints(&name, &circles::of_crate(&root, folder, &texts)));
    }
    if complaints.is_empty() { Ok(()) } else { Err(complaints.join("\n")) }
}

/// What a crate must have and this one lacks.
fn missing_parts(folder: &Path) -> Vec<String> {
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut parts = vec!["README.md", "Cargo.toml"];
    // The facade and the command have no numerics of their own to show or measure.
    if !name.starts_with("rangecam") {
        parts.extend(["src/lib.rs", "examples", "benches"]);
    }
    parts.retain(|part| !folder.join(part).exists());
    parts.into_iter().map(|part| format!("crates/{name}: {part} is missing")).collect()
}

/// Files of tests that the one test program of a crate does not have as modules: they would never run.
fn tests_left_out(folder: &Path) -> Result<Vec<String>, String> {
    let program = folder.join("tests/main.rs");
    if !program.exists() {
        return Ok(Vec::new());
    }
    let text = read(&program)?;
    let modules: BTreeSet<&str> =
        text.lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';')).chain(["main"]).collect();
    let files = entries(&folder.join("tests"))?.into_iter().filter(|path| path.extension().is_some_and(|e| e == "rs"));
    let left_out = files.filter(|path| !modules.contains(&*path.file_stem().unwrap_or_default().to_string_lossy()));
    Ok(left_out.map(|path| format!("{} is no module of tests/main.rs", path.display())).collect())
}

/// Tests in the sources of a library whose manifest says that it has none: they would never run.
fn tests_switched_off(folder: &Path) -> Result<Vec<String>, String> {
    if !read(&folder.join("Cargo.toml"))?.contains("\ntest = false\n") {
        return Ok(Vec::new());
    }
    let mut found = Vec::new();
    for path in files_below(&folder.join("src"))? {
        if read(&path)?.contains("#[test]\n") {
            found.push(format!("{}: its tests never run, since Cargo.toml has `test = false`", path.display()));
        }
    }
    Ok(found)
}

/// Keys in bold brackets at the beginning of a list entry.
fn bibliography_keys(text: &str) -> BTreeSet<String> {
    let entries = text.lines().filter_map(|line| line.strip_prefix("- **["));
    entries.filter_map(|rest| rest.split_once(']').map(|(key, _)| key.to_owned())).collect()
}

/// Citations such as `[Lange2000]`: letters, then a year, that the bibliography lacks.
fn unknown_keys(text: &str, known: &BTreeSet<String>) -> BTreeSet<String> {
    let brackets = text.split('[').skip(1).filter_map(|rest| rest.split_once(']').map(|(key, _)| key));
    brackets.filter(|key| is_key(key) && !known.contains(*key)).map(str::to_owned).collect()
}

fn is_key(text: &str) -> bool {
    let letters = text.chars().take_while(|c| c.is_alphabetic()).count();
    let rest: Vec<char> = text.chars().skip(letters).collect();
    let year = rest.iter().take(4).filter(|c| c.is_ascii_digit()).count() == 4;
    let suffix = rest.iter().skip(4).all(char::is_ascii_lowercase) && rest.len() <= 5;
    letters >= 2 && text.starts_with(char::is_uppercase) && year && suffix
}

pub(crate) fn folders(parent: &Path) -> Result<Vec<PathBuf>, String> {
    let mut found: Vec<PathBuf> = entries(parent)?.into_iter().filter(|path| path.is_dir()).collect();
    found.sort();
    Ok(found)
}

/// All files, leaving out what is built or hidden.
fn files_below(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let mut found = Vec::new();
    for path in entries(folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !path.is_dir() {
            found.push(path);
        } else if !name.starts_with('.') && name != "target" && name != "out" {
            found.extend(files_below(&path)?);
        }
    }
    found.sort();
    Ok(found)
}

/// A file that is larger than anything that belongs here, as one that was only laid down in the folder.
fn too_large(root: &Path, path: &Path) -> Option<String> {
    let bytes = path.metadata().map_or(0, |found| found.len());
    let shown = path.strip_prefix(root).unwrap_or(path).display();
    (bytes > LARGEST_FILE).then(|| format!("{shown}: {bytes} bytes, at most {LARGEST_FILE}: does it belong here?"))
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let list = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(list.flatten().map(|entry| entry.path()).collect())
}

pub(crate) fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_citation_is_letters_and_a_year() {
        assert!(is_key("Lange2000") && is_key("Lichti2011b"));
        assert!(!is_key("Error") && !is_key("0; 3") && !is_key("f64; 3") && !is_key("Vec2000x9"));
    }

    #[test]
    fn an_unknown_citation_is_found() {
        let known = bibliography_keys("- **[Lange2000]** R. Lange\n");
        assert_eq!(
            unknown_keys(concat!("see [Lange2000] and [Nobody", "1999]"), &known),
            ["Nobody1999".to_owned()].into()
        );
    }
}
