//! From the centres of ellipses to those of the dots, through the perspective in which the whole grid is seen.

use nalgebra::{Point3, Vector2};
use statistics::upper_median;

use crate::circles::ellipse::Ellipse;
use crate::grid::homography::Homography;
use crate::sightings::measured_point::NodePoint;

/// Moves each node from the centre of its ellipse to the image of its dot's centre, for a grid whose nodes lie at `node_m`.
///
/// The map of the board onto the image takes circles to ellipses: what lies between the centre of such an ellipse and the
/// image of the circle's centre is taken off. Their radius is what the sizes of the ellipses say; the dot at node (0, 0) may
/// have another, `origin` times that of the others. A lens bends this by its own change over a dot, which is left out: a
/// hundredth of a correction that is some tenths of a pixel. No camera needs to be known.
pub(super) fn to_circle_centres(
    seen: &mut [(NodePoint, Ellipse)],
    node_m: impl Fn([usize; 2]) -> Point3<f64>,
    origin: f64,
) {
    let place = |point: &NodePoint| node_m(point.node).coords.xy();
    let pairs: Vec<_> = seen.iter().map(|(point, _)| (place(point), Vector2::from(point.point.pixel))).collect();
    let Some(map) = Homography::fit(&pairs) else { return };
    let ratio = |point: &NodePoint| if point.node == [0, 0] { origin } else { 1.0 };
    let mut radii: Vec<f64> = seen
        .iter()
        .filter_map(|(point, ellipse)| {
            let [long, short] = ellipse.semi_axes_px;
            Some((long * short / map.area_scale(place(point))?).sqrt() / ratio(point))
        })
        .collect();
    let radius = upper_median(&mut radii);
    for (point, _) in seen {
        let centre = place(point);
        let images = map.map(centre).zip(map.ellipse_centre(centre, radius * ratio(point)));
        if let Some(shift) = images.map(|(circle, ellipse)| circle - ellipse).filter(|shift| shift.norm().is_finite()) {
            for axis in 0..2 {
                point.point.pixel[axis] += shift[axis];
            }
        }
    }
}
