//! Detection, two-path solution and risk of whole frames.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use multipath::{
    Detection, DetectionOptions, Detector, FrequencyResponse, RiskOptions, TwoPathImage, TwoPathOptions, TwoPathSolver,
    assess_risk,
};
use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, RangeFrame, Raster};

const SIZES: [(usize, usize); 3] = [(176, 144), (640, 480), (1024, 1024)];
const FREQUENCIES: [f64; 3] = [20e6, 50e6, 80e6];

fn modulations() -> Vec<Modulation> {
    FREQUENCIES.iter().map(|frequency| Modulation::new(*frequency).unwrap()).collect()
}

fn range(col: usize, row: usize) -> f64 {
    1.0 + ((col * 7 + row * 13) % 1000) as f64 * 0.004
}

/// Every `every`-th pixel has a second path of 0.3 of the light, a metre longer.
fn frame(width: usize, height: usize, every: usize) -> ComplexFrame {
    let channel = |modulation: Modulation| {
        let part = |shift: f64| {
            Raster::from_fn(width, height, |col, row| {
                let range = range(col, row);
                let second = if (row * width + col).is_multiple_of(every) { 0.3 } else { 0.0 };
                let wave = |range: f64| (modulation.phase_from_range(range) - shift).cos();
                (200.0 * (wave(range) + second * wave(range + 1.0))) as f32
            })
        };
        let (real, imaginary) = (part(0.0), part(std::f64::consts::FRAC_PI_2));
        ComplexChannel { modulation, real, imaginary, offset: None, sigma: Raster::filled(width, height, 1.0) }
    };
    let flags = Raster::filled(width, height, Flags::empty());
    ComplexFrame { channels: modulations().into_iter().map(channel).collect(), flags }
}

/// A corner of two walls.
fn corner(width: usize, height: usize) -> (RangeFrame, Vec<[f64; 3]>) {
    let direction = |index: usize| {
        let x = ((index % width) as f64 + 0.5) / width as f64 - 0.5;
        let y = (0.5 - ((index / width) as f64 + 0.5) / height as f64) * height as f64 / width as f64;
        let length = (x * x + y * y + 1.0).sqrt();
        [x / length, y / length, -1.0 / length]
    };
    let directions: Vec<[f64; 3]> = (0..width * height).map(direction).collect();
    let range = directions.iter().map(|u| (3.0 / (u[0].abs() - u[2])) as f32).collect();
    let frame = RangeFrame {
        range: Raster::from_vec(width, height, range).unwrap(),
        sigma: Raster::filled(width, height, 0.005),
        amplitude: Raster::filled(width, height, 100.0),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    (frame, directions)
}

fn frames(criterion: &mut Criterion) {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let response = FrequencyResponse::flat(3);
    let mut detector = Detector::new(&modulations(), &response, &DetectionOptions::default()).unwrap();
    let solver = TwoPathSolver::new(&modulations(), &response, &TwoPathOptions::default()).unwrap();
    let mut group = criterion.benchmark_group("Multipath");
    for (width, height) in SIZES {
        group.throughput(Throughput::Elements((width * height) as u64));
        let mut complex = frame(width, height, 10);
        let ranges = Raster::from_fn(width, height, |col, row| range(col, row) as f32);
        let mut detection = Detection::default();
        group.bench_function(format!("detect/{width}x{height}, one thread"), |bencher| {
            bencher.iter(|| one_thread.install(|| detector.detect_into(&mut complex, &ranges, &mut detection)));
        });
        let mut image = TwoPathImage::default();
        group.bench_function(format!("two paths in a tenth/{width}x{height}, one thread"), |bencher| {
            bencher.iter(|| one_thread.install(|| solver.solve_into(&complex, &mut image)));
        });
        let (mut scene, directions) = corner(width, height);
        let options = RiskOptions { modulation_hz: Some(30e6), ..RiskOptions::for_width(width) };
        group.bench_function(format!("risk/{width}x{height}, one thread"), |bencher| {
            bencher.iter(|| one_thread.install(|| assess_risk(&mut scene, &directions, &options)));
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = frames
}
criterion_main!(benches);
