//! `cargo xtask sensitivity [WORD ...]`: what a statistic says where constants of a crate are other ones.
//!
//! A copy of the repository is built once in which every constant that is a number, and not public, is read from the environment, but
//! for lengths of arrays; the example then runs with each of them at multiples of its value (counts: rounded, at least 1). What `docs/benchmarks.md` says of constants
//! comes from here.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shell::{Outcome, root};

/// Environment variable with the constant that is another one: `file::NAME=MULTIPLE`.
const VARIABLE: &str = "CONSTANT_TIMES";

/// Which constants, and which example judges them.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Constants whose `file::NAME` contains one of these words; all where none is named.
    words: Vec<String>,
    /// Crate whose constants they are.
    #[arg(long, default_value = "projective-registration")]
    package: String,
    /// Example that prints the figures, without times.
    #[arg(long, default_value = "frame_pairs")]
    example: String,
    /// Crate whose example it is, where it is another one.
    #[arg(long)]
    example_of: Option<String>,
    /// Arguments of the example.
    #[arg(long = "arguments", default_value = "verdicts")]
    passed: String,
    /// What each constant is multiplied by.
    #[arg(long, value_delimiter = ',', default_values_t = [0.5, 2.0])]
    multiples: Vec<f64>,
    /// Only lines of the example with this word are compared; all where it is missing.
    #[arg(long)]
    lines: Option<String>,
    /// Only list the constants.
    #[arg(long)]
    list: bool,
}

/// A constant of a file.
#[derive(Debug, PartialEq, Eq)]
struct Constant {
    /// `file::NAME`, the file from the crate's `src` on, without its ending.
    path: String,
    value: String,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let folder = root().join("target/sensitivity");
    let copy = folder.join("rangecam");
    copy_of_repository(&folder, &copy)?;
    let source = copy.join("crates").join(&arguments.package).join("src");
    let asked = |constant: &Constant| {
        arguments.words.is_empty() || arguments.words.iter().any(|word| constant.path.contains(word.as_str()))
    };
    let constants: Vec<Constant> = opened(&source)?.into_iter().filter(asked).collect();
    if constants.is_empty() {
        return Err(format!("no constant of {} is named so: {}", arguments.package, arguments.words.join(", ")));
    }
    if arguments.list {
        for constant in &constants {
            println!("{} = {}", constant.path, constant.value);
        }
        return Ok(());
    }
    let program = built(&folder, &copy, arguments)?;
    let said = |change: Option<String>| -> Result<String, String> {
        let mut command = Command::new(&program);
        command.args(arguments.passed.split_whitespace()).envs(change.map(|change| (VARIABLE, change)));
        let output = command.output().map_err(|error| format!("{}: {error}", program.display()))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let kept = text.lines().filter(|line| arguments.lines.as_ref().is_none_or(|word| line.contains(word)));
        Ok(kept.map(without_times).collect::<Vec<_>>().join("\n"))
    };
    let as_it_is = said(None)?;
    println!("as it is:\n{as_it_is}");
    for constant in &constants {
        for multiple in &arguments.multiples {
            let now = said(Some(format!("{}={multiple}", constant.path)))?;
            println!("{} = {} times {multiple}: {}", constant.path, constant.value, difference(&as_it_is, &now));
        }
    }
    Ok(())
}

/// A line without its milliseconds, which differ from run to run.
fn without_times(line: &str) -> String {
    let words: Vec<&str> = line.split(' ').collect();
    let is_time = |k: usize| words.get(k + 1).is_some_and(|unit| unit.trim_end_matches([',', ')', ';']) == "ms");
    let kept = words.iter().enumerate().map(|(k, word)| if is_time(k) { "_" } else { *word });
    kept.collect::<Vec<_>>().join(" ")
}

/// The lines that differ.
fn difference(before: &str, now: &str) -> String {
    let mut text = String::new();
    for line in now.lines().filter(|line| !before.lines().any(|other| other == *line)) {
        let _ = write!(text, "\n    {line}");
    }
    if text.is_empty() { "the same".to_owned() } else { text }
}

/// All files under version control as they are now, beside a link to what lies beside the repository for reading.
fn copy_of_repository(folder: &Path, copy: &Path) -> Outcome {
    let failed = |error: std::io::Error| format!("{}: {error}", copy.display());
    let listed = Command::new("git").args(["ls-files", "-z", "-co", "--exclude-standard"]).current_dir(root()).output();
    let listed = listed.map_err(|error| format!("git: {error}"))?.stdout;
    if copy.exists() {
        std::fs::remove_dir_all(copy).map_err(failed)?;
    }
    for name in String::from_utf8_lossy(&listed).split('\0').filter(|name| root().join(name).is_file()) {
        let to = copy.join(name);
        std::fs::create_dir_all(to.parent().unwrap_or(copy)).map_err(failed)?;
        std::fs::copy(root().join(name), &to).map_err(failed)?;
    }
    let (beside, link) = (root().join("../shared"), folder.join("shared"));
    #[cfg(unix)]
    if beside.exists() && !link.exists() {
        std::os::unix::fs::symlink(beside.canonicalize().map_err(failed)?, link).map_err(failed)?;
    }
    Ok(())
}

/// Has every constant of the crate read from the environment; the constants.
fn opened(source: &Path) -> Result<Vec<Constant>, String> {
    let mut texts = Vec::new();
    for file in files(source)? {
        let text = std::fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let name = file.strip_prefix(source).unwrap_or(&file).with_extension("").to_string_lossy().into_owned();
        texts.push((file, name, text));
    }
    let shared = shared(&texts.iter().map(|(_, name, text)| (name.as_str(), text.as_str())).collect::<Vec<_>>());
    let mut constants = Vec::new();
    for (file, name, text) in &texts {
        let (text, found) = opened_file(text, name, &shared);
        std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))?;
        constants.extend(found);
    }
    let library = source.join("lib.rs");
    let text = std::fs::read_to_string(&library).map_err(|error| format!("{}: {error}", library.display()))?;
    let reader = format!(
        "\npub(crate) fn constant_times(path: &str) -> f64 {{\n    \
         let change = std::env::var(\"{VARIABLE}\").unwrap_or_default();\n    \
         let asked = change.split_once('=').filter(|(name, _)| *name == path);\n    \
         asked.and_then(|(_, multiple)| multiple.parse().ok()).unwrap_or(1.0)\n}}\n"
    );
    std::fs::write(&library, text + &reader).map_err(|error| format!("{}: {error}", library.display()))?;
    constants.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(constants)
}

/// Module and name of the constants that other files of the crate use as they are: neither handed on, nor a part of others.
fn shared<'t>(texts: &[(&'t str, &'t str)]) -> Vec<(&'t str, &'t str)> {
    let mut found = Vec::new();
    for (file, text) in texts {
        let module = file.trim_end_matches("/mod").rsplit('/').next().unwrap_or(file);
        let open = text.lines().filter(|line| line.starts_with("pub(")).filter_map(declaration);
        found.extend(open.map(|(name, ..)| (module, name)));
    }
    let stays = |name: &str| {
        let handed_on =
            |text: &str| uses(text).any(|own| own.starts_with("pub") && names(own).any(|word| word == name));
        texts.iter().any(|(_, text)| is_part(name, text) || handed_on(text))
    };
    found.retain(|(_, name)| !stays(name));
    found
}

/// The `use` statements of a file.
fn uses(text: &str) -> impl Iterator<Item = &str> {
    let is_use = |own: &&str| own.starts_with("use ") || own.starts_with("pub") && own.contains(" use ");
    text.split(';').map(|own| own.trim_start().rsplit("\n\n").next().unwrap_or(own)).filter(is_use)
}

fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !is_of_name(c))
}

/// Whether other constants, or lengths of arrays, are made of a constant.
fn is_part(name: &str, text: &str) -> bool {
    let is_constant = |line: &&str| line.contains("const ") && declaration(line).is_none();
    let is_length = |line: &&str| {
        let behind = |part: &str| part.split_once(']').is_some_and(|(length, _)| length.contains(name));
        line.split("; ").skip(1).any(behind) || line.contains(&format!("<{name}"))
    };
    // In braces it is a part of a message.
    let in_text = |line: &&str| line.contains(&format!("{{{name}}}"));
    let others = text.lines().filter(|line| is_constant(line) || is_length(line) || in_text(line));
    others.flat_map(names).any(|word| word == name)
}

/// A file in which constants with a number for a value are functions, and these constants; `shared`: module and name of those that others use.
fn opened_file(text: &str, file: &str, shared: &[(&str, &str)]) -> (String, Vec<Constant>) {
    let found: Vec<_> = text.lines().filter_map(|line| opened_line(line, text, shared)).collect();
    let imported = |&&(module, name): &&(&str, &str)| {
        uses(text).any(|own| names(own).any(|word| word == module) && names(own).any(|word| word == name))
    };
    let own = found.iter().map(|own| own[1]).chain(shared.iter().filter(imported).map(|other| other.1));
    let own: Vec<&str> = own.collect();
    let mut is_use = false;
    let lines = text.lines().map(|line| {
        is_use |= line.starts_with("use ") || line.starts_with("pub") && line.contains(" use ");
        let stays = is_use || line.trim_start().starts_with("//");
        is_use &= !line.contains(';');
        match opened_line(line, text, shared) {
            _ if stays => line.to_owned(),
            Some([visibility, name, kind, value]) => format!(
                "#[allow(non_snake_case)]\n{visibility}fn {name}() -> {kind} {{\n    static VALUE: std::sync::OnceLock<{kind}> = \
                 std::sync::OnceLock::new();\n    *VALUE.get_or_init(|| {})\n}}",
                if kind == "usize" {
                    format!("(({value} as f64 * crate::constant_times(\"{file}::{name}\")).round() as usize).max(1)")
                } else {
                    format!("{value} * crate::constant_times(\"{file}::{name}\") as {kind}")
                }
            ),
            None => called(line, &own, shared),
        }
    });
    let constants = found.iter().map(|own| Constant { path: format!("{file}::{}", own[1]), value: own[3].to_owned() });
    (lines.collect::<Vec<_>>().join("\n") + "\n", constants.collect())
}

/// Visibility, name, type and value of a constant that is opened.
fn opened_line<'l>(line: &'l str, text: &str, shared: &[(&str, &str)]) -> Option<[&'l str; 4]> {
    let (name, kind, value) = declaration(line)?;
    let visibility = line.split_once("const ")?.0;
    let is_shared = shared.iter().any(|other| other.1 == name);
    let opens = if visibility.is_empty() { !is_part(name, text) } else { is_shared };
    opens.then_some([visibility, name, kind, value])
}

/// Name, type and value of `const NAME: f64 = 0.5;` at the beginning of a line, public in the crate at most; counts are of at least 2.
fn declaration(line: &str) -> Option<(&str, &str, &str)> {
    let private = ["pub(crate) ", "pub(super) "].iter().find_map(|visibility| line.strip_prefix(visibility));
    let (name, rest) = private.unwrap_or(line).strip_prefix("const ")?.split_once(": ")?;
    let (kind, value) = rest.strip_suffix(';')?.split_once(" = ")?;
    let is_number = value.replace('_', "").parse::<f64>().is_ok_and(f64::is_finite);
    let is_count = kind == "usize" && value.parse::<usize>().is_ok_and(|count| count > 1);
    (is_number && (kind == "f64" || kind == "f32" || is_count)).then_some((name, kind, value))
}

const fn is_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

/// The line with each of these names called as a function; behind a path only those of `shared` behind their module.
fn called(line: &str, names: &[&str], shared: &[(&str, &str)]) -> String {
    let mut text = String::new();
    let mut rest = line;
    while !rest.is_empty() {
        let end = rest.find(|c: char| !is_of_name(c)).unwrap_or(rest.len());
        let (word, behind) = rest.split_at(end);
        text.push_str(word);
        let path = text[..text.len() - word.len()].strip_suffix("::");
        let is_of = |path: &str| shared.iter().any(|(module, name)| *name == word && names_last(path) == *module);
        if path.map_or(names.contains(&word), is_of) {
            text.push_str("()");
        }
        let next = behind.find(is_of_name).unwrap_or(behind.len());
        text.push_str(&behind[..next]);
        rest = &behind[next..];
    }
    text
}

/// The last name of a path.
fn names_last(path: &str) -> &str {
    path.rsplit(|c: char| !is_of_name(c)).next().unwrap_or(path)
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    Ok(found)
}

/// The example of the copy. It has a folder of its own for what is built: cargo would take its crates for the repository's.
fn built(folder: &Path, copy: &Path, arguments: &Arguments) -> Result<PathBuf, String> {
    let target = folder.join("target");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args([
            "build",
            "--package",
            arguments.example_of.as_ref().unwrap_or(&arguments.package),
            "--all-features",
            "--release",
            "--example",
            &arguments.example,
        ])
        .current_dir(copy)
        .env("CARGO_TARGET_DIR", &target)
        .status()
        .map_err(|error| format!("cargo: {error}"))?;
    if !status.success() {
        return Err(format!("the copy in {} does not build: {status}", copy.display()));
    }
    Ok(target.join("release/examples").join(&arguments.example))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_do_not_count_as_a_difference() {
        assert_eq!(
            without_times("a: 12 right, 3.4 ms (one cloud 5 ms), 7 mm"),
            "a: 12 right, _ ms (one cloud _ ms), 7 mm"
        );
    }

    #[test]
    fn constants_are_opened_and_their_uses_called() {
        let text = "/// Share.\nconst SHARE: f64 = 0.5;\npub const OPEN: f64 = 1.0;\nconst COUNT: usize = 3;\nstruct S([u8; 2 * COUNT]);\nconst MOST: usize = 4;\nconst A: f32 = 2.0;\nconst B: f32 = A * 3.0;\nfn f() -> f64 {\n    // SHARE of all\n    SHARE * other::SHARE + MY_SHARE\n}\n";
        let (opened, constants) = opened_file(text, "folder/file", &[]);
        let of = |name: &str, value: &str| Constant { path: format!("folder/file::{name}"), value: value.to_owned() };
        assert_eq!(constants, [of("SHARE", "0.5"), of("MOST", "4")]);
        assert!(opened.contains("fn MOST() -> usize") && opened.contains("const COUNT: usize = 3;"), "{opened}");
        assert!(opened.contains("fn SHARE() -> f64"), "{opened}");
        assert!(opened.contains("    SHARE() * other::SHARE + MY_SHARE"), "{opened}");
        assert!(opened.contains("// SHARE of all") && opened.contains("const A: f32 = 2.0;"), "{opened}");
    }

    #[test]
    fn constants_that_other_files_use_are_called_there() {
        let home =
            "pub(crate) const FAR: f64 = 2.0;\npub(crate) const WIDE: usize = 5;\npub(crate) const OUT: f64 = 1.0;\n";
        let user = "//! Uses.\n\nuse crate::home::{\n    FAR,\n    WIDE,\n};\npub(crate) use crate::home::OUT;\nfn f(a: [f64; WIDE]) -> f64 {\n    FAR * home::FAR * other::FAR * OUT\n}\n";
        let shared = shared(&[("folder/home", home), ("folder/user", user)]);
        assert_eq!(shared, [("home", "FAR")], "one is a length, one is handed on");
        let (opened, constants) = opened_file(home, "folder/home", &shared);
        assert_eq!(constants, [Constant { path: "folder/home::FAR".to_owned(), value: "2.0".to_owned() }]);
        assert!(opened.contains("pub(crate) fn FAR() -> f64") && opened.contains("const WIDE: usize = 5;"), "{opened}");
        let (opened, _) = opened_file(user, "folder/user", &shared);
        assert!(
            opened.contains("\n    FAR,\n") && opened.contains("FAR() * home::FAR() * other::FAR * OUT"),
            "{opened}"
        );
    }
}
