//! Terms that the camera has and nobody asks for.

use self_calibration::{CauseKind, Network};

use super::pick::ranges;
use super::{Expected, Fault};

pub fn all() -> Vec<Fault> {
    let fault = |name, without, spoil| Fault { without, ..Fault::new(name, spoil) };
    vec![
        fault(
            "only c and d0 asked for",
            &["xp", "yp", "k1", "k2", "p1", "p2", "d4", "d5", "d6", "d7", "e1", "e2"],
            |_, _| missing(&["k1"]),
        ),
        fault("no lens terms", &["k1", "k2", "p1", "p2"], |_, _| missing(&["k1"])),
        fault("no radial lens terms", &["k1", "k2"], |_, _| missing(&["k1"])),
        fault("no k2", &["k2"], |_, _| missing(&["k2"])),
        fault("no decentring lens terms", &["p1", "p2"], |network: &mut Network, _| {
            // A lens that is farther off centre: 0.2 pixels in the corners.
            let format = network.camera.format;
            for seen in &mut network.sightings {
                let pixel = seen.pixel.unwrap();
                let [x, y] = format.image_from_pixel(pixel);
                let p1 = 3e-4;
                let moved = [x + p1 * (3.0 * x * x + y * y), y + 2.0 * p1 * x * y];
                seen.pixel = Some(format.pixel_from_image(moved)).filter(|_| moved[0].abs() < 3.5);
            }
            network.sightings.retain(|seen| seen.pixel.is_some());
            missing(&["p1", "p2"])
        }),
        fault("no offset of the ranges", &["d0"], |network: &mut Network, _| {
            ranges(network, |range| range + 0.06);
            missing(&["d0"])
        }),
        fault("no waves of the ranges", &["d4", "d5", "d6", "d7"], |_, _| missing(&["d6", "d7"])),
        fault("no waves of length U/4", &["d6", "d7"], |_, _| missing(&["d6", "d7"])),
        fault("no tilt of the ranges", &["e1", "e2"], |_, _| missing(&["e1", "e2"])),
        fault("a lens with affinity", &[], |network: &mut Network, _| {
            // Columns stretched by 0.3 % about the middle of the image.
            for seen in &mut network.sightings {
                seen.pixel = seen.pixel.map(|[col, row]| [87.5 + (col - 87.5) * 0.997, row]);
            }
            missing(&["b1", "b2"])
        }),
    ]
}

fn missing(names: &[&str]) -> Expected {
    Expected::Told(vec![CauseKind::MissingTerms], names.iter().map(ToString::to_string).collect())
}
