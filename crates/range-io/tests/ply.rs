//! Clouds: round trips, other programs' files, and every way a file can be cut or lie.
#![cfg(feature = "ply")]
// What goes through a file comes back to the last bit.

use crate::common;
use proptest::prelude::*;
use range_io::ply::{CloudFile, PlyWriter, Precision, read_cloud, read_some_of_cloud, write_cloud};

use crate::scratch::{Scratch, cloud};

fn read(scratch: &Scratch, bytes: &[u8]) -> Result<CloudFile, range_io::Error> {
    read_cloud(scratch.holding(NAME, bytes))
}

const NAME: &str = "cloud.ply";

proptest! {
    #![proptest_config(common::cases(32))]

    #[test]
    fn clouds_come_back(points in prop::collection::vec(prop::array::uniform3(prop::num::f64::NORMAL), 0..50), with in 0_u8..64) {
        let scratch = Scratch::new();
        let mut written = CloudFile { points, ..cloud(0) };
        let full = cloud(written.len());
        written.normals = full.normals.filter(|_| with & 1 > 0);
        written.intensity = full.intensity.filter(|_| with & 2 > 0);
        written.sigma = full.sigma.filter(|_| with & 4 > 0);
        written.flags = full.flags.filter(|_| with & 8 > 0);
        written.frame = full.frame.filter(|_| with & 16 > 0);
        written.covariance = full.covariance.filter(|_| with & 32 > 0);
        write_cloud(scratch.file(NAME), &written, Precision::Double).unwrap();
        prop_assert_eq!(&read_cloud(scratch.file(NAME)).unwrap(), &written);
        write_cloud(scratch.file(NAME), &written, Precision::Single).unwrap();
        for point in &mut written.points {
            *point = point.map(|value| f64::from(value as f32));
        }
        prop_assert_eq!(read_cloud(scratch.file(NAME)).unwrap(), written);
    }
}

#[test]
fn blocks_make_one_cloud() {
    let scratch = Scratch::new();
    let whole = cloud(10_000);
    let part = |range: std::ops::Range<usize>| CloudFile {
        points: whole.points[range.clone()].to_vec(),
        intensity: Some(whole.intensity.as_ref().unwrap()[range].to_vec()),
        ..CloudFile::default()
    };
    let mut writer = PlyWriter::create(scratch.file(NAME), Precision::Double).unwrap();
    writer.append(&CloudFile::default()).unwrap();
    for range in [0..1, 1..5000, 5000..5000, 5000..10_000] {
        writer.append(&part(range)).unwrap();
    }
    assert!(writer.append(&whole).unwrap_err().to_string().contains("expected [\"intensity\"]"));
    writer.commit().unwrap();
    assert_eq!(read_cloud(scratch.file(NAME)).unwrap(), part(0..10_000));
    let some = |first: u64, most: usize| read_some_of_cloud(scratch.file(NAME), first, most).unwrap();
    assert_eq!([some(0, 4999), some(4999, 1), some(5000, 9000)], [0..4999, 4999..5000, 5000..10_000].map(part));
    assert_eq!((some(10_000, 5).len(), some(u64::MAX, usize::MAX).len(), some(7, 0).len()), (0, 0, 0));
    let uneven = CloudFile { sigma: Some(vec![0.0]), ..CloudFile::default() };
    let fault = write_cloud(scratch.file(NAME), &uneven, Precision::Single).unwrap_err().to_string();
    assert_eq!(fault, "cloud: `sigma`: has 1 values for 0 points");
}

#[test]
fn a_cloud_without_points_is_a_file_without_points() {
    let scratch = Scratch::new();
    PlyWriter::create(scratch.file(NAME), Precision::Single).unwrap().commit().unwrap();
    assert_eq!(read_cloud(scratch.file(NAME)).unwrap(), CloudFile::default());
}

#[test]
fn other_programs_files_are_read_in_all_encodings() {
    let scratch = Scratch::new();
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nobj_info other\nelement camera 2\nproperty uchar id\nproperty short v\n\
             element vertex 2\nproperty uchar red\nproperty float z\nproperty double x\nproperty int y\n\
             property float scalar_Intensity\nproperty float flags\nelement face 1\nproperty list uchar int vertex_indices\n\
             end_header\n"
        )
    };
    let expected = CloudFile {
        points: vec![[1.5, -2.0, 0.25], [2.5, 70000.0, -0.5]],
        intensity: Some(vec![7.0, 8.5]),
        flags: Some(vec![3, 65535]),
        ..CloudFile::default()
    };
    let ascii = header("ascii") + "1 2\n3 4\n255 0.25 1.5 -2 7 3\n0 -0.5 2.5 70000 8.5 65535\n3 0 1 0\n";
    assert_eq!(read(&scratch, ascii.as_bytes()).unwrap(), expected);
    let windows = ascii.replace('\n', "\r\n");
    assert_eq!(read(&scratch, windows.as_bytes()).unwrap(), expected);
    for big_endian in [false, true] {
        let mut bytes = header(if big_endian { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
        let mut put = |little: &[u8]| {
            let mut value = little.to_vec();
            if big_endian {
                value.reverse();
            }
            bytes.extend(value);
        };
        for camera in 0..2_u8 {
            put(&[camera]);
            put(&300_i16.to_le_bytes());
        }
        for (i, point) in expected.points.iter().enumerate() {
            put(&[9]);
            put(&(point[2] as f32).to_le_bytes());
            put(&point[0].to_le_bytes());
            put(&(point[1] as i32).to_le_bytes());
            put(&expected.intensity.as_ref().unwrap()[i].to_le_bytes());
            put(&f32::from(expected.flags.as_ref().unwrap()[i]).to_le_bytes());
        }
        assert_eq!(read(&scratch, &bytes).unwrap(), expected);
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error() {
    let scratch = Scratch::new();
    write_cloud(scratch.file(NAME), &cloud(3), Precision::Single).unwrap();
    let bytes = std::fs::read(scratch.file(NAME)).unwrap();
    for length in 0..bytes.len() {
        assert!(read(&scratch, &bytes[..length]).is_err(), "cut at {length}");
    }
    let ascii = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty int x\nproperty int y\nproperty int z\nend_header\n1 2 3\n4 5 6";
    // Without its last digit the file would be short of a number.
    for length in 0..ascii.len() {
        assert!(read(&scratch, &ascii[..length]).is_err(), "cut at {length}");
    }
    assert!(read(&scratch, ascii).is_ok());
}

#[test]
fn what_is_wrong_is_said() {
    let scratch = Scratch::new();
    let fault = |from: &str, to: &str| {
        let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                    property ushort flags\nend_header\n1 2 3 4\n";
        assert!(text.contains(from));
        read(&scratch, text.replace(from, to).as_bytes()).unwrap_err().to_string()
    };
    for (from, to, expected) in [
        ("ply\n", "plx\n", "does not begin with the line `ply`"),
        ("ascii 1.0", "ascii 2.0", "`format ascii 2.0`"),
        ("format ascii 1.0\n", "", "no `format`"),
        ("ascii", "text", "format `text`"),
        ("vertex 1", "vertex -1", "`-1` of element `vertex`"),
        ("vertex 1", "vertex 99999999999999", "promises 99999999999999 vertices"),
        ("vertex 1", "vertex 2", "ends before its last vertex"),
        ("vertex 1", "point 1", "no element `vertex`"),
        ("float x", "float128 x", "unknown type `float128`"),
        ("float x", "float y", "`y` twice"),
        ("float z", "float w", "2 of the properties x, y, z"),
        ("float x", "list uchar int x", "has lists in element `vertex`"),
        ("1 2 3 4", "1 2 3", "no `flags` in vertex 0"),
        ("1 2 3 4", "1 2 3 4 5", "more than 4 values"),
        ("1 2 3 4", "1 b 3 4", "`y` = `b`"),
        ("1 2 3 4", "1 2 3 -4", "`flags` = -4, expected a whole number from 0 to 65535"),
        ("1 2 3 4", "1 2 3 0.5", "`flags` = 0.5"),
    ] {
        let message = fault(from, to);
        assert!(message.contains(expected) && message.contains("cloud.ply: "), "{message}\nexpected: {expected}");
    }
}
