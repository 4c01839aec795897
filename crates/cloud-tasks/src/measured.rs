//! Regions fitted, and lengths between what was found in them.

use std::collections::BTreeMap;

use commands::Result;
use measurement::{
    Base, Cloud, Direction, FitOptions, FittedCylinder, FittedPlane, FittedSphere, Place, PlaneDistance, Quantity,
    Region, Support, VolumeOptions, angle, axis_distance, fit_cylinder, fit_plane, fit_sphere, flatness,
    plane_distance, plane_to_plane, point_distance, volume,
};
use nalgebra::{Point3, Unit, Vector3};
use point_uncertainty::Source;

use crate::plan::{LengthKind, NamedRegion, request};
use crate::result::ResultCloud;
use crate::summary::{FlatnessSummary, LengthSummary, MissingCells, RegionSummary, SigmaWithout};

/// Cells without points that a summary lists: a hole of more is seen by its first ones and its area.
const MOST_MIDDLES: usize = 1000;

/// What was found in a region.
pub(crate) enum Found {
    Plane(FittedPlane),
    Sphere(FittedSphere),
    Cylinder(FittedCylinder),
    Place(Place),
    Surface(Region),
    Direction(Direction),
    KnownPlane { point: Point3<f64>, normal: Unit<Vector3<f64>> },
}

/// All regions with what was found, or why nothing was.
pub(crate) type AllFound = BTreeMap<String, std::result::Result<Found, String>>;

/// A length as it was measured; the gap of two planes for a picture.
pub(crate) struct Measured {
    pub(crate) summary: LengthSummary,
    pub(crate) planes: Option<PlaneDistance>,
    /// Sentence on cells without points.
    pub(crate) doubt: Option<String>,
}

impl Found {
    pub(crate) fn support(&self) -> Option<&Support> {
        match self {
            Self::Plane(plane) => Some(&plane.support),
            Self::Sphere(sphere) => Some(&sphere.support),
            Self::Cylinder(cylinder) => Some(&cylinder.support),
            _ => None,
        }
    }

    fn place(&self) -> Option<Place> {
        match self {
            Self::Sphere(sphere) => Some(sphere.place()),
            Self::Place(place) => Some(place.clone()),
            _ => None,
        }
    }

    fn direction(&self) -> Option<Direction> {
        match self {
            Self::Plane(plane) => Some(plane.direction()),
            Self::Cylinder(cylinder) => Some(cylinder.direction()),
            Self::Direction(direction) => Some(direction.clone()),
            Self::KnownPlane { normal, .. } => Some(Direction::fixed(*normal)),
            _ => None,
        }
    }
}

/// What is in a region without a fit; `None` of regions whose points are fitted.
///
/// # Errors
/// A region that means nothing.
pub(crate) fn known(named: &str, region: &NamedRegion, cloud: &ResultCloud) -> Result<Option<Found>> {
    let slip = |error: measurement::Error| request(format!("region `{named}`: {error}"));
    let unit = |along: &[f64; 3]| {
        let wrong = || request(format!("region `{named}`: {along:?} is no direction"));
        Unit::try_new(Vector3::from(*along), f64::MIN_POSITIVE).filter(|unit| unit.norm().is_finite()).ok_or_else(wrong)
    };
    let place = |at_m: &[f64; 3]| match at_m.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(request(format!("region `{named}`: `at_m` has {value}, expected finite coordinates"))),
        None => Ok(Point3::from(*at_m)),
    };
    Ok(Some(match region {
        NamedRegion::Fixed { at_m } => Found::Place(Place::fixed(place(at_m)?)),
        NamedRegion::Nearest { at_m } => {
            let at = place(at_m)?;
            let square = |point: &&usize| (cloud.points[**point] - at).norm_squared();
            let nearest = cloud.usable.iter().filter(|point| square(point).is_finite());
            let nearest = nearest.min_by(|one, two| square(one).total_cmp(&square(two)));
            let none = || request(format!("region `{named}`: the cloud has no points without flags"));
            Found::Place(Place::of_point(&cloud.cloud(), *nearest.ok_or_else(none)?).map_err(slip)?)
        }
        NamedRegion::Direction { along } => Found::Direction(Direction::fixed(unit(along)?)),
        NamedRegion::KnownPlane { point_m, normal } => {
            Found::KnownPlane { point: place(point_m)?, normal: unit(normal)? }
        }
        NamedRegion::Surface(region) => Found::Surface(region.clone()),
        NamedRegion::Plane(_) | NamedRegion::Sphere(_) | NamedRegion::Cylinder(_) | NamedRegion::Mean(_) => {
            return Ok(None);
        }
    }))
}

/// Points without flag in a region.
pub(crate) fn select(cloud: &ResultCloud, region: &Region) -> std::result::Result<Vec<usize>, measurement::Error> {
    let usable: Vec<Point3<f64>> = cloud.usable.iter().map(|point| cloud.points[*point]).collect();
    Ok(region.select(&usable)?.into_iter().map(|at| cloud.usable[at]).collect())
}

/// What a region shows by its points; only of regions that [`known`] has no answer for.
pub(crate) fn fit(
    region: &NamedRegion,
    cloud: &Cloud<'_>,
    points: &[usize],
    options: &FitOptions,
) -> std::result::Result<Found, measurement::Error> {
    match region {
        NamedRegion::Plane(_) => Ok(Found::Plane(fit_plane(cloud, points, options)?)),
        NamedRegion::Sphere(_) => Ok(Found::Sphere(fit_sphere(cloud, points, options)?)),
        NamedRegion::Cylinder(_) => Ok(Found::Cylinder(fit_cylinder(cloud, points, options)?)),
        _ => Ok(Found::Place(Place::mean(cloud, points)?)),
    }
}

/// The figures of a region.
pub(crate) fn region_summary(kind: &'static str, points: usize, found: &Found) -> RegionSummary {
    let array = |vector: Vector3<f64>| Some(<[f64; 3]>::from(vector));
    let (position_m, direction, radius_m) = match found {
        Found::Plane(plane) => (array(plane.point.coords), array(plane.normal.into_inner()), None),
        Found::Sphere(sphere) => (array(sphere.centre.coords), None, Some(sphere.radius_m)),
        Found::Cylinder(cylinder) => {
            (array(cylinder.point.coords), array(cylinder.axis.into_inner()), Some(cylinder.radius_m))
        }
        Found::Place(place) => (array(place.position.coords), None, None),
        Found::Direction(direction) => (None, array(direction.vector.into_inner()), None),
        Found::KnownPlane { point, normal } => (array(point.coords), array(normal.into_inner()), None),
        Found::Surface(_) => (None, None, None),
    };
    let support = found.support();
    RegionSummary {
        kind,
        points,
        left_out: support.map_or(0, |support| support.left_out.len()),
        unusable: support.map_or(0, |support| support.unusable),
        position_m,
        direction,
        radius_m,
        sigma0: support.map(|support| support.scatter.sigma0),
        probability: support.map(|support| support.scatter.probability),
        refused: None,
    }
}

/// Measures one length.
pub(crate) fn measure_length(name: &str, quantity: &LengthKind, found: &AllFound, cloud: &ResultCloud) -> Measured {
    let mut measured = Measured {
        summary: LengthSummary { name: name.to_owned(), kind: quantity.name(), ..LengthSummary::default() },
        planes: None,
        doubt: None,
    };
    if let Err(reason) = measured.fill(quantity, found, cloud) {
        measured.summary.refused = Some(reason);
    }
    measured
}

impl Measured {
    fn fill(
        &mut self,
        quantity: &LengthKind,
        found: &AllFound,
        cloud: &ResultCloud,
    ) -> std::result::Result<(), String> {
        let mut parts = Vec::new();
        for region in quantity.regions() {
            match found.get(region) {
                Some(Ok(part)) => parts.push(part),
                Some(Err(reason)) => return Err(format!("region `{region}`: {reason}")),
                None => return Err(format!("there is no region `{region}`")),
            }
        }
        let other = || "it cannot be measured between these".to_owned();
        let value = match (quantity, parts.as_slice()) {
            (LengthKind::Flatness { .. }, [Found::Plane(plane)]) => {
                self.flatness(plane);
                return Ok(());
            }
            (LengthKind::Distance { at_m, .. }, [Found::Plane(one), Found::Plane(two)]) => {
                let at = at_m.map(Point3::from);
                let planes = plane_to_plane(&cloud.cloud(), one, two, at).map_err(|error| error.to_string())?;
                self.of_planes(&planes, cloud);
                let distance = planes.distance.clone();
                self.planes = Some(planes);
                distance
            }
            (LengthKind::Distance { .. }, [one, two]) => distance(one, two).ok_or_else(other)?,
            (LengthKind::Angle { .. }, [one, two]) => {
                angle(&one.direction().ok_or_else(other)?, &two.direction().ok_or_else(other)?)
            }
            (LengthKind::Radius { .. }, [Found::Sphere(sphere)]) => sphere.radius(),
            (LengthKind::Radius { .. }, [Found::Cylinder(cylinder)]) => cylinder.radius(),
            (LengthKind::Diameter { .. }, [Found::Sphere(sphere)]) => sphere.diameter(),
            (LengthKind::Diameter { .. }, [Found::Cylinder(cylinder)]) => cylinder.diameter(),
            (LengthKind::Volume { cell_m, .. }, [Found::Surface(region), over]) => {
                self.volume(region, over, *cell_m, cloud)?
            }
            _ => return Err(other()),
        };
        self.estimate(&value, cloud);
        Ok(())
    }

    fn estimate(&mut self, quantity: &Quantity, cloud: &ResultCloud) {
        let cloud = cloud.cloud();
        let all = quantity.estimate(&cloud);
        // Files for people have degrees.
        let (unit, factor) = match all.unit {
            measurement::Unit::Radian => ("deg", 1.0_f64.to_degrees()),
            other => (other.name(), 1.0),
        };
        let summary = &mut self.summary;
        (summary.value, summary.unit, summary.sigma) = (Some(all.value * factor), unit, Some(all.sigma * factor));
        summary.interval = Some(all.interval.map(|end| end * factor));
        let variance = all.shares.variance();
        if variance > 0.0 {
            summary.shares =
                Source::ALL.into_iter().map(|source| (source.name(), all.shares.of(source) / variance)).collect();
        }
        summary.without = Source::ALL
            .into_iter()
            .filter(|source| all.shares.of(*source) != 0.0)
            .map(|source| {
                let rest = quantity.estimate_without(&cloud, source);
                let interval = rest.interval.map(|end| end * factor);
                SigmaWithout { source: source.name(), sigma: rest.sigma * factor, interval }
            })
            .collect();
    }

    fn of_planes(&mut self, planes: &PlaneDistance, cloud: &ResultCloud) {
        let angle = planes.angle.estimate(&cloud.cloud());
        let at = planes.at;
        self.summary.taken_at_m = Some(at.coords.into());
        self.summary.remarks.push(format!(
            "taken at ({:.3}, {:.3}, {:.3}) m along the mean normal; the planes are at {:.3} degrees (95 %: {:.3} to {:.3}), over \
             which the distance changes by up to {:.4} m in the regions",
            at.x,
            at.y,
            at.z,
            angle.value.to_degrees(),
            angle.interval[0].to_degrees(),
            angle.interval[1].to_degrees(),
            planes.change_m
        ));
    }

    fn flatness(&mut self, plane: &FittedPlane) {
        let form = flatness(plane);
        let summary = &mut self.summary;
        (summary.value, summary.unit) = (Some(form.form_m), "m");
        summary.sigma = form.sigma_m.is_finite().then_some(form.sigma_m);
        summary.interval = Some(form.interval_m);
        let [spread_m, noise_m] = [form.spread_m, form.noise_m];
        summary.flatness = Some(FlatnessSummary { spread_m, noise_m, probability: form.probability });
        summary.remarks.push(format!(
            "root mean square form beyond noise; robust spread across the plane {spread_m:.5} m, noise alone gives {noise_m:.5} m"
        ));
    }

    fn volume(
        &mut self,
        region: &Region,
        over: &Found,
        cell_m: f64,
        cloud: &ResultCloud,
    ) -> std::result::Result<Quantity, String> {
        let base = match over {
            Found::Plane(plane) => Base::Fitted(plane),
            Found::KnownPlane { point, normal } => Base::Fixed { point: *point, normal: *normal },
            _ => return Err("a volume needs a plane".to_owned()),
        };
        // Flagged points are no surface: they stand where no region is.
        let mut points = vec![Point3::from([f64::NAN; 3]); cloud.points.len()];
        for point in &cloud.usable {
            points[*point] = cloud.points[*point];
        }
        let usable = Cloud { points: &points, ..cloud.cloud() };
        let found = volume(&usable, region, &base, &VolumeOptions { cell_m }).map_err(|error| error.to_string())?;
        self.summary.remarks.push(format!(
            "over {:.4} m2 in {} cells of {cell_m} m; {:.4} m2 without points",
            found.area_m2,
            found.cells,
            found.missing_m2()
        ));
        self.doubt = found.doubt();
        self.summary.missing = (!found.missing.is_empty()).then(|| MissingCells {
            cells: found.missing.len(),
            area_m2: found.missing_m2(),
            middles_m: found.missing.iter().take(MOST_MIDDLES).map(|cell| cell.middle.coords.into()).collect(),
        });
        Ok(found.volume)
    }
}

/// Of a place from a place, a plane or an axis.
fn distance(one: &Found, two: &Found) -> Option<Quantity> {
    let (place, other) = match (one.place(), two.place()) {
        (Some(one), Some(two)) => return Some(point_distance(&one, &two)),
        (Some(place), None) => (place, two),
        (None, Some(place)) => (place, one),
        (None, None) => return None,
    };
    match other {
        Found::Plane(plane) => Some(plane_distance(&place, plane).magnitude()),
        Found::Cylinder(cylinder) => Some(axis_distance(&place, cylinder)),
        _ => None,
    }
}
