//! Clouds as PCD, E57, VTK and text: round trips, other programs' files, and every way a file can be cut or lie.
#![cfg(feature = "clouds")]
// What goes through a file comes back to the last bit.

use crate::common;
use crate::scratch;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use range_io::clouds::{CloudFile, Precision, read_any_cloud, write_any_cloud};
use range_io::e57::{E57Scan, read_e57, write_e57};

use crate::scratch::Scratch;

fn read(scratch: &Scratch, name: &str, bytes: &[u8]) -> Result<CloudFile, range_io::Error> {
    read_any_cloud(scratch.holding(name, bytes))
}

fn fault(scratch: &Scratch, name: &str, bytes: &[u8]) -> String {
    read(scratch, name, bytes).unwrap_err().to_string()
}

/// A cloud with a value everywhere, and a pose.
fn cloud(points: usize) -> CloudFile {
    let pose = Isometry3::new(Vector3::new(1.0, -2.0, 3.5), Vector3::new(0.3, -0.2, 1.0));
    CloudFile { world_from_cloud: Some(pose), ..scratch::cloud(points) }
}

/// Equal but for NaN, which no `==` finds, and for the rounding of a quaternion.
fn assert_same(found: &CloudFile, expected: &CloudFile) {
    let bare = |cloud: &CloudFile| CloudFile { points: Vec::new(), world_from_cloud: None, ..cloud.clone() };
    assert_eq!(bare(found), bare(expected));
    let bits = |cloud: &CloudFile| -> Vec<u64> {
        let canonical = |value: &f64| if value.is_nan() { f64::NAN } else { *value };
        cloud.points.iter().flatten().map(|value| canonical(value).to_bits()).collect()
    };
    assert_eq!(bits(found), bits(expected));
    assert_eq!(found.world_from_cloud.is_some(), expected.world_from_cloud.is_some());
    if let (Some(found), Some(expected)) = (found.world_from_cloud, expected.world_from_cloud) {
        assert!((found.to_homogeneous() - expected.to_homogeneous()).amax() < 1e-15);
    }
}

#[test]
fn the_own_part_of_sigma_is_written_and_not_read() {
    let scratch = Scratch::new();
    for name in ["own.ply", "own.pcd", "own.e57"] {
        let expected = scratch::cloud(7);
        let with_own = CloudFile { sigma_own: Some(vec![0.001; 7]), ..expected.clone() };
        write_any_cloud(scratch.file(name), &with_own, Precision::Double).unwrap();
        assert_same(&read_any_cloud(scratch.file(name)).unwrap(), &expected);
        let bytes = std::fs::read(scratch.file(name)).unwrap();
        assert!(bytes.windows(9).any(|window| window == b"sigma_own"), "{name}");
        let short = CloudFile { sigma_own: Some(vec![0.001; 6]), ..expected };
        let fault = write_any_cloud(scratch.file(name), &short, Precision::Double).unwrap_err().to_string();
        assert!(fault.contains("`sigma_own`: has 6 values for 7 points"), "{fault}");
    }
}

proptest! {
    #![proptest_config(common::cases(32))]

    #[test]
    fn clouds_come_back(
        points in prop::collection::vec(prop::array::uniform3(prop::num::f64::NORMAL), 2..50), with in 0_u8..128,
        organised in any::<bool>(), format in 0_usize..3,
    ) {
        let scratch = Scratch::new();
        let file = scratch.file(["a.ply", "a.pcd", "a.e57"][format]);
        let mut written = CloudFile { points, ..cloud(0) };
        if organised {
            let height = 2 + written.len() / 3;
            written.points.resize(3 * height, [f64::NAN; 3]);
            written.points[1] = [f64::NAN; 3];
            written.size = Some([3, height]);
        }
        let full = cloud(written.len());
        written.normals = full.normals.filter(|_| with & 1 > 0);
        written.intensity = full.intensity.filter(|_| with & 2 > 0);
        written.sigma = full.sigma.filter(|_| with & 4 > 0);
        written.flags = full.flags.filter(|_| with & 8 > 0);
        written.frame = full.frame.filter(|_| with & 16 > 0);
        written.covariance = full.covariance.filter(|_| with & 32 > 0);
        written.world_from_cloud = full.world_from_cloud.filter(|_| with & 64 > 0);
        write_any_cloud(&file, &written, Precision::Double).unwrap();
        assert_same(&read_any_cloud(&file).unwrap(), &written);
        // Positions beyond the single ones become infinite there, which E57 states as no point.
        written.points.iter_mut().flatten().for_each(|value| *value = f64::from((*value / 1e300) as f32));
        write_any_cloud(&file, &written, Precision::Single).unwrap();
        assert_same(&read_any_cloud(&file).unwrap(), &written);
    }

    #[test]
    fn noise_is_refused_without_panic(noise in prop::collection::vec(any::<u8>(), 0..200), at in 0_usize..600, format in 0_usize..3) {
        let scratch = Scratch::new();
        let file = scratch.file(["a.ply", "a.pcd", "a.e57"][format]);
        write_any_cloud(&file, &cloud(20), Precision::Single).unwrap();
        let mut bytes = std::fs::read(&file).unwrap();
        let at = at.min(bytes.len());
        let end = (at + noise.len()).min(bytes.len());
        bytes[at..end].copy_from_slice(&noise[..end - at]);
        // Any answer will do that is none of a broken program.
        let _ = read(&scratch, "b", &bytes);
        let vtk = [b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 9 float\n".as_slice(), &noise].concat();
        let _ = read(&scratch, "b.vtk", &vtk);
        let _ = read(&scratch, "b.xyz", &[b"1 2 3\n".as_slice(), &noise].concat());
    }
}

#[test]
fn a_pcd_is_read_in_all_encodings() {
    let scratch = Scratch::new();
    let header = |data: &str| {
        format!(
            "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS x _ rgb z y Intensity hist\nSIZE 4 1 4 8 2 1 4\n\
             TYPE F U U F I U F\nCOUNT 1 3 1 1 1 1 2\nWIDTH 2\nHEIGHT 2\nVIEWPOINT 1 2 3 0 1 0 0\nPOINTS 4\nDATA {data}\n"
        )
    };
    let points: [([f64; 3], u8); 4] =
        [([0.5, -300.0, 0.1], 7), ([f64::NAN, 2.0, 0.2], 0), ([1.5, 3.0, 0.3], 255), ([2.5, 4.0, 1e300], 9)];
    let field = |index: usize| -> Vec<Vec<u8>> {
        let values = points.iter().map(|([x, y, z], intensity)| match index {
            0 => (*x as f32).to_le_bytes().to_vec(),
            1 => vec![1, 2, 3],
            3 => z.to_le_bytes().to_vec(),
            4 => (*y as i16).to_le_bytes().to_vec(),
            5 => vec![*intensity],
            _ => vec![9; if index == 2 { 4 } else { 8 }],
        });
        values.collect()
    };
    let fields: Vec<Vec<Vec<u8>>> = (0..7).map(field).collect();
    let by_point: Vec<u8> =
        (0..4).flat_map(|point| fields.iter().flat_map(move |field| field[point].clone())).collect();
    let by_field: Vec<u8> = fields.iter().flatten().flatten().copied().collect();
    let expected = CloudFile {
        points: points.iter().map(|(point, _)| *point).collect(),
        intensity: Some(points.iter().map(|(_, intensity)| f32::from(*intensity)).collect()),
        size: Some([2, 2]),
        world_from_cloud: Some(Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::x() * std::f64::consts::PI)),
        ..CloudFile::default()
    };
    let lines = points.iter().map(|([x, y, z], i)| format!("{x} 0 0 0 4.2e9 {z} {y} {i} 1 2\n"));
    let ascii = header("ascii") + &lines.collect::<Vec<_>>().concat();
    assert_same(&read(&scratch, "a.pcd", ascii.as_bytes()).unwrap(), &expected);
    let binary = [header("binary").as_bytes(), &by_point].concat();
    assert_same(&read(&scratch, "a.pcd", &binary).unwrap(), &expected);
    // Literal runs, and one reference: the eight equal bytes of the last field refer to the byte before them.
    let mut packed: Vec<u8> =
        by_field[..by_field.len() - 31].chunks(32).flat_map(|run| [&[run.len() as u8 - 1][..], run].concat()).collect();
    packed.extend([7 << 5, 31 - 9, 0]);
    let sizes = [(packed.len() as u32).to_le_bytes(), (by_field.len() as u32).to_le_bytes()].concat();
    let compressed = [header("binary_compressed").as_bytes(), &sizes, &packed].concat();
    assert_same(&read(&scratch, "a.pcd", &compressed).unwrap(), &expected);
    for (whole, data) in [(&binary, "binary"), (&compressed, "binary_compressed")] {
        for length in 0..whole.len() {
            assert!(read(&scratch, "a.pcd", &whole[..length]).is_err(), "{data} cut at {length}");
        }
    }
    let lie = [header("binary_compressed").as_bytes(), &[255; 8], &packed].concat();
    assert!(fault(&scratch, "a.pcd", &lie).contains("once unpacked"), "{}", fault(&scratch, "a.pcd", &lie));
}

#[test]
fn what_is_wrong_with_a_pcd_is_said() {
    let scratch = Scratch::new();
    let text = "VERSION 0.7\nFIELDS x y z flags\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 1\nHEIGHT 1\n\
                VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3 4\n";
    assert_eq!(read(&scratch, "a.pcd", text.as_bytes()).unwrap().flags, Some(vec![4]));
    for (from, to, expected) in [
        ("VERSION 0.7", "VERSION 0.6", "version `0.6`, expected 0.7"),
        ("SIZE 4 4 4 2\n", "", "no line `SIZE`"),
        ("SIZE 4 4 4 2", "SIZE 4 4 4", "3 words in `SIZE`, expected 4"),
        ("SIZE 4 4 4 2", "SIZE 4 4 4 3", "`flags` of unknown type U with size 3"),
        ("TYPE F F F U", "TYPE F F Q U", "`z` of unknown type Q"),
        ("COUNT 1 1 1 1", "COUNT 1 1 1 99999999999", "points of more than"),
        ("COUNT 1 1 1 1", "COUNT 1 1 1 2", "2 values of `flags` a point"),
        ("WIDTH 1", "WIDTH 9999999999", "`POINTS` 1, expected `WIDTH` x `HEIGHT` = 9999999999"),
        ("WIDTH 1\nHEIGHT 1", "WIDTH 5000000000\nHEIGHT 5000000000", "too many"),
        ("WIDTH 1", "WIDTH 2\nPOINTS 2", "`POINTS` twice"),
        ("VIEWPOINT 0 0 0 1", "VIEWPOINT 0 0 0 2", "unit quaternion"),
        ("DATA ascii", "DATA zip", "`DATA zip`"),
        ("DATA ascii\n1 2 3 4\n", "DATA ascii\n", "has 0 of 1"),
        ("1 2 3 4", "1 2 3", "no `flags` in point 0"),
        ("1 2 3 4", "1 2 3 4 5", "more than 4 values"),
        ("1 2 3 4", "1 b 3 4", "`y` = `b` in point 0"),
        ("1 2 3 4", "1 2 3 -4", "`flags` = -4"),
        ("FIELDS x", "FIELDS y", "`y` twice"),
    ] {
        assert!(text.contains(from));
        let message = fault(&scratch, "a.pcd", text.replace(from, to).as_bytes());
        assert!(message.contains(expected) && message.contains("a.pcd: "), "{message}\nexpected: {expected}");
    }
}

#[test]
fn scans_keep_names_and_poses_and_join_in_one_frame() {
    let scratch = Scratch::new();
    let file = scratch.file("stations.e57");
    let turned = Isometry3::rotation(Vector3::z() * std::f64::consts::FRAC_PI_2);
    let first = CloudFile { points: vec![[1.0, 0.0, 0.0]], intensity: Some(vec![f32::NAN]), ..CloudFile::default() };
    let second = CloudFile {
        points: vec![[2.0, 0.0, 0.0], [3.0, 0.0, 1.0]],
        intensity: Some(vec![5.0, f32::NAN]),
        world_from_cloud: Some(turned),
        ..CloudFile::default()
    };
    let scans = [("S00", first), ("S01", second)].map(|(name, cloud)| E57Scan { name: name.into(), cloud });
    write_e57(&file, &scans, Precision::Double).unwrap();
    let back = read_e57(&file).unwrap();
    assert_eq!(back.len(), 2);
    assert_eq!((back[0].name.as_str(), back[1].name.as_str()), ("S00", "S01"));
    assert_eq!(back[1].cloud.points, scans[1].cloud.points);
    let intensity = back[1].cloud.intensity.as_ref().unwrap();
    assert!(intensity[0] == 5.0 && intensity[1].is_nan());
    let all = read_any_cloud(&file).unwrap();
    assert_eq!(all.frame, Some(vec![0, 1, 1]));
    let expected = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 3.0, 1.0]];
    let worst = all.points.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(worst.fold(0.0, f64::max) < 1e-15);
    let again = scratch.file("again.e57");
    write_e57(&again, &scans, Precision::Double).unwrap();
    assert_eq!(std::fs::read(&file).unwrap(), std::fs::read(&again).unwrap(), "same scans, same file");
}

#[test]
fn an_e57_that_is_cut_or_lies_is_an_error() {
    let scratch = Scratch::new();
    let file = scratch.file("a.e57");
    write_any_cloud(&file, &cloud(30), Precision::Single).unwrap();
    let bytes = std::fs::read(&file).unwrap();
    for length in (0..bytes.len()).step_by(37) {
        assert!(read(&scratch, "b.e57", &bytes[..length]).is_err(), "cut at {length}");
    }
    // The same file with a lie in its description, and checksums that hold.
    for (from, to, expected) in [
        ("recordCount=\"30\"", "recordCount=\"300000000000\"", "promises 300000000000 points"),
        ("recordCount=\"30\"", "recordCount=\"3000\"", "scan 0"),
        ("cartesianY", "cartesianQ", "neither Cartesian nor spherical"),
    ] {
        lie(&scratch.file("c.e57"), from, to);
        let message = read_any_cloud(scratch.file("c.e57")).unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains("c.e57: "), "{message}");
    }
}

/// A file of thirty points whose description says something else.
fn lie(file: &Path, from: &str, to: &str) {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let mut writer = E57Writer::from_file(file, "{guid}").unwrap();
    let single = RecordDataType::Single { min: None, max: None };
    let record = |name| Record { name, data_type: single.clone() };
    let axes = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ].map(record);
    let mut cloud = writer.add_pointcloud("{cloud}", axes.to_vec()).unwrap();
    for index in 0..30_u8 {
        cloud.add_point(vec![RecordValue::Single(f32::from(index)); 3]).unwrap();
    }
    cloud.finalize().unwrap();
    writer
        .finalize_customized_xml(|xml| {
            assert!(xml.contains(from), "{xml}");
            Ok(xml.replace(from, to))
        })
        .unwrap();
}

#[test]
fn point_lists_are_read() {
    let scratch = Scratch::new();
    let expected = CloudFile { points: vec![[1.0, -2.0, 0.5], [3.0, 4.0, -1e-3]], ..CloudFile::default() };
    assert_eq!(read(&scratch, "a.xyz", b"# made by hand\n1 -2 0.5 \n3\t4 -1e-3").unwrap(), expected);
    assert_eq!(read(&scratch, "a.csv", b"x,y,z\r\n1 , -2,0.5\r\n3,4,-1e-3\r\n").unwrap(), expected);
    assert_eq!(read(&scratch, "a.txt", b"//X;Y;Z;R\n1;-2;.5;9\n3;4;-1e-3;9\n").unwrap(), expected);
    let normals = CloudFile { normals: Some(vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]), ..expected.clone() };
    assert_eq!(read(&scratch, "a.xyzn", b"1 -2 .5 0 0 1\n3 4 -1e-3 0 1 0\n").unwrap(), normals);
    assert_eq!(read(&scratch, "b.csv", b"y,x,z,nx,ny,nz\n-2,1,.5,0,0,1\n4,3,-1e-3,0,1,0\n").unwrap(), normals);
    for (text, expected) in [
        ("1 2 3\n4 5\n", "a.xyz:2:3: has 2 fields, expected 3"),
        ("1 2 3\n4 5 x\n", "a.xyz:2:3: `z`: is `x`, expected a number"),
        ("1 2 3 4 5 6\n", "a.xyz:1:1: has 6 fields without names"),
        ("x y z x\n1 2 3 4\n", "has property `x` twice"),
        ("hello\n", "is no point cloud that is known here"),
        ("", "is no point cloud that is known here"),
        ("1,,3\n1 2 3\n", "a.xyz:1:2: `y`: is ``"),
    ] {
        let message = fault(&scratch, "a.xyz", text.as_bytes());
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
}

#[test]
fn vtk_points_are_read_with_their_attributes() {
    let scratch = Scratch::new();
    let expected = CloudFile {
        points: vec![[1.0, -2.0, 0.5], [3.0, 4.0, -0.25]],
        normals: Some(vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]),
        intensity: Some(vec![7.0, 8.0]),
        sigma: Some(vec![0.5, 0.25]),
        ..CloudFile::default()
    };
    let ascii = "# vtk DataFile Version 3.0\ndata\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 -2 .5 3\n4 -0.25\n\
                 VERTICES 2 4\n1 0\n1 1\n\nCELL_DATA 2\nSCALARS sigma float 1\nLOOKUP_TABLE default\n9 9\nPOINT_DATA 2\n\
                 NORMALS n float\n0 0 1\n0 1 0\nSCALARS intensity float\nLOOKUP_TABLE default\n7\n8\n\
                 FIELD data 2\nsigma 1 2 float\n0.5 0.25\nother 2 2 int\n1 2 3 4\n";
    assert_eq!(read(&scratch, "a.vtk", ascii.as_bytes()).unwrap(), expected);
    let mut binary =
        b"# vtk DataFile Version 5.1\ndata\nBINARY\nDATASET STRUCTURED_GRID\nDIMENSIONS 1 2 1\nPOINTS 2 double\n"
            .to_vec();
    binary.extend(expected.points.iter().flatten().flat_map(|value| value.to_be_bytes()));
    binary.extend(b"\nVERTICES 3 2\nOFFSETS vtktypeint64\n");
    binary.extend([0_i64, 1, 2].iter().flat_map(|value| value.to_be_bytes()));
    binary.extend(b"\nCONNECTIVITY vtktypeint64\n");
    binary.extend([0_i64, 1].iter().flat_map(|value| value.to_be_bytes()));
    binary.extend(b"\nPOINT_DATA 2\nSCALARS flags unsigned_short\nLOOKUP_TABLE default\n\x00\x07\x01\x00\n");
    let found = read(&scratch, "a.vtk", &binary).unwrap();
    assert_eq!((&found.points, found.size, found.flags), (&expected.points, Some([1, 2]), Some(vec![7, 256])));
    for (from, to, expected) in [
        ("POINTS 2", "POINTS 2000000000", "promises 6000000000 values of POINTS"),
        ("POINTS 2 float", "POINTS 2 quad", "unknown type `quad`"),
        ("-0.25", "b", "`b` in POINTS"),
        ("POLYDATA", "RECTILINEAR_GRID", "data set `RECTILINEAR_GRID`"),
        ("ASCII", "TEXT", "`TEXT` in its third line"),
        ("VERTICES", "THINGS", "`THINGS 2 4`, which is not understood"),
        ("8\nFIELD", "FIELD", "expected a number"),
        ("3 4\n", "3\n", "promises 4 values of other"),
    ] {
        let message = fault(&scratch, "a.vtk", ascii.replacen(from, to, 1).as_bytes());
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
}

#[test]
fn a_folder_and_an_unknown_ending_are_named() {
    let scratch = Scratch::new();
    let message = read_any_cloud(scratch.file("")).unwrap_err().to_string();
    assert!(message.contains("is a folder, expected the file of a point cloud"), "{message}");
    let message = write_any_cloud(scratch.file("a.xyz"), &cloud(1), Precision::Single).unwrap_err().to_string();
    assert!(message.contains("expected .ply, .pcd or .e57"), "{message}");
}

#[test]
fn real_lists_have_their_points() {
    for (file, points, normals) in [
        ("stanford_bunny_2scans/bun000.xyz", 40_256, false),
        ("libpointmatcher_icp/car_cloud400.csv", 24_989, true),
        ("libpointmatcher_icp/car_cloud401.csv", 25_193, false),
        ("libpointmatcher_icp/cloud.00000.vtk", 24_989, false),
    ] {
        let Some(path) = common::real(file) else { continue };
        let cloud = read_any_cloud(path).unwrap();
        assert_eq!((cloud.len(), cloud.normals.is_some()), (points, normals), "{file}");
    }
}
