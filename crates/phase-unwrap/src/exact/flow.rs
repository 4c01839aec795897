//! Successive shortest paths between residues, with potentials that prove the optimum.

use super::network::{LARGEST_PRICE, Network, UNPRICED};
use super::regions::{NONE, OUTSIDE, Regions};
use crate::tree::grid::Grid;

/// Circular array of buckets: reduced costs are at most twice the largest price.
const BUCKETS: usize = 256;
const _: () = assert!(BUCKETS > 2 * LARGEST_PRICE as usize);
/// How a loop was reached: over one of its four sides, or inside its region.
const WITHIN: u8 = 4;
/// Radii of the searches, in units of price: near partners first, so that few searches are long.
const FIRST_RADIUS: u32 = 4 * LARGEST_PRICE as u32;

/// State of the flow and of one search.
#[derive(Debug, Default)]
pub(super) struct Flow {
    /// Dual variable of each loop; 0 outside.
    potential: Vec<i32>,
    /// Residue that is left at each loop; that of a hole is kept at its representative.
    excess: Vec<i32>,
    distance: Vec<u32>,
    /// Number of the search that reached the loop, doubled; plus one when its distance is final.
    mark: Vec<u32>,
    search: u32,
    from: Vec<u8>,
    /// First loop of each region that the search reached.
    entry: Vec<(u32, u32)>,
    settled: Vec<u32>,
    buckets: Vec<Vec<u32>>,
    sources: Vec<u32>,
}

/// What does not change during the search.
#[derive(Clone, Copy)]
struct Image<'a> {
    grid: &'a Grid,
    phase: &'a [f32],
    regions: &'a Regions,
}

/// A side of a loop: the step to the loop beyond, and the edge that is crossed.
#[derive(Clone, Copy)]
struct Side {
    step: usize,
    axis: usize,
    edge: usize,
    /// Change of the added cycles when one unit of residue is moved across.
    change: i32,
}

fn sides(grid: &Grid) -> [Side; 4] {
    let stride = grid.stride;
    [
        Side { step: 0_usize.wrapping_sub(stride), axis: 0, edge: 0, change: -1 },
        Side { step: stride, axis: 0, edge: stride, change: 1 },
        Side { step: usize::MAX, axis: 1, edge: 0, change: 1 },
        Side { step: 1, axis: 1, edge: 1, change: -1 },
    ]
}

impl Flow {
    /// Loads the residues; their number, where a hole counts as one.
    pub fn start(&mut self, grid: &Grid, network: &Network, regions: &Regions) -> usize {
        for plane in [&mut self.potential, &mut self.excess] {
            plane.clear();
            plane.resize(grid.len(), 0);
        }
        self.mark.clear();
        self.mark.resize(grid.len(), 0);
        self.distance.resize(grid.len(), 0);
        self.from.resize(grid.len(), 0);
        self.entry.clear();
        self.entry.resize(regions.len() + 1, (0, 0));
        self.buckets.resize(BUCKETS, Vec::new());
        self.search = 0;
        for (f, &residue) in network.residue.iter().enumerate() {
            if residue != 0 && regions.region[f] != OUTSIDE {
                self.excess[regions.representative(f)] += i32::from(residue);
            }
        }
        self.sources.clear();
        let sources = self.excess.iter().enumerate().filter(|(_, excess)| **excess != 0);
        self.sources.extend(sources.map(|(f, _)| f as u32));
        self.sources.len()
    }

    /// Adds cycles to the steps until all loops close; after [`Flow::start`].
    pub fn solve(&mut self, grid: &Grid, phase: &[f32], network: &mut Network, regions: &Regions) {
        let image = Image { grid, phase, regions };
        let mut radius = FIRST_RADIUS;
        while !self.sources.is_empty() {
            let mut sources = std::mem::take(&mut self.sources);
            sources.retain(|&source| !self.discharge(image, network, source as usize, radius));
            self.sources = sources;
            radius = radius.saturating_mul(4);
        }
    }

    /// Moves the residue of a loop to residues of the other sign or outside; false if none lies within the radius.
    fn discharge(&mut self, image: Image<'_>, network: &mut Network, source: usize, radius: u32) -> bool {
        while self.excess[source] != 0 {
            let sign = self.excess[source].signum();
            let Some(target) = self.find(image, network, source, sign, radius) else {
                return false;
            };
            let reached = self.distance[target];
            for &f in &self.settled {
                // At most the reach of the search, a few times the image's side in prices.
                self.potential[f as usize] += sign * (self.distance[f as usize] as i32 - reached as i32);
            }
            self.carry(image, network, [source, target], sign);
            self.excess[source] -= sign;
            if image.regions.region[target] != OUTSIDE {
                self.excess[image.regions.representative(target)] += sign;
            }
        }
        true
    }

    /// The nearest loop that takes a residue of this sign, by reduced cost.
    fn find(
        &mut self,
        image: Image<'_>,
        network: &mut Network,
        source: usize,
        sign: i32,
        radius: u32,
    ) -> Option<usize> {
        let regions = image.regions;
        self.search += 1;
        self.settled.clear();
        let mut waiting = 0;
        self.reach(source, 0, WITHIN, &mut waiting);
        let mut distance = 0;
        let mut found = None;
        while waiting > 0 && distance <= radius {
            let Some(f) = self.buckets[distance as usize % BUCKETS].pop() else {
                distance += 1;
                continue;
            };
            let f = f as usize;
            waiting -= 1;
            if self.mark[f] != 2 * self.search || self.distance[f] != distance {
                continue;
            }
            self.mark[f] += 1;
            self.settled.push(f as u32);
            let region = regions.region[f];
            if region == OUTSIDE || self.excess[regions.representative(f)].signum() == -sign {
                found = Some(f);
                break;
            }
            if region != NONE {
                self.enter(regions, f, distance, &mut waiting);
            }
            self.expand(image, network, f, sign, &mut waiting);
        }
        // A search that found its target leaves entries behind.
        if waiting > 0 {
            self.buckets.iter_mut().for_each(Vec::clear);
        }
        found
    }

    /// Reaches the four loops beside a final one.
    #[inline]
    fn expand(&mut self, image: Image<'_>, network: &mut Network, f: usize, sign: i32, waiting: &mut usize) {
        let Image { grid, phase, .. } = image;
        let distance = self.distance[f];
        for (direction, side) in sides(grid).iter().enumerate() {
            let edge = f + side.edge;
            let price = i32::from(network.price(phase, side.axis, edge, [1, grid.stride][side.axis]));
            if price == 0 {
                continue;
            }
            let other = f.wrapping_add(side.step);
            let added = network.added[side.axis][edge] * side.change * sign;
            let cost = if added >= 0 { price } else { -price };
            // Never negative: that is what the potentials are for.
            let reduced = cost + sign * (self.potential[f] - self.potential[other]);
            self.reach(other, distance + reduced.unsigned_abs(), direction as u8, waiting);
        }
    }

    #[inline]
    fn reach(&mut self, f: usize, distance: u32, from: u8, waiting: &mut usize) {
        let mark = self.mark[f];
        let open = 2 * self.search;
        if mark < open || (mark == open && distance < self.distance[f]) {
            self.mark[f] = open;
            self.distance[f] = distance;
            self.from[f] = from;
            self.buckets[distance as usize % BUCKETS].push(f as u32);
            *waiting += 1;
        }
    }

    /// Inside a hole nothing costs anything: all of its loops are as far as the first one.
    fn enter(&mut self, regions: &Regions, f: usize, distance: u32, waiting: &mut usize) {
        let region = regions.region[f];
        if self.entry[region as usize].0 == self.search {
            return;
        }
        self.entry[region as usize] = (self.search, f as u32);
        for &member in regions.members(region) {
            self.reach(member as usize, distance, WITHIN, waiting);
        }
    }

    /// Adds the cycles along the path that the search found.
    fn carry(&self, image: Image<'_>, network: &mut Network, [source, target]: [usize; 2], sign: i32) {
        let sides = sides(image.grid);
        let mut f = target;
        while f != source {
            if self.from[f] == WITHIN {
                f = self.entry[image.regions.region[f] as usize].1 as usize;
            } else {
                let side = sides[usize::from(self.from[f])];
                f = f.wrapping_sub(side.step);
                network.added[side.axis][f + side.edge] += side.change * sign;
            }
        }
    }

    /// The cost of the added cycles, and the value of the dual solution if it is feasible.
    ///
    /// Feasible are potentials that differ by at most the price across each edge, are equal in a region and 0 outside:
    /// then no flow is cheaper than the sum of residues times potentials.
    pub fn certificate(&self, grid: &Grid, network: &Network, regions: &Regions) -> (u64, Option<u64>) {
        let (mut cost, mut feasible) = (0, true);
        for (axis, step) in [grid.stride, 1].into_iter().enumerate() {
            for (edge, (&price, &added)) in network.price[axis].iter().zip(&network.added[axis]).enumerate() {
                // What no search came by has no cycles added and no potential on either side.
                if price > 0 {
                    cost += u64::from(price) * u64::from(added.unsigned_abs());
                    let difference = self.potential[edge] - self.potential[edge - step];
                    let allowed = if price == UNPRICED { 0 } else { price };
                    feasible &= difference.unsigned_abs() <= u32::from(allowed);
                }
            }
        }
        let mut bound = 0;
        for (f, &residue) in network.residue.iter().enumerate() {
            let potential = self.potential[f];
            bound -= i64::from(residue) * i64::from(potential);
            feasible &= match regions.region[f] {
                NONE => true,
                OUTSIDE => potential == 0,
                _ => potential == self.potential[regions.representative(f)],
            };
        }
        (cost, if feasible { u64::try_from(bound).ok() } else { None })
    }
}
