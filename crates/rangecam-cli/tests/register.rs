//! The command `register` as a shell sees it.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A bumpy surface, seen with its origin moved by `x`; `shift` makes other points of the same surface.
fn write_bumps(path: &Path, x: f64, shift: f64) {
    let mut lines = String::new();
    for k in 0..6400 {
        let (u, v) = (0.02 * (f64::from(k % 80) + shift), 0.02 * (f64::from(k / 80) + shift));
        let z = 0.12 * (2.1 * u).sin() * (5.3 * v).cos() + 0.07 * (7.0 * u + 1.0).cos() + 0.3 * (u - 0.7) * v;
        writeln!(lines, "{} {} {}", u - x, v, z).unwrap();
    }
    std::fs::write(path, lines).unwrap();
}

#[test]
fn help_names_every_option() {
    let help = text(&rangecam(&["register", "--help"]).stdout);
    for word in ["--guess", "--multi", "--track", "--calibration", "--out", "--json", "--quiet", "survey folder"] {
        assert!(help.contains(word), "{word} in {help}");
    }
}

#[test]
fn two_clouds_with_a_guess() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    write_bumps(Path::new(&path("one.xyz")), 0.0, 0.0);
    write_bumps(Path::new(&path("two.xyz")), 0.05, 0.4);
    std::fs::write(path("guess.txt"), "1 0 0 0.03\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap();
    let arguments = [
        "register",
        &path("one.xyz"),
        &path("two.xyz"),
        "--guess",
        &path("guess.txt"),
        "--out",
        &path("out"),
        "--json",
    ];
    let output = rangecam(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    let x = json["stations"][1]["position_m"][0].as_f64().unwrap();
    // Points 2 cm apart on a curved surface: their planes are right to a tenth of a millimetre.
    assert!((x - 0.05).abs() < 1e-3, "{x}");
    for file in ["report.html", "summary.json", "cloud.ply", "stations.csv", "trajectory.txt"] {
        assert!(folder.path().join("out").join(file).is_file(), "{file}");
    }
}

#[test]
fn errors_say_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = folder.path().join("one.xyz").display().to_string();
    write_bumps(Path::new(&cloud), 0.0, 0.0);
    let one = rangecam(&["register", &cloud]);
    assert_eq!(one.status.code(), Some(2));
    assert!(text(&one.stderr).contains("name a second one"), "{}", text(&one.stderr));
    assert_eq!(rangecam(&["register"]).status.code(), Some(2), "an input is required");
    let absent = rangecam(&["register", "/nowhere/survey"]);
    assert!(text(&absent.stderr).contains("there is no such file or folder"), "{}", text(&absent.stderr));
}

/// What an image shows: nothing, a bumpy wall, or another one.
#[derive(Clone, Copy)]
enum Shows {
    Nothing,
    Wall,
    OtherWall,
}

/// A folder of depth images of 160 x 120 pixels in the form of 7-Scenes.
fn write_images(folder: &Path, shows: &[Shows]) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("camera-intrinsics.txt"), "150 0 80\n0 150 60\n0 0 1\n").unwrap();
    for (k, shows) in shows.iter().enumerate() {
        let file = std::fs::File::create(folder.join(format!("frame-{k:06}.depth.png"))).unwrap();
        let mut encoder = png::Encoder::new(file, 160, 120);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let depth = |pixel: u32| {
            let (u, v) = (f64::from(pixel % 160) / 40.0, f64::from(pixel / 160) / 40.0);
            2.0 + 0.15 * (2.0 * u).sin() * (3.1 * v).cos() + 0.1 * u + 0.05 * (1.3 * v * u).cos()
        };
        let stored = |pixel: u32| match shows {
            Shows::Nothing => 0,
            Shows::Wall => (1000.0 * depth(pixel)) as u16,
            Shows::OtherWall => {
                let (u, v) = (f64::from(pixel % 160) / 40.0, f64::from(pixel / 160) / 40.0);
                (1500.0 + 200.0 * (3.7 * v).sin() - 150.0 * (2.9 * u + v).cos() - 100.0 * v) as u16
            }
        };
        let bytes: Vec<u8> = (0..160 * 120).flat_map(|pixel| stored(pixel).to_be_bytes()).collect();
        encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
    }
}

#[test]
fn an_image_that_belongs_to_no_other_is_left_out_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    write_images(Path::new(&path("walls")), &[Shows::Wall, Shows::OtherWall, Shows::Wall, Shows::Wall]);
    let plan = r#"(name: "walls", stages: [PointCloud(), Register(start: order), Adjust()])"#;
    std::fs::write(path("plan.ron"), plan).unwrap();
    let output = rangecam(&["run", &path("walls"), "-p", &path("plan.ron"), "--out", &path("out")]);
    let said = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("frame-000001: not placed, and not in the results"), "{said}");
    let file = |name: &str| folder.path().join("out").join(name);
    let placed: Vec<String> =
        range_io::tables::read_stations(file("stations.csv")).unwrap().into_iter().map(|row| row.station).collect();
    assert_eq!(placed, ["frame-000000", "frame-000002", "frame-000003"]);
    // Points are those of the placed ones, which count on without a gap.
    let frames = range_io::ply::read_cloud(file("cloud.ply")).unwrap().frame.unwrap();
    assert_eq!((frames.len(), frames.iter().max()), (3 * 160 * 120, Some(&2)));
    let errors = std::fs::read_to_string(file("common_errors.ron")).unwrap();
    assert_eq!(errors.matches("view:").count(), 3);
    let refused = rangecam(&["fuse", &path("out"), "--out", &path("fused")]);
    assert!(text(&refused.stderr).contains("calibration that has `range_noise`"), "{}", text(&refused.stderr));
}

#[test]
fn a_folder_of_images_is_tracked() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    write_images(Path::new(&path("still")), &[Shows::Wall; 4]);
    let output = rangecam(&["register", &path("still"), "--track", "--out", &path("out"), "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: serde_json::Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!((&json["verdict"], &json["frames"]), (&"tracked".into(), &4.into()));
    // One image four times: the camera stands still.
    assert!(json["path_length_m"].as_f64().unwrap() < 1e-3, "{}", json["path_length_m"]);
    for file in
        ["report.html", "summary.json", "cloud.ply", "stations.csv", "trajectory.txt", "trajectory_adjusted.txt"]
    {
        assert!(folder.path().join("out").join(file).is_file(), "{file}");
    }

    // A sequence that ends lost is done in part.
    write_images(Path::new(&path("ends")), &[Shows::Wall, Shows::Wall, Shows::Nothing, Shows::Nothing]);
    let output = rangecam(&["register", &path("ends"), "--track", "--out", &path("lost"), "--json"]);
    assert_eq!(output.status.code(), Some(5));
    let json: serde_json::Value = serde_json::from_str(&text(&output.stdout)).unwrap();
    assert_eq!((&json["verdict"], &json["lost"]), (&"lost".into(), &2.into()));
    assert!(json["doubts"][0]["words"].as_str().unwrap().contains("not found again"), "{json}");
    assert!(folder.path().join("lost/trajectory.txt").is_file());

    let several = rangecam(&["register", &path("still"), &path("ends"), "--track"]);
    assert!(text(&several.stderr).contains("name one folder"), "{}", text(&several.stderr));
    assert_eq!(rangecam(&["register", &path("still"), "--track", "--multi"]).status.code(), Some(2));
}
