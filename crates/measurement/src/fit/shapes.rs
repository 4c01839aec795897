//! Fitted shapes as their users know them.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::robust::robust;
use super::support::Support;
use super::surface::Shape;
use crate::{Cloud, Direction, FitOptions, Place, Quantity, Result, Unit as UnitOfValue};

/// A plane fitted to points of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedPlane {
    /// Its point in the middle of the points.
    pub point: Point3<f64>,
    /// Unit normal; which of the two sides it points to means nothing.
    pub normal: Unit<Vector3<f64>>,
    /// The points.
    pub support: Support,
    frame: Matrix3<f64>,
}

/// A sphere fitted to points of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedSphere {
    /// Its centre.
    pub centre: Point3<f64>,
    /// Its radius, metre.
    pub radius_m: f64,
    /// The points.
    pub support: Support,
}

/// A circular cylinder fitted to points of a cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedCylinder {
    /// Point of its axis beside the middle of the points.
    pub point: Point3<f64>,
    /// Direction of its axis; which of the two ways it points means nothing.
    pub axis: Unit<Vector3<f64>>,
    /// Its radius, metre.
    pub radius_m: f64,
    /// The points.
    pub support: Support,
    frame: Matrix3<f64>,
}

/// Fits a plane to points of a cloud, robustly: weighted by what each point has for itself across the surface, without points of
/// something else.
///
/// # Errors
/// [`Error::TooFewPoints`](crate::Error::TooFewPoints), [`Error::Collinear`](crate::Error::Collinear),
/// [`Error::NotThatShape`](crate::Error::NotThatShape).
pub fn fit_plane(cloud: &Cloud<'_>, points: &[usize], options: &FitOptions) -> Result<FittedPlane> {
    let fit = robust(cloud, points, Shape::Plane, options)?;
    let support = Support::new(&fit, options.doubt_level);
    let normal = Unit::new_normalize(fit.surface.axis());
    Ok(FittedPlane { point: fit.surface.base.into(), normal, support, frame: fit.surface.frame })
}

/// Fits a sphere to points of a cloud, as [`fit_plane`] does a plane.
///
/// # Errors
/// [`Error::TooFewPoints`](crate::Error::TooFewPoints), [`Error::NotDetermined`](crate::Error::NotDetermined),
/// [`Error::NotThatShape`](crate::Error::NotThatShape).
pub fn fit_sphere(cloud: &Cloud<'_>, points: &[usize], options: &FitOptions) -> Result<FittedSphere> {
    let fit = robust(cloud, points, Shape::Sphere, options)?;
    let support = Support::new(&fit, options.doubt_level);
    Ok(FittedSphere { centre: fit.surface.base.into(), radius_m: fit.surface.radius, support })
}

/// Fits a circular cylinder to points of a cloud, as [`fit_plane`] does a plane.
///
/// # Errors
/// Those of [`fit_sphere`].
pub fn fit_cylinder(cloud: &Cloud<'_>, points: &[usize], options: &FitOptions) -> Result<FittedCylinder> {
    let fit = robust(cloud, points, Shape::Cylinder, options)?;
    let support = Support::new(&fit, options.doubt_level);
    let (surface, axis) = (&fit.surface, Unit::new_normalize(fit.surface.axis()));
    Ok(FittedCylinder { point: surface.base.into(), axis, radius_m: surface.radius, support, frame: surface.frame })
}

impl FittedPlane {
    /// The normal with its derivatives.
    pub fn direction(&self) -> Direction {
        tilted(&self.frame, &self.support)
    }

    /// Derivatives by the parameters of a shift of the plane along a line: `along` tells how far the normal's tilt moves it.
    pub(crate) fn by_tilt(&self, tilt: &Vector3<f64>, shift: f64) -> [f64; 5] {
        [self.frame.column(0).dot(tilt), self.frame.column(1).dot(tilt), shift, 0.0, 0.0]
    }

    /// Two directions in the plane.
    pub(crate) fn axes(&self) -> [Vector3<f64>; 2] {
        [0, 1].map(|at| self.frame.column(at).into_owned())
    }
}

impl FittedSphere {
    /// The centre with its derivatives.
    pub fn place(&self) -> Place {
        let gradients = [0, 1, 2].map(|axis| {
            let mut weights = [0.0; 5];
            weights[axis] = 1.0;
            self.support.gradient(&weights)
        });
        Place { position: self.centre, gradients }
    }

    /// The radius.
    pub fn radius(&self) -> Quantity {
        radius(Shape::Sphere, self.radius_m, &self.support)
    }

    /// The diameter.
    pub fn diameter(&self) -> Quantity {
        self.radius().times(2.0)
    }
}

impl FittedCylinder {
    /// The axis with its derivatives.
    pub fn direction(&self) -> Direction {
        tilted(&self.frame, &self.support)
    }

    /// The radius.
    pub fn radius(&self) -> Quantity {
        radius(Shape::Cylinder, self.radius_m, &self.support)
    }

    /// The diameter.
    pub fn diameter(&self) -> Quantity {
        self.radius().times(2.0)
    }

    /// Derivatives by the parameters of the position of the axis along a direction, `along_m` from its point.
    pub(crate) fn by_place(&self, direction: &Vector3<f64>, along_m: f64) -> [f64; 5] {
        let [x, y] = [self.frame.column(0).dot(direction), self.frame.column(1).dot(direction)];
        [along_m * x, along_m * y, x, y, 0.0]
    }
}

fn radius(shape: Shape, value: f64, support: &Support) -> Quantity {
    Quantity::new(value, UnitOfValue::Metre, support.gradient(&shape.radius_at()))
}

fn tilted(frame: &Matrix3<f64>, support: &Support) -> Direction {
    let gradient = |at: usize| {
        let mut weights = [0.0; 5];
        weights[at] = 1.0;
        support.gradient(&weights)
    };
    Direction {
        vector: Unit::new_normalize(frame.column(2).into_owned()),
        tilts: [0, 1].map(|at| (frame.column(at).into_owned(), gradient(at))).to_vec(),
    }
}
