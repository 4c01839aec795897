use std::fmt;
use std::path::Path;

use serde::de::{Deserializer, SeqAccess, Visitor};
use serde::ser::Serializer;

use super::{FrameEntry, Level, ReferencePath, StoredDepth, Survey, SurveyCamera, TruthFiles};
use crate::InvalidField;
use crate::text::limits::{MOST_FREQUENCIES, MOST_PHASE_STEPS, MOST_PIXELS};

/// Bytes of a field of words that is printed as it is.
const LONGEST_WORDS: usize = 200;

type Check = Result<(), InvalidField>;

impl Survey {
    pub(super) fn check(&self) -> Check {
        self.camera.check(self.level)?;
        for (index, frame) in self.frames.iter().enumerate() {
            frame.check(&format!("frames[{index}]"))?;
        }
        let words =
            [("camera_identity", &self.camera_identity), ("firmware", &self.firmware), ("operator", &self.operator)];
        for (field, words) in words {
            if let Some(words) = words {
                let printable = !words.trim().is_empty() && !words.contains(char::is_control);
                require(
                    printable && words.len() <= LONGEST_WORDS,
                    field,
                    format!("expected 1 to {LONGEST_WORDS} bytes without control characters"),
                )?;
            }
        }
        self.check_power_on()?;
        self.check_frame_rates()?;
        if let Some(path) = &self.reference_path {
            path.check(self.camera.width, self.camera.height)?;
        }
        if let Some(depth) = &self.depth {
            depth.check(self.level)?;
        }
        if let Some(truth) = &self.truth {
            truth.check(self.frames.len())?;
        }
        self.extras.iter().try_for_each(|(name, file)| check_path(format!("extras.{name}"), file))
    }

    fn check_frame_rates(&self) -> Check {
        for (index, rate) in self.frame_rates.iter().enumerate() {
            let (since, hertz) = (format!("frame_rates[{index}].since_s"), format!("frame_rates[{index}].rate_hz"));
            check_finite(&since, rate.since_s)?;
            let later = index == 0 || rate.since_s > self.frame_rates[index - 1].since_s;
            require(later, since, format!("is {}, expected a time after the rate before", rate.since_s))?;
            let holds = rate.rate_hz.is_finite() && rate.rate_hz >= 0.0;
            require(holds, hertz, format!("is {}, expected a frame rate that is not negative", rate.rate_hz))?;
        }
        Ok(())
    }

    fn check_power_on(&self) -> Check {
        let Some(power_on_s) = self.power_on_s else { return Ok(()) };
        check_finite("power_on_s", power_on_s)?;
        let early = self.frames.iter().position(|frame| frame.timestamp_s.is_some_and(|time_s| time_s < power_on_s));
        early.map_or(Ok(()), |index| {
            let field = format!("frames[{index}].timestamp_s");
            Err(InvalidField::new(field, format!("is before the camera was switched on (`power_on_s: {power_on_s}`)")))
        })
    }
}

impl SurveyCamera {
    fn check(&self, level: Level) -> Check {
        require(self.width > 0, "camera.width", "is 0, expected at least one column")?;
        require(self.height > 0, "camera.height", "is 0, expected at least one row")?;
        require(
            self.width.checked_mul(self.height).is_some_and(|pixels| pixels <= MOST_PIXELS),
            "camera.width",
            format!("{} x {} pixels, expected at most {MOST_PIXELS} in all", self.width, self.height),
        )?;
        for (index, &pitch) in self.pixel_pitch_mm.iter().enumerate() {
            check_positive(format!("camera.pixel_pitch_mm[{index}]"), pitch)?;
        }
        check_positive("camera.principal_distance_mm", self.principal_distance_mm)?;
        for (index, &coordinate) in self.principal_point_mm.iter().enumerate() {
            check_finite(format!("camera.principal_point_mm[{index}]"), coordinate)?;
        }
        self.check_modulation(level)?;
        check_finite("camera.phase_offset_rad", self.phase_offset_rad)?;
        check_positive("camera.raw_scale", self.raw_scale)?;
        self.saturation.map_or(Ok(()), |value| check_positive("camera.saturation", value))
    }

    fn check_modulation(&self, level: Level) -> Check {
        for (index, &hz) in self.modulation_hz.iter().enumerate() {
            check_positive(format!("camera.modulation_hz[{index}]"), hz)?;
        }
        let frequencies = self.modulation_hz.len();
        let needed = matches!(level, Level::Samples | Level::Phase);
        require(
            frequencies > 0 || !needed,
            "camera.modulation_hz",
            format!("is missing or empty, expected at least one frequency for level `{}`", level.name()),
        )?;
        require(
            frequencies <= MOST_FREQUENCIES,
            "camera.modulation_hz",
            format!("{frequencies} frequencies, expected at most {MOST_FREQUENCIES}"),
        )?;
        match self.phase_steps {
            Some(steps) => require(
                (3..=MOST_PHASE_STEPS).contains(&steps),
                "camera.phase_steps",
                format!("is {steps}, expected 3 to {MOST_PHASE_STEPS}"),
            ),
            None => require(level != Level::Samples, "camera.phase_steps", "is missing, level `samples` needs it"),
        }
    }
}

impl FrameEntry {
    fn check(&self, path: &str) -> Check {
        check_path(format!("{path}.file"), &self.file)?;
        check_name(format!("{path}.station"), &self.station)?;
        for (name, value) in [("timestamp_s", self.timestamp_s), ("temperature_c", self.temperature_c)] {
            value.map_or(Ok(()), |value| check_finite(format!("{path}.{name}"), value))?;
        }
        self.integration_time_s.map_or(Ok(()), |value| check_positive(format!("{path}.integration_time_s"), value))
    }
}

impl ReferencePath {
    fn check(&self, width: usize, height: usize) -> Check {
        let sides = [("columns", self.columns, width), ("rows", self.rows, height)];
        for (name, [first, last], size) in sides {
            require(
                first <= last && last < size,
                format!("reference_path.{name}"),
                format!("is ({first}, {last}), expected the first and the last of {size} {name}, counted from 0"),
            )?;
        }
        check_positive("reference_path.length_m", self.length_m)
    }
}

impl StoredDepth {
    fn check(&self, level: Level) -> Check {
        require(level == Level::Depth, "depth", format!("belongs to level `depth`, not to `{}`", level.name()))?;
        check_positive("depth.scale_m", self.scale_m)
    }
}

impl TruthFiles {
    fn check(&self, frames: usize) -> Check {
        let files = self.frames.len();
        require(
            files == 0 || files == frames,
            "truth.frames",
            format!("lists {files} files for {frames} frames, expected one each or none"),
        )?;
        for (index, file) in self.frames.iter().enumerate() {
            check_path(format!("truth.frames[{index}]"), file)?;
        }
        self.stations.iter().try_for_each(|file| check_path("truth.stations", file))?;
        self.calibration.iter().try_for_each(|file| check_path("truth.calibration", file))
    }
}

fn require(holds: bool, field: impl Into<String>, reason: impl Into<String>) -> Check {
    if holds { Ok(()) } else { Err(InvalidField::new(field, reason)) }
}

fn check_positive(field: impl Into<String>, value: f64) -> Check {
    require(value.is_finite() && value > 0.0, field, format!("is {value}, expected a positive number"))
}

fn check_finite(field: impl Into<String>, value: f64) -> Check {
    require(value.is_finite(), field, format!("is {value}, expected a finite number"))
}

/// A name goes into tables, reports and onto terminals.
fn check_name(field: impl Into<String>, name: &str) -> Check {
    let field = field.into();
    require(!name.trim().is_empty(), field.as_str(), "is empty, expected a name")?;
    let printable = !name.contains(char::is_control);
    require(printable, field, format!("is {name:?}, expected a name without control characters"))
}

fn check_path(field: impl Into<String>, path: &Path) -> Check {
    let relative = !path.as_os_str().is_empty() && !path.has_root();
    let printable = !path.to_string_lossy().contains(char::is_control);
    let shown = path.display().to_string();
    let reason = format!("is `{}`, expected a path relative to the survey's folder", shown.escape_debug());
    require(relative && printable, field, reason)
}

/// Reads `0` as well as `[0, 65535]`.
pub(super) fn one_or_more<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u16>, D::Error> {
    struct OneOrMore;

    impl<'de> Visitor<'de> for OneOrMore {
        type Value = Vec<u16>;

        fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
            formatter.write_str("a value from 0 to 65535 or a list of such")
        }

        fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<Self::Value, E> {
            let value = u16::try_from(value);
            value.map(|v| vec![v]).map_err(|_| E::custom("expected a value from 0 to 65535"))
        }

        fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Self::Value, E> {
            self.visit_u64(u64::try_from(value).unwrap_or(u64::MAX))
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
            let mut values = Vec::new();
            while let Some(value) = sequence.next_element()? {
                values.push(value);
            }
            Ok(values)
        }
    }

    deserializer.deserialize_any(OneOrMore)
}

pub(super) fn one_or_list<S: Serializer>(values: &[u16], serializer: S) -> Result<S::Ok, S::Error> {
    match values {
        [value] => serializer.serialize_u16(*value),
        list => serializer.collect_seq(list),
    }
}
