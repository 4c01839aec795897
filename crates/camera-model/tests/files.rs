//! Cameras in RON files.
#![cfg(feature = "serde")]

use crate::common::plain_camera;
use camera_model::{Camera, LensDistortion};

#[test]
fn a_camera_is_read_as_it_was_written() {
    let camera = plain_camera();
    let text = ron::to_string(&camera).unwrap();
    assert_eq!(ron::from_str::<Camera>(&text).unwrap(), camera);
}

#[test]
fn what_is_left_out_of_a_lens_is_zero_and_what_is_unknown_is_refused() {
    let lens = ron::from_str::<LensDistortion>("(k1: -0.002)").unwrap();
    assert_eq!(lens, LensDistortion { k1: -0.002, ..LensDistortion::default() });
    assert!(ron::from_str::<LensDistortion>("(k4: 0.1)").is_err());
}
