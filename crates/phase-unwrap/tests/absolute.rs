//! Absolute wrap counts at one frequency on rendered rooms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{HEIGHT, Scene, WIDTH};
use phase_unwrap::{SpatialOptions, unwrap_spatial};

#[test]
fn rooms() {
    let options = SpatialOptions::default();
    let mut options = options;
    if let Ok(v) = std::env::var("PJ") { options.phase_jump_rad = v.parse().unwrap(); }
    if let Ok(v) = std::env::var("AJ") { options.amplitude_jump = v.parse().unwrap(); }
    if let Ok(v) = std::env::var("MW") { options.maximum_wraps = v.parse().unwrap(); }
    if std::env::var("GEO").is_ok() { options.geometry = Some(phase_unwrap::ImageGeometry { principal_distance_px: 200.0, principal_point_px: [87.5, 71.5] }); }
    let (mut bad, mut worst, mut mean_unsure, mut worst_unsure, mut mean) = (0, 1.0_f64, 0.0, 0.0_f64, 0.0);
    let n_seeds = std::env::var("NS").map_or(24, |v| v.parse().unwrap());
    for seed in 0..n_seeds {
        let view = Scene::random(seed).view(1000 + seed, 0.015);
        let t = std::time::Instant::now();
        let found = unwrap_spatial(&view.phase, Some(&view.amplitude), None, &options).unwrap();
        let ms = t.elapsed().as_secs_f64() * 1e3;
        let (mut sure, mut right, mut all_right, mut unsure_clean) = (0, 0, 0, 0);
        let mut kinds = [0; 3];
        for i in 0..WIDTH * HEIGHT {
            let ok = found.wraps.as_slice()[i] == view.wraps.as_slice()[i];
            let s = found.confidence.as_slice()[i] >= options.minimum_confidence;
            sure += s as usize;
            right += (s && ok) as usize;
            all_right += ok as usize;
            unsure_clean += (!s && !view.mixed.as_slice()[i]) as usize;
            if s && !ok {
                kinds[if view.mixed.as_slice()[i] {
                    0
                } else if view.cycles.as_slice()[i] < 0.35 {
                    1
                } else {
                    2
                }] += 1;
            }
        }
        let n = (WIDTH * HEIGHT) as f64;
        if std::env::var("DUMP").is_ok_and(|d| d == seed.to_string()) {
            let f = |name: &str, v: Vec<f64>| {
                std::fs::write(
                    format!("/tmp/pu_{name}.txt"),
                    v.iter().map(|x| x.to_string()).collect::<Vec<_>>().join(" "),
                )
                .unwrap();
            };
            f("truth", view.wraps.as_slice().iter().map(|x| *x as f64).collect());
            f("found", found.wraps.as_slice().iter().map(|x| *x as f64).collect());
            f("conf", found.confidence.as_slice().iter().map(|x| *x as f64).collect());
            f("amp", view.amplitude.as_slice().iter().map(|x| (*x as f64).ln()).collect());
            f("phase", view.phase.as_slice().iter().map(|x| *x as f64).collect());
            f("seg", found.segment.as_slice().iter().map(|x| ((*x as u64 * 2654435761) % 251) as f64).collect());
        }
        let r = right as f64 / (sure.max(1)) as f64; let u = 1.0 - sure as f64 / n;
        if r < 0.995 { bad += 1; print!("BAD "); } worst = worst.min(r); mean += r / n_seeds as f64; mean_unsure += u / n_seeds as f64; worst_unsure = worst_unsure.max(u); if u > 0.08 { print!("UNSURE "); }
        let mixed = view.mixed.as_slice().iter().filter(|m| **m).count() as f64 / n;
        let maxr = view.cycles.as_slice().iter().fold(0.0_f64, |a, b| a.max(*b));
        println!(
            "{seed}: sure right {:.4} unsure {:.4} (clean {:.4}) all right {:.4} mixed {mixed:.3} wrong m/n/f {kinds:?} segs {} far {:.1} C {:?} {ms:.1} ms",
            right as f64 / sure as f64,
            1.0 - sure as f64 / n,
            unsure_clean as f64 / n,
            all_right as f64 / n,
            found.islands[0].segments,
            maxr * 5.0,
            found.typical_amplitude_at_interval
        );
    }
    println!("SUM bad {bad} worst {worst:.4} mean {mean:.5} unsure mean {mean_unsure:.4} worst {worst_unsure:.4}");
}
