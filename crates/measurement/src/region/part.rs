//! What lies between planes, within a round surface, and over a polygon, all at once.

use nalgebra::{Point3, Vector3};

/// Sine of the angle below which a line goes along a prism: rounding of a unit vector.
const PARALLEL: f64 = 1e-12;

/// A direction with the least and the largest coordinate along it.
type Slab = (Vector3<f64>, f64, f64);

/// A sphere, or a cylinder with an axis.
#[derive(Debug, Clone, PartialEq)]
struct Round {
    centre: Vector3<f64>,
    axis: Option<Vector3<f64>>,
    radius: f64,
}

/// A polygon in a plane: two directions and the corners' coordinates along them.
#[derive(Debug, Clone, PartialEq)]
struct Polygon {
    axes: [Vector3<f64>; 2],
    corners: Vec<[f64; 2]>,
}

/// The points that meet all of a few conditions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Part {
    slabs: Vec<Slab>,
    round: Option<Round>,
    polygon: Option<Polygon>,
    /// Points whose surroundings of this radius enclose it; none where it has no end.
    hull: Vec<Vector3<f64>>,
    margin: f64,
}

impl Part {
    pub(crate) fn of_box(centre: Vector3<f64>, axes: [Vector3<f64>; 3], half: Vector3<f64>) -> Self {
        let slab = |at: usize| (axes[at], axes[at].dot(&centre) - half[at], axes[at].dot(&centre) + half[at]);
        let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 1 { half[axis] } else { -half[axis] };
        let corner =
            |corner| centre + axes[0] * sign(corner, 0) + axes[1] * sign(corner, 1) + axes[2] * sign(corner, 2);
        Self {
            slabs: (0..3).map(slab).collect(),
            round: None,
            polygon: None,
            hull: (0..8).map(corner).collect(),
            margin: 0.0,
        }
    }

    pub(crate) fn of_sphere(centre: Vector3<f64>, radius: f64) -> Self {
        let round = Some(Round { centre, axis: None, radius });
        Self { slabs: Vec::new(), round, polygon: None, hull: vec![centre], margin: radius }
    }

    pub(crate) fn of_cylinder(from: Vector3<f64>, to: Vector3<f64>, radius: f64) -> Self {
        let axis = (to - from).normalize();
        let round = Some(Round { centre: from, axis: Some(axis), radius });
        let slabs = vec![(axis, axis.dot(&from), axis.dot(&to))];
        Self { slabs, round, polygon: None, hull: vec![from, to], margin: radius }
    }

    pub(crate) fn of_prism(corners: &[Vector3<f64>], normal: Vector3<f64>, reach: [f64; 2]) -> Self {
        let middle = corners.iter().sum::<Vector3<f64>>() / corners.len() as f64;
        let axes = across(&normal);
        let flat = corners.iter().map(|corner| [axes[0].dot(corner), axes[1].dot(corner)]).collect();
        let height = normal.dot(&middle);
        let ends = corners.iter().flat_map(|corner| {
            let foot = corner + normal * (height - normal.dot(corner));
            [foot - normal * reach[0], foot + normal * reach[1]]
        });
        Self {
            slabs: vec![(normal, height - reach[0], height + reach[1])],
            round: None,
            polygon: Some(Polygon { axes, corners: flat }),
            hull: ends.collect(),
            margin: 0.0,
        }
    }

    pub(crate) fn of_half_spaces(spaces: Vec<(Vector3<f64>, f64)>) -> Self {
        let slabs = spaces.into_iter().map(|(inward, from)| (inward, from, f64::INFINITY)).collect();
        Self { slabs, round: None, polygon: None, hull: Vec::new(), margin: 0.0 }
    }

    pub(crate) fn contains(&self, point: &Point3<f64>) -> bool {
        let point = &point.coords;
        self.slabs.iter().all(|(along, low, high)| (*low..=*high).contains(&along.dot(point)))
            && self.round.as_ref().is_none_or(|round| round.offset(point).norm() <= round.radius)
            && self.polygon.as_ref().is_none_or(|polygon| polygon.contains(polygon.flat(point)))
    }

    /// Whether a line runs through it.
    pub(crate) fn meets(&self, point: &Vector3<f64>, along: &Vector3<f64>) -> bool {
        let mut span = Some([f64::NEG_INFINITY, f64::INFINITY]);
        for (direction, low, high) in &self.slabs {
            span = span.and_then(|span| between(span, direction.dot(point), direction.dot(along), [*low, *high]));
        }
        if let Some(round) = &self.round {
            span = span.and_then(|span| round.clip(span, point, along));
        }
        match (span, &self.polygon) {
            (None, _) => false,
            (Some(_), None) => true,
            (Some(span), Some(polygon)) => polygon.meets(span, point, along),
        }
    }

    /// Least and largest coordinates along a direction; `None` where it has no end.
    pub(crate) fn extent(&self, along: &Vector3<f64>) -> Option<[f64; 2]> {
        let all = self.hull.iter().map(|point| along.dot(point));
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        (low <= high).then_some([low - self.margin, high + self.margin])
    }
}

/// Two directions across a unit vector and each other.
pub(crate) fn across(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = normal.iamin();
    let first = normal.cross(&Vector3::ith(least, 1.0)).normalize();
    [first, normal.cross(&first)]
}

/// Part of a span on a line where `at + t slope` is within limits.
fn between([from, to]: [f64; 2], at: f64, slope: f64, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    if slope == 0.0 {
        return (low..=high).contains(&at).then_some([from, to]);
    }
    let ends = [(low - at) / slope, (high - at) / slope];
    let clipped = [from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1]))];
    (clipped[0] <= clipped[1]).then_some(clipped)
}

impl Round {
    /// From the centre or the axis.
    fn offset(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.without_axis(point - self.centre)
    }

    fn without_axis(&self, vector: Vector3<f64>) -> Vector3<f64> {
        self.axis.map_or(vector, |axis| vector - axis * axis.dot(&vector))
    }

    fn clip(&self, [from, to]: [f64; 2], point: &Vector3<f64>, along: &Vector3<f64>) -> Option<[f64; 2]> {
        let (offset, slope) = (self.offset(point), self.without_axis(*along));
        let (square, half) = (slope.norm_squared(), offset.dot(&slope));
        let inside = self.radius * self.radius - offset.norm_squared();
        if square < f64::EPSILON * f64::EPSILON {
            return (inside >= 0.0).then_some([from, to]);
        }
        let root = (half * half + square * inside).sqrt();
        let clipped = [from.max((-half - root) / square), to.min((-half + root) / square)];
        // A root of a negative number is NaN, and nothing is above it.
        (root >= 0.0 && clipped[0] <= clipped[1]).then_some(clipped)
    }
}

impl Polygon {
    fn flat(&self, point: &Vector3<f64>) -> [f64; 2] {
        self.axes.map(|axis| axis.dot(point))
    }

    fn edges(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        let count = self.corners.len();
        (0..count).map(move |at| (self.corners[at], self.corners[(at + 1) % count]))
    }

    /// By the number of edges that a ray crosses.
    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let crossed = self.edges().filter(|(from, to)| {
            (from[1] > y) != (to[1] > y) && x < from[0] + (y - from[1]) / (to[1] - from[1]) * (to[0] - from[0])
        });
        crossed.count() % 2 == 1
    }

    /// Whether a part of a line is over it: tested in the middle between any two crossings of edges.
    fn meets(&self, [from, to]: [f64; 2], point: &Vector3<f64>, along: &Vector3<f64>) -> bool {
        let (start, slope) = (self.flat(point), self.flat(along));
        if slope[0].hypot(slope[1]) < PARALLEL {
            return self.contains(start);
        }
        let mut places: Vec<f64> = [from, to].into_iter().filter(|place| place.is_finite()).collect();
        for (first, second) in self.edges() {
            let edge = [second[0] - first[0], second[1] - first[1]];
            let way = [first[0] - start[0], first[1] - start[1]];
            let place = (way[0] * edge[1] - way[1] * edge[0]) / (slope[0] * edge[1] - slope[1] * edge[0]);
            if place > from && place < to {
                places.push(place);
            }
        }
        places.sort_by(f64::total_cmp);
        places.windows(2).any(|pair| {
            let middle = f64::midpoint(pair[0], pair[1]);
            self.contains([start[0] + slope[0] * middle, start[1] + slope[1] * middle])
        })
    }
}
