//! Control as observed values.

use crate::functional_model::{Component, Row, Setup, Source};

impl Setup<'_> {
    /// Coordinates of a control point as rows; `None` where it takes no part as weighted control.
    pub(crate) fn target_control(&self, index: usize) -> Option<Vec<Row>> {
        let target = &self.network.targets[index];
        let (point, covariance) = (target.point?, target.covariance?);
        let row = |axis: usize| Row {
            source: Source::Target(index, axis),
            component: Component::Control,
            observed: point[axis],
            sigma: covariance[(axis, axis)].sqrt(),
        };
        Some((0..3).map(row).collect())
    }

    /// Components of a control pose as rows: position, then the rotation from the given attitude, which is none.
    pub(crate) fn station_control(&self, index: usize) -> Option<Vec<Row>> {
        let station = &self.network.stations[index];
        let (pose, covariance) = (station.world_from_camera?, station.covariance?);
        let row = |component: usize| Row {
            source: Source::Station(index, component),
            component: Component::Control,
            observed: if component < 3 { pose.translation.vector[component] } else { 0.0 },
            sigma: covariance[(component, component)].sqrt(),
        };
        Some((0..6).map(row).collect())
    }
}
