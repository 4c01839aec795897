//! A painted wall and a painted floor, as a camera sees their amplitude.

use nalgebra::Isometry3;

use crate::common::Pinhole;

/// A painted wall in the plane y = 2 and a painted floor at z = 0: amplitude and points of a camera.
pub fn frame(camera: &Pinhole, world_from_camera: &Isometry3<f64>) -> (Vec<f32>, Vec<[f64; 3]>) {
    let (mut amplitude, mut points) = (Vec::new(), Vec::new());
    let eye = world_from_camera.translation.vector;
    for row in 0..camera.height {
        for column in 0..camera.width {
            let ray = camera.ray(column, row);
            let d = world_from_camera.rotation * ray;
            let to_wall = if d.y > 0.0 { (2.0 - eye.y) / d.y } else { f64::INFINITY };
            let to_floor = if d.z < 0.0 { -eye.z / d.z } else { f64::INFINITY };
            let range = to_wall.min(to_floor).min(20.0);
            let hit = eye + d * range;
            let place = if to_wall < to_floor { [hit.x, hit.z] } else { [hit.x, hit.y + 50.0] };
            amplitude.push((1e4 * paint(place) / (range * range)) as f32);
            let point = ray * range;
            points.push([point.x, point.y, point.z]);
        }
    }
    (amplitude, points)
}

/// Blots of 5 to 15 cm on a grid of 30 cm, at hashed places with hashed darkness.
fn paint(place: [f64; 2]) -> f64 {
    let mut value = 1.0;
    let cell = place.map(|c| (c / 0.3).floor() as i64);
    for step in 0..9 {
        let [u, v] = [cell[0] + step % 3 - 1, cell[1] + step / 3 - 1];
        let hashed = |k: i64| {
            let mixed = (u * 73_856_093) ^ (v * 19_349_663) ^ (k * 83_492_791);
            (mixed.wrapping_mul(0x2545_f491_4f6c_dd1d) as u64 >> 40) as f64 / (1_u64 << 24) as f64
        };
        let centre = [(u as f64 + hashed(1)) * 0.3, (v as f64 + hashed(2)) * 0.3];
        let radius = 0.05 + 0.1 * hashed(3);
        let squared = ((place[0] - centre[0]).powi(2) + (place[1] - centre[1]).powi(2)) / (radius * radius);
        value *= 1.0 - 0.7 * hashed(4) * (-squared).exp();
    }
    value
}
