use nalgebra::Vector3;

use crate::{Error, Result};

/// Beyond this no unit measures (rad/s, m/s²), and products of such numbers would leave the range of f64 in the end.
const LARGEST: f64 = 1e6;

/// One sample of an inertial unit, in its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialSample {
    /// Time, second.
    pub timestamp_s: f64,
    /// Angular rate, radian per second.
    pub angular_rate: Vector3<f64>,
    /// Specific force, metre per second squared: at rest it points up with the length of gravity.
    pub specific_force: Vector3<f64>,
}

impl InertialSample {
    /// Whether all numbers are finite and such as a unit may measure.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let sound = |v: &Vector3<f64>| v.iter().all(|x| x.abs() < LARGEST);
        self.timestamp_s.is_finite() && sound(&self.angular_rate) && sound(&self.specific_force)
    }

    /// The sample at a time between this and a later one.
    #[must_use]
    pub fn interpolated(&self, later: &Self, timestamp_s: f64) -> Self {
        let share = (timestamp_s - self.timestamp_s) / (later.timestamp_s - self.timestamp_s);
        Self {
            timestamp_s,
            angular_rate: self.angular_rate.lerp(&later.angular_rate, share),
            specific_force: self.specific_force.lerp(&later.specific_force, share),
        }
    }

    /// Refuses samples that cannot be used, and times that do not ascend.
    pub(crate) fn check(samples: &[Self]) -> Result<()> {
        for (index, sample) in samples.iter().enumerate() {
            if !sample.is_finite() {
                return Err(Error::NonFinite { what: "inertial sample", index });
            }
            if index > 0 && sample.timestamp_s <= samples[index - 1].timestamp_s {
                return Err(Error::NotAscending { what: "inertial sample", index });
            }
        }
        Ok(())
    }

    /// The samples of an interval (second), with one interpolated at either end; ends up to `max_gap_s` beyond the samples are given
    /// the nearest one.
    pub(crate) fn within(samples: &[Self], [from_s, to_s]: [f64; 2], max_gap_s: f64) -> Result<Vec<Self>> {
        let at = |time_s: f64| -> Option<Self> {
            let after = samples.partition_point(|sample| sample.timestamp_s <= time_s);
            let before = after.checked_sub(1).and_then(|before| samples.get(before));
            match (before, samples.get(after)) {
                (Some(before), Some(next)) => Some(before.interpolated(next, time_s)),
                (Some(nearest), None) | (None, Some(nearest)) => Some(Self { timestamp_s: time_s, ..*nearest }),
                (None, None) => None,
            }
        };
        let first = samples.partition_point(|sample| sample.timestamp_s <= from_s);
        let end = samples.partition_point(|sample| sample.timestamp_s < to_s).max(first);
        // What the interval touches, a sample before and after it: no two of these may be too far apart.
        let touched = &samples[first.saturating_sub(1)..(end + 1).min(samples.len())];
        let times = touched.iter().map(|sample| sample.timestamp_s.clamp(from_s, to_s));
        let inside: Vec<f64> = std::iter::once(from_s).chain(times).chain([to_s]).collect();
        let longest = inside.windows(2).map(|pair| (pair[1] - pair[0], pair[0])).max_by(|a, b| a.0.total_cmp(&b.0));
        let bare = touched.windows(2).map(|pair| (pair[1].timestamp_s - pair[0].timestamp_s, pair[0].timestamp_s));
        let gap = bare.chain(longest).find(|(seconds, _)| *seconds > max_gap_s);
        let whole = Error::Gap { from_s, seconds: to_s - from_s, allowed_s: max_gap_s };
        if let Some((seconds, from_s)) = gap {
            return Err(Error::Gap { from_s, seconds, allowed_s: max_gap_s });
        }
        let (Some(start), Some(last)) = (at(from_s), at(to_s)) else { return Err(whole) };
        let between = samples[first..end].iter().filter(|sample| sample.timestamp_s > from_s).copied();
        Ok(std::iter::once(start).chain(between).chain([last]).collect())
    }
}
