//! Outputs appear whole or not at all, and never over what they were made from.

use std::fs;
use std::io::Write;
use std::path::Path;

use atomic_output::{Destination, Error, FileWriter, OutputFolder, fault, write_text};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// An output of nothing that is read.
fn open(target: &Path) -> Result<OutputFolder, Error> {
    Destination::new(target, &[] as &[&Path])?.open()
}

/// Writes files of these names into an output, each with its name as text.
fn output(target: &Path, files: &[&str]) -> Result<(), Error> {
    let output = open(target)?;
    for file in files {
        write_text(output.file(file)?, file)?;
    }
    output.commit()
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
        let output = open(&target).unwrap();
        // Written by other means, too.
        fs::write(output.file(format!("{round}/data.txt")).unwrap(), round).unwrap();
        assert!(!target.join(round).exists());
        output.commit().unwrap();
    }
    assert_eq!(names(&target), [OutputFolder::MARKER, "second"]);
    assert_eq!(names(&root.path().join("out")), ["run"]);
    let marker = fs::read_to_string(target.join(OutputFolder::MARKER)).unwrap();
    assert_eq!(marker.lines().skip(1).collect::<Vec<_>>(), ["second/data.txt"]);
}

#[test]
fn a_folder_without_commit_leaves_the_older_output() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    output(&target, &["old.txt"]).unwrap();
    let unfinished = open(&target).unwrap();
    fs::write(unfinished.path().join("half.txt"), "half").unwrap();
    drop(unfinished);
    assert_eq!(names(&target), [OutputFolder::MARKER, "old.txt"]);
    assert_eq!(names(root.path()), ["run"]);
    // Parents that were made for it go with it.
    drop(open(&root.path().join("a/b/c")).unwrap());
    assert_eq!(names(root.path()), ["run"]);
}

#[test]
fn a_folder_of_other_things_is_never_replaced() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("thesis");
    fs::create_dir(&target).unwrap();
    // An empty folder may be taken.
    let output = open(&target).unwrap();
    // Someone puts a file there in the meantime.
    fs::write(target.join("chapter.txt"), "years of work").unwrap();
    assert!(output.commit().unwrap_err().to_string().contains("no earlier output"));
    assert!(open(&target).is_err());
    assert!(open(&target.join("chapter.txt")).is_err());
    assert_eq!(names(&target), ["chapter.txt"]);
    assert_eq!(names(root.path()), ["thesis"]);
}

#[test]
fn files_that_the_output_did_not_write_are_kept_and_named() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    let add_file = |path: &Path| fs::write(path, "mine").unwrap();
    let add_folder = |path: &Path| fs::create_dir(path).unwrap();
    #[allow(clippy::type_complexity)]
    let cases: [(&str, &dyn Fn(&Path)); 3] =
        [("notes.txt", &add_file), ("frames/mine.txt", &add_file), ("empty", &add_folder)];
    for (name, add) in cases {
        output(&target, &["cloud.ply", "frames/a.npz"]).unwrap();
        add(&target.join(name));
        let words = open(&target).unwrap_err().to_string();
        assert!(words.contains(&format!("`{name}`")) && words.contains("did not write"), "{words}");
        assert!(target.join(name).exists() && target.join("cloud.ply").exists());
        fs::remove_dir_all(&target).unwrap();
    }
    // Put there while the new output is being written.
    output(&target, &["cloud.ply"]).unwrap();
    let unfinished = open(&target).unwrap();
    add_file(&target.join("notes.txt"));
    assert!(unfinished.commit().unwrap_err().to_string().contains("`notes.txt`"));
    assert_eq!(names(&target), [OutputFolder::MARKER, "cloud.ply", "notes.txt"]);
    assert_eq!(names(root.path()), ["run"]);
}

#[test]
fn an_output_without_a_list_is_not_removed() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    fs::create_dir(&target).unwrap();
    for marker in ["This folder is written and replaced as a whole.\n", "", "../secret\n"] {
        fs::write(target.join(OutputFolder::MARKER), marker).unwrap();
        let words = open(&target).unwrap_err().to_string();
        assert!(words.contains("earlier version") && words.contains("name another folder"), "{words}");
    }
    // A list that names what lies elsewhere takes nothing from there.
    fs::remove_dir_all(&target).unwrap();
    fs::write(root.path().join("secret"), "kept").unwrap();
    output(&target, &["a.txt"]).unwrap();
    let marker = target.join(OutputFolder::MARKER);
    let text = fs::read_to_string(&marker).unwrap();
    fs::write(&marker, format!("{text}../secret\n{}\n", root.path().join("secret").display())).unwrap();
    output(&target, &["b.txt"]).unwrap();
    assert_eq!(names(root.path()), ["run", "secret"]);
}

#[test]
fn an_output_is_not_written_over_what_is_read() {
    let root = tempfile::tempdir().unwrap();
    let at = |path: &str| root.path().join(path);
    fs::create_dir_all(at("q/frames")).unwrap();
    fs::write(at("q/survey.ron"), "").unwrap();
    let hostile = ["q", "q/frames", "q/new/deep", "x/../q", "q/../q", "q/.", "no/such/../../q"];
    for out in hostile.map(at).into_iter().chain([root.path().to_path_buf()]) {
        let error = Destination::new(&out, &[at("q")]).unwrap_err();
        assert!(matches!(error, Error::OverInput { .. }), "{}: {error}", out.display());
    }
    // A file that is read may have an output beside it, but none in its place or around it.
    for out in ["q/survey.ron", "q"] {
        assert!(matches!(Destination::new(at(out), &[at("q/survey.ron")]).unwrap_err(), Error::OverInput { .. }));
    }
    Destination::new(at("q/out"), &[at("q/survey.ron")]).unwrap();
    // Names that only begin alike.
    Destination::new(at("q2"), &[at("q")]).unwrap();
    // Inputs that are not there are no reason to fail here.
    assert!(Destination::new(at("n/m"), &[at("n")]).is_err());
    for nameless in ["..", ".", "/", ""] {
        assert!(Destination::new(nameless, &[at("q")]).is_err());
    }
    assert_eq!(names(root.path()), ["q"]);
}

#[cfg(unix)]
#[test]
fn links_are_followed() {
    use std::os::unix::fs::symlink;
    let root = tempfile::tempdir().unwrap();
    let at = |path: &str| root.path().join(path);
    fs::create_dir_all(at("q")).unwrap();
    symlink(at("q"), at("to_q")).unwrap();
    symlink("to_q", at("to_link")).unwrap();
    symlink(root.path(), at("q/up")).unwrap();
    symlink("circle", at("circle")).unwrap();
    for (out, input) in [("to_q", "q"), ("to_link", "q"), ("q", "to_link"), ("to_q/new", "q"), ("q/up/q/x", "q")] {
        assert!(
            matches!(Destination::new(at(out), &[at(input)]).unwrap_err(), Error::OverInput { .. }),
            "{out} {input}"
        );
    }
    assert!(Destination::new(at("circle"), &[at("q")]).is_err());
    // The folder that a link leads to is replaced, and the link stays; also one that leads to nothing yet.
    symlink("real", at("link")).unwrap();
    for file in ["first.txt", "second.txt"] {
        output(&at("link"), &[file]).unwrap();
        assert_eq!(names(&at("real")), [OutputFolder::MARKER, file]);
        assert!(at("link").is_symlink());
    }
    // A link among the files of an output goes, and not what it leads to.
    symlink(at("real/second.txt"), at("real/cloud.ply")).unwrap();
    let marker = at("real").join(OutputFolder::MARKER);
    fs::write(&marker, format!("{}cloud.ply\n", fs::read_to_string(&marker).unwrap())).unwrap();
    fs::remove_file(at("real/cloud.ply")).unwrap();
    fs::write(at("elsewhere.txt"), "kept").unwrap();
    symlink(at("elsewhere.txt"), at("real/cloud.ply")).unwrap();
    output(&at("real"), &["third.txt"]).unwrap();
    assert_eq!(fs::read_to_string(at("elsewhere.txt")).unwrap(), "kept");
    assert_eq!(names(&at("real")), [OutputFolder::MARKER, "third.txt"]);
}

#[test]
fn an_output_cut_off_between_its_renames_is_restored() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    // What a commit leaves that was killed after moving the older output aside.
    output(&target, &["old.txt"]).unwrap();
    let aside = root.path().join(".run.replaced");
    fs::rename(&target, &aside).unwrap();
    drop(open(&target).unwrap());
    assert_eq!(names(&target), [OutputFolder::MARKER, "old.txt"]);
    // And one killed before it removed the older output.
    fs::create_dir(&aside).unwrap();
    output(&target, &["new.txt"]).unwrap();
    assert_eq!(names(root.path()), ["run"]);
}

#[test]
fn leftovers_of_killed_runs_go_and_those_of_living_ones_stay() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    // No process has this number on Linux, where it is below 2^22.
    let killed = root.path().join(".run.partial-4194999-0");
    fs::create_dir_all(killed.join("frames")).unwrap();
    fs::write(killed.join("frames/half.npz"), "half").unwrap();
    // Of another name, and not of ours.
    for other in [".run.partial-x", ".run2.partial-4194999-0", "run.partial-4194999-0"] {
        fs::create_dir(root.path().join(other)).unwrap();
    }
    let living = open(&target).unwrap();
    let second = open(&target).unwrap();
    assert!(living.path().is_dir() && second.path().is_dir());
    if cfg!(target_os = "linux") {
        assert!(!killed.exists());
        fs::remove_dir(root.path().join(".run.partial-x")).unwrap();
    }
    living.commit().unwrap();
    second.commit().unwrap();
    // An older output that was exchanged, but not removed yet, with a file that someone had added.
    let exchanged = root.path().join(".run.partial-4194999-1");
    fs::rename(&target, &exchanged).unwrap();
    fs::write(exchanged.join("mine.txt"), "mine").unwrap();
    output(&target, &["a.txt"]).unwrap();
    assert!(exchanged.join("mine.txt").exists());
    fs::remove_file(exchanged.join("mine.txt")).unwrap();
    output(&target, &["a.txt"]).unwrap();
    assert!(!exchanged.exists() || !cfg!(target_os = "linux"));
}

#[test]
fn leftover_files_of_killed_runs_go_and_those_of_living_ones_stay() {
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("one.ron");
    let killed = root.path().join(".one.ron.partial-4194999-0");
    fs::write(&killed, "half").unwrap();
    for other in [".one.ron.partial-x", ".two.ron.partial-4194999-0"] {
        fs::write(root.path().join(other), "other").unwrap();
    }
    let living = FileWriter::create(&target).unwrap();
    assert!(!killed.exists() || !cfg!(target_os = "linux"));
    // A second writer takes the first one's file for what it is.
    write_text(&target, "second").unwrap();
    living.commit().unwrap();
    assert_eq!(fs::read_to_string(&target).unwrap(), "");
    assert!(root.path().join(".one.ron.partial-x").exists() && root.path().join(".two.ron.partial-4194999-0").exists());
}

/// Each change of the disk fails once: the older output stands, or the new one where nothing failed, and nothing else.
#[test]
fn every_change_of_the_disk_may_fail() {
    for in_one_step in [true, false] {
        for older in [true, false] {
            let mut failing = 0;
            loop {
                let root = tempfile::tempdir().unwrap();
                let target = root.path().join("a/run");
                if older {
                    output(&target, &["old.txt"]).unwrap();
                }
                let work = || fault::at(Some(failing), || output(&target, &["new.txt", "frames/0.npz"]));
                let (result, changes) = if in_one_step { work() } else { fault::without_exchange(work) };
                let case = format!("one step: {in_one_step}, older: {older}, change {failing} of {changes}");
                match result {
                    Err(Error::Io { source, .. }) => {
                        assert_eq!(source.kind(), std::io::ErrorKind::StorageFull, "{case}");
                        if older {
                            assert_eq!(names(&target), [OutputFolder::MARKER, "old.txt"], "{case}");
                            assert_eq!(names(&root.path().join("a")), ["run"], "{case}");
                        } else {
                            assert_eq!(names(root.path()), [""; 0], "{case}");
                        }
                    }
                    Err(other) => unreachable!("{case}: {other}"),
                    Ok(()) => {
                        assert_eq!(names(&target), [OutputFolder::MARKER, "frames", "new.txt"], "{case}");
                        assert_eq!(names(&root.path().join("a")), ["run"], "{case}");
                        assert_eq!(changes, failing, "{case}");
                        break;
                    }
                }
                failing += 1;
            }
            assert!(failing > 15, "{failing} changes are too few to be all");
        }
    }
}

/// There is no moment in which neither output stands.
#[cfg(target_os = "linux")]
#[test]
fn readers_always_find_an_output() {
    use std::sync::atomic::{AtomicBool, Ordering};
    let root = tempfile::tempdir().unwrap();
    let target = root.path().join("run");
    output(&target, &["a.txt"]).unwrap();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut missing = 0;
            while !done.load(Ordering::Relaxed) {
                missing += usize::from(!target.join("a.txt").exists());
            }
            missing
        });
        for _ in 0..200 {
            output(&target, &["a.txt"]).unwrap();
        }
        done.store(true, Ordering::Relaxed);
        assert_eq!(reader.join().unwrap(), 0);
    });
}
