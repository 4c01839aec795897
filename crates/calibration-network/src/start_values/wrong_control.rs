//! Control points that most of their sightings contradict.

use crate::functional_model::{Datum, Excluded, Setup};
use crate::start_values::start_finder::target_point;

impl Setup<'_> {
    /// Releases control points that most of their sightings contradict, and keeps these. Where that would be half of the
    /// control, it is another thing that is wrong.
    pub(crate) fn without_wrong_control(&mut self, contradicting: &Excluded) -> Excluded {
        let (network, datum) = (self.network, self.datum);
        let is_control = |target: &usize| datum != Datum::Inner && self.target_control(*target).is_some();
        let control: Vec<usize> = (0..network.targets.len()).filter(is_control).collect();
        let mut seen = vec![(0_usize, 0_usize); network.targets.len()];
        for (index, sighting) in network.sightings.iter().enumerate().filter(|(_, sighting)| sighting.pixel.is_some()) {
            seen[sighting.target].1 += 1;
            seen[sighting.target].0 += usize::from(contradicting.image_points.contains(&index));
        }
        let is_wrong = |target: &usize| seen[*target].0 >= 2 && 2 * seen[*target].0 > seen[*target].1;
        let wrong: Vec<usize> = control.iter().copied().filter(is_wrong).collect();
        let mut left = contradicting.clone();
        if 2 * wrong.len() >= control.len() {
            return left;
        }
        for target in wrong {
            let Some(point) = target_point(network, &self.calibration, &self.start.stations, target) else { continue };
            self.start.targets[target] = Some(point);
            self.excluded.control_points.insert(target);
            left.image_points.retain(|index| network.sightings[*index].target != target);
            left.ranges.retain(|index| network.sightings[*index].target != target);
        }
        left
    }
}
