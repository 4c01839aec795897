//! How much memory a command may take, and clouds in tiles.

use std::path::Path;

use crate::fleet::{RUN, done, files, rangecam, world};

#[test]
fn results_do_not_depend_on_memory_and_what_does_not_fit_is_refused() {
    let root = world();
    done(root.path(), &format!("{RUN} --out out"));
    let whole = files(&root.path().join("out"));
    let (code, said) = rangecam(root.path(), &format!("{RUN} --out little --memory 1MB"));
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("averaging 2 frames of a station: needs") && said.contains("1MB are allowed"), "{said}");
    // As much as it says is enough, and gives the same bytes.
    let enough = said.rsplit("allow --memory ").next().unwrap().split(',').next().unwrap();
    done(root.path(), &format!("{RUN} --out out --memory {enough}"));
    assert!(whole == files(&root.path().join("out")), "less memory gives other bytes");
    for command in ["noise", "fpn", "warmup", "register --track", "register"] {
        let (code, said) =
            rangecam(root.path(), &format!("{command} archive/north/monday/hall --out little --memory 2MB"));
        // Those that need another survey say so first, or this.
        assert_eq!(code, Some(2), "{command}: {said}");
        assert!(command == "warmup" || said.contains("of memory, and 2MB are allowed"), "{command}: {said}");
    }
    let (code, said) = rangecam(root.path(), &format!("{RUN} --memory 2"));
    assert_eq!(code, Some(2));
    assert!(said.contains("--memory") && said.contains("MB, GB, MiB or GiB"), "{said}");
}

#[test]
fn parts_are_merged_within_memory() {
    let root = world();
    done(root.path(), &format!("{RUN} --out whole"));
    for part in 1..=2 {
        done(root.path(), &format!("{RUN} --shard {part}/2 --out parts/{part}"));
    }
    let merge = "merge parts/1 parts/2 --no-times";
    let (code, said) = rangecam(root.path(), &format!("{merge} --out little --memory 1MB"));
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("merging the parts of a run: needs") && said.contains("1MB are allowed"), "{said}");
    // As much as it says is enough for one point at a time.
    let enough = said.rsplit("allow --memory ").next().unwrap().split(',').next().unwrap();
    let whole = files(&root.path().join("whole"));
    done(root.path(), &format!("{merge} --out whole --memory {enough}"));
    assert!(whole == files(&root.path().join("whole")), "less memory gives other bytes");
    // A cloud that is shorter than its part says.
    let cloud = root.path().join("parts/1/cloud.ply");
    let text = std::fs::read(&cloud).unwrap();
    let (place, vertices) = vertices(&text);
    let fewer = format!("{:0>1$}", 12, vertices.len());
    std::fs::write(&cloud, [&text[..place], fewer.as_bytes(), &text[place + vertices.len()..]].concat()).unwrap();
    let (code, said) = rangecam(root.path(), &format!("{merge} --out again"));
    assert!(code == Some(2) && said.contains("has fewer points than its part wrote"), "{code:?} {said}");
}

/// Where the number of points stands in a PLY file, and it.
fn vertices(text: &[u8]) -> (usize, String) {
    let header = String::from_utf8_lossy(&text[..1000]).into_owned();
    let place = header.find("element vertex ").unwrap() + "element vertex ".len();
    (place, header[place..].lines().next().unwrap().to_owned())
}

#[test]
fn a_large_cloud_is_in_tiles_and_who_measures_is_told() {
    let root = world();
    done(root.path(), &format!("{RUN} --out plain"));
    done(root.path(), &format!("{RUN} --tiles-above 1000 --out tiled"));
    let (plain, tiled) = (files(&root.path().join("plain")), files(&root.path().join("tiled")));
    let summary: serde_json::Value = serde_json::from_slice(&tiled[Path::new("summary.json")]).unwrap();
    assert_eq!((&summary["tiles"]["file"], &summary["tiles"]["step_m"]), (&"cloud.copc.laz".into(), &1e-5.into()));
    assert!(summary["tiles"]["points"].as_u64().unwrap() > 1000);
    assert!(tiled.contains_key(Path::new("cloud.copc.laz")) && !tiled.contains_key(Path::new("cloud.ply")));
    // Not above so many: as before.
    done(root.path(), &format!("{RUN} --tiles-above 1000000 --out plainer"));
    let plainer = files(&root.path().join("plainer"));
    assert_eq!(plain[Path::new("cloud.ply")], plainer[Path::new("cloud.ply")]);
    let (code, said) = rangecam(root.path(), "fuse tiled --out fused");
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("its points are in tiles (cloud.copc.laz)"), "{said}");
    let fused = done(root.path(), "fuse plain --tiles-above 0 --out fused --json");
    let fused: serde_json::Value = serde_json::from_str(&fused).unwrap();
    assert_eq!(fused["clouds"][0], "cloud.copc.laz");
    assert!(root.path().join("fused/cloud.copc.laz").is_file() && !root.path().join("fused/cloud.ply").exists());
}
