//! Mixed pixels and low amplitudes on scenes whose truth is known.

use error_models::{GrossErrorOptions, MixedPixelOptions, flag_gross_errors};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use range_image::{Flags, RangeFrame, Raster};

const WIDTH: usize = 176;
const HEIGHT: usize = 144;
/// Field of view of about 47 degrees across 176 pixels.
const PIXELS_PER_UNIT: f64 = 200.0;

/// Unit viewing ray of a pixel position, z forward.
fn ray(col: f64, row: f64) -> [f64; 3] {
    let x = (col - (WIDTH as f64 - 1.0) / 2.0) / PIXELS_PER_UNIT;
    let y = (row - (HEIGHT as f64 - 1.0) / 2.0) / PIXELS_PER_UNIT;
    let norm = (x * x + y * y + 1.0).sqrt();
    [x / norm, y / norm, 1.0 / norm]
}

/// A frame of ranges along the rays with seeded noise.
fn frame(sigma: f64, range: impl Fn(f64, f64) -> f64) -> RangeFrame {
    let mut random = Pcg64::seed_from_u64(7);
    let noise = Normal::new(0.0, sigma).unwrap();
    RangeFrame {
        range: Raster::from_fn(WIDTH, HEIGHT, |col, row| {
            (range(col as f64, row as f64) + noise.sample(&mut random)) as f32
        }),
        sigma: Raster::filled(WIDTH, HEIGHT, sigma as f32),
        amplitude: Raster::filled(WIDTH, HEIGHT, 100.0),
        flags: Raster::filled(WIDTH, HEIGHT, Flags::empty()),
    }
}

/// Range to the plane that meets the optical axis at `depth` and is turned by `angle` about the y axis.
fn plane(col: f64, row: f64, depth: f64, angle: f64) -> f64 {
    let [x, _, z] = ray(col, row);
    let distance = depth * angle.cos() / (x * angle.sin() + z * angle.cos());
    if distance > 0.0 && distance < 50.0 { distance } else { f64::NAN }
}

fn mixed(frame: &mut RangeFrame) -> Raster<bool> {
    let counts = flag_gross_errors(frame, &GrossErrorOptions::default()).unwrap();
    let mixed = frame.flags.map(|flags| flags.contains(Flags::MIXED_PIXEL));
    assert_eq!(counts.mixed_pixel, mixed.as_slice().iter().filter(|mixed| **mixed).count());
    mixed
}

#[test]
fn pixels_mixed_at_a_step_edge_are_flagged_and_no_others() {
    // A wall at 3 m behind an edge that runs obliquely through the pixels; its pixels see both in their share.
    let edge = |row: f64| 60.3 + 0.37 * row;
    let near_share = |col: f64, row: f64| (edge(row) - col + 0.5).clamp(0.0, 1.0);
    for near in [2.5, 1.0] {
        let mut frame = frame(0.002, |col, row| {
            let share = near_share(col, row);
            share * plane(col, row, near, 0.0) + (1.0 - share) * plane(col, row, 3.0, 0.3)
        });
        let found = mixed(&mut frame);
        let (mut expected, mut missed) = (0, 0);
        for row in 0..HEIGHT {
            for col in 0..WIDTH {
                let share = near_share(col as f64, row as f64);
                // Pixels within a tenth of one of the surfaces are about as close to it as the threshold.
                if (0.1..0.9).contains(&share) {
                    expected += 1;
                    missed += usize::from(!found[(col, row)]);
                } else if share.fract().abs() < f64::EPSILON {
                    assert!(!found[(col, row)], "pure pixel {col} {row} flagged, near surface at {near} m");
                }
            }
        }
        assert!(expected > 100);
        assert_eq!(missed, 0, "of {expected}, near surface at {near} m");
    }
}

#[test]
fn an_edge_blurred_over_two_pixels_is_flagged() {
    let share = |col: f64| ((80.0 - col) / 3.0 + 0.5).clamp(0.0, 1.0);
    let mut frame = frame(0.003, |col, row| {
        share(col) * plane(col, row, 1.5, 0.0) + (1.0 - share(col)) * plane(col, row, 2.5, 0.0)
    });
    let found = mixed(&mut frame);
    for row in 0..HEIGHT {
        let of_row: Vec<usize> = (0..WIDTH).filter(|col| found[(*col, row)]).collect();
        let expected: Vec<usize> = (0..WIDTH).filter(|col| (0.1..0.9).contains(&share(*col as f64))).collect();
        assert_eq!(of_row, expected, "row {row}");
    }
}

#[test]
fn pixels_halfway_between_two_near_surfaces_are_flagged() {
    // The three columns about the edge are as straight as a plane: near, halfway, far.
    let mut frame = frame(0.001, |col, row| {
        let far = if col < 60.0 { 0.0 } else { (col - 59.5).clamp(0.5, 1.0) };
        plane(col, row, 2.0, 0.1) + 0.1 * far
    });
    let found = mixed(&mut frame);
    let count = |cols: std::ops::Range<usize>| {
        (3..HEIGHT - 3).flat_map(|row| cols.clone().map(move |col| (col, row))).filter(|at| found[*at]).count()
    };
    assert_eq!(count(60..61), HEIGHT - 6);
    assert_eq!(count(0..60) + count(61..WIDTH), 0);
}

#[test]
fn a_steep_surface_four_pixels_wide_is_no_edge() {
    // A flight of stairs from aside: each pixel lies between its neighbours and far from both.
    let flight = |col: f64| match col as usize {
        0..60 => 2.0,
        60..64 => 2.3 + 0.1 * (col - 60.0),
        _ => 3.0,
    };
    let mut frame = frame(0.001, |col, _| flight(col));
    assert!(!mixed(&mut frame).as_slice().contains(&true));
}

/// A strip between two walls that is a pixel wide and 0.4 m from both, with so much light.
fn strip(light: f32) -> RangeFrame {
    let strip = |col: f64, row: f64| 2.4 + 0.0002 * row + 0.02 * (col - 60.0);
    let wall = |col: f64| if col < 60.0 { 2.0 } else { 2.8 };
    let mut frame = frame(0.001, |col, row| if col as usize == 60 { strip(col, row) } else { wall(col) });
    frame.amplitude = Raster::from_fn(WIDTH, HEIGHT, |col, _| match col {
        0..60 => 100.0,
        60 => light,
        _ => 60.0,
    });
    frame
}

#[test]
fn a_narrow_surface_is_told_from_a_straight_edge_by_its_light() {
    let flagged = |light: f32| mixed(&mut strip(light)).as_slice().iter().filter(|mixed| **mixed).count();
    // Seen at a grazing angle it returns half of it.
    assert_eq!(flagged(40.0), 0);
    // Halfway in range, a mixture is by 0.375 the brighter wall and by 0.625 the other: 75 units.
    assert!(flagged(75.0) > HEIGHT - 8, "{}", flagged(75.0));
    // Nothing is told without light.
    assert!(flagged(f32::NAN) > HEIGHT - 8);
}

#[test]
fn a_sharp_edge_without_mixing_is_not_flagged() {
    let mut frame = frame(0.005, |col, row| plane(col, row, if col < 70.2 { 1.0 } else { 3.0 }, 0.0));
    assert!(!mixed(&mut frame).as_slice().contains(&true));
}

#[test]
fn tilted_planes_are_not_flagged() {
    for degrees in [0.0_f64, 45.0, 70.0, 80.0] {
        for sigma in [1e-4, 0.005, 0.03] {
            let mut frame = frame(sigma, |col, row| plane(col, row, 2.0, degrees.to_radians()));
            assert!(!mixed(&mut frame).as_slice().contains(&true), "{degrees} degrees, sigma {sigma} m");
        }
    }
}

#[test]
fn the_interior_of_a_sphere_is_not_flagged() {
    let (depth, radius) = (1.5, 0.3);
    let inside = |col: f64, row: f64| {
        let along = ray(col, row)[2] * depth;
        radius * radius - (depth * depth - along * along)
    };
    let mut frame = frame(0.003, |col, row| match inside(col, row) {
        square if square > 0.0 => ray(col, row)[2] * depth - square.sqrt(),
        _ => plane(col, row, 2.5, 0.0),
    });
    let found = mixed(&mut frame);
    let mut interior = 0;
    for row in 0..HEIGHT {
        for col in 0..WIDTH {
            // Up to 75 degrees of incidence: there the sphere bends by w² / (R cos³θ) = 1 cm from one pixel of
            // w = 7.5 mm to the next, by 2 cm along a diagonal, which is four times the floor.
            if inside(col as f64, row as f64).max(0.0).sqrt() > radius * 75.0_f64.to_radians().cos() {
                interior += 1;
                assert!(!found[(col, row)], "{col} {row}");
            }
        }
    }
    assert!(interior > 2000);
}

#[test]
fn a_room_corner_and_a_roof_are_not_flagged() {
    for side in [1.0, -1.0] {
        let mut frame = frame(0.003, |col, row| {
            let faces = [plane(col, row, 2.0, 0.8), plane(col, row, 2.0, -0.8)];
            if side > 0.0 { faces[0].min(faces[1]) } else { faces[0].max(faces[1]) }
        });
        assert!(!mixed(&mut frame).as_slice().contains(&true));
    }
}

#[test]
fn outlines_of_round_objects_are_not_flagged_where_noise_is_small() {
    // Means of many frames: the floor alone is left, and a sphere bends by more from pixel to pixel near its outline.
    let depth = 1.5;
    for radius in [0.3, 0.1, 0.05] {
        let inside = |col: f64, row: f64| {
            let along = ray(col, row)[2] * depth;
            radius * radius - (depth * depth - along * along)
        };
        let mut frame = frame(1e-4, |col, row| match inside(col, row) {
            square if square > 0.0 => ray(col, row)[2] * depth - square.sqrt(),
            _ => plane(col, row, 2.5, 0.0),
        });
        let found = mixed(&mut frame);
        let pixels = || (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |col| (col, row)));
        let count = pixels().filter(|at| found[*at]).count();
        let sphere = pixels().filter(|(col, row)| inside(*col as f64, *row as f64) > 0.0).count();
        // A few in which the outline runs just outside.
        assert!(count * 100 < sphere * 3, "radius {radius}: {count} of {sphere} pixels");
    }
}

#[test]
fn one_pixel_before_the_rim_of_the_image_tells_no_tilt() {
    // A wall at grazing incidence, of which two columns are left beside a board in front of it.
    let mut frame = frame(1e-4, |col, row| if col < 1.5 { 2.0 - 0.05 * col } else { plane(col, row, 1.0, 0.0) });
    assert!(!mixed(&mut frame).as_slice().contains(&true));
}

#[test]
fn stairs_of_two_pixels_a_step_are_not_flagged() {
    let mut frame = frame(1e-4, |_, row| 3.0 - 0.15 * (row / 4.0).floor() * 0.5 - 0.03 * (row % 4.0).min(2.0));
    let found = mixed(&mut frame);
    assert!(!found.as_slice().contains(&true), "{}", found.as_slice().iter().filter(|mixed| **mixed).count());
}

#[test]
fn low_amplitudes_are_flagged_and_unknown_ones_are_not() {
    let mut frame = frame(0.01, |_, _| 2.0);
    frame.amplitude[(3, 4)] = 9.0;
    frame.amplitude[(5, 6)] = f32::NAN;
    frame.range[(7, 8)] = f32::NAN;
    let options = GrossErrorOptions { mixed_pixels: None, low_amplitude: Some(10.0) };
    let counts = flag_gross_errors(&mut frame, &options).unwrap();
    assert_eq!((counts.low_amplitude, counts.mixed_pixel), (1, 0));
    assert_eq!(frame.flags[(3, 4)], Flags::LOW_AMPLITUDE);
    assert_eq!(frame.flags[(5, 6)], Flags::empty());
}

#[test]
fn thresholds_follow_the_sigma_of_each_pixel() {
    // The right half is ten times as noisy as the left one: neither is flagged, though noise of 2 cm on the left would be.
    let wall = |col: f64, row: f64| plane(col, row, 2.0, 0.4);
    let noisy = frame(0.02, wall);
    let mut both = frame(0.002, wall);
    let half = WIDTH / 2;
    for row in 0..HEIGHT {
        for col in half..WIDTH {
            both.range[(col, row)] = noisy.range[(col, row)];
            both.sigma[(col, row)] = 0.02;
        }
    }
    // 25 000 pixels in four directions: a pixel has to be off both sides at once by four sigmas, for which noise alone
    // has less than one chance in a million.
    let mut told = both.clone();
    assert!(mixed(&mut told).as_slice().iter().filter(|mixed| **mixed).count() <= 1);
    both.sigma = Raster::filled(WIDTH, HEIGHT, 0.002);
    let found = mixed(&mut both);
    let count = |columns: std::ops::Range<usize>| {
        let pixels = (0..HEIGHT).flat_map(|row| columns.clone().map(move |col| (col, row)));
        pixels.filter(|pixel| found[*pixel]).count()
    };
    assert!(count(0..half - 3) == 0 && count(half..WIDTH) > 100, "{} {}", count(0..half - 3), count(half..WIDTH));
}

#[test]
fn light_of_a_mixture_adds_up_by_its_phases() {
    let flagged = |light: f32, ambiguity_interval_m: f64| {
        let mut frame = strip(light);
        let mixed =
            MixedPixelOptions { ambiguity_interval_m: Some(ambiguity_interval_m), ..MixedPixelOptions::default() };
        let options = GrossErrorOptions { mixed_pixels: Some(mixed), ..GrossErrorOptions::default() };
        flag_gross_errors(&mut frame, &options).unwrap().mixed_pixel
    };
    // Phasors of 100 and 60 units, 0.8 m of 5 m apart: their sum in the middle of both phases, from shares of 0.375 and 0.625.
    let phase = std::f64::consts::TAU * 0.4 / 5.0;
    let sum = (75.0 * phase.cos()) as f32;
    assert!(flagged(sum, 5.0) > HEIGHT - 8, "{}", flagged(sum, 5.0));
    assert_eq!(flagged(75.0, 5.0), 0);
    // Where phases are alike, as in a long interval, it is the other way round.
    assert_eq!(flagged(sum, 500.0), 0);
    assert!(flagged(75.0, 500.0) > HEIGHT - 8);
    // More than half an interval apart, a mixture lies on the other side of both.
    assert_eq!(flagged(sum, 1.5), 0);
}

#[test]
fn an_unknown_sigma_is_replaced_by_that_of_the_options() {
    // Noise of 3 cm that the frame says nothing about: with the true figure given, nothing is flagged.
    let mut silent = frame(0.03, |col, row| plane(col, row, 2.0, 0.0));
    silent.sigma = Raster::filled(WIDTH, HEIGHT, f32::NAN);
    let told = MixedPixelOptions { unknown_sigma_m: 0.03, ..MixedPixelOptions::default() };
    let options = GrossErrorOptions { mixed_pixels: Some(told), ..GrossErrorOptions::default() };
    assert_eq!(flag_gross_errors(&mut silent, &options).unwrap().mixed_pixel, 0);
}

#[test]
fn small_frames_and_bad_options_are_answered() {
    for (width, height) in [(0, 0), (1, 1), (1, 40), (40, 1), (3, 3)] {
        let mut frame = RangeFrame {
            range: Raster::from_fn(width, height, |col, row| 1.0 + (col + row) as f32 * 0.5),
            sigma: Raster::filled(width, height, f32::NAN),
            amplitude: Raster::filled(width, height, f32::NAN),
            flags: Raster::filled(width, height, Flags::empty()),
        };
        assert!(flag_gross_errors(&mut frame, &GrossErrorOptions::default()).is_ok());
    }
    let mut ragged = frame(0.01, |_, _| 2.0);
    ragged.sigma = Raster::filled(1, 1, 0.0);
    assert!(flag_gross_errors(&mut ragged, &GrossErrorOptions::default()).is_err());
    let default = MixedPixelOptions::default();
    for mixed_pixels in [
        MixedPixelOptions { sigmas: f64::NAN, ..default },
        MixedPixelOptions { floor_m: -1.0, ..default },
        MixedPixelOptions { unknown_sigma_m: f64::INFINITY, ..default },
        MixedPixelOptions { sigmas: 0.0, ..default },
        MixedPixelOptions { ambiguity_interval_m: Some(0.0), ..default },
        MixedPixelOptions { floor_m: 0.0, unknown_sigma_m: 0.0, ..default },
    ] {
        let options = GrossErrorOptions { mixed_pixels: Some(mixed_pixels), low_amplitude: None };
        assert!(options.validate().is_err());
    }
    assert!(GrossErrorOptions { low_amplitude: Some(f64::NAN), ..GrossErrorOptions::default() }.validate().is_err());
}
