//! Boards as they are met: by the size of the image and what makes them difficult.

use std::io::Write;

use rand::{RngExt, SeedableRng};
use range_image::Raster;
use targets::BoardSighting;
use targets::camera_model::Camera;
use targets::nalgebra::{Isometry3, Vector2};

use super::board::PrintedBoard;
use super::render::{Optics, Plane, render};
use super::sensor::Sensor;
use super::views::{Wanted, large_camera, random_view, small_camera, true_nodes};

/// An image with its truth.
pub struct Case {
    pub image: Raster<f32>,
    pub wanted: Wanted,
    /// Nodes inside the image, with their pixel positions, and whether they are seen.
    pub truth: Vec<([usize; 2], [f64; 2], bool)>,
}

/// What makes a case: shares of the contrast, pixels.
struct Difficulty {
    noise: f64,
    blur_px: [f64; 2],
    tilt_deg: [f64; 2],
    /// Sides of fields in the small image; in the large one four times as long.
    field_px: [f64; 2],
    vignetting: f64,
    inside_px: f64,
    hidden: bool,
}

/// The kinds of cases: `small_` or `large_`, then one of these.
pub const KINDS: [&str; 8] = ["plain", "tilted", "noisy", "blurred", "fields", "hidden", "outside", "dark"];

fn difficulty(kind: &str) -> Difficulty {
    let plain = Difficulty {
        noise: 0.01,
        blur_px: [0.5, 1.0],
        tilt_deg: [0.0, 30.0],
        field_px: [8.0, 13.0],
        vignetting: 0.3,
        inside_px: 2.0,
        hidden: false,
    };
    match kind {
        "tilted" => Difficulty { tilt_deg: [35.0, 60.0], field_px: [9.0, 14.0], ..plain },
        "noisy" => Difficulty { noise: 0.06, ..plain },
        "blurred" => Difficulty { blur_px: [1.3, 1.5], field_px: [7.0, 12.0], ..plain },
        "fields" => Difficulty { field_px: [5.0, 6.5], tilt_deg: [0.0, 15.0], ..plain },
        "hidden" => Difficulty { hidden: true, ..plain },
        "outside" => Difficulty { inside_px: -30.0, field_px: [10.0, 18.0], ..plain },
        "dark" => Difficulty { vignetting: 0.9, noise: 0.02, ..plain },
        _ => plain,
    }
}

/// The case of a name and a seed: a board of 9 x 6, or of what follows a second `_`, as in `small_plain_6x4`.
pub fn case(name: &str, seed: u64) -> Case {
    let mut parts = name.splitn(3, '_');
    let name = [parts.next().unwrap_or("small"), parts.next().unwrap_or("plain")].join("_");
    let sides = parts.next().and_then(|size| size.split_once('x'));
    let size = sides.map_or([9, 6], |(columns, rows)| [columns, rows].map(|side| side.parse().unwrap()));
    case_of(&name, size, seed)
}

/// The case of a name, a board's size and a seed.
pub fn case_of(name: &str, [columns, rows]: [usize; 2], seed: u64) -> Case {
    let (size, kind) = name.split_once('_').unwrap_or(("small", name));
    let difficulty = difficulty(kind);
    let (camera, scale) = if size == "large" { (large_camera(), 3.6) } else { (small_camera(), 1.0) };
    let wanted = Wanted {
        columns,
        rows,
        square_m: 0.03,
        field_px: difficulty.field_px.map(|px| px * scale),
        tilt_deg: difficulty.tilt_deg,
        inside_px: difficulty.inside_px,
    };
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed ^ 0x9e37_79b9);
    let mut draw = |[low, high]: [f64; 2]| low + (high - low) * random.random::<f64>();
    let (pose, _) = random_view(&camera, &wanted, seed);
    let nodes = true_nodes(&camera, &pose, &wanted);
    let blur_px = draw(difficulty.blur_px);
    let arm = Arm::across(&nodes, &mut draw);
    let before = |at: [f64; 2]| if difficulty.hidden && arm.distance(at) < 0.0 { Some(arm.reflectance) } else { None };
    let optics = Optics { blur_px, vignetting: difficulty.vignetting, before: &before, ..Optics::default() };
    let light = light(&camera, &pose, &wanted, &optics);
    let sensor = Sensor::grey(220.0 * 0.8 * difficulty.noise);
    let seen = |at: [f64; 2]| camera.contains(at) && (!difficulty.hidden || arm.distance(at) > 2.0);
    let truth = nodes.iter().filter(|(_, at)| camera.contains(*at)).map(|(node, at)| (*node, *at, seen(*at))).collect();
    Case { image: sensor.expose(&light, seed), wanted, truth }
}

/// The light of a board with its pose in the camera.
pub fn light(camera: &Camera, camera_from_board: &Isometry3<f64>, wanted: &Wanted, optics: &Optics<'_>) -> Raster<f32> {
    let board = PrintedBoard::new(wanted.columns, wanted.rows, wanted.square_m);
    let plane = Plane { world_from_plane: *camera_from_board, pattern: &board };
    render(camera, &Isometry3::identity(), &[plane], optics)
}

/// A rod with round ends that lies over a part of the board.
struct Arm {
    from: Vector2<f64>,
    to: Vector2<f64>,
    half_width: f64,
    reflectance: f64,
}

impl Arm {
    /// From a node somewhere outwards.
    fn across(nodes: &[([usize; 2], [f64; 2])], draw: &mut impl FnMut([f64; 2]) -> f64) -> Self {
        let at = |share: f64| Vector2::from(nodes[(share * nodes.len() as f64) as usize].1);
        let (from, angle) = (at(draw([0.0, 1.0])), draw([0.0, std::f64::consts::TAU]));
        let size = (at(0.999) - at(0.0)).norm();
        let to = from + Vector2::new(angle.cos(), angle.sin()) * size;
        Self { from, to, half_width: size * draw([0.04, 0.1]), reflectance: draw([0.2, 0.8]) }
    }

    /// Distance of a pixel from its outline, negative inside.
    fn distance(&self, at: [f64; 2]) -> f64 {
        let (along, offset) = (self.to - self.from, Vector2::from(at) - self.from);
        let share = (offset.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (offset - along * share).norm() - self.half_width
    }
}

impl Case {
    /// Writes `<k>.pgm` (8 bit) and `<k>.csv`: column, row, x, y, seen.
    pub fn write(&self, folder: &str, k: u64) {
        let mut image = std::fs::File::create(format!("{folder}/{k}.pgm")).unwrap();
        write!(image, "P5\n{} {}\n255\n", self.image.width(), self.image.height()).unwrap();
        let bytes: Vec<u8> = self.image.as_slice().iter().map(|value| *value as u8).collect();
        image.write_all(&bytes).unwrap();
        let line =
            |([i, j], [x, y], seen): &([usize; 2], [f64; 2], bool)| format!("{i},{j},{x},{y},{}\n", u8::from(*seen));
        let text: String = self.truth.iter().map(line).collect();
        std::fs::write(format!("{folder}/{k}.csv"), text).unwrap();
    }
}

/// What was found, beside the truth.
#[derive(Debug, Clone, Copy, Default)]
pub struct Judged {
    pub found: usize,
    pub nodes: usize,
    pub visible: usize,
    /// Nodes farther than half a field from where they are, or not in the image.
    pub wrong: usize,
    /// Root of the mean square distance of the others.
    pub rms_px: f64,
    /// Mean of the squared errors over their covariance: two where that is right.
    pub squared: f64,
}

impl Judged {
    pub fn of(case: &Case, seen: Option<&BoardSighting>) -> Self {
        let visible = case.truth.iter().filter(|(_, _, seen)| *seen).count();
        let Some(seen) = seen else { return Self { visible, ..Self::default() } };
        let [last_i, last_j] = [case.wanted.columns - 1, case.wanted.rows - 1];
        let turns: [&dyn Fn([usize; 2]) -> [usize; 2]; 4] =
            [&|node| node, &|[i, j]| [last_i - i, last_j - j], &|[i, j]| [j, last_i - i], &|[i, j]| [last_j - j, i]];
        let ways = turns[..seen.ambiguity].iter().map(|turn| Self::with(case, seen, visible, *turn));
        ways.min_by_key(|judged| judged.wrong).unwrap_or_default()
    }

    fn with(case: &Case, seen: &BoardSighting, visible: usize, label: &dyn Fn([usize; 2]) -> [usize; 2]) -> Self {
        let (mut wrong, mut squares, mut squared, mut good) = (0, 0.0, 0.0, 0.0);
        for node in &seen.nodes {
            let at = |[i, j]: [usize; 2]| case.truth.iter().find(|(label, ..)| *label == [i, j]).map(|(_, at, _)| *at);
            let node_label = label(node.node);
            let Some(truth) = at(node_label) else {
                wrong += 1;
                continue;
            };
            let beside =
                [[node_label[0].wrapping_sub(1), node_label[1]], [node_label[0], node_label[1].wrapping_sub(1)]];
            let step = beside
                .iter()
                .filter_map(|beside| at(*beside))
                .map(|b| (Vector2::from(b) - Vector2::from(truth)).norm());
            let limit = step.fold(f64::INFINITY, f64::min) * 0.5;
            let error = Vector2::from(node.point.pixel) - Vector2::from(truth);
            if error.norm() > limit {
                wrong += 1;
                continue;
            }
            good += 1.0;
            squares += error.norm_squared();
            squared += error.dot(&(node.point.covariance.try_inverse().unwrap() * error));
        }
        Self {
            found: 1,
            nodes: seen.nodes.len(),
            visible,
            wrong,
            rms_px: (squares / good).sqrt(),
            squared: squared / good,
        }
    }
}
