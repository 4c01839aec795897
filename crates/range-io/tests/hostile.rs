//! Files that promise more than they hold, have no end, or are made to cost more than they weigh.
#![cfg(all(
    feature = "clouds",
    feature = "survey",
    feature = "calibration",
    feature = "tables",
    feature = "trajectory"
))]

use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use range_io::calibration::Calibration;
use range_io::clouds::read_any_cloud;
use range_io::npz::{NpzReader, NpzWriter};
use range_io::survey::Survey;
use range_io::{
    e57::read_e57,
    mkv,
    pcd::read_pcd,
    ply::{read_cloud, read_some_of_cloud},
    png16, tables, trajectory,
    vtk::read_vtk,
    xyz::read_xyz,
};

use crate::scratch::Scratch;

fn reason<T: std::fmt::Debug>(result: Result<T, range_io::Error>) -> String {
    result.expect_err("a file that must be refused").to_string()
}

/// A reader of any kind; what it made of a file is of no interest here.
type Read = fn(&Path) -> Result<(), range_io::Error>;

const READERS: [(&str, Read); 16] = [
    ("survey.ron", |path| Survey::read(path).map(drop)),
    ("calibration.ron", |path| Calibration::read(path).map(drop)),
    ("cloud.ply", |path| read_cloud(path).and(read_some_of_cloud(path, 1, 2)).map(drop)),
    ("cloud.pcd", |path| read_pcd(path).map(drop)),
    ("cloud.e57", |path| read_e57(path).map(drop)),
    ("cloud.vtk", |path| read_vtk(path).map(drop)),
    ("cloud.xyz", |path| read_xyz(path).map(drop)),
    ("cloud.any", |path| read_any_cloud(path).map(drop)),
    ("depth.png", |path| png16::read(path).map(drop)),
    ("depth.mkv", |path| mkv::Recording::open(path).map(drop)),
    ("frame.npz", |path| NpzReader::open(path).map(drop)),
    ("frame.npy", |path| range_io::npz::read_npy(path, "depth", |_| Ok(())).map(drop)),
    ("calibration.json", |path| range_io::azure::read(path, range_io::azure::DepthMode::NarrowBinned).map(drop)),
    ("observations.csv", |path| tables::read_observations(path).map(drop)),
    ("stations.csv", |path| tables::read_stations(path).map(drop)),
    ("trajectory.txt", |path| trajectory::read_any_trajectory(path).map(drop)),
];

#[test]
fn pipes_devices_and_folders_are_no_files() {
    let scratch = Scratch::new();
    for (name, read) in READERS {
        let pipe = scratch.file(name);
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        // Where there is no such command there are no such pipes.
        if made.is_ok_and(|status| status.success()) {
            let fault = read(&pipe).expect_err(name).to_string();
            assert!(fault.ends_with("is a pipe or device, expected a file"), "{fault}");
        }
        for device in ["/dev/zero", "/dev/null", "/dev/stdin"] {
            if Path::new(device).exists() {
                assert!(read(Path::new(device)).is_err(), "{name} {device}");
            }
        }
        assert!(read(&scratch.file("not there")).expect_err(name).to_string().contains("cannot open"));
    }
}

#[test]
fn a_link_to_a_file_is_a_file() {
    let scratch = Scratch::new();
    let file = scratch.holding("a.xyz", b"1 2 3\n");
    let link = scratch.file("b.xyz");
    std::os::unix::fs::symlink(file, &link).expect("a link");
    assert_eq!(read_xyz(link).expect("a point").len(), 1);
}

#[test]
fn brackets_without_end_cost_no_more_than_their_length() {
    let clock = Instant::now();
    for text in ["[".repeat(40_000), "(".repeat(1 << 20), "Some(".repeat(1 << 18), "{\"a\":".repeat(1 << 18)] {
        for text in
            [text.clone(), format!("(camera: {text}"), format!("(extras: {{\"a\": {text}"), format!("/* {text}")]
        {
            let fault = reason(Survey::parse(Path::new("survey.ron"), &text));
            assert!(fault.starts_with("survey.ron:1:"), "{fault}");
            let fault = reason(Calibration::parse(Path::new("calibration.ron"), &text));
            assert!(fault.len() < 1000, "{fault}");
        }
    }
    // Also where what is deep is well formed.
    let deep = format!("{}1{}", "[".repeat(5000), "]".repeat(5000));
    let fault = reason(Survey::parse(Path::new("survey.ron"), &format!("(frames: {deep})")));
    assert!(fault.starts_with("survey.ron:1:"), "{fault}");
    let deep: Result<ron::Value, range_io::Error> = range_io::ron_text::parse(Path::new("any.ron"), &deep);
    assert!(reason(deep).contains("recursion limit"));
    // Some tenths of a second; each path by itself took minutes and gigabytes.
    assert!(clock.elapsed() < Duration::from_secs(30), "{:?}", clock.elapsed());
}

#[test]
fn elements_of_ply_that_overflow_are_refused() {
    let scratch = Scratch::new();
    let file = |before: &str, vertices: &str, format: &str, body: &str| {
        let text = format!(
            "ply\nformat {format} 1.0\n{before}element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\nend_header\n{body}"
        );
        read_cloud(scratch.holding("a.ply", text.as_bytes()))
    };
    // Counts whose sum is 1 modulo 2^64.
    let before = "element a 18446744073709551615\nproperty uchar q\nelement b 2\nproperty uchar r\n";
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let fault = reason(file(before, "1", format, "9\n7 8 9\n5 5 5\n"));
        assert!(fault.contains("promises 1 vertices behind 18446744073709551615 + 2 elements"), "{fault}");
        for vertices in ["18446744073709551615", "4611686018427387905", "9223372036854775808"] {
            assert!(reason(file("", vertices, format, "1 2 3\n")).contains("more than its"));
        }
        let before = "element a 9223372036854775808\nproperty double q\nproperty double r\n";
        assert!(reason(file(before, "1", format, "1 2 3\n")).contains("more than its"));
        // Elements of nothing take a line each, or no byte.
        let empty = file("element a 18446744073709551615\n", "1", format, "            ");
        assert_eq!(empty.is_err(), format == "ascii");
    }
    assert_eq!(
        file("element a 2\nproperty uchar q\n", "1", "ascii", "1\n2\n5 6 7").expect("a point").points,
        [[5.0, 6.0, 7.0]]
    );
}

#[test]
fn a_text_of_vtk_in_another_encoding_loses_nothing() {
    let scratch = Scratch::new();
    let file = |title: &[u8], line: &[u8]| {
        let head =
            [b"# vtk DataFile Version 3.0\n", title, b"\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n1 2 3\n"].concat();
        let bytes =
            [head.as_slice(), line, b"POINT_DATA 1\nSCALARS intensity float\nLOOKUP_TABLE default\n5\n"].concat();
        read_vtk(scratch.holding("a.vtk", &bytes))
    };
    let plain = file(b"title", b"").expect("a cloud");
    assert_eq!(plain.intensity.as_deref(), Some([5.0].as_slice()));
    assert_eq!(file(b"W\xe4nde", b"").expect("a cloud"), plain);
    assert_eq!(file(b"title", b"METADATA\nINFORMATION 1\nNAME H\xf6he LOCATION x\n\n").expect("a cloud"), plain);
    let fault = reason(file(b"title", b"H\xf6he\n"));
    assert!(fault.contains("has the line `H\u{fffd}he`") && fault.ends_with("(line 7)"), "{fault}");
}

#[test]
fn sizes_of_archives_are_not_believed() {
    let scratch = Scratch::new();
    let file = scratch.file("a.npz");
    let mut writer = NpzWriter::create(&file).expect("an archive");
    writer.add("depth", &[100_000], &vec![0.0_f32; 100_000]).expect("an array");
    writer.commit().expect("an archive");
    let sound = std::fs::read(&file).expect("its bytes");
    read_depth(&file).expect("an archive of zeros");
    // Both sizes of the directory's entry say gigabytes; the header of the array inside stays what it is.
    let directory = sound.windows(4).position(|window| window == b"PK\x01\x02").expect("the directory");
    for fields in [[20, 24].as_slice(), &[20], &[24]] {
        let mut bytes = sound.clone();
        for field in fields {
            bytes[directory + field..directory + field + 4].copy_from_slice(&0xffff_fff0_u32.to_le_bytes());
        }
        // What is read is bounded by the bytes that there are, whatever the directory says.
        let mut promised = 0;
        let read = NpzReader::open(scratch.holding("b.npz", &bytes)).and_then(|mut archive| {
            archive.read("depth", |header| {
                promised = header.bytes().unwrap_or(usize::MAX);
                Ok(())
            })
        });
        assert!(promised <= 400_000, "{promised}");
        drop(read);
    }
}

fn read_depth(path: &Path) -> Result<(), range_io::Error> {
    NpzReader::open(path)?.read("depth", |_| Ok(())).map(drop)
}

#[test]
fn scans_of_no_bits_are_refused() {
    let scratch = Scratch::new();
    let mut cloud = crate::scratch::cloud(100);
    cloud.normals = None;
    range_io::e57::write_e57(
        scratch.file("a.e57"),
        &[range_io::e57::E57Scan { name: "S".into(), cloud }],
        range_io::ply::Precision::Double,
    )
    .expect("a scan");
    assert_eq!(read_e57(scratch.file("a.e57")).expect("a scan")[0].cloud.len(), 100);
    let hostile = with_constant_columns(5000, 1_500_000);
    let fault = reason(read_e57(scratch.holding("b.e57", &hostile)));
    assert!(fault.contains("columns in") || fault.contains("promises"), "{fault}");
}

/// An E57 file whose only scan has columns that take no bits.
fn with_constant_columns(columns: usize, records: u64) -> Vec<u8> {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let integer = RecordDataType::Integer { min: 7, max: 7 };
    let mut prototype = vec![
        Record { name: RecordName::CartesianX, data_type: RecordDataType::Integer { min: 0, max: 1 } },
        Record { name: RecordName::CartesianY, data_type: integer.clone() },
        Record { name: RecordName::CartesianZ, data_type: integer.clone() },
    ];
    let name = |index: usize| RecordName::Unknown { namespace: "x".into(), name: format!("c{index}") };
    prototype.extend((3..columns).map(|index| Record { name: name(index), data_type: integer.clone() }));
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut bytes, "{00000000-0000-0000-0000-000000000000}").expect("a writer");
    writer.register_extension(e57::Extension::new("x", "http://x")).expect("an extension");
    let mut scan = writer.add_pointcloud("{00000000-0000-0000-0000-000000000001}", prototype).expect("a scan");
    let mut values = vec![RecordValue::Integer(7); columns];
    values[0] = RecordValue::Integer(1);
    for _ in 0..10 {
        scan.add_point(values.clone()).expect("a point");
    }
    scan.finalize().expect("a scan");
    // The number of records stands in the XML.
    let marker = "recordCount=\"";
    writer
        .finalize_customized_xml(|xml| {
            let (before, rest) = xml.split_once(marker).expect("a number of records");
            let (_, behind) = rest.split_once('"').expect("its end");
            Ok(format!("{before}{marker}{records}\"{behind}"))
        })
        .expect("a file");
    drop(writer);
    bytes.into_inner()
}

#[test]
fn images_hold_no_more_than_their_bytes() {
    let scratch = Scratch::new();
    png16::write(scratch.file("a.png"), &range_image::Raster::filled(4, 4, 7)).expect("an image");
    let mut bytes = std::fs::read(scratch.file("a.png")).expect("its bytes");
    bytes[16..24].copy_from_slice(&[0, 0, 0x20, 0, 0, 0, 0x20, 0]);
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    let fault = reason(png16::read(scratch.holding("b.png", &bytes)));
    assert!(fault.contains("promises 8192 x 8192 pixels"), "{fault}");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn names_for_terminals_have_no_control_characters() {
    let mut text = String::from("station,target,col,row,range,sigma_col,sigma_row,sigma_range\n");
    writeln!(text, "S\u{1b}[2J,T,1,1,,0.1,0.1,").expect("text");
    let scratch = Scratch::new();
    let fault = reason(tables::read_observations(scratch.holding("observations.csv", text.as_bytes())));
    assert!(fault.contains("a name without control characters") && !fault.contains('\u{1b}'), "{fault}");
    let survey = |station: &str, file: &str| {
        let text = format!(
            "(camera: (width: 4, height: 4, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8, \
             principal_point_mm: (0, 0)), level: range, frames: [(file: {file:?}, station: {station:?})])"
        );
        Survey::parse(Path::new("survey.ron"), &text)
    };
    survey("S 1 µ", "frames/a b.npz").expect("a survey");
    for (station, file) in [("S\u{7}", "a.npz"), ("S\n", "a.npz"), ("S", "a\u{1b}.npz"), ("", "a.npz")] {
        let fault = reason(survey(station, file));
        assert!(!fault.contains(char::is_control), "{fault}");
    }
}

#[test]
fn lines_without_end_are_refused() {
    let scratch = Scratch::new();
    let long = "1 ".repeat(1 << 20);
    let heads = [
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        ),
        ("a.pcd", "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n"),
        ("a.vtk", "# vtk DataFile Version 3.0\n"),
        ("a.xyz", ""),
    ];
    for (name, head) in heads {
        let file = scratch.holding(name, format!("{head}{long}\n").as_bytes());
        assert!(reason(read_any_cloud(file)).contains("expected at most 65536") || name != "a.vtk");
    }
}
