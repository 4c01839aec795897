use super::CloudFile;
use super::file::{COVARIANCE, NORMAL, POSITION};
use crate::text::fault::{Fault, collected, reserve};

/// The recognised properties of a file's points as columns.
pub(crate) struct Columns {
    /// Canonical names with their values.
    columns: Vec<(String, Vec<f64>)>,
    /// Position among the columns of each property of a point.
    of_property: Vec<Option<usize>>,
}

/// The name under which a property is known here: other programs write capitals, `scalar_Intensity`, `normal_x`.
pub(crate) fn canonical(name: &str) -> String {
    let lower = name.to_ascii_lowercase();
    let bare = lower.strip_prefix("scalar_").unwrap_or(&lower);
    match bare {
        "normal_x" | "normalx" => "nx",
        "normal_y" | "normaly" => "ny",
        "normal_z" | "normalz" => "nz",
        other => other,
    }
    .to_owned()
}

impl Columns {
    /// Columns for the properties that are known; `points` must have been held against the file's length.
    pub(crate) fn new<'a>(properties: impl IntoIterator<Item = &'a str>, points: usize) -> Result<Self, Fault> {
        const SINGLE: [&str; 4] = ["intensity", "sigma", "flags", "frame"];
        let known = || POSITION.iter().chain(&NORMAL).chain(&COVARIANCE).chain(&SINGLE);
        let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
        let mut of_property = Vec::new();
        for name in properties {
            let canonical = canonical(name);
            if !known().any(|known| *known == canonical) {
                of_property.push(None);
                continue;
            }
            if columns.iter().any(|(earlier, _)| *earlier == canonical) {
                return Err(format!("has property `{canonical}` twice").into());
            }
            of_property.push(Some(columns.len()));
            columns.push((canonical, reserve(points)?));
        }
        Ok(Self { columns, of_property })
    }

    /// Where the values of a property go; `None` for one that is left alone.
    pub(crate) fn of_property(&mut self, index: usize) -> Option<&mut Vec<f64>> {
        let column = self.of_property.get(index).copied().flatten()?;
        self.columns.get_mut(column).map(|(_, values)| values)
    }

    /// The cloud; each column must have `points` values.
    pub(crate) fn into_cloud(mut self, points: usize) -> Result<CloudFile, Fault> {
        if let Some((name, values)) = self.columns.iter().find(|(_, values)| values.len() != points) {
            return Err(format!("has {} values of `{name}` for {points} points", values.len()).into());
        }
        let positions = self.take_all(POSITION)?.ok_or("has no properties `x`, `y`, `z`")?;
        let normals = self.take_all(NORMAL)?;
        let covariance = self.take_all(COVARIANCE)?;
        let single = |values: Vec<f64>| collected(values.iter().map(|&value| value as f32));
        Ok(CloudFile {
            points: collected((0..points).map(|i| std::array::from_fn(|axis| positions[axis][i])))?,
            normals: normals
                .map(|n| collected((0..points).map(|i| std::array::from_fn(|axis| n[axis][i] as f32))))
                .transpose()?,
            covariance: covariance
                .map(|c| collected((0..points).map(|i| std::array::from_fn(|term| c[term][i] as f32))))
                .transpose()?,
            intensity: self.take("intensity").map(single).transpose()?,
            sigma: self.take("sigma").map(single).transpose()?,
            flags: self
                .take("flags")
                .map(|values| whole("flags", &values, f64::from(u16::MAX), |v| v as u16))
                .transpose()?,
            frame: self
                .take("frame")
                .map(|values| whole("frame", &values, f64::from(u32::MAX), |v| v as u32))
                .transpose()?,
            ..CloudFile::default()
        })
    }

    fn take(&mut self, name: &str) -> Option<Vec<f64>> {
        let index = self.columns.iter().position(|(found, _)| found == name)?;
        Some(std::mem::take(&mut self.columns[index].1))
    }

    /// Columns of which all or none must be there.
    fn take_all<const N: usize>(&mut self, names: [&str; N]) -> Result<Option<[Vec<f64>; N]>, String> {
        let columns = names.map(|name| self.take(name));
        let found = columns.iter().flatten().count();
        match found {
            0 => Ok(None),
            _ if found == N => Ok(Some(columns.map(Option::unwrap_or_default))),
            _ => Err(format!("has {found} of the properties {}, expected all or none", names.join(", "))),
        }
    }
}

/// Values that must be whole numbers from 0 to `largest`.
fn whole<T>(name: &str, values: &[f64], largest: f64, convert: fn(f64) -> T) -> Result<Vec<T>, Fault> {
    let bad = values.iter().find(|value| !(value.fract() == 0.0 && (0.0..=largest).contains(*value)));
    match bad {
        Some(value) => Err(format!("has `{name}` = {value}, expected a whole number from 0 to {largest}").into()),
        None => Ok(collected(values.iter().map(|&value| convert(value)))?),
    }
}
