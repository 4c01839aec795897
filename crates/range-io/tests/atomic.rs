//! Outputs appear whole or not at all.

use std::fs;
use std::io::Write;

use range_io::atomic::{FileWriter, OutputFolder, write_text};

fn names(folder: &std::path::Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_appears_at_commit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    let mut writer = FileWriter::create(&path).unwrap();
    writer.write_all(b"new").unwrap();
    assert!(!path.exists());
    writer.commit().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_file_without_commit_leaves_the_older_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    write_text(&path, "old").unwrap();
    let mut writer = FileWriter::create(&path).unwrap();
    writer.write_all(b"half").unwrap();
    drop(writer);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_file_is_not_written_over_a_folder_or_into_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    assert!(FileWriter::create(folder.path()).unwrap_err().to_string().contains("is a folder"));
    assert!(FileWriter::create(folder.path().join("no/where.txt")).is_err());
}

#[test]
fn a_folder_replaces_an_older_output() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("out/run");
    for round in ["first", "second"] {
        let output = OutputFolder::create(&target).unwrap();
        fs::write(output.file(format!("{round}/data.txt")).unwrap(), round).unwrap();
        assert!(!target.join(round).exists());
        output.commit().unwrap();
    }
    assert_eq!(names(&target), [OutputFolder::MARKER, "second"]);
    assert_eq!(names(&root.path().join("out")), ["run"]);
}

#[test]
fn a_folder_without_commit_leaves_the_older_output() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    let output = OutputFolder::create(&target).unwrap();
    fs::write(output.path().join("old.txt"), "old").unwrap();
    output.commit().unwrap();
    let output = OutputFolder::create(&target).unwrap();
    fs::write(output.path().join("half.txt"), "half").unwrap();
    drop(output);
    assert_eq!(names(&target), [OutputFolder::MARKER, "old.txt"]);
    assert_eq!(names(root.path()), ["run"]);
}

#[test]
fn a_folder_of_other_things_is_never_replaced() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("thesis");
    fs::create_dir(&target).unwrap();
    // An empty folder may be taken.
    let output = OutputFolder::create(&target).unwrap();
    // Someone puts a file there in the meantime.
    fs::write(target.join("chapter.txt"), "years of work").unwrap();
    assert!(output.commit().unwrap_err().to_string().contains("no earlier output"));
    assert!(OutputFolder::create(&target).is_err());
    assert!(OutputFolder::create(target.join("chapter.txt")).is_err());
    assert_eq!(names(&target), ["chapter.txt"]);
    assert_eq!(names(root.path()), ["thesis"]);
}

#[test]
fn an_output_cut_off_between_its_renames_is_restored() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    // What a commit leaves that was killed after moving the older output aside.
    let aside = root.path().join(".run.replaced");
    fs::create_dir(&aside).unwrap();
    fs::write(aside.join(OutputFolder::MARKER), "").unwrap();
    fs::write(aside.join("old.txt"), "old").unwrap();
    drop(OutputFolder::create(&target).unwrap());
    assert_eq!(names(&target), [OutputFolder::MARKER, "old.txt"]);
    // And one killed before it removed the older output.
    fs::create_dir(&aside).unwrap();
    OutputFolder::create(&target).unwrap().commit().unwrap();
    assert_eq!(names(root.path()), ["run"]);
}
