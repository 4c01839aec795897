//! Small sound files of each kind, written by code.

use std::path::Path;

use range_image::Raster;
use range_io::clouds::{CloudFile, Precision, write_any_cloud};
use range_io::npz::NpzWriter;

use super::mutate::{CRC_32, crc};
use super::recorded;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// The sound files of a target; `folder` is a place to write them.
pub fn of(target: &str, folder: &Path) -> Outcome<Vec<Vec<u8>>> {
    let texts: &[&str] = match target {
        "survey" => &[SURVEY, SURVEY_OF_TABLES],
        "calibration" => &[CALIBRATION],
        "pipeline" => &[PIPELINE],
        "network" => &[include_str!("../../../../fixtures/networks/joint.ron"), NETWORK],
        "scene" => &[
            include_str!("../../../../fixtures/scenes/wall.ron"),
            include_str!("../../../../fixtures/scenes/room_small.ron"),
        ],
        "azure" => &[AZURE],
        "observations" => &[OBSERVATIONS],
        "stations" => &["station,x,y,z,omega,phi,kappa\nS1,0,0,1,0,0,0\nS2,1,0,1.5,10,-20,30.5\n"],
        "targets" => &["target,x,y,z,sigma_x,sigma_y,sigma_z\nT1,0,0,1,,,\nT2,1,2,3,0.001,0.001,0.002\n"],
        "distances" => &["from,to,distance,sigma_distance\nT1,T2,1.25,0.0005\nS1,T1,2,0.001\n"],
        "planes" => &["plane,station,nx,ny,nz,d\nP1,S1,0,0,1,2.5\nP2,S1,,,,\n"],
        "imu" => {
            &["timestamp_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n0,0,0,0,0,0,9.81\n0.01,0.1,0,0,0,0,9.8\n"]
        }
        "residuals" => &[RESIDUALS],
        "trajectory" => &[
            "# tum\n0 0 0 0 0 0 0 1\n0.5 1 2 3 0 0 0.6 0.8\n",
            "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 1 1 0 0 2 0 0 1 3\n",
            "#timestamp,x\n1000,0,0,0,1,0,0,0\n2000,1,2,3,1,0,0,0,0,0,0,0,0,0,0,0,0\n",
            "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n",
        ],
        "sequence" => &["# depth maps\n1305031102.16 depth/1.png\n1305031102.2 depth/2.png\n"],
        "xyz" => &["# x y z intensity\n1 2 3 4\n5.5,6,7,8\n", "1 2 3\n4 5 6\n", "x;y;z;nx;ny;nz\n1;2;3;0;0;1\n"],
        _ => &[],
    };
    let mut seeds: Vec<Vec<u8>> = texts.iter().map(|text| text.as_bytes().to_vec()).collect();
    match target {
        "ply" => seeds.extend([ply_of_text().into_bytes(), cloud(folder, "ply")?]),
        "pcd" => seeds.extend([PCD.as_bytes().to_vec(), cloud(folder, "pcd")?, compressed_pcd()]),
        "e57" => seeds.extend([cloud(folder, "e57")?]),
        "vtk" => seeds.extend([VTK.as_bytes().to_vec(), binary_vtk()]),
        "cloud" => seeds.extend([ply_of_text().into_bytes(), cloud(folder, "pcd")?, VTK.as_bytes().to_vec()]),
        "npz" => seeds.extend([npz(folder)?, stored("range.npy", &npy())]),
        "npy" => seeds.push(npy()),
        "png" => {
            let file = folder.join("seed.png");
            range_io::png16::write(&file, &Raster::from_fn(4, 3, |col, row| (1000 * (col + row)) as u16))?;
            seeds.push(std::fs::read(file)?);
        }
        "mkv" => seeds.push(recording()),
        "recording_mcap" => seeds.push(recorded::mcap::recording()),
        "recording_bag" => seeds.extend([recorded::bag::recording("none"), recorded::bag::recording("lz4")]),
        "recording_kinect" => seeds.push(recorded::mkv::recording()),
        "recording_adi" => seeds.extend([recorded::adi::bin(), recorded::adi::adcam(2, 2)]),
        _ => {}
    }
    Ok(seeds)
}

fn cloud(folder: &Path, ending: &str) -> Outcome<Vec<u8>> {
    let cloud = CloudFile {
        points: (0..12).map(|i| [f64::from(i), 0.5 * f64::from(i), -1.0]).collect(),
        intensity: Some((0..12_u8).map(f32::from).collect()),
        flags: Some((0..12).collect()),
        frame: Some((0..12).collect()),
        normals: Some(vec![[0.0, 0.0, 1.0]; 12]),
        size: Some([4, 3]),
        ..CloudFile::default()
    };
    let file = folder.join("seed").with_extension(ending);
    write_any_cloud(&file, &cloud, Precision::Single)?;
    Ok(std::fs::read(file)?)
}

fn ply_of_text() -> String {
    "ply\nformat ascii 1.0\nobj_info num_cols 2\nobj_info num_rows 1\nelement camera 1\nproperty float view_px\n\
     property float view_py\nelement vertex 2\nproperty float x\nproperty float y\nproperty double z\n\
     property uchar intensity\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
     0 0\n1 2 3 4\n5 6 7 8\n3 0 1 0\n"
        .to_owned()
}

const PCD: &str = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n\
    WIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3 4\n5 6 7 8\n";

/// Two points, packed as one literal run.
fn compressed_pcd() -> Vec<u8> {
    let mut bytes = PCD.replace("DATA ascii\n1 2 3 4\n5 6 7 8\n", "DATA binary_compressed\n").into_bytes();
    let values: Vec<u8> = (0..8_u8).flat_map(|value| f32::from(value).to_le_bytes()).collect();
    bytes.extend((values.len() as u32 + 1).to_le_bytes());
    bytes.extend((values.len() as u32).to_le_bytes());
    bytes.push(31);
    bytes.extend(values);
    bytes
}

const VTK: &str = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3\n4 5 6\n\
    VERTICES 2 4\n1 0\n1 1\nPOINT_DATA 2\nNORMALS n float\n0 0 1\n0 0 1\nSCALARS intensity float 1\n\
    LOOKUP_TABLE default\n7\n8\nFIELD FieldData 1\nsigma 1 2 double\n0.1 0.2\n";

fn binary_vtk() -> Vec<u8> {
    let mut bytes =
        b"# vtk DataFile Version 3.0\ntitle\nBINARY\nDATASET STRUCTURED_GRID\nDIMENSIONS 1 2 1\nPOINTS 2 float\n"
            .to_vec();
    bytes.extend((1..7_u8).flat_map(|value| f32::from(value).to_be_bytes()));
    bytes.extend(b"\nPOINT_DATA 2\nSCALARS intensity double\nLOOKUP_TABLE default\n");
    bytes.extend((7..9_u8).flat_map(|value| f64::from(value).to_be_bytes()));
    bytes
}

/// All arrays that a frame of 4 x 3 pixels can have, deflated.
fn npz(folder: &Path) -> Outcome<Vec<u8>> {
    let file = folder.join("seed.npz");
    let ramp: Vec<f32> = (0..48_u8).map(f32::from).collect();
    let mut writer = NpzWriter::create(&file)?;
    writer.add("samples", &[1, 4, 3, 4], &ramp)?;
    writer.add("phase", &[1, 3, 4], &ramp[..12])?;
    writer.add("amplitude", &[1, 3, 4], &ramp[..12])?;
    writer.add("intensity", &[3, 4], &ramp[..12])?;
    writer.add("range", &[3, 4], &ramp[..12])?;
    writer.add("depth", &[3, 4], &[7_u16; 12])?;
    writer.add("wraps", &[1, 3, 4], &[0_i32; 12])?;
    writer.add("mixed", &[3, 4], &[0_u8; 12])?;
    writer.commit()?;
    Ok(std::fs::read(file)?)
}

/// A bare array.
fn npy() -> Vec<u8> {
    let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }";
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{text:<117}\n").bytes());
    bytes.extend((0..12_u8).flat_map(|value| f32::from(value).to_le_bytes()));
    bytes
}

/// An archive whose one member is stored as it is.
fn stored(name: &str, data: &[u8]) -> Vec<u8> {
    let (length, crc) = ((data.len() as u32).to_le_bytes(), crc(data, CRC_32).to_le_bytes());
    let sizes = [crc, length, length].concat();
    let names = [(name.len() as u16).to_le_bytes(), [0; 2]].concat();
    let common = [&[20, 0, 0, 0, 0, 0, 0, 0, 0, 0], sizes.as_slice(), &names].concat();
    let member = [b"PK\x03\x04", common.as_slice(), name.as_bytes(), data].concat();
    let entry = [b"PK\x01\x02\x14\x00", common.as_slice(), &[0; 14], name.as_bytes()].concat();
    let places = [(entry.len() as u32).to_le_bytes(), (member.len() as u32).to_le_bytes()].concat();
    let end = [b"PK\x05\x06", [0, 0, 0, 0, 1, 0, 1, 0].as_slice(), &places, &[0; 2]].concat();
    [member, entry, end].concat()
}

/// An element of a Matroska file.
fn element(id: u32, data: &[u8]) -> Vec<u8> {
    let mut element = id.to_be_bytes()[(id.leading_zeros() / 8) as usize..].to_vec();
    element.extend((data.len() as u32 | 0x1000_0000).to_be_bytes());
    element.extend(data);
    element
}

fn track(number: u8, name: &str) -> Vec<u8> {
    let mut private = vec![0_u8; 40];
    private[16..20].copy_from_slice(b"b16g");
    let parts = [
        element(0xD7, &[number]),
        element(0x86, b"V_MS/VFW/FOURCC"),
        element(0x536E, name.as_bytes()),
        element(0x63A2, &private),
        element(0xE0, &[element(0xB0, &[4]), element(0xBA, &[3])].concat()),
    ];
    element(0xAE, &parts.concat())
}

fn block(number: u8, time: i16) -> Vec<u8> {
    let mut data = vec![0x80 | number];
    data.extend(time.to_be_bytes());
    data.push(0x80);
    data.extend([3; 24]);
    data
}

fn recording() -> Vec<u8> {
    let group = element(0xA0, &element(0xA1, &block(1, 5)));
    let cluster =
        [element(0xE7, &[3, 0xE8]), group, element(0xA3, &block(2, 5)), element(0xA3, &block(1, -1))].concat();
    let attached = [element(0x466E, b"calibration.json"), element(0x465C, b"{}")].concat();
    let segment = [
        element(0x1549_A966, &element(0x2A_D7B1, &[0x0F, 0x42, 0x40])),
        element(0x1654_AE6B, &[track(1, "DEPTH"), track(2, "IR")].concat()),
        element(0x1941_A469, &element(0x61A7, &attached)),
        element(0x1F43_B675, &cluster),
    ];
    [element(0x1A45_DFA3, &[0; 4]), element(0x1853_8067, &segment.concat())].concat()
}

const SURVEY: &str = "#![enable(implicit_some)]
(
    camera: (width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0,
        principal_point_mm: (0.0, 0.0), modulation_hz: [20e6, 30e6], phase_steps: 4, phase_sense: Negative,
        phase_offset_rad: 0.1, saturation: 65535.0, raw_scale: 1.0),
    level: samples,
    frames: [
        (file: \"frames/000_0.npz\", station: \"S00\", timestamp_s: 0.0, integration_time_s: 0.002, temperature_c: 31.5),
        (file: \"frames/001_0.npz\", station: \"S01\", timestamp_s: 1.0),
    ],
    power_on_s: -10.0, frame_rates: [(since_s: -10, rate_hz: 0.5), (since_s: 3600, rate_hz: 10)],
    reference_path: (columns: (170, 175), rows: (0, 5), length_m: 0.75),
    truth: (stations: \"truth/stations.csv\", calibration: \"truth/calibration.ron\", frames: []),
    extras: {\"imu\": \"imu.csv\"},
)
";

const SURVEY_OF_TABLES: &str = "(camera: (width: 640, height: 480, pixel_pitch_mm: (0.01, 0.01),
    principal_distance_mm: 5.25, principal_point_mm: (0.0, 0.0)), level: depth, /* stored */ frames: [],
    depth: (scale_m: 0.001, invalid: [0, 65535]))";

const CALIBRATION: &str = "#![enable(implicit_some)]
(
    format_version: 2,
    camera: (width: 4, height: 3, pixel_pitch_mm: (0.04, 0.04)),
    parameters: [
        (name: \"xp\", value: 0.1, sigma: 0.001, unit: \"mm\", status: Estimated),
        (name: \"yp\", value: -0.2, sigma: 0.001, unit: \"mm\", status: Estimated),
        (name: \"c\", value: 8.1, sigma: 0.002, unit: \"mm\", status: Estimated),
    ],
    range_models: [(integration_time_s: 0.004, modulation_hz: 20e6, parameters: [
        (name: \"d0\", value: 0.024, sigma: 0.001, unit: \"m\", status: Estimated),
    ], range_span_m: (0.5, 7.0))],
    noise: (shot_variance_per_unit: 0.25, dark_sigma: 4.0),
    scattering: Gaussians([(weight: 0.05, sigma_px: (4, 4))]),
    fixed_pattern: (width: 4, height: 3, offset_m: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, NaN]),
    warm_up: (model: (transients: [(amplitude_m: -0.03, time_constant_s: 600)], time_span_s: (10, 6000)),
        deviations: [0.0004, 12]),
    correlation: (names: [\"xp\", \"c\"], matrix: [[1, 0.5], [0.5, 1]]),
    span: (range_m: (0.5, 7.0), temperature_c: (20, 40)),
    provenance: (survey: \"room\", method: \"one-step\", redundancy: 100, sigma0: 1.01),
)
";

const PIPELINE: &str = "(
    name: \"room\",
    source: Simulate(scene: \"../scenes/room.ron\", seed: 1, gross_error_share: 0.01),
    calibrate: (network: \"../networks/room.ron\", terms: [\"c\", \"d0\"]),
    stages: [Demodulate(low_amplitude: 40, noise: (shot_variance_per_unit: 0.25, dark_sigma: 4)), Average(), Deconvolve(),
        Unwrap(maximum_range_m: 12), CorrectRange(warm_up: leave), CorrectImagePoint(), FuseExposures(floor_m: 0.005),
        PointCloud(sigma_pixel: (0.1, 0.1)), Flag(maximum_sigma_m: 0.05, mixed_pixels: (treatment: split)),
        Register(start: order, minimum_overlap: 0.3), Adjust()],
)
";

const NETWORK: &str = "(
    seed: 7,
    camera: (width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0,
             principal_point_mm: (0.0, 0.0), modulation_hz: [20e6]),
    truth: {\"xp\": 0.06, \"c\": 8.02, \"d0\": 0.024},
    field: (columns: 9, rows: 7, spacing_m: 0.3, relief_m: 0.25),
    targets: [(name: \"A\", position_m: (0.0, 0.0, 0.5), sigma_m: (0.001, 0.001, 0.001))],
    stations: [(name: \"S01\", distance_m: 2.0, aside_deg: 30, above_deg: 0, roll_deg: 90, integration_time_s: 0.004)],
    distances: [(\"T001\", \"T009\", 0.0005)],
    sightings: (sigma_pixel: 0.05, sigma_range_m: 0.01, gross_error_share: 0.002, amplitude_at_1_m: 2000),
)
";

const OBSERVATIONS: &str = "station,target,col,row,range,sigma_col,sigma_row,sigma_range,amplitude,integration_time_s\n\
    S1,T1,10.5,20.25,2.125,0.05,0.05,0.01,1200,0.004\nS1,T2,11,12,,0.05,0.05,,,\nS2,\"T 1\",,,3.5,,,0.01,800,\n";

const RESIDUALS: &str = "station,target,component,observed,sigma,residual,redundancy_number,standardised_residual,\
    smallest_detectable,verdict\nS1,T1,col,10.5,0.05,0.01,0.8,0.2,0.3,used\nS1,T1,range,2.1,0.01,,,,,left_out\n";

const AZURE: &str = "{\"CalibrationInformation\": {\"Cameras\": [{\"Location\": \"CALIBRATION_CameraLocationD0\",
    \"Intrinsics\": {\"ModelType\": \"CALIBRATION_LensDistortionModelBrownConrady\", \"ModelParameters\":
    [0.51, 0.52, 0.49, 0.49, 0.5, 0.1, 0.01, 0.8, 0.2, -0.01, 0, 0, 2e-5, -7e-5]}, \"MetricRadius\": 1.74}]}}";
