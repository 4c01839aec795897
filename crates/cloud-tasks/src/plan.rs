//! The file of regions and lengths.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use commands::{Error, Result};
use measurement::{FitOptions, Region, VolumeOptions};
use range_io::ron_text;
use serde::Deserialize;

/// Regions with what they show, and lengths between them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasurePlan {
    /// What is measured with, by name.
    pub regions: BTreeMap<String, NamedRegion>,
    /// What is measured.
    pub lengths: Vec<Length>,
    /// Probability that any good point of a region is left out. Default 0.05.
    #[serde(default = "rejection_level")]
    pub rejection_level: f64,
    /// Probability that points which scatter as stated are doubted. Default 0.01.
    #[serde(default = "doubt_level")]
    pub doubt_level: f64,
}

/// What stands in a region, or is known.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum NamedRegion {
    /// A plane.
    Plane(Region),
    /// A sphere.
    Sphere(Region),
    /// A cylinder.
    Cylinder(Region),
    /// The mean of the region's points.
    Mean(Region),
    /// Any surface, for a volume.
    Surface(Region),
    /// The point of the cloud that is nearest to a place.
    Nearest {
        /// The place, metre.
        at_m: [f64; 3],
    },
    /// A place that is known without error.
    Fixed {
        /// The place, metre.
        at_m: [f64; 3],
    },
    /// A direction that is known without error, such as the vertical.
    Direction {
        /// The direction, of any length.
        along: [f64; 3],
    },
    /// A plane that is known without error, for volumes and angles.
    KnownPlane {
        /// A point of it, metre.
        point_m: [f64; 3],
        /// Its normal, of any length, towards what counts positive.
        normal: [f64; 3],
    },
}

/// A length, an angle, a volume.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Length {
    /// Its name in the results.
    pub name: String,
    /// What it is.
    pub quantity: LengthKind,
}

/// What is measured between regions.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum LengthKind {
    /// Distance of two places, of a place from a plane or a cylinder's axis, of two parallel planes.
    Distance {
        /// The one.
        from: String,
        /// The other.
        to: String,
        /// Where the distance of planes is taken, metre. Default: in the middle between their regions.
        #[serde(default)]
        at_m: Option<[f64; 3]>,
    },
    /// Angle between normals, axes and known directions.
    Angle {
        /// The one.
        from: String,
        /// The other.
        to: String,
    },
    /// Radius of a sphere or cylinder.
    Radius {
        /// Which.
        of: String,
    },
    /// Diameter of a sphere or cylinder.
    Diameter {
        /// Which.
        of: String,
    },
    /// Form deviation of a plane beyond noise.
    Flatness {
        /// Which.
        of: String,
    },
    /// Volume between a surface and a plane.
    Volume {
        /// The surface's region.
        of: String,
        /// The plane.
        over: String,
        /// Edge of the grid's cells, metre. Default 0.02.
        #[serde(default = "cell_m")]
        cell_m: f64,
    },
}

fn rejection_level() -> f64 {
    FitOptions::default().rejection_level
}

fn doubt_level() -> f64 {
    FitOptions::default().doubt_level
}

fn cell_m() -> f64 {
    VolumeOptions::default().cell_m
}

impl LengthKind {
    /// `distance`, `angle`, ..
    pub fn name(&self) -> &'static str {
        match self {
            Self::Distance { .. } => "distance",
            Self::Angle { .. } => "angle",
            Self::Radius { .. } => "radius",
            Self::Diameter { .. } => "diameter",
            Self::Flatness { .. } => "flatness",
            Self::Volume { .. } => "volume",
        }
    }

    /// The regions that it needs.
    pub fn regions(&self) -> Vec<&str> {
        match self {
            Self::Distance { from, to, .. } | Self::Angle { from, to } => vec![from, to],
            Self::Radius { of } | Self::Diameter { of } | Self::Flatness { of } => vec![of],
            Self::Volume { of, over, .. } => vec![of, over],
        }
    }
}

impl NamedRegion {
    /// `plane`, `sphere`, ..
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Sphere(_) => "sphere",
            Self::Cylinder(_) => "cylinder",
            Self::Mean(_) => "mean",
            Self::Surface(_) => "surface",
            Self::Nearest { .. } => "nearest",
            Self::Fixed { .. } => "fixed",
            Self::Direction { .. } => "direction",
            Self::KnownPlane { .. } => "known_plane",
        }
    }
}

impl NamedRegion {
    /// The part of space whose points it is made of.
    pub(crate) fn space(&self) -> Option<&Region> {
        match self {
            Self::Plane(space)
            | Self::Sphere(space)
            | Self::Cylinder(space)
            | Self::Mean(space)
            | Self::Surface(space) => Some(space),
            Self::Nearest { .. } | Self::Fixed { .. } | Self::Direction { .. } | Self::KnownPlane { .. } => None,
        }
    }
}

impl MeasurePlan {
    /// Reads a plan and checks that its names lead somewhere.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let plan: Self = ron_text::read(path)?;
        match plan.fault() {
            Some(message) => Err(request(format!("{}: {message}", path.display()))),
            None => Ok(plan),
        }
    }

    pub(crate) fn options(&self) -> FitOptions {
        FitOptions { rejection_level: self.rejection_level, doubt_level: self.doubt_level, ..FitOptions::default() }
    }

    fn fault(&self) -> Option<String> {
        if self.lengths.is_empty() {
            return Some("`lengths` is empty: nothing is to be measured".to_owned());
        }
        for (name, level) in [("rejection_level", self.rejection_level), ("doubt_level", self.doubt_level)] {
            if !(level > 0.0 && level < 1.0) {
                return Some(format!("`{name}` is {level}: a probability lies between 0 and 1"));
            }
        }
        let mut names = BTreeSet::new();
        for length in &self.lengths {
            if length.name.is_empty() || length.name.contains(char::is_control) {
                return Some(format!(
                    "a length is called {:?}: expected a name without control characters",
                    length.name
                ));
            }
            if !names.insert(&length.name) {
                return Some(format!("two lengths are called `{}`: names must differ", length.name));
            }
            let missing = length.quantity.regions().into_iter().find(|region| !self.regions.contains_key(*region));
            if let Some(missing) = missing {
                let known: Vec<&str> = self.regions.keys().map(String::as_str).collect();
                return Some(format!("`{}` needs region `{missing}`, there are {}", length.name, known.join(", ")));
            }
            if let Some(reason) = self.unfit(&length.quantity) {
                return Some(format!("`{}`: {reason}", length.name));
            }
        }
        None
    }

    /// Why a length can't be measured between things of these kinds.
    fn unfit(&self, quantity: &LengthKind) -> Option<String> {
        let kinds: Vec<&str> =
            quantity.regions().into_iter().filter_map(|name| self.regions.get(name)).map(NamedRegion::kind).collect();
        let place = |kind: &str| ["mean", "nearest", "fixed", "sphere"].contains(&kind);
        let direction = |kind: &str| ["plane", "cylinder", "direction", "known_plane"].contains(&kind);
        let (fits, expected) = match quantity {
            LengthKind::Distance { at_m: Some(_), .. } => {
                (kinds == ["plane"; 2], "`at_m` is for the distance of two planes")
            }
            LengthKind::Distance { .. } => {
                let places = kinds.iter().filter(|kind| place(kind)).count();
                let other = kinds.iter().all(|kind| place(kind) || ["plane", "cylinder"].contains(kind));
                let fits = kinds == ["plane"; 2] || places == 2 || (places == 1 && other);
                (
                    fits,
                    "a distance is that of two places (sphere, mean, nearest, fixed), of a place from a plane or cylinder, or of two planes",
                )
            }
            LengthKind::Angle { .. } => {
                (kinds.iter().all(|kind| direction(kind)), "an angle is between planes, cylinders and directions")
            }
            LengthKind::Radius { .. } | LengthKind::Diameter { .. } => {
                (kinds == ["sphere"] || kinds == ["cylinder"], "a radius is that of a sphere or cylinder")
            }
            LengthKind::Flatness { .. } => (kinds == ["plane"], "flatness is that of a plane"),
            LengthKind::Volume { cell_m, .. } if !(*cell_m > 0.0 && cell_m.is_finite()) => {
                (false, "`cell_m` must be positive and finite")
            }
            LengthKind::Volume { .. } => {
                let over = kinds.get(1).is_some_and(|kind| ["plane", "known_plane"].contains(kind));
                (over && kinds.first() == Some(&"surface"), "a volume is that of a surface over a plane or known_plane")
            }
        };
        (!fits).then(|| format!("{expected}, found {}", kinds.join(" and ")))
    }
}

/// A slip in what was asked for.
pub(crate) fn request(message: impl Into<String>) -> Error {
    Error::Request { command: "measure", message: message.into() }
}
