//! The observations of a shared plane with its unknown plane eliminated.
//!
//! A point at `[u, v]` on a shared plane sees the motion of its station as `[1, u, v] · z`, z being three numbers, and that of
//! the plane likewise: its distance is `ρ + [1, u, v] · (z − a) + derivatives · θ − c`, with the offset and slopes a of
//! the plane and the offset c by which the surface of a tile is off it. Both are unknown and eliminated exactly, so that
//! no point is used twice and the normal equations are those of all points.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix6x3, Vector3};

use crate::planes::shared_planes::SharedPlane;
use crate::planes::sums::{Sums, TileSums};

/// How well the slopes of a shared plane are known from the patches that it was found by, radian.
const SLOPE: f64 = 0.02;

/// Fewest points of a station by which it saw a tile, or takes part in a shared plane by tiles that others saw too: one or two are gross
/// errors, or lie on something beside the plane, and would hold a whole building where nothing else does. With 3
/// and 10 stations of a building are 0.33 and 0.38 mm off for 0.31, and fewer clouds of a Kinect come together without a doubt.
pub(crate) const FEWEST_POINTS: usize = 5;

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
    /// Weight of what each station saw of its tiles, in their order; `None`: one.
    pub weights: Option<&'a [Vec<f64>]>,
}

/// What a station saw of a tile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen<'s> {
    pub tile: usize,
    /// Place of the station in a list.
    pub of: usize,
    /// Place of the tile among those of the station.
    pub slot: usize,
    pub sums: TileSums<'s>,
    pub weight: f64,
}

/// Products of the motions of the stations that saw a shared plane.
#[derive(Debug, Clone)]
pub(crate) enum Products {
    /// Of all with all, and with the shared parameters; the plane eliminated.
    Eliminated(DMatrix<f64>),
    /// Of a plane that very many stations saw: those of stations that saw the same tiles (the lower triangle), and of the plane with
    /// itself. Elimination would couple all of its stations with each other.
    Beside(BTreeMap<(usize, usize), Matrix3<f64>>, Matrix3<f64>),
}

/// Normal equations of a shared plane: three unknowns a station that saw it, then the shared parameters, filled up to threes.
#[derive(Debug, Clone)]
pub(crate) struct Eliminated {
    pub stations: Vec<usize>,
    pub products: Products,
    pub right: DVector<f64>,
    /// Inverse of the normal matrix of the plane, and what it gets from the motions and from the distances.
    inverse: Matrix3<f64>,
    pub from_motions: DMatrix<f64>,
    pub from_distances: Vector3<f64>,
}

impl<'a> SharedPlaneSums<'a> {
    pub(crate) fn tiles(&self) -> Range<usize> {
        self.shared_plane.tiles.numbers()
    }

    /// What these stations saw of the tiles, tile by tile and in each in the order of the stations; what has no weight is left out.
    pub(crate) fn seen(&self, stations: &[usize]) -> Vec<Seen<'a>> {
        let (tiles, mut all) = (self.tiles(), Vec::new());
        for (of, &station) in stations.iter().enumerate() {
            let sums = &self.sums[station];
            for slot in sums.slots(&tiles) {
                let weight = self.weights.map_or(1.0, |weights| weights[station][slot]);
                let seen = sums.at(slot).filter(|_| weight > 0.0);
                all.extend(seen.map(|sums_of| Seen { tile: sums.tile(slot), of, slot, sums: sums_of, weight }));
            }
        }
        // Stable: the stations of a tile stay in their order.
        all.sort_by_key(|seen| seen.tile);
        all
    }

    /// The observations of these stations, ascending. `None` where fewer than two of them saw the shared plane. Where more than
    /// `most` did, the plane stays beside them.
    pub(crate) fn eliminated(&self, stations: &[usize], variances: Variances, most: usize) -> Option<Eliminated> {
        let mut seen = self.seen(stations);
        let mut common = vec![0; stations.len()];
        for one in seen.chunk_by(|a, b| a.tile == b.tile).filter(|tile| tile.len() > 1).flatten() {
            common[one.of] += self.sums[stations[one.of]].count(one.slot);
        }
        let all = stations.len();
        let stations: Vec<usize> = stations
            .iter()
            .zip(common)
            .filter(|(_, points)| *points >= FEWEST_POINTS)
            .map(|(station, _)| *station)
            .collect();
        if stations.len() < 2 {
            return None;
        }
        if stations.len() < all {
            seen = self.seen(&stations);
        }
        Some(Tiled::new(&seen, stations.len(), self.sums[0].order, variances).eliminated(stations, most))
    }
}

/// Products of the motions of stations over all tiles, with the offsets of these eliminated. The shared parameters, three by three,
/// stand for further stations.
struct Tiled {
    /// Of those that saw the same tiles: the lower triangle.
    pairs: BTreeMap<(usize, usize), Matrix3<f64>>,
    right: DVector<f64>,
}

impl Tiled {
    fn new(seen: &[Seen<'_>], count: usize, order: usize, variances: Variances) -> Self {
        let threes = order.div_ceil(3);
        let mut this = Self { pairs: BTreeMap::new(), right: DVector::zeros(3 * (count + threes - 1)) };
        let mut means: BTreeMap<usize, Vector3<f64>> = BTreeMap::new();
        for tile in seen.chunk_by(|a, b| a.tile == b.tile) {
            means.clear();
            let (mut weight, mut distance) = (0.0, 0.0);
            for Seen { of, sums, weight: own, .. } in tile {
                // Errors in common leave a tile less weight than its points have.
                let own = own / (1.0 + variances.shared * own * sums.weight());
                let place = |three: usize| if three == 0 { *of } else { count + three - 1 };
                for a in 0..threes {
                    for b in 0..=a {
                        *this.pairs.entry((place(a), place(b))).or_default() += own * sums.products(a, b);
                    }
                    this.add_right(place(a), own, &sums.rights(a));
                    *means.entry(place(a)).or_default() += own * sums.products(a, 0).column(0);
                }
                weight += own * sums.weight();
                distance += own * sums.right(0);
            }
            if variances.surface > 0.0 && weight > 0.0 {
                let share = 1.0 / (weight + 1.0 / variances.surface);
                for (&a, first) in &means {
                    this.add_right(a, -share * distance, first);
                    for (&b, second) in means.range(..=a) {
                        *this.pairs.entry((a, b)).or_default() -= share * first * second.transpose();
                    }
                }
            }
        }
        this
    }

    fn add_right(&mut self, place: usize, factor: f64, values: &Vector3<f64>) {
        let mut part = self.right.fixed_rows_mut::<3>(3 * place);
        part += factor * values;
    }

    /// The plane eliminated, or beside more than `most` stations.
    fn eliminated(self, stations: Vec<usize>, most: usize) -> Eliminated {
        let Self { pairs, mut right } = self;
        let (count, size) = (stations.len(), right.len());
        // The plane moves as all stations together would, the other way.
        let (mut from_motions, mut from_distances) = (DMatrix::zeros(3, size), Vector3::zeros());
        for (&(a, b), block) in &pairs {
            if a < count {
                let mut part = from_motions.fixed_view_mut::<3, 3>(0, 3 * b);
                part += block;
            }
            if b < count && a != b {
                let mut part = from_motions.fixed_view_mut::<3, 3>(0, 3 * a);
                part += block.transpose();
            }
        }
        let mut of_plane = Matrix3::zeros();
        for k in 0..count {
            from_distances += right.fixed_rows::<3>(3 * k);
            of_plane += from_motions.fixed_view::<3, 3>(0, 3 * k);
        }
        // Points on a line leave a slope open.
        of_plane[(1, 1)] += SLOPE.powi(-2);
        of_plane[(2, 2)] += SLOPE.powi(-2);
        let inverse = of_plane.try_inverse().unwrap_or_else(Matrix3::zeros);
        let products = if size == 3 * count && count > most {
            Products::Beside(pairs, of_plane)
        } else {
            let mut normal = DMatrix::zeros(size, size);
            for (&(a, b), block) in &pairs {
                normal.fixed_view_mut::<3, 3>(3 * b, 3 * a).copy_from(&block.transpose());
                normal.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(block);
            }
            normal -= from_motions.transpose() * inverse * &from_motions;
            right -= from_motions.transpose() * (inverse * from_distances);
            Products::Eliminated(normal)
        };
        Eliminated { stations, products, right, inverse, from_motions, from_distances }
    }
}

impl Eliminated {
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
