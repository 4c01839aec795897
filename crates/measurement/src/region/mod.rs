//! Regions of space that select points.

mod part;

use nalgebra::{Point3, Vector3};

use crate::{Error, Result};
pub(crate) use part::{Part, across};

/// A part of space, world axes, metre.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum Region {
    /// A box along the world axes.
    Box {
        /// Smallest coordinates.
        from_m: [f64; 3],
        /// Largest coordinates.
        to_m: [f64; 3],
    },
    /// A box in any attitude.
    OrientedBox {
        /// Its middle.
        centre_m: [f64; 3],
        /// Lengths of its edges.
        size_m: [f64; 3],
        /// Direction of the first edge.
        first: [f64; 3],
        /// Direction of the second edge; what it has along the first does not count.
        second: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Its centre.
        centre_m: [f64; 3],
        /// Its radius.
        radius_m: f64,
    },
    /// A cylinder with two ends.
    Cylinder {
        /// One end of its axis.
        from_m: [f64; 3],
        /// The other end.
        to_m: [f64; 3],
        /// Its radius.
        radius_m: f64,
    },
    /// A prism over a polygon.
    Prism {
        /// The polygon's corners one after the other; the prism's base is the plane through them.
        corners_m: Vec<[f64; 3]>,
        /// How far the prism reaches to either side of the base: against its normal and along it. The normal points to who sees the
        /// corners counter-clockwise.
        reach_m: [f64; 2],
    },
    /// What several half-spaces have in common.
    HalfSpaces(Vec<HalfSpace>),
    /// All that is in any of several regions.
    Union(Vec<Region>),
}

/// All points on one side of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct HalfSpace {
    /// A point of the plane.
    pub point_m: [f64; 3],
    /// Normal of the plane, into the half-space.
    pub inward: [f64; 3],
}

impl Region {
    /// Indices of the points in it, in their order.
    ///
    /// # Errors
    /// [`Error::Region`], [`Error::OutOfDomain`] where it encloses nothing.
    ///
    /// ```
    /// use measurement::Region;
    /// use measurement::nalgebra::Point3;
    ///
    /// let region = Region::Sphere { centre_m: [0.0, 0.0, 1.0], radius_m: 0.5 };
    /// let points = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.1, 0.0, 1.2)];
    /// assert_eq!(region.select(&points)?, [1]);
    /// # Ok::<(), measurement::Error>(())
    /// ```
    pub fn select(&self, points: &[Point3<f64>]) -> Result<Vec<usize>> {
        let parts = self.parts()?;
        let inside = |point: &Point3<f64>| parts.iter().any(|part| part.contains(point));
        Ok(points.iter().enumerate().filter(|(_, point)| inside(point)).map(|(index, _)| index).collect())
    }

    /// The region as a union of simple parts.
    pub(crate) fn parts(&self) -> Result<Vec<Part>> {
        let part = match self {
            Self::Union(regions) if regions.is_empty() => {
                return Err(Error::Region("a union needs at least one region".to_owned()));
            }
            Self::Union(regions) => {
                let parts: Result<Vec<Vec<Part>>> = regions.iter().map(Self::parts).collect();
                return Ok(parts?.concat());
            }
            Self::Box { from_m, to_m } => along_axes(vector(from_m, "from_m")?, vector(to_m, "to_m")?)?,
            Self::OrientedBox { centre_m, size_m, first, second } => {
                let [x, y] = [direction(first, "first")?, direction(second, "second")?];
                let across = y - x * x.dot(&y);
                if across.norm() < SMALLEST_ANGLE_RAD {
                    return Err(Error::Region("`first` and `second` of a box have one direction".to_owned()));
                }
                let y = across.normalize();
                let half = vector(size_m, "size_m")? * 0.5;
                for value in half.iter() {
                    positive("size_m", 2.0 * value)?;
                }
                Part::of_box(vector(centre_m, "centre_m")?, [x, y, x.cross(&y)], half)
            }
            Self::Sphere { centre_m, radius_m } => {
                Part::of_sphere(vector(centre_m, "centre_m")?, positive("radius_m", *radius_m)?)
            }
            Self::Cylinder { from_m, to_m, radius_m } => {
                let [from, to] = [vector(from_m, "from_m")?, vector(to_m, "to_m")?];
                positive("length of a cylinder's axis", (to - from).norm())?;
                Part::of_cylinder(from, to, positive("radius_m", *radius_m)?)
            }
            Self::Prism { corners_m, reach_m } => prism(corners_m, *reach_m)?,
            Self::HalfSpaces(spaces) => {
                if spaces.is_empty() {
                    return Err(Error::Region("half-spaces are needed, none is given".to_owned()));
                }
                let space = |space: &HalfSpace| {
                    let inward = direction(&space.inward, "inward")?;
                    Ok((inward, inward.dot(&vector(&space.point_m, "point_m")?)))
                };
                Part::of_half_spaces(spaces.iter().map(space).collect::<Result<_>>()?)
            }
        };
        Ok(vec![part])
    }
}

/// Sine of the smallest angle between two edges, and least area of a polygon over its circumference squared: below it rounding of
/// coordinates of kilometres would choose the direction.
const SMALLEST_ANGLE_RAD: f64 = 1e-6;

fn along_axes(from: Vector3<f64>, to: Vector3<f64>) -> Result<Part> {
    for value in (to - from).iter() {
        positive("to_m - from_m", *value)?;
    }
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    Ok(Part::of_box((from + to) * 0.5, axes, (to - from) * 0.5))
}

fn prism(corners_m: &[[f64; 3]], reach_m: [f64; 2]) -> Result<Part> {
    if corners_m.len() < 3 {
        return Err(Error::Region(format!("a polygon has at least three corners, found {}", corners_m.len())));
    }
    let corners = corners_m.iter().map(|corner| vector(corner, "corners_m")).collect::<Result<Vec<_>>>()?;
    for reach in reach_m {
        if !(reach >= 0.0 && reach.is_finite()) {
            return Err(Error::OutOfDomain {
                name: "reach_m",
                value: reach,
                expected: "a finite length, not negative",
            });
        }
    }
    positive("sum of reach_m", reach_m[0] + reach_m[1])?;
    let next = |at: usize| corners[(at + 1) % corners.len()];
    let area: Vector3<f64> =
        (0..corners.len()).map(|at| (corners[at] - corners[0]).cross(&(next(at) - corners[0]))).sum();
    let around: f64 = (0..corners.len()).map(|at| (next(at) - corners[at]).norm()).sum();
    if area.norm() <= SMALLEST_ANGLE_RAD * around * around {
        return Err(Error::Region("the corners of a polygon lie on a line".to_owned()));
    }
    Ok(Part::of_prism(&corners, area.normalize(), reach_m))
}

fn vector(values: &[f64; 3], name: &'static str) -> Result<Vector3<f64>> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(Error::OutOfDomain { name, value: *value, expected: "a finite coordinate" }),
        None => Ok(Vector3::from(*values)),
    }
}

fn direction(values: &[f64; 3], name: &'static str) -> Result<Vector3<f64>> {
    let found = vector(values, name)?;
    found.try_normalize(f64::MIN_POSITIVE).ok_or(Error::OutOfDomain { name, value: 0.0, expected: "a direction" })
}

fn positive(name: &'static str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::OutOfDomain { name, value, expected: "a length is positive and finite" })
}
