//! A wall as it is stored by a camera that states depths: `cargo run -p stored-values --example wall`.

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable};
use range_image::Raster;
use stored_values::{UnitWitness, bendings, judge_kind, judge_unit, repeated_values};

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let format = ImageFormat::new(176, 144, [0.04, 0.04])?;
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 5.0 };
    let rays = RayTable::new(&Camera::new(format, interior, LensDistortion::default())?)?;
    // Whole millimetres; where there is no light, the file has 65535.
    let stored = Raster::from_fn(176, 144, |col, row| {
        let ripple = (1.7 * col as f32 + 23.1 * (row as f32).sin()).sin();
        if (col + 3 * row) % 97 == 0 { 65_535.0 } else { (2500.0 + 4.0 * ripple).round() }
    });
    for code in repeated_values(&stored) {
        println!("{} at {} pixels is no distance", code.value, code.pixels);
    }
    let kind = judge_kind(&bendings(&stored, &rays)?);
    println!("{kind:?}");
    let witness = UnitWitness { median: 2500.0, highest: 2504.0, noise: Some(3.0) };
    let units = judge_unit(&witness, None, &[1.0, 1e-3, 1e-4]);
    println!("metre {:.3}, millimetre {:.3}, tenth of a millimetre {:.3}", units[0], units[1], units[2]);
    Ok(())
}
