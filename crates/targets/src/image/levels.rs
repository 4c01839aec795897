//! Dark and bright of an image, and where its values end.

use range_image::Raster;

/// Share of the pixels that may be darker than dark or brighter than bright: bad pixels, a lamp.
const TAIL: f64 = 0.05;

/// Levels of an image, in the unit of its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Levels {
    /// A twentieth of the values lie below.
    pub(crate) dark: f64,
    /// A twentieth of the values lie above.
    pub(crate) bright: f64,
    /// The value at which brighter pixels end, if the sensor saturates in this image.
    pub(crate) plateau: Option<f64>,
    /// Share of the pixels with a value that lie on the plateau.
    pub(crate) saturated: f64,
}

impl Levels {
    /// The levels of the finite values; `None` where there are none. `noise` is the deviation of the noise.
    pub(crate) fn of(image: &Raster<f32>, noise: f64) -> Option<Self> {
        let mut finite: Vec<f32> = image.as_slice().iter().copied().filter(|value| value.is_finite()).collect();
        if finite.is_empty() {
            return None;
        }
        let largest = finite.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        // Without a plateau, values thin out towards the largest: fewer there than in the two deviations below.
        let below = f64::from(largest) - 2.0 * noise.max(0.0);
        let on_it = finite.iter().filter(|value| **value >= largest).count();
        let near = finite.iter().filter(|value| **value < largest && f64::from(**value) >= below).count();
        let saturated = on_it as f64 / finite.len() as f64;
        let is_plateau = on_it > 8 && on_it > near;
        let dark = f64::from(statistics::ranked(&mut finite, TAIL));
        let bright = f64::from(statistics::ranked(&mut finite, 1.0 - TAIL));
        let plateau = is_plateau.then_some(f64::from(largest));
        Some(Self { dark, bright, plateau, saturated: if is_plateau { saturated } else { 0.0 } })
    }

    /// Bright less dark.
    pub(crate) fn contrast(&self) -> f64 {
        self.bright - self.dark
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp)]
    use super::*;

    #[test]
    fn a_clipped_slope_has_a_plateau_and_another_has_none() {
        let slope = |limit: f32| Raster::from_fn(100, 100, |col, row| (col as f32 + 0.01 * row as f32).min(limit));
        let clipped = Levels::of(&slope(80.0), 0.1).unwrap();
        assert_eq!(clipped.plateau, Some(80.0));
        assert!((clipped.saturated - 0.2).abs() < 0.01);
        let free = Levels::of(&slope(1e3), 0.1).unwrap();
        assert_eq!((free.plateau, free.saturated), (None, 0.0));
        assert!((free.contrast() - 90.0).abs() < 2.0);
    }

    #[test]
    fn nothing_has_no_levels() {
        assert_eq!(Levels::of(&Raster::filled(3, 3, f32::NAN), 1.0), None);
        assert_eq!(Levels::of(&Raster::filled(0, 0, 1.0), f64::NAN), None);
    }
}
