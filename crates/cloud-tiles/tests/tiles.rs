use cloud_tiles::{FEWEST_POINTS_IN_MEMORY, TileOptions, write_tiles};

use crate::read::{Copc, ply};

/// Points of a wavy floor and of a wall that stands on it, as dense as one likes, by numbers that fill both evenly.
fn room(points: usize) -> Vec<[f32; 3]> {
    let share = |index: usize, step: f64| (index as f64 * step).fract();
    let point = |index: usize| {
        let [u, v] = [share(index, 0.754_877_666_246_693), share(index, 0.569_840_290_998_053_3)];
        if index.is_multiple_of(3) {
            [(6.0 * u - 3.0) as f32, 4.0, (3.0 * v) as f32]
        } else {
            [(6.0 * u - 3.0) as f32, (8.0 * v - 4.0) as f32, (0.02 * (9.0 * u).sin()) as f32]
        }
    };
    (0..points).map(point).collect()
}

#[test]
fn every_point_is_in_one_node_with_all_that_is_known_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("cloud.ply"), folder.path().join("cloud.copc.laz"));
    let points = room(120_000);
    ply(&from, &points);
    let tiles = write_tiles(&from, &to, &TileOptions::default()).unwrap();
    let copc = Copc::open(&to);
    assert_eq!((tiles.points, tiles.left_out, tiles.nodes), (120_000, 0, copc.nodes.len()));
    assert_eq!((copc.points, copc.step, tiles.step_m), (120_000, 1e-5, 1e-5));
    assert_eq!(copc.names, ["amplitude", "sigma", "flags", "frame"]);
    assert!(copc.nodes.len() > 4 && copc.nodes.contains_key(&[0, 0, 0, 0]), "{} nodes", copc.nodes.len());
    let mut seen = vec![false; points.len()];
    for (key, node) in &copc.nodes {
        // Every node but the first has a parent.
        assert!(key[0] == 0 || copc.nodes.contains_key(&[key[0] - 1, key[1] / 2, key[2] / 2, key[3] / 2]));
        let side = 2.0 * copc.half / f64::from(1 << key[0]);
        for record in copc.records(*node).chunks(copc.length) {
            let number = u32::from_le_bytes(record[40..44].try_into().unwrap());
            let f32_at = |at: usize| f32::from_le_bytes(record[at..at + 4].try_into().unwrap());
            let place = copc.place(record);
            for axis in 0..3 {
                let truth = f64::from(points[number as usize][axis]);
                assert!((place[axis] - truth).abs() <= 0.5001e-5, "{place:?}");
                let low = copc.centre[axis] - copc.half + side * f64::from(key[1 + axis]);
                assert!((low - 1e-9..low + side + 1e-9).contains(&place[axis]), "{key:?} {place:?}");
            }
            assert_eq!((f32_at(30), f32_at(34)), (1.0 + number as f32, 1e-3 * number as f32));
            let flags = u16::from_le_bytes(record[38..40].try_into().unwrap());
            // Flagged points are withheld.
            assert_eq!((flags, record[15]), if number.is_multiple_of(5) { (8, 4) } else { (0, 0) });
            let intensity = u16::from_le_bytes(record[12..14].try_into().unwrap());
            assert!((f64::from(intensity) / 65535.0 - f64::from(1 + number) / 120_000.0).abs() < 1e-5);
            assert!(!std::mem::replace(&mut seen[number as usize], true), "point {number} is there twice");
        }
    }
    assert!(seen.iter().all(|seen| *seen));
}

#[test]
fn the_first_levels_cover_the_whole_evenly() {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("cloud.ply"), folder.path().join("cloud.copc.laz"));
    ply(&from, &room(200_000));
    write_tiles(&from, &to, &TileOptions::default()).unwrap();
    let copc = Copc::open(&to);
    let root = copc.nodes[&[0, 0, 0, 0]];
    let cell = 2.0 * copc.half / 128.0;
    let cells = |records: &[u8]| {
        let cell = |record: &[u8]| copc.place(record).map(|x| (x / cell).floor() as i64);
        records.chunks(copc.length).map(cell).collect::<std::collections::BTreeSet<_>>()
    };
    let own = cells(&copc.records(root)).len();
    let all: std::collections::BTreeSet<_> = copc.nodes.values().flat_map(|node| cells(&copc.records(*node))).collect();
    // Cells here and there lie differently by a part of one.
    assert!(own as f64 > 0.6 * all.len() as f64, "{own} of {} cells", all.len());
    assert!(root.2 < 50_000);
}

#[test]
fn memory_changes_no_byte_and_no_file_of_parts_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut points = room(700_000);
    // A heap in a corner, so that nodes of very different levels are beyond memory, and points without a place.
    for (index, point) in points.iter_mut().enumerate().skip(60_000) {
        if index % 7 < 6 {
            *point = point.map(|x| 2.5 + 0.01 * x);
        }
    }
    points[5] = [f32::NAN, 0.0, 0.0];
    ply(&path("cloud.ply"), &points);
    let write = |name: &str, points_in_memory: u64| {
        let tiles = write_tiles(path("cloud.ply"), path(name), &TileOptions { points_in_memory }).unwrap();
        assert_eq!((tiles.points, tiles.left_out), (699_999, 1));
        std::fs::read(path(name)).unwrap()
    };
    let (all, little) = (write("a.copc.laz", 4_000_000), write("b.copc.laz", FEWEST_POINTS_IN_MEMORY));
    assert!(all == little, "{} and {} bytes", all.len(), little.len());
    let mut left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["a.copc.laz", "b.copc.laz", "cloud.ply"]);
}

#[test]
fn points_that_are_the_same_stay_together() {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (folder.path().join("cloud.ply"), folder.path().join("cloud.copc.laz"));
    ply(&from, &vec![[1.25, -0.5, 3.0]; 60_000]);
    let tiles = write_tiles(&from, &to, &TileOptions::default()).unwrap();
    assert_eq!(Copc::open(&to).nodes.values().map(|node| node.2).sum::<usize>(), 60_000);
    assert_eq!(tiles.points, 60_000);
}
