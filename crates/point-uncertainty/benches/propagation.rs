//! The covariance of every point of a frame from all sources.
#![allow(clippy::expect_used, missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use point_uncertainty::camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use point_uncertainty::error_models::RangeErrorModel;
use point_uncertainty::nalgebra::{DMatrix, Isometry3, Matrix3, Point3, Vector3};
use point_uncertainty::{Columns, CommonError, CommonErrors, PointErrors, Source, StationErrors, point_covariance};

struct Frame {
    points: Vec<Point3<f64>>,
    station: StationErrors,
}

impl PointErrors for Frame {
    fn noise(&self, point: usize) -> Matrix3<f64> {
        self.station.noise(&self.points[point], 0.01)
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        self.station.sensor(&self.points[point], 0.01)
    }

    fn common(&self, point: usize, derivatives: &mut Vec<(usize, Vector3<f64>)>) {
        self.station.common(&self.points[point], f64::NAN, derivatives);
    }
}

fn points(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("point_covariance");
    for (width, height) in [(176, 144), (640, 480)] {
        let format = ImageFormat::new(width, height, [0.04, 0.04]).expect("a format");
        let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
        let camera = Camera::new(format, interior, LensDistortion::default()).expect("a camera");
        let model = RangeErrorModel::error_free(7.5);
        let name = |at: usize| CommonError { name: format!("e{at}"), source: Source::Calibration };
        let common =
            CommonErrors::new((0..9).map(name).collect(), DMatrix::identity(9, 9) * 1e-6).expect("a covariance");
        let columns = Columns { range: (0..3).map(|at| (at, at)).collect(), pose: Some(3), ..Columns::default() };
        let station =
            StationErrors::new(0, &camera, Some(&model), &Isometry3::identity(), columns, 9).expect("a station");
        let pixels = (0..width * height).map(|at| [(at % width) as f64, (at / width) as f64]);
        let frame = Frame { points: pixels.map(|pixel| camera.point(pixel, 3.0)).collect(), station };
        group.throughput(Throughput::Elements(frame.points.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(format!("{width}x{height}")), |bencher| {
            bencher.iter(|| {
                let all = (0..frame.points.len()).map(|at| point_covariance(at, &frame, &common).trace());
                std::hint::black_box(all.sum::<f64>())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, points);
criterion_main!(benches);
