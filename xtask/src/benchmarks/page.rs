//! The page: prose, and between two marks the results of a statistic.

use std::collections::BTreeMap;

const END: &str = "<!-- end -->";

/// The page with all results as they are kept, each between `<!-- results NAME -->` and `<!-- end -->`.
pub(super) fn render(page: &str, stored: &BTreeMap<String, String>) -> Result<String, String> {
    let mut out = String::new();
    let mut placed = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        out += line;
        out.push('\n');
        let Some(name) = line.strip_prefix("<!-- results ").and_then(|rest| rest.strip_suffix(" -->")) else {
            continue;
        };
        let wrong = |what: &str| format!("docs/benchmarks.md: `{line}` {what}");
        out += stored.get(name).ok_or_else(|| wrong("has no file below docs/benchmarks"))?;
        if !lines.any(|line| line == END) {
            return Err(wrong("has no end"));
        }
        out += END;
        out.push('\n');
        placed.push(name);
    }
    match stored.keys().find(|name| !placed.contains(&name.as_str())) {
        Some(name) => Err(format!("docs/benchmarks/{name}.md has no place in docs/benchmarks.md")),
        None => Ok(out),
    }
}

/// The tables among what a command prints, an empty line between two of them.
pub(super) fn tables(output: &str) -> String {
    let lines: Vec<&str> = output.lines().collect();
    let tables = lines.split(|line| !line.starts_with('|')).filter(|table| !table.is_empty());
    tables.map(|table| table.join("\n")).collect::<Vec<_>>().join("\n\n")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn stored(text: &str) -> BTreeMap<String, String> {
        [("frame".to_owned(), text.to_owned())].into()
    }

    #[test]
    fn results_replace_what_is_between_their_marks() -> Result<(), String> {
        let page = "# Page\nprose\n<!-- results frame -->\nold\n\n| old |\n<!-- end -->\nmore\n";
        let rendered = render(page, &stored("new\n\n| new |\n"))?;
        assert_eq!(rendered, "# Page\nprose\n<!-- results frame -->\nnew\n\n| new |\n<!-- end -->\nmore\n");
        assert_eq!(render(&rendered, &stored("new\n\n| new |\n"))?, rendered);
        Ok(())
    }

    #[test]
    fn marks_without_results_without_end_and_results_without_marks_are_told() {
        let of = |page: &str, stored| render(page, &stored).unwrap_err();
        assert!(of("<!-- results other -->\n<!-- end -->\n", stored("")).contains("no file"));
        assert!(of("<!-- results frame -->\nprose\n", stored("")).contains("no end"));
        assert!(of("prose\n", stored("")).contains("docs/benchmarks/frame.md has no place"));
    }

    #[test]
    fn tables_are_taken_out_of_what_is_printed() {
        let output = "── cargo run\n| a |\n|---|\n| 1 |\n\nwords\n| b |\n|---|\n── 3 s\n";
        assert_eq!(tables(output), "| a |\n|---|\n| 1 |\n\n| b |\n|---|");
        assert_eq!(tables("words\n"), "");
    }
}
