//! `cargo xtask alone`: each README's examples in a package that depends on that crate alone, as its `[dependencies]` says.

use std::path::Path;

use crate::shell::{Outcome, cargo_quietly, root};
use crate::tidy::{folders, read};

/// One of a README's blocks of code.
struct CodeBlock<'a> {
    /// What stands behind the three backticks.
    kind: &'a str,
    /// Line of the README, from one, that the code begins at.
    line: usize,
    lines: Vec<&'a str>,
}

pub(crate) fn run() -> Outcome {
    println!("── alone");
    let root = root();
    let place = root.join("target/alone");
    let mut complaints = Vec::new();
    let mut written = Vec::new();
    for folder in folders(&root.join("crates"))?.iter().filter(|folder| folder.join("src/lib.rs").exists()) {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match packages(&name, folder, &place) {
            Ok(names) => written.extend(names),
            Err(complaint) => complaints.push(format!("crates/{name}/README.md: {complaint}")),
        }
    }
    workspace(&root, &place, &written)?;
    let manifest = place.join("Cargo.toml").display().to_string();
    let target = std::env::var("CARGO_TARGET_DIR").unwrap_or_else(|_| root.join("target").display().to_string());
    // One call a package: in a common one, features that one asks for would be there for all.
    for package in &written {
        let line = ["check", "--quiet", "--offline", "--manifest-path", &manifest, "--package", package];
        if cargo_quietly(&line, &[("CARGO_TARGET_DIR", &target)]).is_err() {
            complaints.push(format!("{package}: an example of the README does not compile with its [dependencies]"));
        }
    }
    if complaints.is_empty() { Ok(()) } else { Err(complaints.join("\n")) }
}

/// A workspace of the packages with the versions and profiles of this one, so that what is compiled serves both.
fn workspace(root: &Path, place: &Path, members: &[String]) -> Outcome {
    let manifest = read(&root.join("Cargo.toml"))?;
    let profiles = manifest.find("[profile.").map_or("", |at| &manifest[at..]);
    write(&place.join("Cargo.toml"), &format!("[workspace]\nresolver = \"3\"\nmembers = {members:?}\n\n{profiles}"))?;
    write(&place.join("Cargo.lock"), &read(&root.join("Cargo.lock"))?)
}

/// Writes a package for each line of a README's `[dependencies]`, which are alternatives; their names.
fn packages(name: &str, folder: &Path, place: &Path) -> Result<Vec<String>, String> {
    let readme = read(&folder.join("README.md"))?;
    let blocks = code_blocks(&readme);
    if !blocks.iter().any(|block| is_rust(block.kind)) {
        return Ok(Vec::new());
    }
    let source = library(&blocks)?;
    let mut names = Vec::new();
    for (index, features) in dependencies(name, &blocks)?.iter().enumerate() {
        let package = format!("alone-{name}-{}", index + 1);
        let head = format!("[package]\nname = \"{package}\"\nversion = \"0.0.0\"\nedition = \"2024\"\n");
        // Some examples are there with a feature only.
        let own = features.iter().fold(String::new(), |text, feature| text + feature + " = []\n");
        let dependency = format!("{name} = {{ path = {:?}, features = {features:?} }}", folder.display().to_string());
        let manifest = format!("{head}\n[features]\ndefault = {features:?}\n{own}\n[dependencies]\n{dependency}\n");
        write(&place.join(&package).join("Cargo.toml"), &manifest)?;
        write(&place.join(&package).join("src/lib.rs"), &source)?;
        names.push(package);
    }
    Ok(names)
}

/// A module for each example.
fn library(blocks: &[CodeBlock]) -> Result<String, String> {
    let mut source = "#![allow(unused, unexpected_cfgs)]\n".to_owned();
    for CodeBlock { kind, line, lines } in blocks.iter().filter(|block| is_rust(block.kind)) {
        if kind.contains("ignore") {
            return Err(format!("line {line}: an example that is not compiled"));
        }
        source.extend(["\nmod readme_line_", &line.to_string(), " {\n", &module(lines), "}\n"]);
    }
    Ok(source)
}

/// The features that each line of the README's `[dependencies]` asks for.
fn dependencies(name: &str, blocks: &[CodeBlock]) -> Result<Vec<Vec<String>>, String> {
    let lines = blocks.iter().find_map(|block| block.lines.strip_prefix(&["[dependencies]"]));
    let lines = lines.filter(|lines| !lines.is_empty()).ok_or("no block of [dependencies]")?;
    let parsed = lines.iter().map(|line| {
        let (key, value) = line.split('#').next().and_then(|line| line.split_once('=')).unwrap_or_default();
        if key.trim() != name {
            return Err(format!("[dependencies] names `{line}`, expected this crate alone"));
        }
        let features = value.split_once("features = [").map_or("", |(_, rest)| rest);
        Ok(features.split('"').skip(1).step_by(2).map(str::to_owned).collect())
    });
    parsed.collect()
}

/// What rustdoc compiles.
fn is_rust(kind: &str) -> bool {
    let known = ["", "rust", "no_run", "should_panic", "ignore"];
    kind.split(',').all(|word| known.contains(&word.trim()) || word.starts_with("edition"))
}

fn code_blocks(text: &str) -> Vec<CodeBlock<'_>> {
    let mut blocks: Vec<CodeBlock> = Vec::new();
    let mut inside = false;
    for (index, line) in text.lines().enumerate() {
        match (line.strip_prefix("```"), inside) {
            (Some(kind), false) => blocks.push(CodeBlock { kind: kind.trim(), line: index + 2, lines: Vec::new() }),
            (None, true) => blocks.iter_mut().last().into_iter().for_each(|block| block.lines.push(line)),
            _ => {}
        }
        inside ^= line.starts_with("```");
    }
    blocks
}

/// An example as the items of a module, as rustdoc reads it: hidden lines shown, and inside a function where it has no `main`.
fn module(lines: &[&str]) -> String {
    let shown = |line: &&str| match line.strip_prefix('#') {
        Some("") => String::new(),
        Some(rest) if rest.starts_with(' ') => rest[1..].to_owned(),
        Some(rest) if rest.starts_with('#') => rest.to_owned(),
        _ => (*line).to_owned(),
    };
    let text = lines.iter().map(shown).fold(String::new(), |text, line| text + &line + "\n");
    if text.contains("fn main(") {
        text
    } else if text.trim_end().ends_with("(())") {
        format!("fn main() -> Result<(), impl core::fmt::Debug> {{\n{text}}}\n")
    } else {
        format!("fn main() {{\n{text}}}\n")
    }
}

/// Leaves a file that is as it should be alone: cargo takes a newer one for a change.
fn write(path: &Path, text: &str) -> Outcome {
    if std::fs::read_to_string(path).is_ok_and(|found| found == text) {
        return Ok(());
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    std::fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const README: &str = "# a\n```toml\n[dependencies]\na-b = \"0.1\"\n```\n```\nuse a_b::C;\n# C::new();\n#\n```\n\
        ```text\nno code\n```\n```rust\n#[derive(Debug)]\nstruct D;\nOk::<(), D>(())\n```\n";

    #[test]
    fn examples_are_read_as_rustdoc_reads_them() {
        let blocks = code_blocks(README);
        let rust: Vec<&CodeBlock> = blocks.iter().filter(|block| is_rust(block.kind)).collect();
        assert_eq!(rust.iter().map(|block| block.line).collect::<Vec<_>>(), [7, 15]);
        assert_eq!(module(&rust[0].lines), "fn main() {\nuse a_b::C;\nC::new();\n\n}\n");
        assert!(
            module(&rust[1].lines).starts_with("fn main() -> Result<(), impl core::fmt::Debug> {\n#[derive(Debug)]")
        );
        assert_eq!(module(&["fn main() {}"]), "fn main() {}\n");
    }

    #[test]
    fn a_dependency_beside_the_crate_is_named() {
        let blocks = code_blocks(README);
        assert_eq!(dependencies("a-b", &blocks), Ok(vec![Vec::new()]));
        assert!(dependencies("a", &blocks).is_err_and(|message| message.contains("a-b = ")));
        let features =
            "```toml\n[dependencies]\na-b = \"0.1\"\na-b = { version = \"0.1\", features = [\"c\"] } # more\n```\n";
        assert_eq!(dependencies("a-b", &code_blocks(features)), Ok(vec![Vec::new(), vec!["c".to_owned()]]));
        assert!(dependencies("a-b", &code_blocks("```\n```\n")).is_err());
    }
}
