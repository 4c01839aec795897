//! Pairs of frames with a given overlap, and scenes that leave a pose open.
#![allow(dead_code)]

use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::{Cuboid, Pinhole, Scene, cloud, look_at};

/// Fraction of the rays of one camera that end where another camera sees them.
pub fn overlap(scene: &Scene, camera: &Pinhole, target: &Isometry3<f64>, source: &Isometry3<f64>) -> f64 {
    let (mut seen, mut all) = (0, 0);
    for row in (0..camera.height).step_by(6) {
        for col in (0..camera.width).step_by(6) {
            let direction = source.rotation * camera.ray(col, row);
            let point = source.translation.vector + direction * scene.range(&source.translation.vector, &direction);
            let local = target.inverse_transform_point(&Point3::from(point));
            let x = -local.x / local.z * camera.focal_px;
            let y = -local.y / local.z * camera.focal_px;
            let inside = local.z < 0.0 && x.abs() < camera.width as f64 / 2.0 && y.abs() < camera.height as f64 / 2.0;
            let away = point - target.translation.vector;
            let range = scene.range(&target.translation.vector, &away.normalize());
            all += 1;
            seen += usize::from(inside && (range - away.norm()).abs() < 0.02);
        }
    }
    f64::from(seen as u32) / f64::from(all as u32)
}

/// Pair `k` of views of the furnished room that share 45 to 55 % of what they see.
pub fn half_overlapping_views(camera: &Pinhole, k: u64) -> (Isometry3<f64>, Isometry3<f64>) {
    let scene = Scene::furnished();
    let mut random = Pcg64::seed_from_u64(40_000 + k);
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    loop {
        let (angle, turn) = (between(0.0, std::f64::consts::TAU), between(-0.5, 0.5));
        let (heights, aims) = ([between(1.1, 1.7), between(1.1, 1.7)], [between(0.3, 0.9), between(0.3, 0.9)]);
        let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let view = |angle: f64, turn: f64, k: usize| {
            let turned = angle + std::f64::consts::PI + turn;
            let position = [0.9 * angle.cos(), 0.6 * angle.sin(), heights[k]];
            look_at(position, [2.2 * turned.cos(), 1.8 * turned.sin(), aims[k]])
        };
        let target = view(angle, turn, 0);
        for step in 1..25 {
            let away = f64::from(step) * 0.05 * side;
            let source = view(angle + 0.3 * away, turn + away, 1);
            if (0.45..0.55).contains(&overlap(&scene, camera, &target, &source)) {
                return (target, source);
            }
        }
    }
}

/// Source, target and true pose of surfaces that leave motions open, with how many: `(name, clouds, pose, open)`.
pub fn open_scene(kind: usize, seed: u64) -> (&'static str, Cloud, Cloud, Isometry3<f64>, usize) {
    let camera = Pinhole::small();
    let far = 1e3;
    let (name, room, a, b, open) = match kind {
        0 => (
            "plane",
            Cuboid::new([-30.0, -30.0, -30.0], [3.0, 30.0, 30.0]),
            look_at([0.0, 0.0, 0.0], [3.0, 0.2, 0.1]),
            look_at([0.1, 0.2, -0.1], [3.0, 0.3, 0.3]),
            3,
        ),
        1 => (
            "corridor",
            Cuboid::new([-far, -1.0, 0.0], [far, 1.0, 2.4]),
            look_at([0.0, 0.2, 1.4], [1.5, -1.0, 0.6]),
            look_at([0.2, 0.1, 1.3], [1.8, -1.0, 0.5]),
            1,
        ),
        2 => (
            "two parallel walls",
            Cuboid::new([-far, -1.0, -far], [far, 1.0, far]),
            look_at([0.0, 0.0, 0.0], [3.0, 0.1, 0.1]),
            look_at([0.1, 0.05, 0.05], [3.0, 0.0, 0.2]),
            3,
        ),
        3 => return revolved("sphere", 3, seed),
        _ => return revolved("cylinder", 2, seed),
    };
    let mut scene = Scene { room, boxes: vec![] };
    if kind == 2 {
        // A camera that looks along the walls sees them up to 5 m.
        scene.room.low.x = -5.0;
        scene.room.high.x = 5.0;
    }
    let (target, source) = (cloud(&scene, &camera, &a, 1.0, 2 * seed), cloud(&scene, &camera, &b, 1.0, 2 * seed + 1));
    if kind == 2 {
        let wall = |c: Cloud, pose: &Isometry3<f64>| keep(c, |p| (pose * p).x.abs() < 4.9);
        return (name, wall(source, &b), wall(target, &a), a.inverse() * b, open);
    }
    (name, source, target, a.inverse() * b, open)
}

fn keep(cloud: Cloud, condition: impl Fn(&Point3<f64>) -> bool) -> Cloud {
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| condition(&cloud.points[i])).collect();
    Cloud {
        points: kept.iter().map(|&i| cloud.points[i]).collect(),
        normals: cloud.normals.map(|n| kept.iter().map(|&i| n[i]).collect()),
        sigma: cloud.sigma.map(|s| kept.iter().map(|&i| s[i]).collect()),
        ..Cloud::default()
    }
}

/// A sphere, or a cylinder with a lid, of 6000 points with 2 mm noise.
fn revolved(name: &'static str, open: usize, seed: u64) -> (&'static str, Cloud, Cloud, Isometry3<f64>, usize) {
    let pose = Isometry3::new(Vector3::new(0.2, -0.3, 2.0), Vector3::new(0.1, 0.3, -0.2));
    let surface = |seed: u64| {
        let mut random = Pcg64::seed_from_u64(seed);
        let points = (0..6000).map(|_| {
            let radius = 0.5 + 2e-3 * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random);
            let direction: Vector3<f64> = Vector3::from_fn(|_, _| StandardNormal.sample(&mut random)).normalize();
            if open == 3 {
                return Point3::from(direction * radius);
            }
            let angle = random.random::<f64>() * std::f64::consts::TAU;
            Point3::new(radius * angle.cos(), radius * angle.sin(), 2.0 * random.random::<f64>() - 1.0)
        });
        Cloud::new(points.collect())
    };
    (name, surface(2 * seed), surface(2 * seed + 1).transformed(&pose), pose, open)
}

/// The faces of room and boxes as triangles.
pub fn triangles(scene: &Scene) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for cuboid in std::iter::once(&scene.room).chain(&scene.boxes) {
        let first = vertices.len() as u32;
        let corner = |k: usize| Vector3::from_fn(|a, _| if k >> a & 1 == 0 { cuboid.low[a] } else { cuboid.high[a] });
        vertices.extend((0..8).map(|k| Point3::from(corner(k))));
        for (a, b, c) in [(1, 2, 4), (2, 4, 1), (4, 1, 2)] {
            for side in [0, a] {
                triangles.push([first + side, first + side + b, first + side + b + c]);
                triangles.push([first + side, first + side + b + c, first + side + c]);
            }
        }
    }
    (vertices, triangles)
}
