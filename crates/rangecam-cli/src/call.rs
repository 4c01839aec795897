//! What of the typed arguments a result depends on.

use std::ffi::OsString;

use pipeline::commands::made::Call;

use crate::arguments::Arguments;

/// Options that a result does not depend on, by their names, and whether a value follows.
const NOT_RECORDED: [(&str, bool); 9] = [
    ("--quiet", false),
    ("-q", false),
    ("--json", false),
    ("--skip-done", false),
    ("--threads", true),
    ("--memory", true),
    ("--out", true),
    ("-o", true),
    // Parts and the whole are made with the same options.
    ("--shard", true),
];

/// How the program was called.
pub(crate) fn call(typed: &[OsString], arguments: &Arguments) -> Call {
    Call { options: recorded(typed), skip_done: arguments.skip_done, no_times: arguments.no_times }
}

fn recorded(typed: &[OsString]) -> Vec<String> {
    let mut words = typed.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
    let mut options = Vec::new();
    while let Some(word) = words.next() {
        let is = |name: &str, has_value: bool| {
            let with_value = || word.strip_prefix(name).is_some_and(|rest| rest.starts_with('='));
            word == name || (has_value && with_value())
        };
        match NOT_RECORDED.into_iter().find(|(name, has_value)| is(name, *has_value)) {
            Some((name, true)) if word == name => drop(words.next()),
            Some(_) => {}
            None => options.push(word),
        }
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_result_does_not_depend_on_is_left_out() {
        let words = |line: &str| recorded(&line.split(' ').map(OsString::from).collect::<Vec<_>>());
        let plain = ["run", "survey", "-p", "p.ron"];
        for line in [
            "rangecam run survey -p p.ron",
            "rangecam --threads 2 run survey --memory 2GB -p p.ron --out x --shard 1/2 -q --json",
            "rangecam run survey --threads=2 --shard=2/2 -p p.ron -o x --skip-done",
        ] {
            assert_eq!(words(line), plain, "{line}");
        }
        assert_eq!(words("rangecam --no-times run survey"), ["--no-times", "run", "survey"]);
    }
}
