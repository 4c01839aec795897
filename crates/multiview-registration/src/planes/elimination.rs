//! The observations of a shared plane with its unknown plane eliminated.
//!
//! A point at `[u, v]` on a shared plane sees the motion of its station as `[1, u, v] · z`, z being three numbers, and that of
//! the plane likewise: its distance is `ρ + [1, u, v] · (z − a) + derivatives · θ − c`, with the offset and slopes a of
//! the plane and the offset c by which the surface of a tile is off it. Both are unknown and eliminated exactly, so that
//! no point is used twice and the normal equations are those of all points.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix6x3, Vector3};

use crate::planes::shared_planes::SharedPlane;
use crate::planes::sums::{Sums, TileSums};

/// How well the slopes of a shared plane are known from the patches that it was found by, radian.
const SLOPE: f64 = 0.02;

/// Variances beyond the noise of points, metre².
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Variances {
    /// Of the surface of a tile about the plane of its shared plane.
    pub surface: f64,
    /// Of what the points of a station in a tile have in common.
    pub shared: f64,
}

/// What the stations saw of one shared plane.
pub(crate) struct SharedPlaneSums<'a> {
    pub shared_plane: &'a SharedPlane,
    pub sums: &'a [Sums],
    /// Weight of what each station saw of each tile, tile by tile.
    pub weights: &'a [f64],
}

/// Normal equations of a shared plane: three unknowns a station that saw it, then the shared parameters.
#[derive(Debug, Clone)]
pub(crate) struct Eliminated {
    pub stations: Vec<usize>,
    pub normal: DMatrix<f64>,
    pub right: DVector<f64>,
    /// Inverse of the normal matrix of the plane, and what it gets from the motions and from the distances.
    inverse: Matrix3<f64>,
    from_motions: DMatrix<f64>,
    from_distances: Vector3<f64>,
}

impl SharedPlaneSums<'_> {
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

    pub(crate) fn tiles(&self) -> std::ops::Range<usize> {
        self.shared_plane.tiles.first..self.shared_plane.tiles.first + self.shared_plane.tiles.len()
    }

    /// Stations, of these, that saw something of the shared plane.
    pub(crate) fn seen_by(&self, stations: &[usize]) -> Vec<usize> {
        let sees = |station: usize| self.tiles().any(|tile| self.tile(tile, &[station]).next().is_some());
        stations.iter().copied().filter(|&station| sees(station)).collect()
    }

    /// The observations of these stations. `None` where fewer than two of them saw the shared plane.
    pub(crate) fn eliminated(&self, stations: &[usize], variances: Variances) -> Option<Eliminated> {
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
                let own = own / (1.0 + variances.shared * own * sums.weight());
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
            if variances.surface > 0.0 && weight > 0.0 {
                at.extend(of_motions..size);
                let share = 1.0 / (weight + 1.0 / variances.surface);
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
    pub(crate) fn rename(&mut self, stations: &[usize]) {
        for station in &mut self.stations {
            *station = stations.iter().position(|other| other == station).unwrap_or(*station);
        }
    }

    /// Offset and slopes by which the plane moves with these motions of the stations (and parameters).
    pub(crate) fn plane(&self, motions: &DVector<f64>) -> Vector3<f64> {
        let from_motions = &self.from_motions * motions;
        self.inverse * (self.from_distances + Vector3::new(from_motions[0], from_motions[1], from_motions[2]))
    }
}

/// How the motion z of a shared plane's points follows the tangent `[dt, dtheta]` of their station: `z = matrixᵀ x`.
pub(crate) fn motion_of(shared_plane: &SharedPlane, pose: &Isometry3<f64>) -> Matrix6x3<f64> {
    let back = pose.rotation.inverse();
    let lever = shared_plane.origin - pose.translation.vector;
    let turns = [lever, shared_plane.right, shared_plane.up].map(|arm| back * arm.cross(&shared_plane.normal));
    Matrix6x3::from_fn(|row, column| match (row, column) {
        (0..3, 0) => shared_plane.normal[row],
        (0..3, _) => 0.0,
        _ => turns[column][row - 3],
    })
}
