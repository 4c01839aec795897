//! Colour maps, by interpolation between a few anchors.

/// A map from 0..1 to colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark to bright, equal steps look equal (after viridis).
    Sequential,
    /// Blue over white to red, for signed values.
    Diverging,
    /// Black to white.
    Grey,
}

/// Where there is no value.
pub const NO_VALUE: [u8; 3] = [222, 222, 222];

const SEQUENTIAL: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];
const DIVERGING: [[u8; 3]; 7] =
    [[33, 60, 130], [67, 120, 190], [160, 200, 225], [247, 247, 247], [245, 190, 150], [214, 96, 77], [140, 20, 40]];
const GREY: [[u8; 3]; 2] = [[0, 0, 0], [255, 255, 255]];

impl ColourMap {
    /// The colour at `t`, clamped to 0..1; not a number gives [`NO_VALUE`].
    pub fn colour(self, t: f64) -> [u8; 3] {
        if t.is_nan() {
            return NO_VALUE;
        }
        let anchors: &[[u8; 3]] = match self {
            Self::Sequential => &SEQUENTIAL,
            Self::Diverging => &DIVERGING,
            Self::Grey => &GREY,
        };
        let position = t.clamp(0.0, 1.0) * (anchors.len() - 1) as f64;
        let below = (position as usize).min(anchors.len() - 2);
        let share = position - below as f64;
        let mix = |k: usize| {
            let (a, b) = (f64::from(anchors[below][k]), f64::from(anchors[below + 1][k]));
            (a + share * (b - a)).round() as u8
        };
        [mix(0), mix(1), mix(2)]
    }
}

/// Distinct colours for stations and curves.
pub const CATEGORIES: [[u8; 3]; 10] = [
    [31, 119, 180],
    [255, 127, 14],
    [44, 160, 44],
    [214, 39, 40],
    [148, 103, 189],
    [140, 86, 75],
    [227, 119, 194],
    [110, 110, 110],
    [188, 189, 34],
    [23, 190, 207],
];

/// `#rrggbb`.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_gaps_of_a_map() {
        assert_eq!(ColourMap::Sequential.colour(0.0), SEQUENTIAL[0]);
        assert_eq!(ColourMap::Sequential.colour(7.0), SEQUENTIAL[8]);
        assert_eq!(ColourMap::Diverging.colour(0.5), [247, 247, 247]);
        assert_eq!(ColourMap::Grey.colour(f64::NAN), NO_VALUE);
    }
}
