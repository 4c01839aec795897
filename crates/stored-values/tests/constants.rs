//! Values that are none.

use range_image::Raster;
use stored_values::repeated_values;

/// A wall in whole millimetres.
fn wall() -> Raster<f32> {
    Raster::from_fn(160, 120, |col, row| (2000.0 + 3.0 * col as f32 + (row % 7) as f32).floor())
}

#[test]
fn a_code_is_told_from_a_surface() {
    assert_eq!(repeated_values(&wall()), []);
    assert_eq!(repeated_values(&Raster::filled(160, 120, 1500.0)), []);
    for code in [65_535.0, 7_500.0, 1.0, -1.0] {
        let mut frame = wall();
        for (index, value) in frame.as_mut_slice().iter_mut().enumerate() {
            if (index * 7919) % 101 == 0 {
                *value = code;
            }
        }
        let found = repeated_values(&frame);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!((found[0].value, found[0].near), (code, 0));
    }
}

#[test]
fn nothing_and_steps_of_a_quantised_depth_are_no_codes() {
    for value in [0.0, f32::NAN, f32::INFINITY] {
        assert_eq!(repeated_values(&Raster::filled(160, 120, value)), []);
    }
    // Steps of 2 % between neighbours, as of disparities.
    let steps = Raster::from_fn(160, 120, |col, _| 1000.0 * 1.02_f32.powi((col / 4) as i32));
    assert_eq!(repeated_values(&steps), []);
}

#[test]
fn a_code_that_went_through_a_product_is_one_still() {
    let frame = Raster::from_fn(160, 120, |col, row| {
        let factor = 1.0 + 0.3 * (col as f32 / 160.0).powi(2);
        let value = if (col + row) % 9 == 0 { 65.535 } else { 2.0 + 0.01 * col as f32 };
        (value * factor) / factor
    });
    let pixels: usize =
        repeated_values(&frame).iter().filter(|found| found.value > 60.0).map(|found| found.pixels).sum();
    assert!(pixels > 2000, "{pixels}");
}
