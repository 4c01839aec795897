//! No command writes where it reads, whatever it is told, and none changes what it reads.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use recordings::{Encoding, Image, McapWriter, Payload};
use tempfile::TempDir;

/// A command with all that it reads, and what it is run on.
struct Case {
    name: &'static str,
    /// Arguments but `--out`; paths are relative to the case's folder.
    line: Vec<&'static str>,
    /// What is read: `--out` may not be there.
    inputs: Vec<&'static str>,
}

fn case(name: &'static str, line: &'static str, inputs: &'static str) -> Case {
    Case { name, line: line.split(' ').collect(), inputs: inputs.split(' ').collect() }
}

/// Every command that writes.
fn cases() -> Vec<Case> {
    vec![
        case("run", "run survey -p plan/p.ron -c cal/c.ron", "survey plan/p.ron cal/c.ron"),
        case("run, source of the pipeline", "run -p plan/source.ron", "survey plan/source.ron"),
        case("run, scene of the pipeline", "run -p plan/scene.ron", "scenes/room.ron plan/scene.ron"),
        case(
            "run, network of the pipeline",
            "run survey -p plan/network.ron",
            "survey networks/n.ron plan/network.ron",
        ),
        case("run, a part", "run survey -p plan/p.ron -c cal/c.ron --shard 1/2", "survey plan/p.ron cal/c.ron"),
        case("merge", "merge part1 part2", "part1 part2 survey plan/p.ron cal/c.ron"),
        case("workflow", "workflow archive -p plan/p.ron", "archive plan/p.ron"),
        case("fleet", "fleet flow", "flow/codes flow/results"),
        case("simulate", "simulate scenes/room.ron", "scenes/room.ron"),
        case("simulate-network", "simulate-network networks/n.ron", "networks/n.ron"),
        case("calibrate", "calibrate targets -c cal/c.ron", "targets cal/c.ron"),
        case(
            "calibrate, two surveys",
            "calibrate targets --method two-step-independent --lens-survey lens",
            "targets lens",
        ),
        case("calibrate, surfaces", "calibrate survey -c cal/c.ron --method surfaces", "survey cal/c.ron"),
        case("measure", "measure older --lengths plan/lengths.ron", "older plan/lengths.ron"),
        case("fuse", "fuse older", "older"),
        case("colour", "colour rig S01 -c rigged", "rig rigged"),
        case("targets", "targets survey -c cal/c.ron -k checkerboard 9x6 0.025", "survey cal/c.ron"),
        case("targets, single", "targets survey -c cal/c.ron -k lights", "survey cal/c.ron"),
        case("calibrate, rings first", "calibrate survey -c cal/c.ron --targets rings 0.05", "survey cal/c.ron"),
        case("calibrate, targets first", "calibrate survey -c cal/c.ron --targets circles 7x5 0.4", "survey cal/c.ron"),
        case("plan", "plan targets -c cal/c.ron", "targets cal/c.ron"),
        case("scattering", "scattering survey without -c cal/c.ron", "survey without cal/c.ron"),
        case("noise", "noise survey -c cal/c.ron", "survey cal/c.ron"),
        case("fpn", "fpn survey -c cal/c.ron", "survey cal/c.ron"),
        case("warmup", "warmup survey -c cal/c.ron", "survey cal/c.ron"),
        case("register", "register survey --guess poses/s.csv -c cal/c.ron", "survey poses/s.csv cal/c.ron"),
        case("register, clouds", "register one/a.xyz two/b.xyz --multi", "one/a.xyz two/b.xyz"),
        case("register, track", "register survey --track --guess poses/s.csv", "survey poses/s.csv"),
        case("orient", "orient targets --by targets -c cal/c.ron", "targets cal/c.ron"),
        case(
            "orient, tracker",
            "orient survey --by tracker --poses poses/t.txt --known poses/s.csv",
            "survey poses/t.txt poses/s.csv",
        ),
        case("orient, imu", "orient survey --by imu --known poses/s.csv", "survey poses/s.csv"),
        case("convert", "convert rec/r.mcap -c cal/c.ron", "rec/r.mcap cal/c.ron"),
        case("compare", "compare one/a.xyz two/b.xyz", "one/a.xyz two/b.xyz"),
        case("compare, outputs", "compare older newer", "older newer"),
    ]
}

/// Commands that write nothing; `live` where it is not told to by `--ply` and the like, which are tried by themselves.
const READERS: [&str; 5] = ["inspect", "explain", "diff", "check", "live"];

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

fn rangecam(folder: &Path, line: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(line).current_dir(folder).output().unwrap()
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            copy(&from, &to);
        } else {
            fs::copy(from, to).unwrap();
        }
    }
}

/// Two depth images of the survey's size.
fn recording() -> Vec<u8> {
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    let stream = writer.stream("/depth/image_raw").unwrap();
    for time_ns in 1..3 {
        let image = Image::from_u16("depth", [66, 54], Encoding::Unsigned16, &[1500; 66 * 54]).unwrap();
        writer.message(stream, time_ns, &Payload::Image(image)).unwrap();
    }
    writer.finish().unwrap()
}

/// A folder with one of everything. Surveys and results carry the mark of a complete output, as those do that this
/// program made: it alone would let them be replaced.
fn world() -> TempDir {
    let root = tempfile::tempdir().unwrap();
    let at = |path: &str| root.path().join(path);
    for folder in ["plan", "cal", "scenes", "networks", "poses", "one", "two", "rec"] {
        fs::create_dir(at(folder)).unwrap();
    }
    // A quarter of the pixels: what is asked does not depend on them.
    let room = fs::read_to_string(fixtures().join("scenes/room_small.ron")).unwrap();
    let [full, pitch] = ["width: 132, height: 108", "0.05333333333333334"];
    assert!(room.contains(full) && room.contains(pitch));
    let room = room.replace(full, "width: 66, height: 54").replace(pitch, "0.10666666666666667");
    fs::write(at("scenes/room.ron"), room).unwrap();
    fs::copy(fixtures().join("networks/target_field.ron"), at("networks/n.ron")).unwrap();
    for (line, folder) in [("simulate scenes/room.ron", "survey"), ("simulate-network networks/n.ron", "targets")] {
        let line: Vec<&str> = line.split(' ').chain(["--out", folder, "--quiet"]).collect();
        let made = rangecam(root.path(), &line);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
    copy(&at("survey"), &at("without"));
    copy(&at("targets"), &at("lens"));
    fs::copy(at("survey/calibration.ron"), at("cal/c.ron")).unwrap();
    fs::copy(at("survey/stations.csv"), at("poses/s.csv")).unwrap();
    fs::write(at("poses/t.txt"), "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n").unwrap();
    let stages = "stages: [Demodulate(), Average(), Unwrap()]";
    let network = "calibrate: (network: \"../networks/n.ron\", terms: [\"d0\"])";
    for (name, more) in [
        ("p", ""),
        ("source", "source: Survey(folder: \"../survey\"),"),
        ("scene", "source: Simulate(scene: \"../scenes/room.ron\", seed: 1),"),
        ("network", network),
    ] {
        let comma = if more.is_empty() || more.ends_with(',') { "" } else { "," };
        fs::write(at(&format!("plan/{name}.ron")), format!("(name: \"{name}\", {more}{comma} {stages})")).unwrap();
    }
    fs::write(at("plan/lengths.ron"), "(regions: {}, lengths: [])").unwrap();
    let points: Vec<String> = (0..400).map(|k| format!("{} {} {}\n", k % 20, k / 20, k % 7)).collect();
    let points = points.concat();
    for cloud in ["one/a.xyz", "two/b.xyz"] {
        fs::write(at(cloud), &points).unwrap();
    }
    fs::write(at("rec/r.mcap"), recording()).unwrap();
    for folder in ["older", "newer", "rigged", "rig/left", "rig/right"] {
        copy(&at("targets"), &at(folder));
    }
    for part in ["1", "2"] {
        let (shard, out) = (format!("{part}/2"), format!("part{part}"));
        let line =
            ["run", "survey", "-p", "plan/p.ron", "-c", "cal/c.ron", "--shard", &shard, "--out", &out, "--quiet"];
        let made = rangecam(root.path(), &line);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
    for folder in ["archive/north/monday/hall", "flow/codes/north/monday/recordings", "flow/results"] {
        fs::create_dir_all(at(folder)).unwrap();
    }
    fs::write(at("flow/codes/north/monday/recordings/hall.code"), "2").unwrap();
    fs::write(at("rig/rig.ron"), "(cameras: [(name: \"left\"), (name: \"right\")])").unwrap();
    root
}

/// Every file with its bytes, links with where they lead.
fn everything(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut pending = vec![root.to_path_buf()];
    while let Some(folder) = pending.pop() {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_symlink() {
                found.insert(path.clone(), fs::read_link(&path).unwrap().display().to_string().into_bytes());
            } else if path.is_dir() {
                found.insert(path.clone(), Vec::new());
                pending.push(path);
            } else {
                found.insert(path.clone(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Ways to name an input, what contains it and what lies in it as the output.
fn hostile(root: &Path, input: &str) -> Vec<String> {
    let path = root.join(input);
    let name = path.file_name().unwrap().to_str().unwrap().to_owned();
    let mut ways = vec![
        input.to_owned(),
        path.display().to_string(),
        format!("./nothing/../{input}"),
        format!("{input}/."),
        "../".to_owned() + root.file_name().unwrap().to_str().unwrap(),
        root.display().to_string(),
        format!("link_to_{name}"),
    ];
    if path.is_dir() {
        ways.extend([format!("{input}/out"), format!("{input}/a/b"), format!("link_to_{name}/out")]);
    }
    if let Some(parent) = Path::new(input).parent().filter(|parent| !parent.as_os_str().is_empty()) {
        ways.push(parent.display().to_string());
    }
    ways
}

#[test]
fn no_command_writes_where_it_reads() {
    let world = world();
    let root = world.path();
    #[cfg(unix)]
    for input in cases().iter().flat_map(|case| &case.inputs) {
        let name = Path::new(input).file_name().unwrap().to_str().unwrap();
        let _ = std::os::unix::fs::symlink(root.join(input), root.join(format!("link_to_{name}")));
    }
    let before = everything(root);
    for case in cases() {
        for input in &case.inputs {
            for out in hostile(root, input) {
                let line: Vec<&str> = case.line.iter().copied().chain(["--out", &out]).collect();
                let refused = rangecam(root, &line);
                let words = String::from_utf8_lossy(&refused.stderr);
                let told = format!("{}, --out {out}: {words}", case.name);
                assert_eq!(refused.status.code(), Some(2), "{told}");
                let known = ["cannot be the output folder", "cannot be the output file", "is a file"];
                assert!(known.iter().any(|known| words.contains(known)), "{told}");
            }
        }
        assert!(everything(root) == before, "{} changed something", case.name);
    }
}

/// A stream of clouds is one file, which may not be, or lie in, what is read either.
#[test]
fn live_writes_no_clouds_where_it_reads() {
    let world = world();
    let root = world.path();
    fs::create_dir(root.join("filling")).unwrap();
    fs::write(root.join("filling/end"), "").unwrap();
    let inputs = ["survey", "cal/c.ron", "filling", "filling/end", "survey/survey.ron"];
    #[cfg(unix)]
    for input in inputs {
        let name = Path::new(input).file_name().unwrap().to_str().unwrap();
        let _ = std::os::unix::fs::symlink(root.join(input), root.join(format!("link_to_{name}")));
    }
    let before = everything(root);
    for (source, read) in [("survey", &inputs[..2]), ("filling", &inputs)] {
        for out in read.iter().flat_map(|input| hostile(root, input)) {
            // One check looks after all of them.
            let options = ["--ply", "--mcap", "--trajectory", "--map"];
            for option in &options[if source == "survey" { 2 } else { 0 }..] {
                let line = ["live", source, "-s", "survey", "-c", "cal/c.ron", "--fast", option, &out];
                let refused = rangecam(root, &line);
                let told = format!("{source}, {option} {out}: {}", String::from_utf8_lossy(&refused.stderr));
                assert_eq!(refused.status.code(), Some(2), "{told}");
            }
        }
        assert!(everything(root) == before, "live {source} changed something");
    }
}

/// What each command reads is as it was, where it works and where it fails, and where it writes nothing.
#[test]
fn no_command_changes_what_it_reads() {
    let world = world();
    let root = world.path();
    let before = everything(root);
    for case in cases() {
        let out = tempfile::tempdir().unwrap();
        let target = out.path().join("out").display().to_string();
        let line: Vec<&str> = case.line.iter().copied().chain(["--out", &target, "--quiet"]).collect();
        rangecam(root, &line);
        assert!(everything(root) == before, "{} changed something", case.name);
    }
    let mcap = tempfile::tempdir().unwrap();
    let again = format!("convert rec/r.mcap --out {}", mcap.path().join("again.mcap").display());
    for line in [
        again.as_str(),
        "inspect survey",
        "inspect rec/r.mcap",
        "explain survey --frame 0 --pixel 3,3",
        "diff cal/c.ron survey/calibration.ron",
        "check survey -c cal/c.ron",
        "live survey -c cal/c.ron --fast --frames 2 --track",
    ] {
        let line: Vec<&str> = line.split(' ').collect();
        rangecam(root, &line);
        assert!(everything(root) == before, "{} changed something", line[0]);
    }
}

/// A command that is new must be among those above.
#[test]
fn every_command_is_tried() {
    let help = rangecam(Path::new("."), &["--help"]);
    let help = String::from_utf8(help.stdout).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // The name stands two columns in; further lines of a description stand further in.
    let names = commands.filter_map(|line| line.strip_prefix("  ").filter(|rest| !rest.starts_with(' ')));
    let names: Vec<&str> = names.filter_map(|line| line.split(' ').next()).filter(|name| *name != "help").collect();
    assert!(names.len() > 10, "{help}");
    for name in names {
        let tried = READERS.contains(&name) || cases().iter().any(|case| case.line[0] == name);
        assert!(tried, "{name} is not among the commands tried here");
    }
}
