//! A ray table against the one in a Kinect v2's factory calibration; skips where the real captures are not at hand.

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/kinect2_factory_tables");
const SIZE: [usize; 2] = [512, 424];

/// The camera in units in which a pixel is 1/365 mm. Lens and interior orientation are the least-squares fit of these
/// six numbers to every fourth pixel of the table of cosines; the table of x factors took no part in it.
fn kinect() -> Camera {
    let format = ImageFormat::new(SIZE[0], SIZE[1], [1.0 / 365.0, 1.0 / 365.0]).unwrap();
    let interior = InteriorOrientation {
        principal_point_mm: format.image_from_pixel([254.665_831, 211.325_101]),
        principal_distance_mm: 368.285_564 / 365.0,
    };
    let lens = LensDistortion { k1: 0.051_732_6, k2: -0.106_760_6, k3: -0.099_919_2, ..LensDistortion::default() };
    Camera::new(format, interior, lens).unwrap()
}

fn table(name: &str) -> Option<Vec<f64>> {
    let bytes = std::fs::read(format!("{FOLDER}/{name}")).ok()?;
    Some(bytes.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect())
}

#[test]
fn rays_are_those_of_the_factory_table() {
    let (Some(cosines), Some(tangents)) = (table("zTable.bin"), table("xTable.bin")) else {
        println!("skipped: {FOLDER} is not there");
        return;
    };
    let rays = RayTable::new(&kinect()).unwrap();
    assert_eq!(cosines.len(), rays.directions().len());
    let largest = cosines.iter().copied().fold(0.0, f64::max);
    let (mut sum, mut worst_cosine, mut worst_tangent) = (0.0, 0.0_f64, 0.0_f64);
    for ((ray, &cosine), tangent) in rays.directions().iter().zip(&cosines).zip(&tangents) {
        // Pixel (118, 10) is empty in the factory's file.
        if cosine == 0.0 {
            continue;
        }
        let difference = -ray[2] - cosine / largest;
        sum += difference * difference;
        worst_cosine = worst_cosine.max(difference.abs());
        // The x table holds 8192 times the tangent, x to the right.
        worst_tangent = worst_tangent.max((ray[0] / -ray[2] - tangent / 8192.0).abs());
    }
    let rms = (sum / cosines.len() as f64).sqrt();
    println!("cosine: rms {rms:.1e}, worst {worst_cosine:.1e}; tangent in x: worst {worst_tangent:.1e}");
    // The factory's polynomial is another one: what is left is 0.04 per mille rms of the cosine, and half a
    // pixel (1/365) of the tangent in the outermost corner.
    assert!(rms < 5e-5 && worst_cosine < 1e-3 && worst_tangent < 1.0 / 365.0);
}
