//! Pairs of frames and of clouds, from raw points to a pose, from the identity.

use super::super::table::{Bars, Least, head, number};
use super::{PAIRS, Stage};
use crate::shell::Outcome;

/// Frames that everyone aligns.
struct Case {
    name: &'static str,
    folder: &'static str,
    /// Distance between targets, first pair and number of pairs.
    pairs: [usize; 3],
}

const LARGE: Case = Case { name: "640x480", folder: "large", pairs: [2, 0, 10] };
const MEDIUM: Case = Case { name: "224x172", folder: "medium", pairs: [2, 0, 20] };
/// Every tenth frame from 140 to 380. Of those before, some have a pose that all methods deny alike.
const KINECT: Case = Case { name: "Kinect", folder: "kinect", pairs: [1, 24, 24] };
const WHOLE: Case = Case { name: "Kinect, all", folder: "kinect", pairs: [1, 0, 59] };
const LASER: Case = Case { name: "laser", folder: "laser", pairs: [1, 0, 1] };

const NAMES: [(&str, &str); 16] = [
    ("gicp_fine", "small_gicp GICP, 2.5 cm"),
    ("gicp_medium", "small_gicp GICP, 5 cm"),
    ("gicp_coarse", "small_gicp GICP, 8 cm"),
    ("vgicp_fine", "small_gicp VGICP, 2.5 cm"),
    ("vgicp_medium", "small_gicp VGICP, 5 cm"),
    ("vgicp_coarse", "small_gicp VGICP, 8 cm"),
    ("plane_fine", "small_gicp point to plane, 2.5 cm"),
    ("open3d_gicp", "Open3D GICP, 5 cm"),
    ("open3d_plane", "Open3D point to plane, 5 cm"),
    ("open3d_tukey", "the same, Tukey's kernel"),
    ("open3d_projective", "Open3D projective, 10-15-30 iterations"),
    ("open3d_projective_short", "Open3D projective, 6-3-1 iterations"),
    ("organised", "`icp-registration`, frames"),
    ("voxels", "`icp-registration`, voxels"),
    ("align", "`icp-registration`, `align` of frames"),
    ("align_unorganised", "`icp-registration`, `align` of clouds"),
];
/// What the bars need; these run as often as asked for, the others once.
const AGAIN: [&str; 2] = ["gicp", "vgicp"];

pub(super) fn run(stage: &Stage, least: &mut Least, bars: &mut Bars) -> Outcome {
    let mut cases = vec![LARGE, MEDIUM];
    cases.extend(stage.kinect.then_some(KINECT));
    cases.extend(stage.laser.then_some(LASER));
    for case in &cases {
        for run in 0..stage.runs {
            compare(stage, case, if run == 0 { &[] } else { &AGAIN }, least)?;
        }
    }
    if stage.kinect {
        compare(stage, &WHOLE, &["gicp_medium", "vgicp_medium"], least)?;
        cases.push(WHOLE);
    }
    print(&cases, least);
    for case in &cases {
        add_bars(case, least, bars);
    }
    threads(stage, bars)
}

/// Everyone in turn.
fn compare(stage: &Stage, case: &Case, peers: &[&str], least: &mut Least) -> Outcome {
    println!("── {}", case.name);
    let pairs = case.pairs.map(|number| number.to_string());
    let pairs = pairs.each_ref().map(String::as_str);
    least.note_all(case.name, &stage.peers("frames", case.folder, &[&pairs, peers].concat())?);
    let all: &[&str] = if peers.is_empty() { &["all"] } else { &[] };
    let printed = stage.ours(&["frames"], case.folder, &[&pairs, all].concat())?;
    for (who, _) in NAMES.iter().filter(|(who, _)| printed.count(who) > 0) {
        least.note_line(case.name, who, &PAIRS, &printed);
    }
    Ok(())
}

fn print(cases: &[Case], least: &Least) {
    let mut cells = vec!["from raw points to a pose: CPU ms, median degrees, median mm, good pairs".to_owned()];
    cells.extend(cases.iter().map(|case| format!("{} ({} pairs)", case.name, case.pairs[2])));
    head(&cells.iter().map(String::as_str).collect::<Vec<_>>());
    for (who, name) in NAMES {
        let cell = |case: &Case| {
            let figures = PAIRS.map(|figure| least.get(case.name, who, figure));
            if figures[0].is_nan() { "-".to_owned() } else { figures.map(number).join(", ") }
        };
        println!("| {name} | {} |", cases.iter().map(cell).collect::<Vec<_>>().join(" | "));
    }
}

fn add_bars(case: &Case, least: &Least, bars: &mut Bars) {
    let get = |who: &str, figure: &str| least.get(case.name, who, figure);
    let name = case.name;
    let mut times_faster = |bar: f64, peer: &str, words: &str| {
        let ratio = get(peer, "ms") / get("organised", "ms");
        bars.at_least(&format!("{name}, times faster than {words}"), bar, ratio);
    };
    let mut limits = None;
    if name == LARGE.name {
        times_faster(8.0, "gicp_fine", "GICP, 2.5 cm");
        times_faster(8.0, "gicp_coarse", "GICP, 8 cm (its fastest)");
        // PCL has no package; its organised projection took 0.43 of this GICP's time on one machine.
        times_faster(1.0 / 0.107, "gicp_fine", "GICP, 2.5 cm (a quarter of PCL's organised projection)");
        limits = Some([0.0030, 0.15]);
    } else if name == MEDIUM.name {
        times_faster(14.0, "vgicp_fine", "VGICP, 2.5 cm");
        times_faster(14.0, "vgicp_coarse", "VGICP, 8 cm (its fastest)");
        limits = Some([0.0126, 0.70]);
    }
    if let Some([degrees, millimetres]) = limits {
        bars.at_most(&format!("{name}, median degrees"), degrees, get("organised", "deg"));
        bars.at_most(&format!("{name}, median mm"), millimetres, get("organised", "mm"));
    }
    if limits.is_some() || name == KINECT.name {
        bars.at_least(&format!("{name}, good pairs"), case.pairs[2] as f64, get("organised", "good"));
    }
    if [LARGE.name, LASER.name].contains(&name) {
        add_bars_of_clouds(name, least, bars);
    }
}

/// The same points without their order.
fn add_bars_of_clouds(name: &str, least: &Least, bars: &mut Bars) {
    let get = |who: &str, figure: &str| least.get(name, who, figure);
    for (peer, words) in [("gicp_fine", "with its finest voxels"), ("gicp_coarse", "with its coarsest voxels")] {
        let ratio = get(peer, "ms") / get("voxels", "ms");
        bars.at_least(&format!("{name} as clouds, times faster than GICP {words}"), 1.5, ratio);
    }
    let best = ["gicp_fine", "gicp_medium", "gicp_coarse"].map(|who| get(who, "mm"));
    let best = best.into_iter().fold(f64::INFINITY, f64::min);
    bars.at_most(&format!("{name} as clouds, mm over GICP's best"), 1.0, get("voxels", "mm") / best);
}

/// Elapsed time on two threads, with the same bits. Processors share memory and heat: what two registrations reach that
/// share nothing else is stated beside it.
fn threads(stage: &Stage, bars: &mut Bars) -> Outcome {
    let printed = stage.ours(&["threads"], LARGE.folder, &[])?;
    let possible = printed.get("possible", 0);
    let what = format!("640x480, two threads, times faster ({possible:.2} by two registrations at once)");
    bars.at_least(&what, 1.85, printed.get("faster", 0));
    bars.at_least("640x480, two threads, pairs with the same bits", 10.0, printed.get("same_bits", 0));
    Ok(())
}
