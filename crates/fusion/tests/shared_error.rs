//! Frames that a sensor bends alike: walls as thin as their noise, and standard deviations that hold.

use fusion::nalgebra::{Matrix3, Vector3};
use fusion::{Error, Fused, FusionOptions, Surfel, fuse};
use statistics::robust_standard_deviation;

use crate::common::bent::Bent;

fn options(bent: &Bent, is_looked_for: bool) -> FusionOptions {
    FusionOptions { shared_error: is_looked_for.then_some(bent.grid), ..FusionOptions::default() }
}

/// Scatter of fused points about the planes of wall and floor over their standard deviations, and that of the points about the mean of their
/// fused point, over their noise.
fn scatter(bent: &Bent, fused: &Fused, sigma_m: fn(&Surfel) -> f64) -> [f64; 2] {
    let mut all = Vec::new();
    for (at, normal) in [(2.0, -Vector3::y()), (0.0, Vector3::z())] {
        let offset = |position: &Vector3<f64>| normal.dot(position) - if normal.z > 0.5 { at } else { -at };
        let near = |surfel: &&Surfel| surfel.normal.dot(&normal) > 0.9 && offset(&surfel.position.coords).abs() < 0.1;
        let rows: Vec<(Vector3<f64>, f64, f64)> = fused
            .surfels
            .iter()
            .filter(near)
            .map(|surfel| {
                let aside = [surfel.position.x, if normal.z > 0.5 { surfel.position.y } else { surfel.position.z }];
                (Vector3::new(1.0, aside[0], aside[1]), offset(&surfel.position.coords), sigma_m(surfel))
            })
            .collect();
        assert!(rows.len() > 200, "{}", rows.len());
        let normal: Matrix3<f64> = rows.iter().map(|(row, _, sigma)| row * row.transpose() / (sigma * sigma)).sum();
        let right: Vector3<f64> = rows.iter().map(|(row, height, sigma)| row * (height / (sigma * sigma))).sum();
        let plane = normal.cholesky().unwrap().solve(&right);
        all.extend(rows.iter().map(|(row, height, sigma)| (height - row.dot(&plane)) / sigma));
    }
    [robust_standard_deviation(&all), thickness(bent, fused)]
}

/// Of points on the floor and the wall, corrected, over their noise with what neighbours share.
fn thickness(bent: &Bent, fused: &Fused) -> f64 {
    use fusion::point_uncertainty::PointErrors;
    let mut derivatives = Vec::new();
    let mut by_surfel: Vec<Vec<(f64, f64)>> = vec![Vec::new(); fused.surfels.len()];
    for (point, surfel) in fused.surfel_of_point.iter().enumerate() {
        let Some(surfel) = surfel else { continue };
        derivatives.clear();
        bent.common(point, &mut derivatives);
        let shift: Vector3<f64> = derivatives.iter().map(|(column, by)| by * fused.corrections[*column]).sum();
        let normal = fused.surfels[*surfel as usize].normal;
        let height = normal.dot(&(bent.points[point] - shift - fused.surfels[*surfel as usize].position));
        let own = normal.dot(&(bent.noise(point) * normal));
        let shared = bent.sensor(point).map_or(0.0, |(_, shift)| shift.dot(&normal).powi(2));
        by_surfel[*surfel as usize].push((height, (own + shared).sqrt()));
    }
    let of_surfel = |heights: &Vec<(f64, f64)>| -> Vec<f64> {
        let mean = heights.iter().map(|(height, _)| height).sum::<f64>() / heights.len() as f64;
        heights.iter().map(|(height, sigma)| (height - mean) / sigma).collect()
    };
    let all: Vec<f64> = by_surfel.iter().filter(|heights| heights.len() > 8).flat_map(of_surfel).collect();
    robust_standard_deviation(&all)
}

#[test]
fn what_all_frames_bend_alike_is_taken_off() {
    let bent = Bent::new(0.004, 0);
    let [plain, fused] = [false, true]
        .map(|is_looked_for| fuse(&bent.registered(), &bent, &bent.common, &options(&bent, is_looked_for)).unwrap());
    assert!(plain.shared_error.is_none());
    // Drawn: 0.004, alike over twelve pixels.
    let found = fused.shared_error.unwrap();
    assert!((0.002..0.008).contains(&found.sigma_per_m) && (6.0..=48.0).contains(&found.length_px), "{found:?}");
    // Without it, frames see parts of the walls so far apart that it is taken for noise.
    assert!(plain.noise_factor > 1.5 && fused.noise_factor == 1.0, "{} {}", plain.noise_factor, fused.noise_factor);
    let by_sources = |surfel: &Surfel| (surfel.shares.variance() + surfel.shape_variance).sqrt();
    let [[sigma_before, thickness_before], [sigma_after, thickness_after]] =
        [scatter(&bent, &plain, by_sources), scatter(&bent, &fused, by_sources)];
    // The frames tell that something is missing.
    let [told_before, _] = scatter(&bent, &plain, Surfel::sigma_m);
    assert!((0.8..1.3).contains(&told_before), "{told_before}");
    // After, deviations have in them what whole walls err by with the poses, which is no scatter.
    assert!(sigma_before > 0.8 && (0.4..1.0).contains(&sigma_after), "{sigma_before} {sigma_after}");
    assert!(thickness_before > 1.1 && (0.75..1.1).contains(&thickness_after), "{thickness_before} {thickness_after}");
}

#[test]
fn a_camera_that_bends_nothing_is_not_corrected() {
    let bent = Bent::new(0.0, 10);
    let [plain, fused] = [false, true]
        .map(|is_looked_for| fuse(&bent.registered(), &bent, &bent.common, &options(&bent, is_looked_for)).unwrap());
    assert!(fused.shared_error.is_none(), "{:?}", fused.shared_error);
    let places = |fused: &Fused| -> Vec<_> { fused.surfels.iter().map(|surfel| surfel.position).collect() };
    assert_eq!(places(&plain), places(&fused));
    assert_eq!(plain.corrections, fused.corrections);
}

#[test]
fn nodes_that_are_no_common_errors_are_refused() {
    let bent = Bent::new(0.0, 1);
    let none = fusion::point_uncertainty::CommonErrors::none();
    let error = fuse(&bent.registered(), &bent, &none, &options(&bent, true)).unwrap_err();
    assert!(matches!(error, Error::SharedError { errors: 0, .. }), "{error}");
}
