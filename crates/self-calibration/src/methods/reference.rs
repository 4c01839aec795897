//! Reference ranges and what is uncertain of them.

use adjust::{BlockId, Scale};
use calibration_network::functional_model::{Setup, Solved, modelled_pixel};
use calibration_network::precision::Geometry;
use nalgebra::{DMatrix, Vector3};

use crate::{DistanceEnd, Error, Network, Result};

/// Reference ranges of some sightings: `ρ_ref = values + root · z`, z being independent standard normal numbers.
#[derive(Debug, Clone)]
pub(crate) struct Reference {
    /// Sightings, by their position in the network.
    pub(crate) sightings: Vec<usize>,
    /// Image points at which corrections are taken, pixel: modelled ones where poses and coordinates were adjusted, else
    /// those measured.
    pub(crate) pixels: Vec<Option<[f64; 2]>>,
    /// Reference ranges, metre.
    pub(crate) values: Vec<f64>,
    /// `J L` with the covariance `L Lᵀ` of what they were computed from.
    pub(crate) root: DMatrix<f64>,
    /// Rows of L that belong to quantities reported beside the ranges.
    pub(crate) carried: DMatrix<f64>,
}

impl Reference {
    /// From stations and targets of a first adjustment, with its full covariance. [`Self::carried`] has the rows of its
    /// calibration parameters (in the order of their names), of the stations' positions and of the targets.
    pub(crate) fn from_network(setup: &Setup<'_>, solved: &Solved, sightings: Vec<usize>) -> Result<Self> {
        let parameters = setup.estimated_parameters(solved);
        let geometry = solved.geometry()?;
        let mut places: Vec<(BlockId, usize)> = parameters.iter().map(|(_, block, i)| (*block, *i)).collect();
        let first_station = places.len();
        let blocks = &solved.blocks;
        places.extend(blocks.stations.iter().flat_map(|&block| (0..3).map(move |axis| (block, axis))));
        let mut first_of_target = vec![usize::MAX; blocks.targets.len()];
        for (target, block) in blocks.targets.iter().enumerate() {
            if let Some(block) = *block {
                first_of_target[target] = places.len();
                places.extend((0..3).map(|axis| (block, axis)));
            }
        }
        let root = root_of(solved, &places)?;
        let camera = setup.calibration_found(solved)?.camera;
        let mut values = Vec::with_capacity(sightings.len());
        let mut pixels = Vec::with_capacity(sightings.len());
        let mut rows = DMatrix::zeros(sightings.len(), root.ncols());
        for (row, &index) in sightings.iter().enumerate() {
            let seen = &setup.network.sightings[index];
            let (distance, direction) = between(&geometry, seen.station, seen.target);
            values.push(distance);
            let point = geometry.targets[seen.target];
            pixels.push(point.and_then(|point| modelled_pixel(&camera, &geometry.stations[seen.station], &point)));
            for axis in 0..3 {
                let station = root.row(first_station + 3 * seen.station + axis);
                let target = root.row(first_of_target[seen.target] + axis);
                let sum = (target - station) * direction[axis];
                let mut own = rows.row_mut(row);
                own += sum;
            }
        }
        Ok(Self { sightings, pixels, values, root: rows, carried: root })
    }

    /// From known distances, and from known poses and coordinates where there is no distance.
    pub(crate) fn from_laboratory(network: &Network, sightings: Vec<usize>) -> Result<Self> {
        let mut columns = Columns::default();
        let mut values = Vec::with_capacity(sightings.len());
        for (row, &index) in sightings.iter().enumerate() {
            let seen = &network.sightings[index];
            match known_distance(network, seen.station, seen.target) {
                Some(number) => {
                    let known = &network.distances[number];
                    values.push(known.distance_m);
                    columns.add(row, Origin::Distance(number), &[known.sigma_m]);
                }
                None => values.push(from_coordinates(network, row, seen.station, seen.target, &mut columns)?),
            }
        }
        let root = columns.matrix(sightings.len());
        let pixels = sightings.iter().map(|&index| network.sightings[index].pixel).collect();
        Ok(Self { sightings, pixels, values, carried: DMatrix::zeros(0, root.ncols()), root })
    }

    /// Without some of its rows.
    pub(crate) fn without(&self, rejected: &std::collections::BTreeSet<usize>) -> Self {
        let kept: Vec<usize> = (0..self.values.len()).filter(|&row| !rejected.contains(&self.sightings[row])).collect();
        Self {
            sightings: kept.iter().map(|&row| self.sightings[row]).collect(),
            pixels: kept.iter().map(|&row| self.pixels[row]).collect(),
            values: kept.iter().map(|&row| self.values[row]).collect(),
            root: self.root.select_rows(&kept),
            carried: self.carried.clone(),
        }
    }
}

fn between(geometry: &Geometry, station: usize, target: usize) -> (f64, Vector3<f64>) {
    let centre = geometry.stations[station].translation.vector;
    let arm = geometry.targets[target].map_or(Vector3::repeat(f64::NAN), |point| point.coords - centre);
    let length = arm.norm();
    (length, arm / length)
}

/// L of `Q = L Lᵀ` over chosen unknowns. A free network's Q is singular: a share of 1e-10 of the variances on the
/// diagonal (a hundred-thousandth of each deviation) makes it definite; what is held has a zero row.
fn root_of(solved: &Solved, places: &[(BlockId, usize)]) -> Result<DMatrix<f64>> {
    let mut q = calibration_network::precision::covariance_of(&solved.solution, places)?;
    for i in 0..places.len() {
        let variance = q[(i, i)];
        q[(i, i)] = if variance > 0.0 { variance * (1.0 + 1e-10) } else { 1.0 };
    }
    let held: Vec<bool> = places
        .iter()
        .map(|&(block, component)| Ok(solved.solution.covariance(block, Scale::Prior)?[(component, component)] <= 0.0))
        .collect::<Result<_>>()?;
    let Some(factor) = q.cholesky() else {
        return Err(adjust::Error::Decomposition { what: "covariance of the first step" }.into());
    };
    let mut root = factor.unpack();
    for (row, _) in held.iter().enumerate().filter(|(_, held)| **held) {
        root.row_mut(row).fill(0.0);
    }
    Ok(root)
}

fn known_distance(network: &Network, station: usize, target: usize) -> Option<usize> {
    let ends = [DistanceEnd::Station(station), DistanceEnd::Target(target)];
    network.distances.iter().position(|known| [known.from, known.to] == ends || [known.to, known.from] == ends)
}

fn from_coordinates(
    network: &Network,
    row: usize,
    station: usize,
    target: usize,
    columns: &mut Columns,
) -> Result<f64> {
    let (from, to) = (&network.stations[station], &network.targets[target]);
    // Without standard deviations a pose or coordinates are an approximation, which is no reference.
    let known_pose = from.world_from_camera.zip(from.covariance);
    let (Some((pose, of_pose)), Some((point, of_point))) = (known_pose, to.point.zip(to.covariance)) else {
        let pair = network.pair(station, target);
        let needs = format!(
            "{pair} has a range, but neither a known distance nor a known pose and known coordinates, each with its \
             standard deviations"
        );
        return Err(Error::MethodNeeds { method: "laboratory".to_owned(), needs });
    };
    let arm = point.coords - pose.translation.vector;
    let length = arm.norm();
    if length <= 0.0 {
        let needs = format!("{} is in the station itself", network.pair(station, target));
        return Err(Error::MethodNeeds { method: "laboratory".to_owned(), needs });
    }
    let direction = arm / length;
    let position = of_pose.fixed_view::<3, 3>(0, 0).into_owned();
    for (origin, covariance) in [(Origin::Station(station), position), (Origin::Target(target), of_point)] {
        if let Some(factor) = covariance.cholesky() {
            let sign = if matches!(origin, Origin::Station(_)) { -1.0 } else { 1.0 };
            let part = (direction.transpose() * factor.l()) * sign;
            columns.add(row, origin, part.as_slice());
        }
    }
    Ok(length)
}

/// Where an uncertain quantity comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Origin {
    Distance(usize),
    Station(usize),
    Target(usize),
}

/// Columns of a matrix by their origin.
#[derive(Default)]
struct Columns {
    first: std::collections::BTreeMap<Origin, usize>,
    count: usize,
    entries: Vec<(usize, usize, f64)>,
}

impl Columns {
    fn add(&mut self, row: usize, origin: Origin, values: &[f64]) {
        let count = self.count;
        let first = *self.first.entry(origin).or_insert(count);
        if first == count {
            self.count += values.len();
        }
        self.entries.extend(values.iter().enumerate().map(|(i, value)| (row, first + i, *value)));
    }

    fn matrix(&self, rows: usize) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(rows, self.count);
        for &(row, column, value) in &self.entries {
            out[(row, column)] += value;
        }
        out
    }
}
