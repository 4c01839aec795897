//! Surfaces with the parameters of their adjustment, which are small steps from the present surface:
//! - plane: two tilts, shift along the normal;
//! - sphere: centre, radius;
//! - cylinder: two tilts of the axis, two shifts across it, radius.

use std::fmt;

use nalgebra::{Matrix3, Vector3};

/// Which shape a region shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A plane.
    Plane,
    /// A sphere, seen from outside or from within.
    Sphere,
    /// A circular cylinder, seen from outside or from within.
    Cylinder,
}

impl Shape {
    /// Number of parameters.
    pub fn parameters(self) -> usize {
        match self {
            Self::Plane => 3,
            Self::Sphere => 4,
            Self::Cylinder => 5,
        }
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
        })
    }
}

/// Values by parameter; those beyond a shape's number are zero.
pub(crate) type Parameters = [f64; 5];

/// A surface: a point of it (the centre, a point of the axis), a frame whose third column is normal or axis, a radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Surface {
    pub(crate) shape: Shape,
    pub(crate) base: Vector3<f64>,
    pub(crate) frame: Matrix3<f64>,
    pub(crate) radius: f64,
}

/// Distance of a point from a surface, outward normal there, derivatives of the distance by the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beside {
    pub(crate) distance: f64,
    pub(crate) normal: Vector3<f64>,
    pub(crate) by: Parameters,
}

impl Surface {
    pub(crate) fn axis(&self) -> Vector3<f64> {
        self.frame.column(2).into_owned()
    }

    fn across(&self, at: usize) -> Vector3<f64> {
        self.frame.column(at).into_owned()
    }

    /// From the centre, the axis or along the normal.
    fn offset(&self, vector: Vector3<f64>) -> Vector3<f64> {
        match self.shape {
            Shape::Plane => self.axis() * self.axis().dot(&vector),
            Shape::Sphere => vector,
            Shape::Cylinder => vector - self.axis() * self.axis().dot(&vector),
        }
    }

    pub(crate) fn beside(&self, point: &Vector3<f64>) -> Beside {
        let way = point - self.base;
        let [first, second] = [self.across(0), self.across(1)];
        if self.shape == Shape::Plane {
            let normal = self.axis();
            let by = [first.dot(&way), second.dot(&way), -1.0, 0.0, 0.0];
            return Beside { distance: normal.dot(&way), normal, by };
        }
        let offset = self.offset(way);
        let length = offset.norm();
        let n = offset / length;
        let by = if self.shape == Shape::Sphere {
            [-n.x, -n.y, -n.z, -1.0, 0.0]
        } else {
            let (along, x, y) = (self.axis().dot(&way), n.dot(&first), n.dot(&second));
            [-along * x, -along * y, -x, -y, -1.0]
        };
        Beside { distance: length - self.radius, normal: n, by }
    }

    /// Way along a unit direction from a point to the nearest place where it meets the surface, and the way from there to where
    /// it meets it again, which a plane never does.
    pub(crate) fn way(&self, point: &Vector3<f64>, along: &Vector3<f64>) -> Option<(f64, f64)> {
        let (offset, slope) = (self.offset(point - self.base), self.offset(*along));
        let (square, half) = (slope.norm_squared(), offset.dot(&slope));
        if self.shape == Shape::Plane {
            let way = -half / square;
            return way.is_finite().then_some((way, f64::INFINITY));
        }
        let root = (half * half - square * (offset.norm_squared() - self.radius * self.radius)).sqrt();
        // The nearer of the two, without the difference of nearly equal numbers.
        let way = (self.radius * self.radius - offset.norm_squared()) / (half + root.copysign(half));
        (root > 0.0 && way.is_finite()).then_some((way, 2.0 * root / square))
    }

    /// The surface a small step away.
    pub(crate) fn moved(&self, step: &Parameters) -> Self {
        let mut moved = *self;
        let [first, second] = [self.across(0), self.across(1)];
        match self.shape {
            Shape::Plane => {
                moved.base += self.axis() * step[2];
                moved.frame = turned(&self.frame, self.axis() + first * step[0] + second * step[1]);
            }
            Shape::Sphere => {
                moved.base += Vector3::new(step[0], step[1], step[2]);
                moved.radius += step[3];
            }
            Shape::Cylinder => {
                moved.base += first * step[2] + second * step[3];
                moved.frame = turned(&self.frame, self.axis() + first * step[0] + second * step[1]);
                moved.radius += step[4];
            }
        }
        moved
    }

    /// The same surface with its base beside a point: tilts then turn it there.
    pub(crate) fn based_at(&self, point: &Vector3<f64>) -> Self {
        let way = point - self.base;
        let base = match self.shape {
            Shape::Plane => point - self.offset(way),
            Shape::Sphere => self.base,
            Shape::Cylinder => self.base + self.axis() * self.axis().dot(&way),
        };
        Self { base, ..*self }
    }
}

/// A frame whose third column has this direction, and whose first is as near to the old one as it can be.
fn turned(frame: &Matrix3<f64>, third: Vector3<f64>) -> Matrix3<f64> {
    let third = third.normalize();
    let first = frame.column(0) - third * third.dot(&frame.column(0));
    let first = first.normalize();
    Matrix3::from_columns(&[first, third.cross(&first), third])
}

/// Sum of derivatives by parameters times weights.
pub(crate) fn combined(by: &Parameters, weights: &Parameters) -> f64 {
    by.iter().zip(weights).map(|(by, weight)| by * weight).sum()
}
