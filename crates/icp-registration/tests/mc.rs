#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]
mod common;
use common::{Pinhole, Scene, frame, look_at};
use icp_registration::{Cloud, OrganisedNormalOptions, organised_normals};
fn make(scene: &Scene, camera: &Pinhole, w: &nalgebra::Isometry3<f64>, noise: f64, seed: u64, half: usize, minn: f64) -> Cloud {
    let (points, sigmas) = frame(scene, camera, w, noise, seed);
    let o = OrganisedNormalOptions{half_width_px: half, min_fill: minn, ..Default::default()};
    let normals = organised_normals(&points, camera.width, camera.height, &o).unwrap();
    Cloud::from_frame(&points, Some(&normals), Some(&sigmas)).unwrap()
}
use icp_registration::{IcpOptions, align, pose_difference};
use nalgebra::{Matrix6, Vector6};
#[test]
fn mc() {
    let scene = Scene::furnished();
    let camera = Pinhole::small();
    let pairs = [
        ([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8], [-1.2, -0.6, 1.5], [2.0, -0.2, 0.7]),
        ([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8], [-1.0, -1.2, 1.2], [1.6, 1.4, 0.9]),
        ([1.6, 0.2, 1.5], [-2.0, -0.5, 0.8], [1.3, 0.0, 1.3], [-2.0, 0.5, 0.6]),
    ];
    let base = IcpOptions{ initial_correspondence_distance_m: Some(0.1), ..IcpOptions::default()};
    let variants: Vec<(&str, f64, usize, f64, IcpOptions)> = vec![
        ("h2 .9", 1.0, 2, 0.9, base.clone()),
        ("h2 .9 n.3", 0.3, 2, 0.9, base.clone()),
        ("h2 .9 pp", 1.0, 2, 0.9, IcpOptions{metric: icp_registration::Metric::PointToPoint, ..base.clone()}),
        ("h2 .9 LS", 1.0, 2, 0.9, IcpOptions{kernel: icp_registration::RobustKernel::None, ..base.clone()}),
    ];
    for (name, noise, half, truenormals, options) in variants { println!("== {name}");
    for (k, (p0, a0, p1, a1)) in pairs.iter().enumerate() {
        let (w0, w1) = (look_at(*p0, *a0), look_at(*p1, *a1));
        let truth = w0.inverse() * w1;
        let n = 24;
        let mut ds: Vec<Vector6<f64>> = vec![];
        let mut mc = Matrix6::zeros(); let mut nees = 0.0; let mut it = 0;
        for seed in 0..n as u64 {
            let target = make(&scene, &camera, &w0, noise, 100 + seed, half, truenormals);
            let source = make(&scene, &camera, &w1, noise, 2000 + seed, half, truenormals);
            let result = align(&source, &target, &truth, &options).unwrap();
            let d = pose_difference(&truth, &result.target_from_source);
            nees += d.dot(&(result.covariance.try_inverse().unwrap() * d)) / n as f64;
            mc += result.covariance / n as f64; it += result.iterations;
            ds.push(d);
        }
        let f = |v: Vector6<f64>| { let s: Vec<String> = (0..6).map(|i| format!("{:7.3}", if i<3 {v[i]*1e3} else {v[i].to_degrees()*10.0})).collect(); s.join(" ") };
        let mean = ds.iter().sum::<Vector6<f64>>() / n as f64;
        let sd = Vector6::from_fn(|i,_| (ds.iter().map(|d| (d[i]-mean[i]).powi(2)).sum::<f64>()/(n as f64-1.0).max(1.0)).sqrt());
        println!("noise {noise} pair {k} nees {nees:.1} it {}", it / n);
        println!("  mean {}", f(mean));
        println!("  sd   {}", f(sd));
        println!("  pred {}", f(Vector6::from_fn(|i,_| mc[(i,i)].sqrt())));
    }}
}
