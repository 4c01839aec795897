//! Points as records of a LAS file: format 6 with a value more for each property that LAS has no field for.

use crate::ply::{Kind, PlyFile, Property};
use crate::{Error, Result};

/// Bytes of a record of format 6.
pub(crate) const POINT_6: usize = 30;
/// Steps of coordinates that are tried, metre: the finest that 31 bits hold the cloud in. A hundredth of a millimetre is a hundredth of
/// what range cameras scatter; finer digits would be noise that no packing makes smaller.
const STEPS_M: [f64; 4] = [1e-5, 1e-4, 1e-3, 1e-2];
/// Largest whole coordinate.
const LARGEST: f64 = 2_147_483_000.0;
/// In the byte of flags: a point that is to be left out.
const WITHHELD: u8 = 1 << 2;

/// What is known of all points before any is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    pub(crate) low: [f64; 3],
    pub(crate) high: [f64; 3],
    pub(crate) intensity: f64,
    pub(crate) points: u64,
}

/// How points become records.
pub(crate) struct Layout {
    position: [Property; 3],
    intensity: Option<Property>,
    flags: Option<Property>,
    frame: Option<Property>,
    /// Properties that follow the fields of LAS, in the types that they have.
    pub(crate) further: Vec<Property>,
    pub(crate) step_m: f64,
    /// Where whole coordinates count from, whole metres.
    pub(crate) origin_m: [f64; 3],
    pub(crate) extent: Extent,
    /// Bytes of a record.
    pub(crate) length: usize,
    /// Binary digits of the largest coordinate.
    pub(crate) bits: u32,
}

impl Extent {
    pub(crate) fn of(file: &PlyFile) -> Result<Self> {
        let (position, intensity) = (file.position()?, file.property("intensity"));
        let mut all = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], intensity: 0.0, points: 0 };
        file.each(|point| {
            let place = position.map(|property| property.of(point));
            if place.iter().all(|x| x.is_finite()) {
                for (axis, x) in place.into_iter().enumerate() {
                    all.low[axis] = all.low[axis].min(x);
                    all.high[axis] = all.high[axis].max(x);
                }
                // NaN is no maximum.
                all.intensity = intensity.map_or(0.0, |property| property.of(point)).max(all.intensity);
                all.points += 1;
            }
            Ok(())
        })?;
        Ok(all)
    }
}

impl Layout {
    pub(crate) fn new(path: &std::path::Path, file: &PlyFile, extent: Extent) -> Result<Self> {
        if extent.points == 0 {
            return Err(Error::NoPoints { path: path.to_owned(), points: file.points });
        }
        let origin_m = extent.low.map(f64::floor);
        let extent_m = [0, 1, 2].map(|axis| extent.high[axis] - origin_m[axis]).into_iter().fold(0.0, f64::max);
        let Some(step_m) = STEPS_M.into_iter().find(|step| extent_m / step < LARGEST) else {
            return Err(Error::TooWide { path: path.to_owned(), extent_m });
        };
        let largest = (extent_m / step_m).round() as u32;
        let owned = |name: &str| file.property(name).cloned();
        let position = file.position()?.map(Property::clone);
        let further = file.properties.iter().filter(|property| !["x", "y", "z"].contains(&property.name.as_str()));
        let further: Vec<Property> = further.cloned().collect();
        Ok(Self {
            position,
            intensity: owned("intensity"),
            flags: owned("flags"),
            frame: owned("frame"),
            length: POINT_6 + further.iter().map(|property| property.kind.bytes()).sum::<usize>(),
            further,
            step_m,
            origin_m,
            extent,
            // A cell of one step at the least.
            bits: (u32::BITS - largest.leading_zeros()).max(1),
        })
    }

    /// Appends the record of a point; none where it has no place.
    pub(crate) fn put(&self, point: &[u8], record: &mut Vec<u8>) -> bool {
        let place = self.position.each_ref().map(|property| property.of(point));
        if place.iter().any(|x| !x.is_finite()) {
            return false;
        }
        for (x, origin) in place.into_iter().zip(self.origin_m) {
            let whole = ((x - origin) / self.step_m).round() as i32;
            record.extend_from_slice(&whole.to_le_bytes());
        }
        let share = self.intensity.as_ref().map_or(0.0, |property| property.of(point)) / self.extent.intensity;
        let intensity = if share > 0.0 { (share * f64::from(u16::MAX)).round() as u16 } else { 0 };
        record.extend_from_slice(&intensity.to_le_bytes());
        // One return of one.
        record.push(0x11);
        let flagged = self.flags.as_ref().is_some_and(|property| property.of(point) > 0.0);
        record.push(if flagged { WITHHELD } else { 0 });
        // Class (never classified), user data, angle of the scanner.
        record.extend_from_slice(&[0; 4]);
        // Frames that the field can't count stand in the further value alone.
        let frame = self.frame.as_ref().map_or(0.0, |property| property.of(point));
        let source = if frame <= f64::from(u16::MAX) { frame as u16 } else { 0 };
        record.extend_from_slice(&source.to_le_bytes());
        record.extend_from_slice(&0_f64.to_le_bytes());
        for property in &self.further {
            record.extend_from_slice(&point[property.at..property.at + property.kind.bytes()]);
        }
        true
    }

    /// Names and LAS's numbers of the types of the further values.
    pub(crate) fn further_values(&self) -> impl Iterator<Item = (&str, u8)> {
        self.further.iter().map(|property| {
            let name = match property.name.as_str() {
                // LAS has a field of that name, whose unit is a part of the largest.
                "intensity" => "amplitude",
                "nx" => "NormalX",
                "ny" => "NormalY",
                "nz" => "NormalZ",
                other => other,
            };
            let number = match property.kind {
                Kind::U8 => 1,
                Kind::U16 => 3,
                Kind::U32 => 5,
                Kind::F32 => 9,
                Kind::F64 => 10,
            };
            (name, number)
        })
    }
}

/// The whole coordinates of a record.
pub(crate) fn place(record: &[u8]) -> [u32; 3] {
    [0, 4, 8].map(|at| {
        let bytes = record.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
        bytes.map_or(0, u32::from_le_bytes)
    })
}
