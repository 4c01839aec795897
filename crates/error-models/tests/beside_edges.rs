//! Standard deviations beside edges against the errors that pixels mixed of two surfaces have.

use error_models::{Error, sigma_beside_edges};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

const WIDTH: usize = 132;
const HEIGHT: usize = 108;
/// Principal distance, pixel: a field of view of 75 degrees.
const FOCAL_PX: f64 = 86.0;
/// Rays along the side of a pixel.
const RAYS: usize = 5;

fn direction(col: f64, row: f64) -> [f64; 3] {
    let [x, y] = [(col - 65.5) / FOCAL_PX, (53.5 - row) / FOCAL_PX];
    let length = (x * x + y * y + 1.0).sqrt();
    [x / length, y / length, -1.0 / length]
}

/// Points with these ranges.
fn points(ranges: &[f64]) -> Vec<[f64; 3]> {
    let point =
        |(at, range): (usize, &f64)| direction((at % WIDTH) as f64, (at / WIDTH) as f64).map(|part| part * range);
    ranges.iter().enumerate().map(point).collect()
}

/// A slanted wall with a frame 5 cm before it, a pillar, a board across a corner, and a ball.
fn scene(col: f64, row: f64) -> (f64, usize) {
    let [x, y, z] = direction(col, row);
    let plane = |normal: [f64; 3], distance: f64| {
        let along = normal[0] * x + normal[1] * y + normal[2] * z;
        if along < -1e-3 { -distance / along } else { f64::INFINITY }
    };
    let wall = plane([-0.5, 0.0, 0.866], 3.0);
    let floor = plane([0.0, 1.0, 0.0], 1.3);
    let inside = |range: f64, x_m: [f64; 2], y_m: [f64; 2]| {
        let (at_x, at_y) = (range * x, range * y);
        if (x_m[0]..x_m[1]).contains(&at_x) && (y_m[0]..y_m[1]).contains(&at_y) { range } else { f64::INFINITY }
    };
    let frame = inside(plane([-0.5, 0.0, 0.866], 2.95), [-0.4, 0.9], [0.1, 0.8]);
    let pillar = inside(plane([0.1, 0.0, 0.995], 2.2), [-1.3, -0.93], [-2.0, 2.0]);
    let board = inside(plane([0.3, 0.4, 0.866], 1.6), [0.0, 0.5], [-0.65, -0.2]);
    let (centre, radius) = ([-0.45, -0.25, -2.0], 0.35);
    let along = x * centre[0] + y * centre[1] + z * centre[2];
    let beside = centre.iter().map(|part: &f64| part * part).sum::<f64>() - along * along;
    let ball = if beside < radius * radius { along - (radius * radius - beside).sqrt() } else { f64::INFINITY };
    let surfaces = [wall, floor, frame, pillar, board, ball].into_iter().enumerate();
    surfaces.map(|(number, range)| (range, number)).fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a })
}

/// One pixel: the range that it should have, and whether its rays see one surface.
struct Seen {
    error: f64,
    is_mixed: bool,
}

/// A frame whose pixels see what their rays do, with noise.
fn observed(sigma: f64, seed: u64) -> (Vec<[f64; 3]>, Vec<Seen>) {
    let mut random = Pcg64::seed_from_u64(seed);
    let noise = Normal::new(0.0, sigma).unwrap();
    let (mut ranges, mut all) = (Vec::new(), Vec::new());
    for at in 0..WIDTH * HEIGHT {
        let (col, row) = ((at % WIDTH) as f64, (at / WIDTH) as f64);
        let part = |ray: usize| (ray as f64 + 0.5) / RAYS as f64 - 0.5;
        let rays = (0..RAYS * RAYS).map(|ray| scene(col + part(ray % RAYS), row + part(ray / RAYS)));
        let rays: Vec<(f64, usize)> = rays.collect();
        let mean_of = |of: &dyn Fn(usize) -> bool| {
            let ranges: Vec<f64> = rays.iter().filter(|(_, number)| of(*number)).map(|(range, _)| *range).collect();
            ranges.iter().sum::<f64>() / ranges.len() as f64
        };
        let is_mixed = rays.iter().any(|(_, number)| *number != rays[0].1);
        let range = mean_of(&|_| true) + noise.sample(&mut random);
        // A pixel of two surfaces lies right on either of them.
        let errors = rays.iter().map(|(_, number)| range - mean_of(&|of| of == *number));
        let error = errors.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
        ranges.push(range);
        all.push(Seen { error, is_mixed });
    }
    (points(&ranges), all)
}

/// Mean squared error over variance.
fn ratio<'a>(seen: impl Iterator<Item = (&'a Seen, f64)>) -> f64 {
    let (sum, count) =
        seen.fold((0.0, 0), |(sum, count), (seen, sigma)| (sum + (seen.error / sigma).powi(2), count + 1));
    sum / f64::from(count)
}

#[test]
fn squared_errors_beside_edges_are_those_stated() {
    for sigma in [0.002, 0.006, 0.015] {
        let (points, seen) = observed(sigma, 3);
        let raised = sigma_beside_edges(&points, &vec![sigma as f32; points.len()], WIDTH).unwrap();
        let of = |mixed: bool, sigmas: &[f64]| {
            ratio(seen.iter().zip(sigmas.iter().copied()).filter(|(seen, _)| seen.is_mixed == mixed))
        };
        let (noise, after) =
            (vec![sigma; points.len()], raised.iter().map(|sigma| f64::from(*sigma)).collect::<Vec<_>>());
        let [before, mixed, others] = [of(true, &noise), of(true, &after), of(false, &after)];
        let raised = after.iter().filter(|after| **after > 1.001 * sigma).count();
        assert!(before > 15.0 && mixed < 3.0, "{before} {mixed}");
        assert!((0.75..1.1).contains(&others), "{others}");
        let all = ratio(seen.iter().zip(after.iter().copied()));
        assert!((0.8..1.15).contains(&all), "{all}");
        assert!(raised < WIDTH * HEIGHT / 8, "{raised}");
    }
}

#[test]
fn walls_keep_their_sigma_with_holes_too() {
    let mut random = Pcg64::seed_from_u64(5);
    let noise = Normal::new(0.0, 0.0005).unwrap();
    for holes in [0.0, 0.2, 0.5] {
        // Slanted by 70 degrees, with little noise: any bend of the model itself would stand out.
        let range = |at: usize| {
            let [x, _, z] = direction((at % WIDTH) as f64, (at / WIDTH) as f64);
            1.2 / (0.94 * x - 0.34 * z)
        };
        let mut observed = |at: usize| {
            let range = range(at) + noise.sample(&mut random);
            if random.random_bool(holes) || !(0.0..12.0).contains(&range) { f64::NAN } else { range }
        };
        let points = points(&(0..WIDTH * HEIGHT).map(&mut observed).collect::<Vec<_>>());
        let measured = points.iter().filter(|point| point[2].is_finite()).count();
        let sigma = sigma_beside_edges(&points, &vec![0.0005; points.len()], WIDTH).unwrap();
        let raised = sigma.iter().filter(|sigma| **sigma > 0.00075).count();
        // Four blocks at a level of 0.1 % each, and what stands at the end of the wall.
        let share = if holes < 0.3 { 0.015 } else { 0.35 };
        assert!((raised as f64) < share * measured as f64, "{raised} of {measured}");
    }
}

#[test]
fn what_is_not_known_stays_as_it_is() {
    let ranges = [f64::NAN, 0.0, -1.0, f64::INFINITY, 2.0];
    let sigmas = [f32::NAN, 0.0, f32::INFINITY, 0.01];
    let points = points(&(0..WIDTH * HEIGHT).map(|at| ranges[(at * 7 + at / WIDTH) % 5]).collect::<Vec<_>>());
    let before: Vec<f32> = (0..points.len()).map(|at| sigmas[(at * 5 + at / WIDTH) % 4]).collect();
    let after = sigma_beside_edges(&points, &before, WIDTH).unwrap();
    for ((before, after), point) in before.iter().zip(&after).zip(&points) {
        let is_known = point[2] < 0.0 && point[2].is_finite() && *before == 0.01;
        assert!(is_known && *after >= *before || before.to_bits() == after.to_bits(), "{before} {after}");
    }
    for [width, height] in [[1, 1], [1, 9], [9, 1], [2, 2]] {
        let small: Vec<[f64; 3]> = (0..width * height).map(|at| [0.0, 0.0, -1.0 - at as f64]).collect();
        let sigma = sigma_beside_edges(&small, &vec![0.01; small.len()], width).unwrap();
        assert!(sigma.iter().all(|sigma| sigma.is_finite()));
    }
    assert!(sigma_beside_edges(&[], &[], 0).is_err());
    assert_eq!(sigma_beside_edges(&[], &[], 4).unwrap().len(), 0);
    for (sigmas, width) in [(&before[1..], WIDTH), (&before[..], 0), (&before[..], WIDTH + 1)] {
        let refused = sigma_beside_edges(&points, sigmas, width);
        assert!(matches!(refused, Err(Error::WrongLength { .. })), "{refused:?}");
    }
}
