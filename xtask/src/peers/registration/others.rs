//! Pairs without a guess, streams, and rings of stations.

use super::super::table::{Bars, Least, head, row};
use super::{PAIRS, Stage};
use crate::shell::Outcome;

pub(super) fn coarse(stage: &Stage, least: &mut Least, bars: &mut Bars) -> Outcome {
    println!("── without a guess");
    least.note_all("coarse", &stage.peers("coarse", "coarse", &[])?);
    least.note_line("coarse", "coarse", &PAIRS, &stage.ours(&["coarse"], "coarse", &[])?);
    head(&["1 to 2 m, 20 to 60 degrees, half shared", "CPU ms", "median degrees", "median mm", "good of 14"]);
    for (who, name) in [
        ("ransac", "Open3D FPFH and RANSAC, point to plane"),
        ("graph", "Open3D FPFH, KISS-Matcher's solver, point to plane"),
        ("kiss_matcher", "KISS-Matcher, point to plane"),
        ("coarse", "`icp-registration`, without a guess"),
    ] {
        row(name, &PAIRS.map(|figure| least.get("coarse", who, figure)));
    }
    let get = |who: &str, figure: &str| least.get("coarse", who, figure);
    bars.at_least("without a guess, good pairs of 14", 14.0, get("coarse", "good"));
    // TEASER++ has no package: the same features with its successor's solver stand for it.
    let ratio = |peer: &str| get("coarse", "ms") / get(peer, "ms");
    bars.at_most("without a guess, time over FPFH with a solver by graphs (for TEASER++)", 0.5, ratio("graph"));
    bars.at_most("without a guess, time over FPFH with RANSAC", 0.5, ratio("ransac"));
    Ok(())
}

pub(super) fn tracking(stage: &Stage, least: &mut Least, bars: &mut Bars) -> Outcome {
    let mut streams = vec![("tracking", "300 simulated frames")];
    streams.extend(stage.kinect.then_some(("kinect", "60 Kinect frames")));
    for (folder, _) in &streams {
        println!("── stream: {folder}");
        least.note_all(folder, &stage.peers("tracking", folder, &[])?);
        least.note_line(folder, "ours", &["ms", "mm", "lost"], &stage.ours(&["tracking"], folder, &[])?);
    }
    let mut cells = vec!["streams".to_owned()];
    cells.extend(streams.iter().flat_map(|(_, name)| [format!("{name}, CPU ms a frame"), "off, mm".to_owned()]));
    head(&cells.iter().map(String::as_str).collect::<Vec<_>>());
    let get = |folder: &str, who: &str, figure: &str| least.get(folder, who, figure);
    for (who, name) in [
        ("kiss_icp", "KISS-ICP, 10 cm"),
        ("gicp", "small_gicp GICP, frame to frame"),
        ("ours", "`icp-registration`, keyframes"),
    ] {
        let figures = streams.iter().flat_map(|(folder, _)| ["ms", "mm"].map(|figure| get(folder, who, figure)));
        row(name, &figures.collect::<Vec<_>>());
    }
    bars.at_most("300 simulated frames, ms a frame", 5.0, get("tracking", "ours", "ms"));
    bars.at_most("300 simulated frames, mm off", 10.0, get("tracking", "ours", "mm"));
    for (folder, name) in &streams {
        let ratio = |figure: &str| get(folder, "ours", figure) / get(folder, "kiss_icp", figure);
        bars.at_most(&format!("{name}, time over KISS-ICP's"), 1.0 / 15.0, ratio("ms"));
        bars.at_most(&format!("{name}, mm over KISS-ICP's"), 1.0, ratio("mm"));
        bars.at_most(&format!("{name}, frames lost"), 0.0, get(folder, "ours", "lost"));
    }
    Ok(())
}

pub(super) fn stations(stage: &Stage, least: &mut Least, bars: &mut Bars) -> Outcome {
    println!("── stations");
    least.note_all("stations", &stage.peers("stations", "stations", &[])?);
    let printed = stage.ours(&["stations"], "stations", &[])?;
    least.note_line("stations", "ours", &["mm", "ms", "whole_ms"], &printed);
    head(&["16 stations", "rms off, mm", "adjustment, CPU ms", "with pairs, CPU ms"]);
    for (who, name) in [
        ("start", "at the start"),
        ("chain", "small_gicp GICP, chain"),
        ("graph", "small_gicp GICP, Open3D pose graph"),
        ("ours", "`icp-registration`, stations"),
    ] {
        row(name, &["mm", "ms", "whole_ms"].map(|figure| least.get("stations", who, figure)));
    }
    bars.at_most("16 stations, rms off, mm", 0.5, least.get("stations", "ours", "mm"));
    Ok(())
}
