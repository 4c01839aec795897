// Texture factors are copied, not computed: they compare exactly.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::float_cmp)]

use approx::assert_relative_eq;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::closed_form::{Crossing, Cuboid, Rectangle, Room, Sphere};
use super::mesh::Mesh;
use super::texture;
use crate::spec::scene::TextureSpec;

/// Geometry of a few metres in f64: rounding is below 1e-14 m, and grazing rays lose a few digits.
const CLOSE_M: f64 = 1e-10;

fn unit(v: [f64; 3]) -> Vector3<f64> {
    Vector3::from(v).normalize()
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    let component = -1.0..1.0_f64;
    [component.clone(), component.clone(), component]
        .prop_filter("not too short to be a direction", |v| Vector3::from(*v).norm() > 0.1)
        .prop_map(unit)
}

fn point(reach: f64) -> impl Strategy<Value = Point3<f64>> {
    let component = -reach..reach;
    [component.clone(), component.clone(), component].prop_map(Point3::from)
}

/// The twelve triangles of a box with the given half extents.
fn box_mesh(half: Vector3<f64>) -> Mesh {
    let sign = |bit: usize| if bit == 1 { 1.0 } else { -1.0 };
    let corner = |i: usize| [sign(i & 1) * half.x, sign(i >> 1 & 1) * half.y, sign(i >> 2 & 1) * half.z];
    let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let faces = [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];
    let triangles: Vec<[u32; 3]> = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
    Mesh::new(&vertices, &triangles).unwrap()
}

/// A sphere of radius 1 as an octahedron whose faces were divided `levels` times.
fn sphere_mesh(levels: usize) -> Mesh {
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut faces: Vec<[Vector3<f64>; 3]> = Vec::new();
    for (sx, sy, sz) in [(1., 1., 1.), (1., 1., -1.), (1., -1., 1.), (1., -1., -1.)] {
        faces.push([x * sx, y * sy, z * sz]);
        faces.push([x * -sx, y * sy, z * sz]);
    }
    for _ in 0..levels {
        faces = faces
            .iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[*a, ab, ca], [*b, bc, ab], [*c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    let vertices: Vec<[f64; 3]> = faces.iter().flatten().map(|v| [v.x, v.y, v.z]).collect();
    let triangles: Vec<[u32; 3]> = (0..faces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(&vertices, &triangles).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn parry_box_agrees_with_the_closed_form(origin in point(3.0), direction in direction()) {
        let half = Vector3::new(0.7, 1.1, 0.4);
        let solid = Cuboid { center: Point3::origin(), half, world_from_local: UnitQuaternion::identity() };
        let (by_mesh, by_form) = (box_mesh(half).cast(&origin, &direction), solid.cast(&origin, &direction));
        prop_assert_eq!(by_mesh.is_some(), by_form.is_some());
        if let (Some(mesh), Some(form)) = (by_mesh, by_form) {
            prop_assert!((mesh.distance_m - form.distance_m).abs() < CLOSE_M);
            prop_assert!((mesh.normal - form.normal).norm() < CLOSE_M);
        }
    }

    #[test]
    fn parry_triangle_agrees_with_its_plane(origin in point(3.0), direction in direction(), tilt in direction()) {
        let u = tilt.cross(&Vector3::ith(tilt.iamin(), 1.0)).normalize();
        let v = tilt.cross(&u);
        let corners = [u * 2.0, v * 2.0 - u, -v * 2.0 - u].map(|p| [p.x, p.y, p.z]);
        let hit = Mesh::new(&corners, &[[0, 1, 2]]).unwrap().cast(&origin, &direction);
        if let Some(hit) = hit {
            let closed = -tilt.dot(&origin.coords) / tilt.dot(&direction);
            // A ray within 1e-4 of the plane loses four digits.
            prop_assert!((hit.distance_m - closed).abs() < 1e-6 * closed.max(1.0));
            prop_assert!(hit.normal.dot(&direction) < 0.0);
            prop_assert!((hit.normal.dot(&tilt).abs() - 1.0).abs() < CLOSE_M);
        }
    }

    #[test]
    fn a_closed_mesh_lets_no_ray_out(direction in direction(), origin in point(0.5)) {
        let hit = sphere_mesh(3).cast(&origin, &direction).expect("the ray starts inside");
        let sphere = Sphere { center: Point3::origin(), radius: 1.0 };
        let closed = sphere.cast(&origin, &direction).unwrap();
        // Edges of the third division subtend 11.25 degrees or less than 14: their chords lie within 1 - cos 8 deg = 1 %
        // of the sphere, seen at 60 degrees or steeper from inside half the radius.
        prop_assert!(hit.distance_m <= closed.distance_m + CLOSE_M && hit.distance_m > closed.distance_m - 0.02);
    }

    #[test]
    fn from_inside_a_room_every_ray_ends_on_a_wall(origin in point(0.9), direction in direction()) {
        let room = Room { center: Point3::origin(), half: Vector3::new(1.0, 2.0, 3.0) };
        let Crossing { distance_m, normal, face } = room.cast(&origin, &direction).unwrap();
        let place = origin + direction * distance_m;
        let on_walls = (0..3).filter(|i| (place[*i].abs() - room.half[*i]).abs() < CLOSE_M).count();
        prop_assert!(on_walls >= 1 && (0..3).all(|i| place[i].abs() < room.half[i] + CLOSE_M));
        prop_assert!(normal.dot(&direction) < 0.0);
        prop_assert!((place[face / 2] + normal[face / 2] * room.half[face / 2]).abs() < CLOSE_M);
    }

    #[test]
    fn a_sphere_is_hit_at_its_radius(origin in point(4.0), direction in direction()) {
        let sphere = Sphere { center: Point3::new(0.3, -0.2, 0.5), radius: 0.8 };
        if let Some(hit) = sphere.cast(&origin, &direction) {
            let place = origin + direction * hit.distance_m;
            prop_assert!(((place - sphere.center).norm() - 0.8).abs() < CLOSE_M);
            prop_assert!(hit.normal.dot(&direction) <= 0.0);
            prop_assert!((hit.normal.norm() - 1.0).abs() < CLOSE_M);
        } else {
            let along = (sphere.center - origin).dot(&direction).max(0.0);
            prop_assert!((origin + direction * along - sphere.center).norm() >= 0.8 - CLOSE_M);
        }
    }

    #[test]
    fn a_turned_box_is_the_box_in_a_turned_world(origin in point(3.0), direction in direction(), axis in direction()) {
        let half = Vector3::new(0.7, 1.1, 0.4);
        let turn = UnitQuaternion::from_scaled_axis(axis);
        let upright = Cuboid { center: Point3::origin(), half, world_from_local: UnitQuaternion::identity() };
        let turned = Cuboid { world_from_local: turn, ..upright.clone() };
        let (a, b) = (upright.cast(&origin, &direction), turned.cast(&(turn * origin), &(turn * direction)));
        prop_assert_eq!(a.is_some(), b.is_some());
        if let (Some(a), Some(b)) = (a, b) {
            prop_assert!((a.distance_m - b.distance_m).abs() < CLOSE_M);
            prop_assert!((turn * a.normal - b.normal).norm() < CLOSE_M);
        }
    }
}

#[test]
fn a_rectangle_ends_at_its_edges_and_has_two_sides() {
    let rectangle = Rectangle::new(Point3::new(0.0, 0.0, 1.0), Vector3::x() * 2.0, Vector3::y());
    let from_below = rectangle.cast(&Point3::new(1.0, 0.5, 0.0), &Vector3::z()).unwrap();
    assert_relative_eq!(from_below.distance_m, 1.0);
    assert_relative_eq!(from_below.normal, -Vector3::z());
    let from_above = rectangle.cast(&Point3::new(1.0, 0.5, 3.0), &-Vector3::z()).unwrap();
    assert_relative_eq!(from_above.distance_m, 2.0);
    assert_relative_eq!(from_above.normal, Vector3::z());
    assert!(rectangle.cast(&Point3::new(2.1, 0.5, 0.0), &Vector3::z()).is_none());
    assert!(rectangle.cast(&Point3::new(1.0, -0.1, 0.0), &Vector3::z()).is_none());
    assert!(rectangle.cast(&Point3::new(1.0, 0.5, 0.0), &Vector3::x()).is_none());
    assert!(rectangle.cast(&Point3::new(1.0, 0.5, 0.0), &-Vector3::z()).is_none());
}

#[test]
fn a_box_is_seen_from_outside_and_from_inside() {
    let solid =
        Cuboid { center: Point3::origin(), half: Vector3::repeat(1.0), world_from_local: UnitQuaternion::identity() };
    let outside = solid.cast(&Point3::new(-3.0, 0.0, 0.0), &Vector3::x()).unwrap();
    assert_relative_eq!(outside.distance_m, 2.0);
    assert_relative_eq!(outside.normal, -Vector3::x());
    let inside = solid.cast(&Point3::origin(), &Vector3::x()).unwrap();
    assert_relative_eq!(inside.distance_m, 1.0);
    assert_relative_eq!(inside.normal, -Vector3::x());
    // Along a face's plane, exactly: the ray touches and is neither lost to NaN nor doubled.
    assert!(solid.cast(&Point3::new(-3.0, 1.0, 0.0), &Vector3::x()).is_some());
    assert!(solid.cast(&Point3::new(-3.0, 1.1, 0.0), &Vector3::x()).is_none());
}

#[test]
fn a_checker_alternates_and_discs_lie_on_their_grid() {
    let checker = TextureSpec::Checker { size_m: 0.5, factor: 0.25 };
    let on_floor = |x: f64, y: f64| texture::factor(&checker, &Vector3::new(x, y, 0.0), &Vector3::z());
    let row: Vec<f64> = [-0.75, -0.25, 0.25, 0.75].iter().map(|x| on_floor(*x, 0.1)).collect();
    assert_eq!(row, [1.0, 0.25, 1.0, 0.25]);
    assert_eq!([on_floor(0.25, 0.25), on_floor(0.25, 0.75)], [1.0, 0.25]);
    let discs = TextureSpec::Discs { spacing_m: 0.5, radius_m: 0.1, factor: 0.25, first_m: [0.1, -0.2] };
    let on_wall = |y: f64, z: f64| texture::factor(&discs, &Vector3::new(9.0, y, z), &Vector3::x());
    assert_eq!(
        [on_wall(0.6, -1.2), on_wall(0.69, -1.2), on_wall(0.71, -1.2), on_wall(0.35, 0.05)],
        [1.0, 1.0, 0.25, 0.25]
    );
}

#[test]
fn noise_is_smooth_bounded_and_even() {
    let noise = TextureSpec::Noise { size_m: 1.0, contrast: 0.5, seed: 7 };
    let at = |x: f64| texture::factor(&noise, &Vector3::new(x, 0.4 * x, -0.3 * x), &Vector3::z());
    let values: Vec<f64> = (0..20_000).map(|i| at(0.01 * f64::from(i) - 100.0)).collect();
    assert!(values.iter().all(|v| (0.5..=1.5).contains(v)));
    // Steepest slope of the interpolation: 1.5 a lattice cell times the largest difference 2, times the contrast, over
    // three axes with steps 1, 0.4, 0.3.
    assert!(values.windows(2).all(|w| (w[1] - w[0]).abs() < 0.01 * 1.5 * 2.0 * 0.5 * 1.7));
    // 200 cells of standard deviation below 0.5 / sqrt 3: the mean is known to 0.02.
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    assert!((mean - 1.0).abs() < 0.06, "mean {mean}");
    let spread = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    assert!(spread.sqrt() > 0.05, "spread {}", spread.sqrt());
}
