//! The observations of a facet with its unknown plane eliminated.
//!
//! A point at `[u, v]` on a facet sees the motion of its station as `[1, u, v] · z`, z being three numbers, and that of
//! the plane likewise: its distance is `ρ + [1, u, v] · (z − a) + derivatives · θ − c`, with the offset and slopes a of
//! the plane and the offset c by which the surface of a tile is off it. Both are unknown and eliminated exactly, so that
//! no point is used twice and the normal equations are those of all points.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix6x3, Vector3};

use super::facets::Facet;
use super::scatter::TileMean;
use super::sums::{Sums, TileSums};

/// How well the slopes of a facet are known from the patches that it was found by, radian.
const SLOPE: f64 = 0.02;

/// What the stations saw of one facet.
pub(super) struct FacetSums<'a> {
    pub facet: &'a Facet,
    pub sums: &'a [Sums],
    /// Weight of what each station saw of each tile, tile by tile, and the variance that its points share, metre².
    pub weights: &'a [f64],
    pub shared: &'a [f64],
    /// Variance of the surface of a tile about the plane, metre².
    pub roughness: f64,
}

/// Normal equations of a facet: three unknowns a station that saw it, then the shared parameters.
#[derive(Debug, Clone)]
pub(super) struct Eliminated {
    pub stations: Vec<usize>,
    pub normal: DMatrix<f64>,
    pub right: DVector<f64>,
    /// Inverse of the normal matrix of the plane, and what it gets from the motions and from the distances.
    inverse: Matrix3<f64>,
    from_motions: DMatrix<f64>,
    from_distances: Vector3<f64>,
}

impl FacetSums<'_> {
    /// What the stations saw of the tile, those with no weight left out: position among `stations`, sums, weight.
    fn tile<'s>(&'s self, tile: usize, stations: &'s [usize]) -> impl Iterator<Item = (usize, TileSums<'s>, f64)> {
        let count = self.sums.len();
        let of = move |(k, &station): (usize, &usize)| {
            let sums = self.sums[station].of(tile)?;
            let weight = self.weights[tile * count + station];
            (weight > 0.0).then_some((k, sums, weight))
        };
        stations.iter().enumerate().filter_map(of)
    }

    pub(super) fn tiles(&self) -> std::ops::Range<usize> {
        self.facet.tiles.first..self.facet.tiles.first + self.facet.tiles.len()
    }

    /// Stations, of these, that saw something of the facet.
    pub(super) fn seen_by(&self, stations: &[usize]) -> Vec<usize> {
        let sees = |station: usize| self.tiles().any(|tile| self.tile(tile, &[station]).next().is_some());
        stations.iter().copied().filter(|&station| sees(station)).collect()
    }

    /// The observations of these stations. `None` where fewer than two of them saw the facet.
    pub(super) fn eliminated(&self, stations: &[usize]) -> Option<Eliminated> {
        let stations = self.seen_by(stations);
        if stations.len() < 2 {
            return None;
        }
        let of_motions = 3 * stations.len();
        let size = of_motions + self.sums[0].order - 3;
        let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        let (mut mean, mut at) = (DVector::zeros(size), Vec::with_capacity(size));
        for tile in self.tiles() {
            mean.fill(0.0);
            at.clear();
            let (mut weight, mut distance) = (0.0, 0.0);
            for (k, sums, own) in self.tile(tile, &stations) {
                // Errors in common leave a tile less weight than its points have.
                let shared = self.shared[tile * self.sums.len() + stations[k]];
                let own = own / (1.0 + shared * own * sums.weight());
                let row = |i: usize| if i < 3 { 3 * k + i } else { of_motions + i - 3 };
                for i in 0..self.sums[0].order {
                    for j in 0..self.sums[0].order {
                        normal[(row(i), row(j))] += own * sums.product(i, j);
                    }
                    right[row(i)] += own * sums.right(i);
                    mean[row(i)] += own * sums.product(i, 0);
                }
                at.extend(3 * k..3 * k + 3);
                weight += own * sums.weight();
                distance += own * sums.right(0);
            }
            if self.roughness > 0.0 && weight > 0.0 {
                at.extend(of_motions..size);
                let share = 1.0 / (weight + 1.0 / self.roughness);
                for &i in &at {
                    for &j in &at {
                        normal[(i, j)] -= share * mean[i] * mean[j];
                    }
                    right[i] -= share * mean[i] * distance;
                }
            }
        }
        Some(Eliminated::new(stations, normal, right))
    }
}

impl FacetSums<'_> {
    /// What the equations get where a station sees the tiles of a cell of directions too far by the standard deviation of one
    /// point, cell by cell.
    pub(super) fn answers(&self, eliminated: &Eliminated, means: &[TileMean]) -> BTreeMap<[u32; 3], DVector<f64>> {
        let (stations, size) = (&eliminated.stations, eliminated.right.len());
        let mut answers: BTreeMap<[u32; 3], DVector<f64>> = BTreeMap::new();
        for tile in means.chunk_by(|a, b| a.tile == b.tile) {
            let mut seen = Vec::with_capacity(tile.len());
            for (k, sums, own) in self.tile(tile[0].tile, stations) {
                let own = own / (1.0 + self.shared[tile[0].tile * self.sums.len() + stations[k]] * own * sums.weight());
                let mean = Vector3::from_fn(|i, _| own * sums.product(i, 0));
                seen.extend(tile.iter().find(|mean| mean.station == stations[k]).map(|of| (k, mean, of)));
            }
            let weight: f64 = seen.iter().map(|(_, mean, _)| mean[0]).sum();
            let share = if self.roughness > 0.0 { 1.0 / (weight + 1.0 / self.roughness) } else { 0.0 };
            for (k, mean, of) in &seen {
                let answer = answers.entry(of.bearing).or_insert_with(|| DVector::zeros(size));
                let sigma_m = of.point_variance.sqrt();
                let mut own = answer.fixed_rows_mut::<3>(3 * k);
                own += mean * sigma_m;
                for (other, of_other, _) in &seen {
                    let mut own = answer.fixed_rows_mut::<3>(3 * other);
                    own -= of_other * (share * mean[0] * sigma_m);
                }
            }
        }
        for answer in answers.values_mut() {
            let of_plane: Vector3<f64> = (0..stations.len()).map(|k| answer.fixed_rows::<3>(3 * k).into_owned()).sum();
            *answer -= eliminated.from_motions.transpose() * (eliminated.inverse * of_plane);
        }
        answers
    }
}

impl Eliminated {
    fn new(stations: Vec<usize>, mut normal: DMatrix<f64>, mut right: DVector<f64>) -> Self {
        let count = stations.len();
        // The plane moves as all stations together would, the other way.
        let mut from_motions = DMatrix::zeros(3, normal.ncols());
        let (mut of_plane, mut from_distances) = (Matrix3::zeros(), Vector3::zeros());
        for k in 0..count {
            from_motions += normal.rows(3 * k, 3);
            from_distances += right.fixed_rows::<3>(3 * k);
        }
        for k in 0..count {
            of_plane += from_motions.fixed_view::<3, 3>(0, 3 * k);
        }
        // Points on a line leave a slope open.
        of_plane[(1, 1)] += SLOPE.powi(-2);
        of_plane[(2, 2)] += SLOPE.powi(-2);
        let inverse = of_plane.try_inverse().unwrap_or_else(Matrix3::zeros);
        normal -= from_motions.transpose() * inverse * &from_motions;
        right -= from_motions.transpose() * (inverse * from_distances);
        Self { stations, normal, right, inverse, from_motions, from_distances }
    }

    /// Numbers the stations by their place in a list that holds them all.
    pub(super) fn rename(&mut self, stations: &[usize]) {
        for station in &mut self.stations {
            *station = stations.iter().position(|other| other == station).unwrap_or(*station);
        }
    }

    /// Offset and slopes by which the plane moves with these motions of the stations (and parameters).
    pub(super) fn plane(&self, motions: &DVector<f64>) -> Vector3<f64> {
        let from_motions = &self.from_motions * motions;
        self.inverse * (self.from_distances + Vector3::new(from_motions[0], from_motions[1], from_motions[2]))
    }
}

/// How the motion z of a facet's points follows the tangent `[dt, dtheta]` of their station: `z = matrixᵀ x`.
pub(super) fn motion_of(facet: &Facet, pose: &Isometry3<f64>) -> Matrix6x3<f64> {
    let back = pose.rotation.inverse();
    let lever = facet.origin - pose.translation.vector;
    let turns = [lever, facet.right, facet.up].map(|arm| back * arm.cross(&facet.normal));
    Matrix6x3::from_fn(|row, column| match (row, column) {
        (0..3, 0) => facet.normal[row],
        (0..3, _) => 0.0,
        _ => turns[column][row - 3],
    })
}
