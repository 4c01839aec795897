//! Options say what they are where nobody sets them.

use std::collections::BTreeSet;

/// Public fields of `…Options` and `…Settings` with a default whose documentation does not state it. `texts` are all
/// sources as they are shown, `crates/name/src/..`, and what stands in them.
pub(crate) fn complaints(texts: &[(String, String)]) -> Vec<String> {
    let sources = || texts.iter().filter_map(|(shown, text)| Some((shown, crate_of(shown)?, text)));
    let mut defaults = BTreeSet::new();
    for (_, name, text) in sources() {
        let implemented = text.lines().filter_map(|line| line.split_once("impl Default for ").map(|(_, rest)| rest));
        defaults.extend(implemented.map(|rest| (name, identifier(rest))));
    }
    let mut found = Vec::new();
    for (shown, name, text) in sources() {
        let lines: Vec<&str> = text.lines().collect();
        for (index, line) in lines.iter().enumerate() {
            let head = line.strip_prefix("pub struct ").filter(|head| head.ends_with('{'));
            let Some(options) = head.map(identifier) else { continue };
            let named = options.ends_with("Options") || options.ends_with("Settings");
            if named && (is_derived(&lines[..index]) || defaults.contains(&(name, options))) {
                let silent = silent_fields(&lines[index + 1..]).into_iter();
                found.extend(silent.map(|field| format!("{shown}: {options}::{field} does not say its default")));
            }
        }
    }
    found
}

/// The crate that a source belongs to.
fn crate_of(shown: &str) -> Option<&str> {
    let (name, rest) = shown.strip_prefix("crates/")?.split_once('/')?;
    rest.starts_with("src/").then_some(name)
}

fn identifier(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    &text[..end]
}

/// Whether the attributes right above derive `Default`.
fn is_derived(above: &[&str]) -> bool {
    let attributes = above.iter().rev().take_while(|line| line.starts_with("#[") || line.starts_with("///"));
    attributes.into_iter().any(|line| line.starts_with("#[derive(") && line.contains("Default"))
}

/// Public fields of a struct, from the line after its name, whose documentation lacks the word.
fn silent_fields<'a>(lines: &[&'a str]) -> Vec<&'a str> {
    let (mut silent, mut stated) = (Vec::new(), false);
    for line in lines.iter().take_while(|line| !line.starts_with('}')).map(|line| line.trim()) {
        if line.starts_with("///") {
            stated |= line.to_lowercase().contains("default");
        } else if !line.starts_with("#[") {
            if let Some(field) = line.strip_prefix("pub ").filter(|_| !stated) {
                silent.push(identifier(field));
            }
            stated = false;
        }
    }
    silent
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_without_its_default_is_named() {
        let source = "#[derive(Debug, Default)]\npub struct AOptions {\n    /// Metre. Default: 0.\n    pub a_m: f64,\n    \
            /// Metre.\n    #[x]\n    pub b_m: f64,\n}\npub struct BOptions {\n    pub c: f64,\n}\n\
            pub struct COptions<'a> {\n    pub d: &'a str,\n}\nimpl Default for COptions<'_> {}\n";
        let texts = |path: &str| vec![(path.to_owned(), source.to_owned())];
        let found = complaints(&texts("crates/x/src/lib.rs"));
        assert_eq!(
            found,
            ["AOptions::b_m", "COptions::d"]
                .map(|field| format!("crates/x/src/lib.rs: {field} does not say its default"))
        );
        assert!(complaints(&texts("crates/x/tests/main.rs")).is_empty());
    }
}
