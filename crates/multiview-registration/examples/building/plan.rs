//! A building of corridors with furnished rooms on both sides, and the way of a camera through it.
#![allow(dead_code)]

use multiview_registration::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use multiview_registration::point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Width of corridors, depth and width of rooms, thickness of walls, height of rooms and of doors, width of doors, metre.
const CORRIDOR: f64 = 2.4;
const DEPTH: f64 = 4.0;
const WIDTH: f64 = 4.4;
const WALL: f64 = 0.15;
const HEIGHT: f64 = 2.6;
const DOOR: [f64; 2] = [1.0, 2.1];
/// From one corridor to the next.
const PITCH: f64 = CORRIDOR + 2.0 * DEPTH + 3.0 * WALL;
/// Longest step and largest turn from station to station.
const STEP_M: f64 = 0.7;
const TURN: f64 = 0.53;
/// Of the camera, metre.
const FARTHEST: f64 = 7.5;

/// An axis-parallel box, metre.
pub struct Cuboid {
    pub low: Vector3<f64>,
    pub high: Vector3<f64>,
}

impl Cuboid {
    /// Distances at which a ray enters and leaves.
    fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64) {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            let (a, b) = ((self.low[k] - origin[k]) / direction[k], (self.high[k] - origin[k]) / direction[k]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near, far)
    }

    fn apart_m(&self, from: &Vector3<f64>) -> f64 {
        let beside = |k: usize| (self.low[k] - from[k]).max(from[k] - self.high[k]).max(0.0);
        Vector3::from_fn(|k, _| beside(k)).norm()
    }
}

/// The building, and the stations in the order in which they are visited.
pub struct Building {
    pub hull: Cuboid,
    pub boxes: Vec<Cuboid>,
    pub stations: Vec<Isometry3<f64>>,
}

/// Pixels of a camera of 70 degrees.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    pub width: usize,
    pub height: usize,
}

impl Building {
    /// A building for so many stations: about as many corridors as each has pairs of rooms.
    pub fn new(stations: usize, seed: u64) -> Self {
        // A pair of rooms takes some 38 stations.
        let pairs = stations.div_ceil(38);
        let slots = ((pairs as f64 * 2.0).sqrt().ceil() as usize).max(1);
        let corridors = pairs.div_ceil(slots).max(1);
        let mut random = Pcg64::seed_from_u64(seed);
        let length = slots as f64 * (WIDTH + WALL);
        let across = corridors as f64 * PITCH;
        let hull = cuboid(
            [-CORRIDOR, -DEPTH - CORRIDOR / 2.0 - WALL, 0.0],
            [length + CORRIDOR, across - DEPTH - CORRIDOR / 2.0 - 2.0 * WALL, HEIGHT],
        );
        let mut building = Self { hull, boxes: Vec::new(), stations: Vec::new() };
        let mut way = Way::default();
        for corridor in 0..corridors {
            let middle = corridor as f64 * PITCH;
            for slot in 0..slots {
                for side in [-1.0, 1.0] {
                    building.room(slot as f64 * (WIDTH + WALL), middle, side, &mut random);
                }
            }
            if corridor > 0 {
                // The wall between the rooms of two corridors.
                let at = middle - CORRIDOR / 2.0 - WALL - DEPTH;
                building.boxes.push(cuboid([-WALL, at - WALL, 0.0], [length, at, HEIGHT]));
            }
            building.ends(middle, length, &mut random);
            Self::visit(corridor, slots, &mut way);
        }
        building.stations = way.stations;
        building.stations.truncate(stations);
        building
    }

    /// Walls and furniture of a room whose left wall begins at x, beside the corridor at y.
    fn room(&mut self, x: f64, y: f64, side: f64, random: &mut Pcg64) {
        let front = y + side * CORRIDOR / 2.0;
        let along = |a: f64, b: f64| if side > 0.0 { [front + a, front + b] } else { [front - b, front - a] };
        let mut add = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]| {
            self.boxes.push(cuboid([x0, y0, z0], [x1, y1, z1]));
        };
        let (door, wall) = (x + WIDTH / 2.0, along(0.0, WALL));
        add([x - WALL, door - DOOR[0] / 2.0], wall, [0.0, HEIGHT]);
        add([door + DOOR[0] / 2.0, x + WIDTH], wall, [0.0, HEIGHT]);
        add([door - DOOR[0] / 2.0, door + DOOR[0] / 2.0], wall, [DOOR[1], HEIGHT]);
        add([x - WALL, x], along(WALL, WALL + DEPTH), [0.0, HEIGHT]);
        add([x + WIDTH, x + WIDTH + WALL], along(WALL, WALL + DEPTH), [0.0, HEIGHT]);
        let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        // Along the walls, away from the door, one in the middle, and two pictures.
        // Where they begin and end along and across, and which side wall they stand at.
        let furniture = [
            ([0.0, 0.6], [1.2, 2.4], -1),
            ([WIDTH - 0.6, WIDTH], [0.9, 2.1], 1),
            ([0.8, 2.0], [3.3, 4.0], 0),
            ([2.5, 3.7], [3.5, 4.0], 0),
        ];
        for ([x0, x1], [y0, y1], wall) in furniture {
            let (shift, height) = (between(-0.25, 0.25), between(0.4, 2.0));
            let (inner, outer) = (between(-0.15, 0.1), between(-0.1, 0.15));
            let (dx, dy) = if wall == 0 { (shift, 0.0) } else { (0.0, shift) };
            let x0 = if wall == -1 { x0 } else { x0 + dx + inner };
            let x1 = if wall == 1 { x1 } else { x1 + dx + outer };
            add([x + x0, x + x1], along(WALL + y0 + dy, WALL + y1 + dy), [0.0, height]);
        }
        let (mx, my) = (between(1.9, 2.5), between(1.9, 2.5));
        add([x + mx - 0.4, x + mx + 0.4], along(WALL + my - 0.3, WALL + my + 0.3), [0.0, between(0.4, 0.75)]);
        let at = between(0.6, 2.8);
        add([x + at, x + at + 0.9], along(WALL + DEPTH - 0.06, WALL + DEPTH), [between(1.2, 1.4), between(1.8, 2.1)]);
        let at = between(2.4, 3.0);
        add([x, x + 0.05], along(WALL + at, WALL + at + 0.7), [between(1.2, 1.4), between(1.8, 2.1)]);
        // In the corridor: a cabinet, a pillar.
        let at = between(0.1, 0.5);
        add([x + at, x + at + between(0.5, 0.9)], along(-0.3, 0.0), [0.0, between(0.8, 1.9)]);
        let at = between(3.3, 3.9);
        add([x + at, x + at + 0.25], along(-0.2, 0.0), [0.0, HEIGHT]);
        // A lamp at the ceiling, a board beside the door, a radiator.
        let at = between(1.2, 1.9);
        add([x + at, x + at + 0.6], along(-0.9, -0.6), [HEIGHT - 0.15, HEIGHT]);
        let at = between(2.9, 3.1);
        add([x + at, x + at + 0.35], along(-0.06, 0.0), [between(1.2, 1.4), between(1.7, 2.0)]);
        let at = between(1.2, 1.4);
        add([x + at, x + at + 0.25], along(-0.12, 0.0), [0.0, between(0.5, 1.1)]);
    }

    /// What stands along the outer walls of the ways from corridor to corridor: without it nothing tells where a station is on them.
    fn ends(&mut self, middle: f64, length: f64, random: &mut Pcg64) {
        let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        for [outer, inward] in [[-CORRIDOR, 1.0], [length + CORRIDOR, -1.0]] {
            for step in 0..6 {
                let y = middle - 1.0 + PITCH / 6.0 * (f64::from(step) + between(0.0, 0.3));
                let (width, depth, height) = (between(0.3, 0.9), between(0.12, 0.4), between(0.5, 2.0));
                let ends = if inward > 0.0 { [outer, outer + depth] } else { [outer - depth, outer] };
                self.boxes.push(cuboid([ends[0], y, 0.0], [ends[1], y + width, height]));
                if step % 2 == 0 {
                    let lamp = outer + inward * between(0.9, 1.4);
                    self.boxes.push(cuboid([lamp - 0.2, y, HEIGHT - 0.15], [lamp + 0.2, y + 0.5, HEIGHT]));
                }
            }
        }
    }

    /// Through a corridor, all its rooms and to the next one.
    fn visit(corridor: usize, slots: usize, way: &mut Way) {
        let (y, forward) = (corridor as f64 * PITCH, corridor.is_multiple_of(2));
        let heading = if forward { 0.0 } else { std::f64::consts::PI };
        let sign = if forward { 1.0 } else { -1.0 };
        let length = slots as f64 * (WIDTH + WALL);
        way.go([if forward { -0.8 } else { length + 0.6 }, y], heading);
        for k in 0..slots {
            let slot = if forward { k } else { slots - 1 - k };
            let door = slot as f64 * (WIDTH + WALL) + WIDTH / 2.0;
            for side in [1.0, -1.0] {
                let into = side * std::f64::consts::FRAC_PI_2;
                way.go([door - 0.4 * sign, y - side * 0.75], heading + 0.6 * (into - heading).sin());
                way.go([door, y - side * 0.8], into);
                way.go([door, y + side * (CORRIDOR / 2.0 + 0.7)], into);
                // Round the room, looking over its middle.
                let middle = [door, y + side * (CORRIDOR / 2.0 + WALL + DEPTH / 2.0)];
                for step in 1..=12 {
                    let yaw = into + f64::from(step) * std::f64::consts::PI / 6.0;
                    way.at([middle[0] - 1.2 * yaw.cos(), middle[1] - 1.1 * yaw.sin()], yaw);
                }
                // Back, looking ahead.
                way.go([door, y - side * 0.6], into);
            }
            way.go([door + 0.4 * sign, y], heading);
            way.go([door + (WIDTH / 2.0) * sign, y], heading);
        }
        let end = if forward { length + CORRIDOR / 2.0 } else { -CORRIDOR / 2.0 };
        way.go([end - 1.5 * sign, y], heading);
        let up = std::f64::consts::FRAC_PI_2;
        way.go([end, y], up);
        way.go([end, y + PITCH - 0.6], up);
        way.go([end, y + PITCH], heading + std::f64::consts::PI);
    }

    /// What a station sees: a cloud with normals and standard deviations. One in a hundred pixels is wrong.
    pub fn cloud(&self, station: usize, camera: Camera, seed: u64) -> Cloud {
        let pose = &self.stations[station];
        let eye = pose.translation.vector;
        let near: Vec<&Cuboid> = self.boxes.iter().filter(|cuboid| cuboid.apart_m(&eye) < FARTHEST).collect();
        let mut random = Pcg64::seed_from_u64(seed * 1_000_003 + station as u64);
        let (mut points, mut sigmas) = (Vec::new(), Vec::new());
        for pixel in 0..camera.width * camera.height {
            let ray = camera.ray(pixel);
            let direction = pose.rotation * ray;
            let mut range = self.hull.hit(&eye, &direction).1;
            for cuboid in &near {
                let (enters, leaves) = cuboid.hit(&eye, &direction);
                if enters > 0.0 && enters < leaves {
                    range = range.min(enters);
                }
            }
            let sigma = 1e-3 + 0.5e-3 * range * range;
            let normal: f64 = StandardNormal.sample(&mut random);
            let wrong = random.random::<f64>() < 0.01;
            let observed = if wrong { 0.3 + 6.0 * random.random::<f64>() } else { range + sigma * normal };
            let point = if range < FARTHEST { ray * observed } else { Vector3::repeat(f64::NAN) };
            points.push([point.x, point.y, point.z]);
            sigmas.push(sigma as f32);
        }
        let normals = organised_normals(&points, camera.width, camera.height, &OrganisedNormalOptions::default());
        let cloud = normals.ok().and_then(|normals| Cloud::from_frame(&points, Some(&normals), Some(&sigmas)).ok());
        cloud.unwrap_or_else(|| Cloud::new(Vec::new()))
    }

    /// Poses that are off by a length and an angle.
    pub fn approximate(&self, off_m: f64, off_deg: f64, seed: u64) -> Vec<Isometry3<f64>> {
        let off = |(k, pose): (usize, &Isometry3<f64>)| {
            let mut random = Pcg64::seed_from_u64(seed * 7_000_003 + k as u64);
            let mut unit = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut random)).normalize();
            let (shift, axis) = (unit() * off_m, unit() * off_deg.to_radians());
            pose * Isometry3::new(shift, axis)
        };
        self.stations.iter().enumerate().map(off).collect()
    }

    /// The description for `rangecam simulate`: the building as one mesh.
    pub fn description(&self, camera: Camera) -> String {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        let all = self.boxes.iter();
        for cuboid in all {
            let first = vertices.len();
            for k in 0..8 {
                let at = |axis: usize| if (k >> axis) & 1 == 0 { cuboid.low[axis] } else { cuboid.high[axis] };
                vertices.push(format!("({:.4}, {:.4}, {:.4})", at(0), at(1), at(2)));
            }
            for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
                triangles.extend(
                    [[a, b, c], [a, c, d]].map(|[a, b, c]| format!("({}, {}, {})", first + a, first + b, first + c)),
                );
            }
        }
        let stations = self.stations.iter().enumerate().map(|(k, pose)| {
            let (at, ahead) = (pose.translation.vector, pose * multiview_registration::nalgebra::Point3::new(0.0, 0.0, -2.0));
            format!(
                "(name: \"S{k:04}\", position_m: ({:.6}, {:.6}, {:.6}), attitude: LookAt(target_m: ({:.6}, {:.6}, {:.6})))",
                at.x, at.y, at.z, ahead.x, ahead.y, ahead.z
            )
        });
        let pitch = 5.0 / camera.focal_px();
        format!(
            "(\n    scene: (objects: [\n        (name: \"hull\", shape: Room(min_m: ({:.4}, {:.4}, 0), max_m: ({:.4}, {:.4}, {HEIGHT})), albedo: 0.6),\n        \
             (name: \"building\", albedo: 0.6, shape: Mesh(\n            vertices_m: [{}],\n            triangles: [{}],\n        )),\n    ]),\n    \
             camera: (\n        geometry: (\n            format: (width: {}, height: {}, pixel_pitch_mm: ({pitch}, {pitch})),\n            \
             interior: (principal_point_mm: (0, 0), principal_distance_mm: 5),\n        ),\n        modulation_hz: [15e6],\n        phase_steps: 4,\n    ),\n    \
             illumination: (source_power: 4e7),\n    exposure: (frames_per_station: 1, integration_time_s: 0.002),\n    stations: [\n        {},\n    ],\n    \
             errors: (noise: (shot_variance_per_unit: 0.05, dark_sigma: 3)),\n)\n",
            self.hull.low.x,
            self.hull.low.y,
            self.hull.high.x,
            self.hull.high.y,
            vertices.join(", "),
            triangles.join(", "),
            camera.width,
            camera.height,
            stations.collect::<Vec<_>>().join(",\n        ")
        )
    }
}

fn cuboid(low: [f64; 3], high: [f64; 3]) -> Cuboid {
    Cuboid { low: Vector3::from(low), high: Vector3::from(high) }
}

impl Camera {
    pub fn focal_px(self) -> f64 {
        0.714 * self.width as f64
    }

    fn ray(self, pixel: usize) -> Vector3<f64> {
        let x = (pixel % self.width) as f64 - (self.width as f64 - 1.0) / 2.0;
        let y = (self.height as f64 - 1.0) / 2.0 - (pixel / self.width) as f64;
        Vector3::new(x, y, -self.focal_px()).normalize()
    }
}

/// Stations one after the other, with others between where they would be too far apart.
#[derive(Default)]
struct Way {
    stations: Vec<Isometry3<f64>>,
    last: Option<([f64; 2], f64)>,
}

impl Way {
    fn at(&mut self, place: [f64; 2], yaw: f64) {
        let number = self.stations.len() as f64;
        let position = Vector3::new(place[0], place[1], 1.45 + 0.15 * (0.9 * number).sin());
        let ahead = Vector3::new(yaw.cos(), yaw.sin(), -0.22 + 0.08 * (1.7 * number).cos());
        let back = -ahead.normalize();
        let right = Vector3::z().cross(&back).normalize();
        let axes = Matrix3::from_columns(&[right, back.cross(&right), back]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        self.stations.push(Isometry3::from_parts(Translation3::from(position), rotation));
        self.last = Some((place, yaw));
    }

    fn go(&mut self, place: [f64; 2], yaw: f64) {
        let Some((from, before)) = self.last else { return self.at(place, yaw) };
        let turn = (yaw - before).sin().atan2((yaw - before).cos());
        let steps = ((place[0] - from[0]).hypot(place[1] - from[1]) / STEP_M).max(turn.abs() / TURN).ceil().max(1.0);
        for k in 1..=steps as usize {
            let share = k as f64 / steps;
            let between = [0, 1].map(|axis| from[axis] + share * (place[axis] - from[axis]));
            self.at(between, before + share * turn);
        }
    }
}
