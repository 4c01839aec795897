//! Licences, sources and duplicates of what is compiled in, held against `deny.toml` without any tool beside cargo.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What speaks against the packages of the workspace's lock file on this machine.
pub(crate) fn complaints(root: &Path) -> Result<Vec<String>, String> {
    let rules = std::fs::read_to_string(root.join("deny.toml")).map_err(|error| format!("deny.toml: {error}"))?;
    let metadata = metadata(root)?;
    let none = Vec::new();
    // With a platform named, all packages are listed, and those that it compiles stand in `resolve`.
    let compiled: BTreeSet<&str> = nodes(&metadata).filter_map(|node| node["id"].as_str()).collect();
    let packages = metadata["packages"].as_array().unwrap_or(&none);
    let packages: Vec<&Value> =
        packages.iter().filter(|package| package["id"].as_str().is_some_and(|id| compiled.contains(id))).collect();
    let mut found = licences(&packages, &strings(&rules, "allow"));
    found.extend(sources(&packages));
    found.extend(banned(&metadata, &packages, &rules));
    found.extend(duplicates(&packages, &strings(&rules, "skip")));
    found.extend(too_new(&packages, &rust_version(root)?));
    Ok(found)
}

fn metadata(root: &Path) -> Result<Value, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let rustc = Command::new("rustc").arg("-vV").output().map_err(|error| format!("rustc: {error}"))?;
    let version = String::from_utf8_lossy(&rustc.stdout).into_owned();
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).ok_or("rustc does not tell its host")?;
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--all-features", "--locked", "--filter-platform", host])
        .current_dir(root)
        .output()
        .map_err(|error| format!("cargo metadata: {error}"))?;
    if !output.status.success() {
        return Err(format!("cargo metadata: {}", String::from_utf8_lossy(&output.stderr)));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| format!("cargo metadata: {error}"))
}

fn nodes(metadata: &Value) -> impl Iterator<Item = &Value> {
    metadata["resolve"]["nodes"].as_array().into_iter().flatten()
}

fn name(package: &Value) -> &str {
    package["name"].as_str().unwrap_or_default()
}

fn licences(packages: &[&Value], allowed: &[String]) -> Vec<String> {
    let refused = packages.iter().filter_map(|package| {
        let licence = package["license"].as_str().unwrap_or("none");
        (!is_allowed(licence, allowed)).then(|| format!("{}: licence `{licence}` is not in deny.toml", name(package)))
    });
    refused.collect()
}

/// Whether an SPDX expression can be met by allowed licences. `OR` binds less than `AND`; `/` is an old way to write it.
fn is_allowed(expression: &str, allowed: &[String]) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    let holds = any(&words, &mut at, allowed);
    holds && at == words.len()
}

fn any(words: &[&str], at: &mut usize, allowed: &[String]) -> bool {
    let mut holds = all(words, at, allowed);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        holds |= all(words, at, allowed);
    }
    holds
}

fn all(words: &[&str], at: &mut usize, allowed: &[String]) -> bool {
    let mut holds = one(words, at, allowed);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        holds &= one(words, at, allowed);
    }
    holds
}

fn one(words: &[&str], at: &mut usize, allowed: &[String]) -> bool {
    let Some(word) = words.get(*at) else { return false };
    *at += 1;
    if *word == "(" {
        let holds = any(words, at, allowed);
        *at += 1;
        return holds;
    }
    let mut licence = (*word).to_owned();
    if words.get(*at) == Some(&"WITH") {
        licence = format!("{word} WITH {}", words.get(*at + 1).unwrap_or(&""));
        *at += 2;
    }
    allowed.contains(&licence)
}

fn sources(packages: &[&Value]) -> Vec<String> {
    let other = packages.iter().filter(|package| {
        package["source"]
            .as_str()
            .is_some_and(|source| !source.starts_with("registry+") && !source.starts_with("sparse+"))
    });
    other.map(|package| format!("{}: comes from {}, expected the registry", name(package), package["source"])).collect()
}

/// Crates that nothing but a wrapper may depend on.
fn banned(metadata: &Value, packages: &[&Value], rules: &str) -> Vec<String> {
    let quoted = |text: &str| -> Vec<String> { text.split('"').skip(1).step_by(2).map(str::to_owned).collect() };
    let mut found = Vec::new();
    // One line an entry: `{ crate = "cc", wrappers = ["generator"] }`.
    for line in rules.lines().filter(|line| line.contains("crate = ") && line.contains("wrappers = ")) {
        let words = quoted(line);
        let Some((banned, wrappers)) = words.split_first() else { continue };
        let name_of: BTreeMap<&str, &str> =
            packages.iter().filter_map(|package| Some((package["id"].as_str()?, name(package)))).collect();
        for node in nodes(metadata) {
            let dependencies = node["deps"].as_array().into_iter().flatten();
            let needs = dependencies.filter_map(|dep| name_of.get(dep["pkg"].as_str()?)).any(|dep| dep == banned);
            let by = node["id"].as_str().and_then(|id| name_of.get(id)).copied().unwrap_or_default();
            if needs && !wrappers.iter().any(|wrapper| wrapper == by) {
                found.push(format!("{by}: needs the crate {banned}, which deny.toml bans"));
            }
        }
    }
    found
}

/// The oldest compiler that the workspace promises to build with.
pub(crate) fn rust_version(root: &Path) -> Result<String, String> {
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).map_err(|error| format!("Cargo.toml: {error}"))?;
    let stated = manifest.lines().find_map(|line| line.strip_prefix("rust-version = \"")?.strip_suffix('"'));
    stated.map(str::to_owned).ok_or_else(|| "Cargo.toml: no rust-version".to_owned())
}

/// Crates that ask for a newer compiler than the workspace promises.
fn too_new(packages: &[&Value], promised: &str) -> Vec<String> {
    let newer = packages.iter().filter_map(|package| {
        let asked = package["rust_version"].as_str()?;
        let text = || format!("{}: asks for Rust {asked}, the workspace promises {promised}", name(package));
        (numbers(asked) > numbers(promised)).then(text)
    });
    newer.collect()
}

fn numbers(version: &str) -> Vec<u32> {
    let mut numbers: Vec<u32> = version.split('.').map(|part| part.parse().unwrap_or(0)).collect();
    numbers.resize(3, 0);
    numbers
}

/// Crates in two versions that no entry of `skip` names.
fn duplicates(packages: &[&Value], skipped: &[String]) -> Vec<String> {
    let mut versions: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for package in packages {
        versions.entry(name(package)).or_default().insert(package["version"].as_str().unwrap_or_default());
    }
    let twice =
        versions.into_iter().filter(|(name, found)| found.len() > 1 && !skipped.iter().any(|skip| skip == name));
    twice.map(|(name, found)| format!("{name}: compiled in versions {found:?}; deny.toml skips only others")).collect()
}

/// The strings of the list `key = [ ... ]` in a TOML text.
fn strings(text: &str, key: &str) -> Vec<String> {
    let mut lines = text.lines().skip_while(|line| !line.starts_with(&format!("{key} = [")));
    let mut list = String::new();
    for line in lines.by_ref() {
        // A comment behind an entry may hold quotes.
        let line = line.split_once('#').map_or(line, |(before, _)| before);
        list.push_str(line);
        if line.contains(']') {
            break;
        }
    }
    list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_of_licences_are_understood() {
        let allowed: Vec<String> = ["MIT", "Apache-2.0 WITH LLVM-exception", "Zlib"].map(str::to_owned).to_vec();
        for fine in
            ["MIT", "MIT OR GPL-3.0", "GPL-3.0/MIT", "(GPL-3.0 OR MIT) AND Zlib", "Apache-2.0 WITH LLVM-exception"]
        {
            assert!(is_allowed(fine, &allowed), "{fine}");
        }
        for wrong in ["GPL-3.0", "MIT AND GPL-3.0", "Apache-2.0", "none", "", "MIT GPL-3.0", "(MIT AND GPL-3.0) OR"] {
            assert!(!is_allowed(wrong, &allowed), "{wrong}");
        }
    }

    #[test]
    fn a_crate_for_a_newer_compiler_is_named() {
        let package = |version: &str| serde_json::json!({ "name": "x", "rust_version": version });
        let (old, new) = (package("1.9.3"), package("1.90.1"));
        assert!(too_new(&[&old, &package("1.90.0")], "1.90").is_empty());
        assert_eq!(too_new(&[&old, &new], "1.90"), ["x: asks for Rust 1.90.1, the workspace promises 1.90"]);
    }

    #[test]
    fn lists_are_read_from_the_rules() {
        let text = "[a]\nallow = [\n    \"MIT\", # \"not this\"\n    \"Zlib\",\n]\nskip = [\"x\"]\n";
        assert_eq!(strings(text, "allow"), ["MIT", "Zlib"]);
        assert_eq!((strings(text, "skip"), strings(text, "none").len()), (vec!["x".to_owned()], 0));
    }
}
