//! Colours on a cloud: of two walls of known pattern, the nearer of which hides a part of the other.

use std::fs::{create_dir_all, read, read_to_string, write};
use std::path::{Path, PathBuf};

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use commands::{Failure, Judged, Silent, Verdict};
use error_models::{AmplitudeScale, ModelSet, RangeErrorModel, RangeNoise};
use nalgebra::{Isometry3, Point3, Vector3};
use png::{BitDepth, ColorType, Encoder};
use range_image::{RangeFrame, Raster};
use range_io::calibration::Calibration;
use range_io::npz::NpzWriter;
use rig_tasks::{ColourRequest, Unseen, colour, colour_points, read_mountings};

/// Fields of the patterns, metre, and their colours: of the wall, and of the board before it.
const FIELD_M: f64 = 0.1;
const COLOURS: [[f64; 3]; 4] = [[200.0, 40.0, 40.0], [40.0, 200.0, 40.0], [40.0, 40.0, 200.0], [230.0, 230.0, 40.0]];
/// The rig stands 2 m before the wall, and the board hangs 0.6 m before it.
const DISTANCE_M: f64 = 2.0;
const BOARD_M: [f64; 3] = [0.27, 0.22, 0.6];
const NOISE_M: f64 = 0.003;

fn cameras() -> [Camera; 2] {
    let camera = |format: ImageFormat, c: f64, k1: f64| {
        let interior = InteriorOrientation { principal_point_mm: [0.03, -0.02], principal_distance_mm: c };
        Camera::new(format, interior, LensDistortion { k1, ..LensDistortion::default() }).unwrap()
    };
    let [range, colour] = [(176, 144, 0.04), (640, 512, 0.01)].map(|(w, h, pitch)| ImageFormat::new(w, h, [pitch; 2]));
    [camera(range.unwrap(), 8.0, -1.5e-3), camera(colour.unwrap(), 6.0, -2e-3)]
}

fn mounting() -> Isometry3<f64> {
    pose_from_euler(Vector3::new(0.12, 0.03, -0.01), [0.5, -1.5, 1.0].map(f64::to_radians))
}

/// What a ray of the rig's frame meets: how far, where on the pattern, and the number of its colour.
fn hit(origin: &Point3<f64>, ray: &Vector3<f64>) -> Option<(f64, Point3<f64>, usize)> {
    let at = |depth: f64| {
        let length = (-depth - origin.z) / ray.z;
        (length > 0.0).then(|| (length, origin + ray * length))
    };
    let field =
        |point: &Point3<f64>| ((point.x / FIELD_M).floor() + (point.y / FIELD_M).floor()).rem_euclid(2.0) as usize;
    let board = at(DISTANCE_M - BOARD_M[2]).filter(|(_, p)| p.x.abs() < BOARD_M[0] && p.y.abs() < BOARD_M[1]);
    match board {
        Some((length, point)) => Some((length, point, 2 + field(&point))),
        None => at(DISTANCE_M).map(|(length, point)| (length, point, field(&point))),
    }
}

/// Ranges with noise, each the mean over its pixel; at rims they lie between board and wall.
fn ranges(camera: &Camera) -> Raster<f32> {
    let mut state = 12_345_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(u32::MAX >> 1)
    };
    Raster::from_fn(camera.format.width, camera.format.height, |col, row| {
        let normal: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let parts = mean(col, row, |pixel| hit(&Point3::origin(), &camera.ray(pixel)).map(|(range, ..)| [range; 3]));
        (parts[0] + NOISE_M * normal) as f32
    })
}

/// Mean of what is seen over a pixel.
fn mean(col: usize, row: usize, seen: impl Fn([f64; 2]) -> Option<[f64; 3]>) -> [f64; 3] {
    let steps = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
    let places = steps.iter().flat_map(|dy| steps.iter().map(move |dx| [col as f64 + dx, row as f64 + dy]));
    let values: Vec<[f64; 3]> = places.filter_map(seen).collect();
    [0, 1, 2].map(|k| values.iter().map(|value| value[k]).sum::<f64>() / values.len() as f64)
}

fn image(camera: &Camera) -> [Raster<f32>; 3] {
    let pose = mounting();
    let seen = |pixel: [f64; 2]| {
        let ray = pose * camera.ray(pixel);
        hit(&pose.translation.vector.into(), &ray).map(|(.., colour)| COLOURS[colour])
    };
    let pixels = Raster::from_fn(camera.format.width, camera.format.height, |col, row| mean(col, row, seen));
    [0, 1, 2].map(|k| pixels.map(|pixel| pixel[k].round() as f32))
}

/// The number of the nearest colour.
fn nearest(colour: [f32; 3]) -> usize {
    let off = |k: usize| (0..3).map(|i| (f64::from(colour[i]) - COLOURS[k][i]).powi(2)).sum::<f64>();
    (0..4).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap()
}

#[test]
fn colours_are_right_to_the_pixel_and_hidden_points_have_none() {
    let [range, grey] = cameras();
    let frame =
        RangeFrame { sigma: Raster::filled(176, 144, NOISE_M as f32), ..RangeFrame::from_range(ranges(&range)) };
    let painted = colour_points(&frame, &range, &image(&grey), &grey, &mounting());
    let eye = Point3::from(mounting().translation.vector);
    let (mut coloured, mut wrong, mut wrong_inside, mut hidden, mut hidden_coloured, mut seen_uncoloured) =
        (0, 0, 0, 0, 0, 0);
    for (index, colour) in painted.colours.iter().enumerate() {
        let pixel = [(index % 176) as f64, (index / 176) as f64];
        let Some((true_range, point, truth)) = hit(&Point3::origin(), &range.ray(pixel)) else { continue };
        // A pixel over a rim has a range between both walls: its point is none of the scene.
        if (f64::from(frame.range.as_slice()[index]) - true_range).abs() > 6.0 * NOISE_M {
            continue;
        }
        let to = point - eye;
        let is_hidden = hit(&eye, &to.normalize()).is_some_and(|(length, ..)| length < to.norm() - 0.05);
        hidden += usize::from(is_hidden);
        match colour {
            Ok(colour) => {
                coloured += 1;
                hidden_coloured += usize::from(is_hidden);
                // The pixel of the other camera is that wide on the pattern.
                let width = 1.2 * to.norm() * 0.01 / 6.0;
                let to_line = |value: f64| (value / FIELD_M - (value / FIELD_M).round()).abs() * FIELD_M;
                let inside = to_line(point.x).min(to_line(point.y)) > width;
                wrong += usize::from(nearest(*colour) != truth);
                wrong_inside += usize::from(inside && nearest(*colour) != truth);
            }
            Err(Unseen::Hidden) => seen_uncoloured += usize::from(!is_hidden),
            Err(_) => {}
        }
    }
    println!(
        "{coloured} coloured, {wrong} with another's colour, {wrong_inside} of them over a pixel from an edge; of {hidden} hidden \
         {hidden_coloured} coloured; {seen_uncoloured} seen without a colour"
    );
    assert!(coloured > 15_000 && hidden > 300, "{coloured} {hidden}");
    assert_eq!((wrong_inside, hidden_coloured), (0, 0));
    assert!(wrong < coloured / 50 && seen_uncoloured < coloured / 25, "{wrong} {seen_uncoloured}");
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        let rig = folder.rig();
        let cameras = cameras();
        for ((name, camera), level) in ["range", "colour"].into_iter().zip(&cameras).zip(["range", "intensity"]) {
            create_dir_all(rig.join(name)).unwrap();
            let format = camera.format;
            let ([x, y], c) = (format.pixel_pitch_mm, camera.interior.principal_distance_mm);
            let (modulation, file) = if level == "range" { ("19986163.9", "E0.npz") } else { ("", "E0.png") };
            let survey = format!(
                "(camera: (width: {}, height: {}, pixel_pitch_mm: ({x}, {y}), principal_distance_mm: {c}, principal_point_mm: \
                 (0.0, 0.0), modulation_hz: [{modulation}], phase_steps: 4), level: {level}, frames: [(file: \"{file}\", station: \
                 \"E0\", timestamp_s: 3.0, integration_time_s: 0.002)])",
                format.width, format.height,
            );
            write(rig.join(name).join("survey.ron"), survey).unwrap();
            let model = RangeErrorModel::error_free(7.5);
            let entries = if level == "range" { vec![(0.002, vec![model])] } else { Vec::new() };
            let mut calibration = Calibration::from_models(camera, &ModelSet { entries }, None).unwrap();
            if level == "range" {
                let noise = RangeNoise {
                    sigma_times_amplitude_m: 0.0,
                    floor_m: NOISE_M,
                    amplitude_scale: AmplitudeScale::default(),
                    shared: None,
                };
                calibration.range_noise = Some(noise);
            }
            calibration.write(rig.join(name).join("calibration.ron")).unwrap();
        }
        let mut file = NpzWriter::create(rig.join("range/E0.npz")).unwrap();
        file.add("range", &[144, 176], ranges(&cameras[0]).as_slice()).unwrap();
        file.add("amplitude", &[144, 176], &vec![1000.0_f32; 176 * 144]).unwrap();
        file.commit().unwrap();
        write_png(&rig.join("colour/E0.png"), &image(&cameras[1]));
        write(rig.join("rig.ron"), "(cameras: [(name: \"range\"), (name: \"colour\")])").unwrap();
        let pose = mounting();
        let [x, y, z]: [f64; 3] = pose.translation.vector.into();
        let [omega, phi, kappa] = camera_model::euler_from_pose(&pose).map(f64::to_degrees);
        let table = format!(
            "camera,x,y,z,omega,phi,kappa,sigma_x,sigma_y,sigma_z,sigma_omega,sigma_phi,sigma_kappa\nrange,0,0,0,0,0,0,,,,,,\n\
             colour,{x},{y},{z},{omega},{phi},{kappa},0.001,0.001,0.001,0.01,0.01,0.01\n"
        );
        write(rig.join("mountings.csv"), table).unwrap();
        folder
    }

    fn rig(&self) -> PathBuf {
        self.0.path().join("rig")
    }

    fn request(&self) -> ColourRequest {
        ColourRequest {
            rig: self.rig(),
            epoch: "E0".to_owned(),
            calibration: None,
            from: None,
            by: None,
            out: self.0.path().join("out"),
        }
    }
}

fn write_png(path: &Path, image: &[Raster<f32>; 3]) {
    let [red, green, blue] = image;
    let mut encoder = Encoder::new(std::fs::File::create(path).unwrap(), red.width() as u32, red.height() as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    let planes = red.as_slice().iter().zip(green.as_slice()).zip(blue.as_slice());
    let bytes: Vec<u8> = planes.flat_map(|((r, g), b)| [*r as u8, *g as u8, *b as u8]).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

#[test]
fn a_rig_colours_the_cloud_of_an_epoch() {
    let folder = Folder::new();
    let summary = colour(&folder.request(), &Silent).unwrap();
    assert_eq!(summary.verdict(), Verdict::Done, "{summary}");
    assert!(summary.coloured > 15_000 && summary.hidden > 300, "{summary}");
    assert_eq!((summary.from.as_str(), summary.by.as_str()), ("range", "colour"));
    let mounted = read_mountings(folder.rig().join("mountings.csv")).unwrap();
    assert!((mounted[1].1.inverse() * mounting()).translation.vector.norm() < 1e-9);
    let out = folder.request().out;
    let bytes = read(out.join("cloud.ply")).unwrap();
    let end = bytes.windows(11).position(|part| part == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    assert!(header.contains("property uchar red\nproperty uchar green\nproperty uchar blue"), "{header}");
    // x, y, z, intensity and sigma of four bytes, flags of two, colours of three.
    let points: Vec<&[u8]> = bytes[end..].chunks_exact(25).collect();
    assert_eq!(points.len(), summary.coloured);
    let single = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap()));
    let of_board = |point: &&&[u8]| single(&point[8..12]) > -1.5;
    let is_blue_or_yellow = |point: &&&[u8]| nearest([22, 23, 24].map(|k| f32::from(point[k]))) >= 2;
    let board: Vec<&&[u8]> = points.iter().filter(of_board).collect();
    let right = board.iter().filter(|point| is_blue_or_yellow(point)).count();
    assert!(board.len() > 2000 && right * 100 >= board.len() * 98, "{right} of {}", board.len());
    assert!(out.join("uncoloured.ply").is_file());
    let json = read_to_string(out.join("summary.json")).unwrap();
    assert!(json.contains("\"hidden\"") && summary.to_string().contains("points with a colour"));
    exposures_of_other_moments_and_slips_are_told(&folder);
}

fn exposures_of_other_moments_and_slips_are_told(folder: &Folder) {
    let survey = folder.rig().join("colour/survey.ron");
    let text = read_to_string(&survey).unwrap();
    write(&survey, text.replace("timestamp_s: 3.0", "timestamp_s: 3.5")).unwrap();
    let late = colour(&folder.request(), &Silent).unwrap();
    assert!(late.verdict() == Verdict::Doubtful && late.doubts[0].words.contains("0.500 s apart"), "{late}");
    write(&survey, text).unwrap();
    let request = folder.request();
    for (request, words) in [
        (ColourRequest { epoch: "E7".to_owned(), ..request.clone() }, "no frame of station `E7`"),
        (ColourRequest { by: Some("range".to_owned()), ..request.clone() }, "none of images alone"),
        (ColourRequest { from: Some("left".to_owned()), ..request.clone() }, "no camera `left`"),
        (ColourRequest { calibration: Some(folder.rig().join("colour")), ..request.clone() }, "mountings.csv"),
    ] {
        let error = colour(&request, &Silent).unwrap_err();
        assert!(error.failure() == Failure::Usage && error.to_string().contains(words), "{words}: {error}");
    }
    // A camera that looks the other way sees none of it.
    let table = folder.rig().join("mountings.csv");
    let turned =
        read_to_string(&table).unwrap().replace("\ncolour,", "\ncolour,0,0,0,0,180,0,0.1,0.1,0.1,0.1,0.1,0.1\nother,");
    write(&table, turned).unwrap();
    assert_eq!(colour(&request, &Silent).unwrap_err().failure(), Failure::Refused);
    write(&table, "camera,x\ncolour,1\n").unwrap();
    assert!(colour(&request, &Silent).unwrap_err().to_string().contains("line 2"));
}
