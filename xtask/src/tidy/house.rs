//! Size of crates and folders: a crate fits in a head, a folder on a screen.

use std::path::{Path, PathBuf};

/// Most lines of a crate's sources, comments and blank lines included.
const LARGEST_CRATE: usize = 8_000;

/// Most entries of a folder of sources.
const LARGEST_FOLDER: usize = 12;

/// What of a crate is too large.
pub(crate) fn complaints(folder: &Path) -> Result<Vec<String>, String> {
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut found = Vec::new();
    let lines = measure(&folder.join("src"), &format!("{name}/src"), &mut found)?;
    if lines > LARGEST_CRATE {
        found.push(format!("crates/{name}: {lines} lines of sources, at most {LARGEST_CRATE}"));
    }
    Ok(found)
}

/// Lines below a folder; complains of folders with too many entries.
fn measure(folder: &Path, shown: &str, found: &mut Vec<String>) -> Result<usize, String> {
    let list = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let entries: Vec<PathBuf> = list.flatten().map(|entry| entry.path()).collect();
    if entries.len() > LARGEST_FOLDER {
        found.push(format!("crates/{shown}: {} entries, at most {LARGEST_FOLDER}", entries.len()));
    }
    let mut lines = 0;
    for path in entries {
        if path.is_dir() {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            lines += measure(&path, &format!("{shown}/{name}"), found)?;
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            lines += text.lines().count();
        }
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_and_a_crate_that_are_too_large_are_named() -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        let part = folder.path().join("heavy/src/part");
        std::fs::create_dir_all(&part)?;
        for index in 0..13 {
            std::fs::write(part.join(format!("m{index}.rs")), "// a line\n".repeat(700))?;
        }
        let found = complaints(&folder.path().join("heavy"))?;
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("heavy/src/part: 13 entries") && found[1].contains("9100 lines"), "{found:?}");
        Ok(())
    }
}
