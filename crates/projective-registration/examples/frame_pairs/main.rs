//! What the registration of organised frames reaches: accuracy and time on simulated pairs (`table`), covariance
//! (`statistics`), success from far-off starts at half overlap (`success`), errors of real pairs over what is stated of
//! them (`honesty`), trusted poses that are wrong among thousands of real pairs (`search`), invalid pixels (`invalid`, `invalid real`, `invalid simulated`), what is trusted without
//! times (`verdicts`, for `cargo xtask sensitivity`), real frames (`real`, where the tests expect them). Without an argument: all.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::expect_used, clippy::cast_lossless)]

#[path = "../../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../tests/depth_frames/mod.rs"]
mod depth_frames;
mod honesty;
mod invalid;
mod measure;
mod real;
mod search;
mod statistics;
mod success;
mod table;
mod verdicts;

use std::sync::Arc;

use common::Pinhole;
use projective_registration::Projection;

fn main() {
    // All work on the thread whose CPU time is measured.
    let threads = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    threads.install(run);
}

fn run() {
    let wanted = std::env::args().nth(1);
    let is_wanted = |name: &str| wanted.as_deref().is_none_or(|w| w == name);
    if is_wanted("table") {
        table::print();
    }
    if is_wanted("statistics") {
        statistics::print();
    }
    if is_wanted("success") {
        success::print();
    }
    if is_wanted("invalid") {
        invalid::print();
    }
    if is_wanted("honesty") {
        honesty::print();
    }
    if is_wanted("search") {
        search::print();
    }
    if is_wanted("verdicts") {
        verdicts::print();
    }
    if is_wanted("real") {
        real::print();
    }
}

/// The projection of a simulated camera.
fn projection(camera: &Pinhole) -> Arc<Projection> {
    let centre = [(camera.width as f64 - 1.0) / 2.0, (camera.height as f64 - 1.0) / 2.0];
    Arc::new(Projection::pinhole(camera.width, camera.height, [camera.focal_px; 2], centre).unwrap())
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    if values.is_empty() {
        return f64::NAN;
    }
    f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2])
}
