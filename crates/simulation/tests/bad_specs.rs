//! A wrong description is refused by the name of its field.

use crate::common;
use crate::common::plain;
use error_models::{FrameRateDrift, ModelSet, RangeErrorModel, TemperatureDrift, Transient, WarmUp};
use range_image::NoiseModel;
use simulation::{
    AttitudeSpec, DigitisationSpec, Error, FixedPatternSpec, IntervalChange, MixedPixelsSpec, MultipathSpec,
    ReferencePathSpec, SampleType, ShapeSpec, SimulationSpec, Simulator, TemperatureSpec, TextureSpec, simulate,
    simulate_frame,
};

type Change = fn(&mut SimulationSpec);

fn mesh(vertices_m: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> ShapeSpec {
    ShapeSpec::Mesh { vertices_m, triangles }
}

const CORNERS: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];

const WRONG: &[(&str, Change)] = &[
    ("scene.objects", |s| s.scene.objects.clear()),
    ("scene.objects[1].albedo", |s| s.scene.objects[1].albedo = 21.0),
    ("scene.objects[0].albedo", |s| s.scene.objects[0].albedo = f64::NAN),
    ("scene.objects[0].shape.max_m", |s| {
        s.scene.objects[0].shape = ShapeSpec::Room { min_m: [0.0; 3], max_m: [1.0, 0.0, 1.0], face_albedo: None };
    }),
    ("scene.objects[0].shape.face_albedo", |s| {
        s.scene.objects[0].shape =
            ShapeSpec::Room { min_m: [0.0; 3], max_m: [1.0; 3], face_albedo: Some([0.5, 0.5, -1.0, 0.5, 0.5, 0.5]) };
    }),
    ("scene.objects[1].shape.radius_m", |s| {
        s.scene.objects[1].shape = ShapeSpec::Sphere { center_m: [0.0; 3], radius_m: 0.0 };
    }),
    ("scene.objects[1].shape.center_m", |s| {
        s.scene.objects[1].shape = ShapeSpec::Sphere { center_m: [0.0, f64::INFINITY, 0.0], radius_m: 1.0 };
    }),
    ("scene.objects[2].shape.size_m", |s| {
        s.scene.objects[2].shape =
            ShapeSpec::Cuboid { center_m: [0.0; 3], size_m: [1.0, -1.0, 1.0], rotation_deg: [0.0; 3] };
    }),
    ("scene.objects[2].shape.edge_v_m", |s| {
        s.scene.objects[2].shape =
            ShapeSpec::Rectangle { corner_m: [0.0; 3], edge_u_m: [1.0, 0.0, 0.0], edge_v_m: [0.1, 1.0, 0.0] };
    }),
    ("scene.objects[2].shape.edge_u_m", |s| {
        s.scene.objects[2].shape =
            ShapeSpec::Rectangle { corner_m: [0.0; 3], edge_u_m: [0.0; 3], edge_v_m: [0.1, 1.0, 0.0] };
    }),
    ("scene.objects[2].shape.triangles", |s| s.scene.objects[2].shape = mesh(CORNERS.to_vec(), vec![])),
    ("scene.objects[2].shape.triangles[0]", |s| s.scene.objects[2].shape = mesh(CORNERS.to_vec(), vec![[0, 1, 3]])),
    ("scene.objects[2].shape.triangles[0]", |s| s.scene.objects[2].shape = mesh(CORNERS.to_vec(), vec![[0, 1, 2]])),
    ("scene.objects[2].shape.vertices_m[1]", |s| {
        s.scene.objects[2].shape = mesh(vec![[0.0; 3], [f64::NAN; 3], [1.0; 3]], vec![[0, 1, 2]]);
    }),
    ("scene.objects[0].texture.size_m", |s| {
        s.scene.objects[0].texture = Some(TextureSpec::Checker { size_m: 0.0, factor: 0.5 });
    }),
    ("scene.objects[0].texture.contrast", |s| {
        s.scene.objects[0].texture = Some(TextureSpec::Noise { size_m: 1.0, contrast: 1.0, seed: 0 });
    }),
    ("scene.objects[0].texture.radius_m", |s| {
        s.scene.objects[0].texture =
            Some(TextureSpec::Discs { spacing_m: 1.0, radius_m: -0.1, factor: 0.5, first_m: [0.0; 2] });
    }),
    ("camera.modulation_hz", |s| s.camera.modulation_hz.clear()),
    ("camera.modulation_hz[0]", |s| s.camera.modulation_hz[0] = -1.0),
    ("scene.objects[1].shape.center_m", |s| {
        s.scene.objects[1].shape = ShapeSpec::Sphere { center_m: [0.0, 1e300, 0.0], radius_m: 1.0 };
    }),
    ("camera.geometry.format", |s| s.camera.geometry.format.width = usize::MAX),
    ("exposure.frames_per_station", |s| s.exposure.frames_per_station = usize::MAX),
    ("camera.phase_steps", |s| s.camera.phase_steps = 2),
    ("camera.phase_offset_rad", |s| s.camera.phase_offset_rad = f64::NAN),
    ("illumination.source_power", |s| s.illumination.source_power = 0.0),
    ("illumination.modulation_contrast", |s| s.illumination.modulation_contrast = 1.5),
    ("illumination.ambient_power", |s| s.illumination.ambient_power = -1.0),
    ("illumination.vignetting_exponent", |s| s.illumination.vignetting_exponent = f64::INFINITY),
    ("exposure.frames_per_station", |s| s.exposure.frames_per_station = 0),
    ("exposure.integration_time_s", |s| s.exposure.integration_time_s = 0.0),
    ("exposure.frame_interval_s", |s| s.exposure.frame_interval_s = -0.1),
    ("exposure.interval_changes[0].from_frame", |s| s.exposure.interval_changes = vec![interval(0, 1.0)]),
    ("exposure.interval_changes[1].from_frame", |s| {
        s.exposure.interval_changes = vec![interval(5, 1.0), interval(5, 2.0)];
    }),
    ("exposure.interval_changes[0].frame_interval_s", |s| s.exposure.interval_changes = vec![interval(5, -1.0)]),
    ("exposure.power_on_s", |s| s.errors.warm_up = Some(following())),
    ("exposure.frame_interval_s", |s| {
        (s.exposure.power_on_s, s.errors.warm_up) = (Some(-1.0), Some(following()));
        s.exposure.interval_changes = vec![interval(1, 0.0)];
    }),
    ("exposure.further_integration_times_s[0]", |s| s.exposure.further_integration_times_s = vec![-0.001]),
    ("exposure.further_integration_times_s[1]", |s| s.exposure.further_integration_times_s = vec![0.001, 0.002]),
    ("exposure.power_on_s", |s| s.exposure.power_on_s = Some(1.0)),
    ("exposure.power_on_s", |s| s.exposure.temperature = Some(temperature(600.0))),
    ("exposure.temperature.time_constant_s", |s| s.exposure.temperature = Some(temperature(0.0))),
    ("exposure.power_on_s", |s| s.errors.warm_up = Some(drift(true))),
    ("exposure.temperature", |s| s.errors.warm_up = Some(drift(false))),
    ("camera.reference_path.columns", |s| s.camera.reference_path = Some(reference([47, 48], 0.7))),
    ("camera.reference_path.length_m", |s| s.camera.reference_path = Some(reference([0, 1], 0.0))),
    ("errors.range_by_integration_time", |s| {
        s.errors.range = Some(vec![model(common::INTERVAL_M)]);
        s.errors.range_by_integration_time = Some(ModelSet { entries: vec![(0.002, vec![model(common::INTERVAL_M)])] });
    }),
    ("errors.range_by_integration_time.entries[0][0].ambiguity_interval_m", |s| {
        s.errors.range_by_integration_time = Some(ModelSet { entries: vec![(0.002, vec![model(5.0)])] });
    }),
    ("stations", |s| s.stations.clear()),
    ("stations[1].name", |s| s.stations.push(s.stations[0].clone())),
    ("stations[0].position_m", |s| s.stations[0].position_m[2] = f64::NAN),
    ("stations[0].attitude.target_m", |s| {
        s.stations[0].attitude = AttitudeSpec::LookAt { target_m: [0.8, 2.0, 0.0], roll_deg: 0.0 };
    }),
    ("stations[0].attitude.phi_deg", |s| {
        s.stations[0].attitude = AttitudeSpec::Euler { omega_deg: 0.0, phi_deg: f64::NAN, kappa_deg: 0.0 };
    }),
    ("stations[0].position_m", |s| s.stations[0].position_m = [3.0, 2.5, 1.0]),
    ("errors.range", |s| s.errors.range = Some(vec![])),
    ("errors.range[0].ambiguity_interval_m", |s| s.errors.range = Some(vec![model(5.0)])),
    ("errors.fixed_pattern.sigma_m", |s| s.errors.fixed_pattern = Some(FixedPatternSpec { sigma_m: -1.0, seed: 0 })),
    ("errors.digitisation.raw_scale", |s| s.errors.digitisation = Some(digitisation(0.0, None))),
    ("errors.digitisation.saturation", |s| s.errors.digitisation = Some(digitisation(1.0, Some(70_000.0)))),
    ("errors.mixed_pixels.rays_per_pixel_side", |s| s.errors.mixed_pixels = Some(mixed(0, 0.05))),
    ("errors.mixed_pixels.threshold_m", |s| s.errors.mixed_pixels = Some(mixed(2, 0.0))),
    ("errors.multipath.directions", |s| s.errors.multipath = Some(MultipathSpec { directions: 0, seed: 0 })),
];

fn model(ambiguity_interval_m: f64) -> RangeErrorModel {
    RangeErrorModel::error_free(ambiguity_interval_m)
}

fn temperature(time_constant_s: f64) -> TemperatureSpec {
    TemperatureSpec { cold_c: 20.0, warm_c: 40.0, time_constant_s }
}

fn interval(from_frame: usize, frame_interval_s: f64) -> IntervalChange {
    IntervalChange { from_frame, frame_interval_s }
}

/// By the frame rate.
fn following() -> WarmUp {
    let part = FrameRateDrift { coefficient_m_per_hz: 0.003, time_constant_s: 600.0, reference_hz: 1.0, span_hz: None };
    WarmUp { frame_rate: Some(part), ..WarmUp::default() }
}

/// By time or by temperature.
fn drift(by_time: bool) -> WarmUp {
    if by_time {
        let transients = vec![Transient { amplitude_m: 0.03, time_constant_s: 600.0 }];
        WarmUp { transients, ..WarmUp::default() }
    } else {
        let temperature = TemperatureDrift { coefficient_m_per_k: 0.001, reference_c: 40.0, span_c: None };
        WarmUp { temperature: Some(temperature), ..WarmUp::default() }
    }
}

fn reference(columns: [usize; 2], length_m: f64) -> ReferencePathSpec {
    ReferencePathSpec { columns, rows: [0, 1], length_m, power: 1e6 }
}

fn digitisation(raw_scale: f64, saturation: Option<f64>) -> DigitisationSpec {
    DigitisationSpec { sample_type: SampleType::U16, raw_scale, saturation }
}

fn mixed(rays_per_pixel_side: usize, threshold_m: f64) -> MixedPixelsSpec {
    MixedPixelsSpec { rays_per_pixel_side, threshold_m }
}

#[test]
fn every_wrong_field_is_named() {
    for (field, change) in WRONG {
        let mut spec = plain();
        change(&mut spec);
        match Simulator::new(&spec).err() {
            Some(Error::Field { field: found, .. }) => assert_eq!(&found, field),
            other => unreachable!("{field}: {other:?}"),
        }
    }
}

#[test]
fn what_other_crates_check_comes_through() {
    let mut spec = plain();
    spec.camera.geometry.interior.principal_distance_mm = -1.0;
    assert!(matches!(simulate(&spec, 1, &|_, _| {}), Err(Error::Camera(_))));
    let mut folded = plain();
    folded.camera.geometry.lens.k1 = 0.1;
    assert!(matches!(simulate(&folded, 1, &|_, _| {}), Err(Error::Camera(_))));
    let mut spec = plain();
    spec.errors.noise = Some(NoiseModel { shot_variance_per_unit: -1.0, dark_sigma: 0.0 });
    assert!(matches!(simulate(&spec, 1, &|_, _| {}), Err(Error::Image(_))));
    let mut spec = plain();
    spec.errors.range = Some(vec![model(f64::NAN)]);
    assert!(matches!(simulate(&spec, 1, &|_, _| {}), Err(Error::RangeError(_))));
    // No model at 2 ms nor on both sides of it.
    let mut spec = plain();
    spec.errors.range_by_integration_time = Some(ModelSet { entries: vec![(0.003, vec![model(common::INTERVAL_M)])] });
    assert!(matches!(simulate(&spec, 1, &|_, _| {}), Err(Error::RangeError(_))));
}

#[test]
fn text_that_is_no_simulation_is_refused_with_its_place() {
    let parse = |text: &str| SimulationSpec::from_ron(text).unwrap_err();
    assert!(matches!(parse(""), Error::Parse { line: 1, .. }));
    let Error::Parse { line, message, .. } = parse("(\n  scene: (objects: [], surprise: 1),\n)") else {
        unreachable!("not a parse error")
    };
    assert_eq!(line, 2);
    assert!(message.contains("surprise"), "{message}");
}

#[test]
fn stations_and_frames_that_are_not_there_are_refused() {
    let spec = plain();
    assert!(matches!(simulate_frame(&spec, 1, 1, 0), Err(Error::NoSuch { what: "station", index: 1, count: 1 })));
    assert!(matches!(simulate_frame(&spec, 1, 0, 2), Err(Error::NoSuch { what: "frame", index: 2, count: 2 })));
}

#[test]
fn an_image_belongs_to_its_simulator() {
    let (one, other) = (Simulator::new(&plain()).unwrap(), Simulator::new(&plain()).unwrap());
    let image = one.station(0).unwrap();
    assert!(one.frame(&image, 0, 1).is_ok());
    assert_eq!(other.frame(&image, 0, 1).unwrap_err(), Error::ForeignImage);
}

#[test]
fn a_description_survives_writing_and_reading() {
    for name in ["room", "room_small", "wall", "corner_multipath"] {
        let spec = common::fixture(name);
        assert_eq!(SimulationSpec::from_ron(&ron::to_string(&spec).unwrap()).unwrap(), spec);
    }
}

#[test]
fn the_smallest_images_are_simulated() {
    for (width, height) in [(1, 1), (1, 7), (7, 1)] {
        let mut spec = plain();
        (spec.camera.geometry.format.width, spec.camera.geometry.format.height) = (width, height);
        let frame = simulate_frame(&spec, 1, 0, 0).unwrap();
        assert_eq!((frame.raw.width(), frame.raw.height()), (width, height));
    }
}
