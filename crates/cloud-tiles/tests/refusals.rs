use cloud_tiles::{Error, TileOptions, write_tiles};

use crate::read::ply;

fn refused(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("cloud.ply"), folder.path().join("cloud.copc.laz"));
    std::fs::write(&from, bytes).unwrap();
    let error = write_tiles(&from, &to, &TileOptions::default()).unwrap_err();
    assert!(!to.exists());
    error.to_string()
}

#[test]
fn what_is_no_ply_of_points_is_named() {
    let head = |lines: &str| format!("ply\nformat binary_little_endian 1.0\n{lines}end_header\n");
    let place = "property float x\nproperty float y\nproperty float z\n";
    for (text, expected) in [
        ("solid\n".to_owned(), "is no PLY file"),
        ("ply\nformat ascii 1.0\nend_header\n".to_owned(), "binary little-endian"),
        ("ply\nformat binary_little_endian 1.0\n".to_owned(), "no header that ends"),
        (head(&format!("element vertex 9999999999999\n{place}")), "too few for 9999999999999 points"),
        (head(&format!("element vertex x\n{place}")), "has \"x\" points"),
        (head("element vertex 0\nproperty float x\nproperty float y\n"), "no properties `x`, `y` and `z`"),
        (head(&format!("element vertex 0\n{place}property float x\n")), "`x` twice"),
        (head(&format!("element vertex 0\n{place}property list uchar int a\n")), "property list"),
        (head(&format!("element vertex 0\n{place}property half a\n")), "the type \"half\""),
        (head(&format!("element vertex 0\n{place}")), "none of its 0 points has finite coordinates"),
    ] {
        let found = refused(text.as_bytes());
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn points_without_a_place_and_without_end_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("cloud.ply"), folder.path().join("cloud.copc.laz"));
    ply(&from, &[[f32::NAN, 0.0, 0.0]]);
    assert!(matches!(write_tiles(&from, &to, &TileOptions::default()), Err(Error::NoPoints { points: 1, .. })));
    ply(&from, &[[0.0, 0.0, 0.0], [1e9, 0.0, 0.0]]);
    assert!(matches!(write_tiles(&from, &to, &TileOptions::default()), Err(Error::TooWide { .. })));
    let options = TileOptions { points_in_memory: 1000 };
    assert!(matches!(write_tiles(&from, &to, &options), Err(Error::OutOfDomain { value: 1000, .. })));
    assert!(matches!(write_tiles(folder.path(), &to, &TileOptions::default()), Err(Error::Io { .. })));
}
