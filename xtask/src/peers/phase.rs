//! Unwrapping: scikit-image, OpenCV, SNAPHU and kamui beside `phase-unwrap`, on the same images.

mod absolute;
mod demodulation;
mod frequencies;

use super::environment::{Environment, Example};
use super::table::{Bars, Folder, Least, head, row};
use crate::shell::Outcome;

/// Peers that take longer than this run once only.
const SLOW_MS: f64 = 2000.0;

/// Image sizes, the peers that are bearable there, and how much faster than scikit-image the tree has to be.
const ROOMS: [(usize, usize, &[&str], f64); 4] = [
    (176, 144, &["scikit_image", "opencv", "snaphu", "kamui"], 7.0),
    (640, 480, &["scikit_image", "opencv", "snaphu", "kamui"], 9.0),
    (1024, 1024, &["scikit_image", "opencv", "snaphu"], 11.0),
    (4096, 4096, &["scikit_image"], 12.0),
];
const HILLS: [(usize, usize, &[&str]); 3] = [
    (176, 144, &["scikit_image", "opencv", "snaphu", "kamui"]),
    (640, 480, &["scikit_image", "snaphu", "kamui"]),
    (1024, 1024, &["scikit_image", "snaphu"]),
];
const NAMES: [(&str, &str); 6] = [
    ("scikit_image", "scikit-image `unwrap_phase`"),
    ("opencv", "OpenCV histogram"),
    ("snaphu", "SNAPHU, smooth, from the tree"),
    ("kamui", "kamui, integer program"),
    ("ours_tree", "`phase-unwrap`, tree"),
    ("ours_noisy", "`phase-unwrap`, noisy"),
];

/// The peers' environment, our example, and how often.
struct Stage {
    environment: Environment,
    ours: Example,
    runs: usize,
}

/// An image that everyone unwraps.
struct Image<'a> {
    case: String,
    size: [String; 2],
    folder: &'a str,
}

pub(crate) fn run(runs: usize) -> Outcome {
    let Some(environment) = Environment::if_possible("phase") else { return Ok(()) };
    let ours = Example::build("phase-unwrap", "peers_phase")?;
    let stage = Stage { environment, ours, runs };
    let mut bars = Bars::default();
    stage.unwrapping(&mut bars)?;
    absolute::run(&stage, &mut bars)?;
    frequencies::run(&stage, &mut bars)?;
    demodulation::run(&stage, &mut bars)?;
    bars.print();
    Ok(())
}

impl Stage {
    fn unwrapping(&self, bars: &mut Bars) -> Outcome {
        let mut least = Least::default();
        for (width, height, peers, _) in ROOMS {
            self.everyone("room", [width, height], peers, "tree", &mut least)?;
        }
        for (width, height, peers) in HILLS {
            self.everyone("hills", [width, height], peers, "noisy", &mut least)?;
        }
        print_rooms(&least);
        print_hills(&least);
        add_bars(&least, bars);
        Ok(())
    }

    /// Makes an image, lets everyone unwrap it in turn, and judges the counts.
    fn everyone(
        &self,
        scene: &str,
        [width, height]: [usize; 2],
        peers: &[&str],
        mode: &str,
        least: &mut Least,
    ) -> Outcome {
        let case = format!("{scene} {width}x{height}");
        println!("── {case}");
        let folder = Folder::new(&format!("{scene}-{width}x{height}"))?;
        let image = Image { case, size: [width.to_string(), height.to_string()], folder: &folder.text() };
        let [width, height] = image.size.each_ref().map(String::as_str);
        self.ours.call(&["scene", scene, width, height, image.folder])?;
        for run in 0..self.runs {
            let quick = |peer: &&&str| run == 0 || least.get(&image.case, peer, "ms") < SLOW_MS;
            let peers: Vec<&str> = peers.iter().filter(quick).copied().collect();
            self.peers(&image, &peers, least)?;
            let printed = self.ours.call(&[mode, width, height, image.folder])?;
            least.note_own(&image.case, &format!("ours_{mode}"), mode, &printed);
        }
        least.note_all(&image.case, &self.script("judge", &image, &[])?);
        folder.remove()
    }

    fn peers(&self, image: &Image<'_>, peers: &[&str], least: &mut Least) -> Outcome {
        if !peers.is_empty() {
            least.note_all(&image.case, &self.script("unwrap", image, peers)?);
        }
        Ok(())
    }

    fn script(&self, command: &str, image: &Image<'_>, rest: &[&str]) -> Result<serde_json::Value, String> {
        let mut arguments = vec![command, image.folder, &image.size[0], &image.size[1]];
        arguments.extend(rest);
        self.environment.call("phase_peers.py", &arguments)
    }
}

fn print_rooms(least: &Least) {
    head(&[
        "a room with true jumps, CPU ms",
        "176x144",
        "640x480",
        "1024x1024",
        "4096x4096",
        "bytes a pixel, 1024x1024",
        "right, 640x480",
        "as scikit-image, 640x480",
    ]);
    for (who, name) in NAMES.into_iter().filter(|(who, _)| *who != "ours_noisy") {
        let mut figures: Vec<f64> =
            ROOMS.iter().map(|(w, h, ..)| least.get(&format!("room {w}x{h}"), who, "ms")).collect();
        figures.push(least.get("room 1024x1024", who, "bytes"));
        figures.extend(["right", "equal"].map(|figure| least.get("room 640x480", who, figure)));
        row(name, &figures);
    }
}

fn print_hills(least: &Least) {
    head(&[
        "smooth hills, noise of 1 rad, CPU ms",
        "176x144",
        "640x480",
        "1024x1024",
        "next to the truth, 640x480",
        "as wrapped, 640x480",
    ]);
    for (who, name) in NAMES.into_iter().filter(|(who, _)| *who != "ours_tree") {
        let mut figures: Vec<f64> =
            HILLS.iter().map(|(w, h, _)| least.get(&format!("hills {w}x{h}"), who, "ms")).collect();
        figures.extend(["right", "exact"].map(|figure| least.get("hills 640x480", who, figure)));
        row(name, &figures);
    }
}

fn add_bars(least: &Least, bars: &mut Bars) {
    for (width, height, _, bar) in ROOMS {
        let case = format!("room {width}x{height}");
        let ratio = least.get(&case, "scikit_image", "ms") / least.get(&case, "ours_tree", "ms");
        bars.at_least(&format!("tree, times faster than scikit-image, {width}x{height}"), bar, ratio);
    }
    for (width, height, ..) in ROOMS {
        let bytes = least.get(&format!("room {width}x{height}"), "ours_tree", "bytes");
        bars.at_most(&format!("tree, bytes a pixel with its result, {width}x{height}"), 40.0, bytes);
    }
    let noisy = |who: &str, figure: &str| least.get("hills 640x480", who, figure);
    bars.at_least("noise of 1 rad, right as wrapped", 0.997, noisy("ours_noisy", "exact"));
    bars.at_least("noise of 1 rad, right next to the truth", 0.997, noisy("ours_noisy", "right"));
    bars.at_most("noise of 1 rad, time over SNAPHU's", 0.1, noisy("ours_noisy", "ms") / noisy("snaphu", "ms"));
}
