//! Files that once broke a reader, and freshly damaged ones: read or refused, never worse.

#[path = "../examples/fuzz_readers/chance.rs"]
mod chance;
#[path = "../examples/fuzz_readers/mutate.rs"]
mod mutate;
#[path = "../../recordings/tests/common/mod.rs"]
mod recorded;
#[path = "../examples/fuzz_readers/seeds.rs"]
mod seeds;
#[path = "../examples/fuzz_readers/targets.rs"]
mod targets;
#[path = "../examples/fuzz_readers/worker.rs"]
mod worker;

use std::path::Path;

use targets::TARGETS;

#[test]
fn kept_files_are_read_or_refused() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/hostile");
    let mut files = 0;
    for folder in std::fs::read_dir(kept).unwrap() {
        let folder = folder.unwrap();
        let name = folder.file_name().to_string_lossy().into_owned();
        let target = TARGETS.iter().find(|target| target.name == name).unwrap_or_else(|| panic!("no target {name}"));
        for file in std::fs::read_dir(folder.path()).unwrap() {
            let kept = file.unwrap().path();
            // Readers go by the ending.
            let scratch = tempfile::tempdir().unwrap();
            let file = scratch.path().join(target.file);
            std::fs::copy(&kept, &file).unwrap();
            worker::judge(target, &file).unwrap_or_else(|what| panic!("{}: {what}", kept.display()));
            files += 1;
        }
    }
    assert!(files > 30, "{files}");
}

#[test]
fn sound_files_are_read() {
    for target in TARGETS.iter().filter(|target| target.name != "sequence") {
        let scratch = tempfile::tempdir().unwrap();
        for (index, seed) in seeds::of(target.name, scratch.path()).unwrap().iter().enumerate() {
            let file = scratch.path().join(target.file);
            std::fs::write(&file, seed).unwrap();
            assert_eq!(worker::judge(target, &file), Ok(true), "{} {index}", target.name);
        }
    }
}

#[test]
fn damaged_files_are_read_or_refused() {
    let scratch = tempfile::tempdir().unwrap();
    let run = worker::Run { seed: 1, cases: 0..3000, folder: scratch.path().to_owned(), only: None };
    let findings = worker::run(&run).unwrap();
    let word = |f: &worker::Finding| format!("{} {}: {} ({} bytes)", f.target, f.case, f.what, f.bytes.len());
    let words: Vec<String> = findings.iter().map(word).collect();
    assert!(words.is_empty(), "{}", words.join("\n"));
}
