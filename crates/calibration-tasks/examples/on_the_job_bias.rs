//! Experiment: bias of corrected ranges by amplitude.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]
use std::path::{Path, PathBuf};
use calibration_tasks::pipeline::{Silent, SimulateSource, simulate};
use commands::plan::{FlagOptions, Stage, to_ranges};
use pipeline::{Plan, process};
use pipeline::survey::ViewData;
use range_calibration::point_cloud::{OrganisedNormalOptions, organised_normals};
use range_io::calibration::Calibration;

fn main() {
    let mut words = std::env::args().skip(1);
    let first: u64 = words.next().unwrap().parse().unwrap();
    let last: u64 = words.next().unwrap().parse().unwrap();
    let (mut sxy, mut sxx) = (0.0, 0.0);
    let mut reg: Vec<Vec<(f64, f64)>> = vec![Vec::new(); 30];
    let mut regf = vec![0.0; 30];
    let which = std::env::var("WHICH").unwrap();
    let scene = PathBuf::from(words.next().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let edges = [0.0, 20.0, 22.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 80.0, 100.0, 150.0, 200.0, 300.0, 400.0, 600.0, 1000.0, 2000.0, 5000.0, 1e9];
    let mut bins: Vec<Vec<(f64, f64)>> = vec![Vec::new(); edges.len()];
    let mut by_range: Vec<Vec<(f64, f64)>> = vec![Vec::new(); 40];
    for seed in first..=last {
        let survey = folder.path().join("survey");
        let source = SimulateSource { scene: scene.display().to_string(), seed, approximate_position_sigma_m: 0.05, approximate_attitude_sigma_deg: 2.0, gross_error_share: 0.0 };
        simulate(&source, Path::new(""), &survey, &Silent).unwrap();
        let truth = survey.join("truth/calibration.ron");
        let calibration = Calibration::read(&truth).unwrap();
        let model = calibration.range_models[0].to_model().unwrap();
        let camera = calibration.camera().unwrap();
        let read = range_io::survey::Survey::read(&survey).unwrap();
        let mut stages = to_ranges(read.level, calibration.scattering.is_some());
        stages.push(Stage::Flag(FlagOptions::default()));
        if seed == first { println!("{stages:?}"); }
        let plan = Plan { name: "surfaces".to_owned(), source: None, calibrate: None, stages };
        let processed = process(&plan, &survey, Some(&truth), &Silent).unwrap();
        for view in &processed.views {
            let ViewData::Range(frame) = &view.data else { panic!() };
            let t = view.truth.as_ref().unwrap();
            let (w, h) = (frame.width(), frame.height());
            let mut points = vec![[f64::NAN; 3]; w * h];
            for i in 0..w * h {
                let p = (i % w, i / w);
                if frame.flags[p].is_empty() && frame.range[p] > 0.0 {
                    let r = f64::from(frame.range[p]);
                    let [x, y] = camera.format.image_from_pixel([p.0 as f64, p.1 as f64]);
                    let [xp, yp] = camera.interior.principal_point_mm;
                    let c = model.correction(r, x - xp, y - yp, f64::from(frame.amplitude[p])).total_m();
                    points[i] = (camera.ray([p.0 as f64, p.1 as f64]) * (r - c)).into();
                }
            }
            let strict = organised_normals(&points, w, h, &OrganisedNormalOptions { half_width_px: 3, ..OrganisedNormalOptions::default() }).unwrap();
            let lenient = organised_normals(&points, w, h, &OrganisedNormalOptions { half_width_px: 2, min_fill: 0.5, ..OrganisedNormalOptions::default() }).unwrap();
            for i in 0..w * h {
                let p = (i % w, i / w);
                let class = if strict[i][0].is_finite() { "strict" } else if lenient[i][0].is_finite() { "lenient" } else { "none" };
                if class != which { continue; }
                let normal = if which == "strict" { strict[i] } else { lenient[i] };
                if !frame.flags[p].is_empty() { continue; }
                let (r, a) = (f64::from(frame.range[p]), f64::from(frame.amplitude[p]));
                let [x, y] = camera.format.image_from_pixel([p.0 as f64, p.1 as f64]);
                let [xp, yp] = camera.interior.principal_point_mm;
                let e = r - model.correction(r, x - xp, y - yp, a).total_m() - f64::from(t.range[p]);
                let s = f64::from(frame.sigma[p]);
                let q = |dc: f64, dr: f64| normal.dot(&camera.ray([p.0 as f64 + dc, p.1 as f64 + dr]));
                let axis = |a: f64, b: f64| { let (p, m, z) = (q(a, b), q(-a, -b), q(0.0, 0.0)); -2.0 * (0.5 * (p - m) / z).powi(2) - 0.5 * (p - 2.0 * z + m) / z };
                let foot = r / 12.0 * (axis(1.0, 0.0) + axis(0.0, 1.0));
                if foot.is_finite() && foot.abs() < 0.02 && e.is_finite() && e.abs() < 6.0 * s { let k = ((foot * -1e4) as usize).min(29); reg[k].push((e, s)); regf[k] += foot; sxy += e * foot / s / s; sxx += foot * foot / s / s; }
                let e = if which == "none" { e } else { e - foot };
                if !e.is_finite() || e.abs() > 6.0 * s { continue; }
                let bin = edges.iter().rposition(|edge| a >= *edge).unwrap();
                bins[bin].push((e, s));
                by_range[((r * 4.0) as usize).min(39)].push((e, s));
            }
        }
        std::fs::remove_dir_all(&survey).unwrap();
    }
    let print = |what: String, v: &Vec<(f64, f64)>| {
        if v.len() < 10 { return; }
        let n = v.len() as f64;
        let mean = v.iter().map(|e| e.0).sum::<f64>() / n;
        let w: f64 = v.iter().map(|e| 1.0 / e.1 / e.1).sum();
        let wm = v.iter().map(|e| e.0 / e.1 / e.1).sum::<f64>() / w;
        let sd = (v.iter().map(|e| (e.0 - mean).powi(2)).sum::<f64>() / n).sqrt();
        let st = (v.iter().map(|e| e.1 * e.1).sum::<f64>() / n).sqrt();
        let mut all: Vec<f64> = v.iter().map(|e| e.0).collect();
        all.sort_by(f64::total_cmp);
        println!("{what:>12} n {:>7} mean {:>8.3} weighted {:>8.3} median {:>8.3} sd {:>8.3} stated {:>8.3} mm  se {:.3}", v.len(), 1e3 * mean, 1e3 * wm, 1e3 * all[all.len() / 2], 1e3 * sd, 1e3 * st, 1e3 * sd / n.sqrt());
    };
    println!("slope of error on footprint {:.3} +- {:.3}", sxy / sxx, (1.0f64 / sxx).sqrt());
    for (k, v) in reg.iter().enumerate() { print(format!("foot {:.3}", 1e3 * regf[k] / v.len() as f64), v); }
    for (k, v) in bins.iter().enumerate() { print(format!("a > {}", edges[k]), v); }
    for (k, v) in by_range.iter().enumerate() { print(format!("r > {}", k as f64 / 4.0), v); }
}
