//! What the width of pixels does to their ranges, taken off points.

use camera_model::{Camera, Error, ImageFormat, InteriorOrientation, LensDistortion, OrganisedCloud, RayTable};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use range_image::Flags;

const WIDTH: usize = 48;
const HEIGHT: usize = 40;
/// Rays on each side of a pixel.
const RAYS: usize = 16;

/// Pixels of 0.7 degrees behind a lens that bends.
fn camera() -> Camera {
    let format = ImageFormat::new(WIDTH, HEIGHT, [0.1; 2]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.1, -0.05], principal_distance_mm: 8.0 };
    let lens = LensDistortion { k1: -1.5e-3, ..LensDistortion::default() };
    Camera::new(format, interior, lens).unwrap()
}

/// A floor 1.4 m below and a wall 6 m away: distances along their normals.
const SURFACES: [([f64; 3], f64); 2] = [([0.0, 0.94, 0.341_174_4], 1.4), ([0.0, 0.0, 1.0], 6.0)];

/// Range along a ray, and the light that comes back.
fn range(ray: &Vector3<f64>) -> [f64; 2] {
    let hit = |(normal, distance): ([f64; 3], f64)| {
        let cosine = -Vector3::from(normal).dot(ray);
        let range_m = if cosine > 0.0 { distance / cosine } else { f64::INFINITY };
        [range_m, cosine / range_m.powi(2)]
    };
    let [floor, wall] = SURFACES.map(hit);
    if floor[0] < wall[0] { floor } else { wall }
}

/// What a camera measures, with noise, and what it ought to along the ray of each pixel's centre, metre.
fn seen(camera: &Camera, sigma_m: f64, seed: u64) -> (OrganisedCloud, Vec<f64>) {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut points, mut truth) = (Vec::new(), Vec::new());
    for index in 0..WIDTH * HEIGHT {
        let [col, row] = [index % WIDTH, index / WIDTH].map(|at| at as f64);
        let (mut sum, mut light) = (0.0, 0.0);
        for part in 0..RAYS * RAYS {
            let [x, y] = [part % RAYS, part / RAYS].map(|at| (at as f64 + 0.5) / RAYS as f64 - 0.5);
            let [range_m, weight] = range(&camera.ray([col + x, row + y]));
            sum += weight * range_m;
            light += weight;
        }
        let ray = camera.ray([col, row]);
        let noise: f64 = random.sample(StandardNormal);
        points.push((ray * (sum / light + sigma_m * noise)).into());
        truth.push(range(&ray)[0]);
    }
    let count = WIDTH * HEIGHT;
    let (sigma, amplitude, flags) =
        (vec![sigma_m.max(1e-3) as f32; count], vec![1.0; count], vec![Flags::empty(); count]);
    (OrganisedCloud { width: WIDTH, height: HEIGHT, points, sigma, amplitude, flags }, truth)
}

/// Mean error and largest error of ranges of pixels, metre.
fn errors(cloud: &OrganisedCloud, truth: &[f64], is_meant: impl Fn(usize) -> bool) -> [f64; 2] {
    let error = |index: usize| Vector3::from(cloud.points[index]).norm() - truth[index];
    let all: Vec<f64> = (0..truth.len()).filter(|&index| is_meant(index)).map(error).collect();
    assert!(all.len() > 200);
    [all.iter().sum::<f64>() / all.len() as f64, all.iter().fold(0.0_f64, |most, error| most.max(error.abs()))]
}

/// Whether a pixel and those beside it lie on one surface.
fn is_on_surface(truth: &[f64], index: usize) -> bool {
    let (col, row) = (index % WIDTH, index / WIDTH);
    let second = |at: usize, step: usize| 1.0 / truth[at - step] + 1.0 / truth[at + step] - 2.0 / truth[at];
    (1..WIDTH - 1).contains(&col)
        && (1..HEIGHT - 1).contains(&row)
        && [1, WIDTH].iter().all(|&step| (second(index, step) * truth[index]).abs() < 1e-3)
}

#[test]
fn slanted_points_come_to_where_the_surface_is() {
    let camera = camera();
    let rays = RayTable::new(&camera).unwrap();
    let (exact, truth) = seen(&camera, 0.0, 5);
    let is_slanted = |index: usize| is_on_surface(&truth, index) && (3.0..5.2).contains(&truth[index]);
    let moved = |mut cloud: OrganisedCloud| {
        let before = errors(&cloud, &truth, is_slanted);
        rays.take_off_pixel_width(&mut cloud).unwrap();
        [before, errors(&cloud, &truth, is_slanted)]
    };
    let [before, after] = moved(exact);
    assert!(before[0] < -5e-4 && after[0].abs() < 2e-5, "{before:?} {after:?}");
    assert!(before[1] > 1e-3 && after[1] < 1e-4, "{before:?} {after:?}");
    // Through noise they move as far in the mean.
    let [noisy, less] = moved(seen(&camera, 0.01, 5).0);
    assert!(((less[0] - noisy[0]) / (after[0] - before[0]) - 1.0).abs() < 0.05, "{noisy:?} {less:?}");
}

#[test]
fn flagged_pixels_and_holes_stay_and_tell_nothing_of_others() {
    let camera = camera();
    let rays = RayTable::new(&camera).unwrap();
    let (mut cloud, truth) = seen(&camera, 0.0, 5);
    // Every seventh pixel is wild and flagged, every fifth has no range.
    let is_wild = |index: usize| index.is_multiple_of(7);
    let is_hole = |index: usize| index % 5 == 2;
    for index in 0..truth.len() {
        if is_wild(index) {
            cloud.flags[index] = Flags::INTERFERENCE;
            cloud.points[index] = cloud.points[index].map(|x| 3.0 * x);
        }
        if is_hole(index) {
            cloud.points[index] = [f64::NAN; 3];
        }
    }
    let before = cloud.clone();
    rays.take_off_pixel_width(&mut cloud).unwrap();
    let is_slanted = |index: usize| {
        is_on_surface(&truth, index) && (3.0..5.2).contains(&truth[index]) && !is_wild(index) && !is_hole(index)
    };
    let [mean, largest] = errors(&cloud, &truth, is_slanted);
    assert!(mean.abs() < 1e-4 && largest < 3e-4, "{mean} {largest}");
    for index in 0..truth.len() {
        let same = before.points[index].map(f64::to_bits) == cloud.points[index].map(f64::to_bits);
        assert!(same || !is_wild(index));
        assert_eq!(cloud.points[index][0].is_nan(), is_hole(index));
    }
    assert_eq!((&before.sigma, &before.amplitude, &before.flags), (&cloud.sigma, &cloud.amplitude, &cloud.flags));
}

#[test]
fn narrow_pixels_are_left() {
    let wide = camera();
    let (cloud, _) = seen(&wide, 0.0, 5);
    // The same image behind a lens of six times the length: 2.1 mrad a pixel for 12.5.
    let interior = InteriorOrientation { principal_distance_mm: 48.0, ..wide.interior };
    let narrow = Camera::new(wide.format, interior, LensDistortion::default()).unwrap();
    let moved = |camera: &Camera| {
        let mut moved = cloud.clone();
        RayTable::new(camera).unwrap().take_off_pixel_width(&mut moved).unwrap();
        moved.points != cloud.points
    };
    assert!(moved(&wide) && !moved(&narrow));
    let mut other = OrganisedCloud { width: 3, ..cloud };
    assert!(RayTable::new(&narrow).unwrap().take_off_pixel_width(&mut other).is_err());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let rays = RayTable::new(&camera()).unwrap();
    let (cloud, _) = seen(&camera(), 0.01, 6);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut cloud = cloud.clone();
        pool.install(|| rays.take_off_pixel_width(&mut cloud)).unwrap();
        cloud.points
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn what_does_not_fit_is_refused_and_small_images_are_left() {
    let rays = RayTable::new(&camera()).unwrap();
    let (cloud, _) = seen(&camera(), 0.0, 6);
    let refused = |change: &dyn Fn(&mut OrganisedCloud)| {
        let mut cloud = cloud.clone();
        change(&mut cloud);
        matches!(rays.footprints(&cloud, Flags::all()), Err(Error::Image(range_image::Error::SizeMismatch { .. })))
    };
    assert!(refused(&|cloud| cloud.width = 3));
    assert!(refused(&|cloud| cloud.points.truncate(100)));
    assert!(refused(&|cloud| cloud.sigma.truncate(cloud.sigma.len() - 1)));
    assert!(refused(&|cloud| cloud.flags.push(Flags::empty())));
    for (width, height) in [(1, 1), (2, 9), (9, 2)] {
        let camera = Camera { format: ImageFormat::new(width, height, [0.1; 2]).unwrap(), ..camera() };
        let rays = RayTable::new(&camera).unwrap();
        let frame = range_image::RangeFrame {
            range: range_image::Raster::filled(width, height, 2.0),
            sigma: range_image::Raster::filled(width, height, f32::NAN),
            amplitude: range_image::Raster::filled(width, height, 1.0),
            flags: range_image::Raster::filled(width, height, Flags::empty()),
        };
        let cloud = rays.back_project(&frame).unwrap();
        let mut moved = cloud.clone();
        rays.take_off_pixel_width(&mut moved).unwrap();
        assert_eq!(cloud.points, moved.points);
    }
}
