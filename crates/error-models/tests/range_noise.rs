//! Standard deviations from amplitudes, and those of a fixed pattern.

use approx::assert_relative_eq;
use error_models::{AmplitudeScale, FixedPattern, RangeErrorModel, RangeNoise, SharedNoise, correct_frame};
use range_image::{ComplexChannel, ComplexFrame, Flags, ImageFormat, Modulation, RangeFrame, Raster};

const NOISE: RangeNoise = RangeNoise {
    sigma_times_amplitude_m: 3.0,
    floor_m: 0.004,
    amplitude_scale: AmplitudeScale::AsReceived,
    shared: None,
};

fn frame() -> RangeFrame {
    let range = Raster::from_vec(4, 1, vec![2.0, 2.0, f32::NAN, 2.0]).unwrap();
    let amplitude = Raster::from_vec(4, 1, vec![1000.0, 0.0, 1000.0, 1000.0]).unwrap();
    let sigma = Raster::from_vec(4, 1, vec![f32::NAN, f32::NAN, f32::NAN, 0.02]).unwrap();
    RangeFrame { range, sigma, amplitude, flags: Raster::filled(4, 1, Flags::empty()) }
}

#[test]
fn pixels_without_a_sigma_get_one() {
    // 3 mm and 4 mm.
    assert_relative_eq!(NOISE.sigma_m(1000.0, 2.0), 0.005, max_relative = 1e-12);
    let scaled = RangeNoise { amplitude_scale: AmplitudeScale::TimesSquaredRange, ..NOISE };
    assert_relative_eq!(scaled.sigma_m(4000.0, 2.0), 0.005, max_relative = 1e-12);
    let mut frame = frame();
    NOISE.predict_sigma(&mut frame).unwrap();
    let sigma = frame.sigma.as_slice();
    assert_relative_eq!(sigma[0], 0.005, max_relative = 1e-6);
    assert!(sigma[1].is_nan() && sigma[2].is_nan(), "no amplitude, no range: {sigma:?}");
    assert_relative_eq!(sigma[3], 0.02, max_relative = 1e-6);
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(RangeNoise { floor_m: bad, ..NOISE }.predict_sigma(&mut frame).is_err());
    }
    for (share, width_px) in [(-0.1, 8.0), (1.1, 8.0), (f64::NAN, 8.0), (0.5, 0.5), (0.5, f64::INFINITY)] {
        let shared = Some(SharedNoise { share, width_px });
        assert!(RangeNoise { shared, ..NOISE }.validate().is_err(), "{share} {width_px}");
    }
    assert!(RangeNoise { floor_m: 0.0, sigma_times_amplitude_m: 0.0, ..NOISE }.validate().is_err(), "no noise at all");
}

#[test]
fn a_complex_image_gets_the_sigma_that_makes_that_of_its_range() {
    let modulation = Modulation::new(30e6).unwrap();
    let plane = |value: f32| Raster::filled(1, 1, value);
    let channel = ComplexChannel {
        modulation,
        real: plane(600.0),
        imaginary: plane(800.0),
        offset: None,
        sigma: plane(f32::NAN),
    };
    let mut frame = ComplexFrame { channels: vec![channel], flags: Raster::filled(1, 1, Flags::empty()) };
    NOISE.predict_complex_sigma(&mut frame).unwrap();
    // σ_ρ = U / 2π · σ_z / A
    let sigma = f64::from(frame.channels[0].sigma[(0, 0)]);
    let range_sigma = modulation.ambiguity_interval_m() / std::f64::consts::TAU * sigma / 1000.0;
    assert_relative_eq!(range_sigma, 0.005, max_relative = 1e-6);
}

#[test]
fn deviations_of_a_fixed_pattern_are_added() {
    let mut frame = frame();
    frame.sigma = Raster::filled(4, 1, 0.003);
    let format = ImageFormat::new(4, 1, [0.1, 0.1]).unwrap();
    let model = RangeErrorModel::error_free(5.0);
    let mut pattern =
        FixedPattern { width: 4, height: 1, offset_m: vec![0.01; 4], sigma_m: vec![0.004, f32::NAN, 0.0, 0.004] };
    correct_frame(&mut frame, &model, &format, [0.0, 0.0], Some(&pattern)).unwrap();
    let sigma = frame.sigma.as_slice();
    assert_relative_eq!(sigma[0], 0.005, max_relative = 1e-6);
    assert_relative_eq!(sigma[1], 0.003, max_relative = 1e-6);
    assert_relative_eq!(frame.range[(0, 0)], 1.99, max_relative = 1e-6);
    pattern.sigma_m[0] = -0.1;
    assert!(correct_frame(&mut frame, &model, &format, [0.0, 0.0], Some(&pattern)).is_err());
    pattern.sigma_m = vec![0.1; 3];
    assert!(correct_frame(&mut frame, &model, &format, [0.0, 0.0], Some(&pattern)).is_err());
}
