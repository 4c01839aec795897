//! Absolute offsets: brightness and borders together, over all candidates of the brightness constant.

use crate::SpatialOptions;
use crate::absolute::brightness::Brightness;
use crate::absolute::labelling::{Labelling, lowest, reward};
use crate::image::borders::Tie;

/// Spacing of the candidates of the logarithm of the constant: half the sharper default scale. A finer one costs time
/// in proportion.
const SPACING: f32 = 0.2;
/// Candidates whose energy is further than this from the best, in nats, cannot change a confidence that matters. A
/// smaller value saves time and shows in confidences, `exp(-36)` in none.
const RELEVANT: f32 = 36.0;
/// Largest margin in nats, that of a segment that has only one possible label. `1 - exp(-30)` is one in single
/// precision.
const CERTAIN: f32 = 30.0;
/// Least share of the image's pixels that makes a segment a witness, and least pixels. Smaller ones are noise and the
/// mixed pixels around an object: each alone says little, but hundreds of them (a dark patch shattered by noise) would
/// together shift the scene. They follow. Tuned on the rooms of `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to
/// 12).
const WITNESS_SHARE: u32 = 1600;
const WITNESS_PIXELS: u32 = 16;
/// Independent draws that a whole scene is worth when two constants are weighed against each other, however many segments
/// it has: patches share materials, and incidence and light are wrong for many of them in the same way. Measured on
/// rendered rooms with and without dark materials; where the angle of incidence is taken out, less is common.
const SCENE_DRAWS: f32 = 6.0;
const SCENE_DRAWS_WITH_RAYS: f32 = 12.0;
/// Independent draws that the brightness of one segment is worth to its own count: it is one material. Tuned on the
/// rooms of `tests/absolute.rs` and `tests/dark_rooms.rs` (1 to 12): with more, brightness alone makes a segment sure.
const SEGMENT_DRAWS: f32 = 2.0;
const FOLLOWER: u32 = u32::MAX;

/// Offsets of the segments with their margins.
#[derive(Debug, Default)]
pub(crate) struct Offsets {
    /// Wrap offset of each segment.
    pub offset: Vec<u16>,
    /// Extra cost, in nats, of the best solution in which the segment has another offset, the evidence counted for what it
    /// is worth.
    pub margin: Vec<f32>,
    /// Logarithm of the constant found or given; `None` without any amplitude.
    pub log_constant: Option<f32>,
    /// Place of each segment among the witnesses, or `FOLLOWER`.
    place: Vec<u32>,
    witnesses: Vec<u32>,
    ties: Vec<Tie>,
    labelling: Labelling,
    costs: Vec<f32>,
    witness_costs: Vec<f32>,
    marginals: Vec<f32>,
    /// For each candidate, witness and label: extra cost within the candidate.
    excess: Vec<f32>,
    energies: Vec<f32>,
}

impl Offsets {
    pub fn find(&mut self, brightness: &Brightness, ties: &[Tie], pixels: &[u32], options: &SpatialOptions) {
        self.choose_witnesses(ties, pixels);
        self.labelling.set_graph(self.witnesses.len(), brightness.labels, &self.ties);
        self.offset.clear();
        self.offset.resize(pixels.len(), 0);
        self.margin.clear();
        self.margin.resize(pixels.len(), 0.0);
        self.excess.clear();
        self.energies.clear();
        let mut best = (f32::INFINITY, 0.0);
        for (log_constant, sweeps) in self.candidates(brightness, options) {
            let energy = self.solve(brightness, log_constant, options, sweeps);
            self.energies.push(energy);
            self.collect_excess(brightness);
            if energy < best.0 {
                best = (energy, log_constant);
                for (&segment, &offset) in self.witnesses.iter().zip(&self.labelling.offset) {
                    self.offset[segment as usize] = offset;
                }
            }
        }
        self.log_constant = brightness.span().map(|_| best.1);
        let draws = if options.geometry.is_some() { SCENE_DRAWS_WITH_RAYS } else { SCENE_DRAWS };
        self.weigh_candidates(brightness, best.0, draws);
        self.measure_margins(brightness.labels);
        self.costs.clear();
        for segment in 0..pixels.len() {
            brightness.add_costs_of(segment, best.1, &options.albedo, &mut self.costs);
        }
        self.lead_followers(ties, brightness.labels);
    }

    fn choose_witnesses(&mut self, ties: &[Tie], pixels: &[u32]) {
        let least = WITNESS_PIXELS.max(pixels.iter().sum::<u32>() / WITNESS_SHARE);
        let least = least.min(pixels.iter().copied().max().unwrap_or(0));
        self.witnesses.clear();
        self.place.clear();
        for (segment, &pixels) in pixels.iter().enumerate() {
            let witness = pixels >= least;
            self.place.push(if witness { self.witnesses.len() as u32 } else { FOLLOWER });
            if witness {
                self.witnesses.push(segment as u32);
            }
        }
        self.ties.clear();
        let place = |segment: u32| self.place[segment as usize];
        let placed = ties.iter().map(|tie| Tie { from: place(tie.from), to: place(tie.to), ..*tie });
        self.ties.extend(placed.filter(|tie| tie.from != FOLLOWER && tie.to != FOLLOWER));
    }

    fn solve(&mut self, brightness: &Brightness, log_constant: f32, options: &SpatialOptions, sweeps: usize) -> f32 {
        self.collect_costs(brightness, log_constant, options);
        self.labelling.solve(&self.witness_costs, sweeps)
    }

    /// Costs of the witnesses; those of the followers, most of the segments, are asked for at the best constant only.
    fn collect_costs(&mut self, brightness: &Brightness, log_constant: f32, options: &SpatialOptions) {
        self.witness_costs.clear();
        for &segment in &self.witnesses {
            brightness.add_costs_of(segment as usize, log_constant, &options.albedo, &mut self.witness_costs);
        }
    }

    /// Constants worth a full solution, from a coarse run over all.
    fn candidates(&mut self, brightness: &Brightness, options: &SpatialOptions) -> Vec<(f32, usize)> {
        const COARSE_SWEEPS: usize = 3;
        const SWEEPS: usize = 12;
        if let Some(typical) = options.albedo.typical_amplitude_at_interval {
            return vec![(typical.ln(), SWEEPS)];
        }
        let Some((low, high)) = brightness.span() else {
            return vec![(0.0, SWEEPS)];
        };
        let count = ((high - low) / SPACING).ceil() as usize + 1;
        // The likeliest first: whose bound is beyond what matters needs no solution.
        let mut bounds: Vec<(f32, f32)> = (0..count)
            .map(|index| {
                let log_constant = low + SPACING * index as f32;
                (self.bound(brightness, log_constant, options), log_constant)
            })
            .collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut best, mut coarse) = (f32::INFINITY, Vec::new());
        for (bound, log_constant) in bounds {
            if bound > best + RELEVANT {
                break;
            }
            let energy = self.solve(brightness, log_constant, options, COARSE_SWEEPS);
            best = best.min(energy);
            coarse.push((log_constant, energy));
        }
        coarse.retain(|c| c.1 <= best + RELEVANT);
        coarse.sort_by(|a, b| a.0.total_cmp(&b.0));
        coarse.into_iter().map(|c| (c.0, SWEEPS)).collect()
    }

    /// No solution at this constant has less energy: each witness at its best label, and every tie kept.
    fn bound(&mut self, brightness: &Brightness, log_constant: f32, options: &SpatialOptions) -> f32 {
        self.collect_costs(brightness, log_constant, options);
        let least = |costs: &[f32]| f64::from(costs.iter().copied().fold(f32::INFINITY, f32::min));
        let alone: f64 = self.witness_costs.chunks_exact(brightness.labels).map(least).sum();
        let kept: f64 = self.ties.iter().map(|tie| f64::from(tie.bonus)).sum();
        (alone - kept) as f32
    }

    /// Appends the extra cost of each label of each witness over its best at this constant. Where the segment's own
    /// brightness speaks for its best label, it does so only as one material.
    fn collect_excess(&mut self, brightness: &Brightness) {
        let labels = brightness.labels;
        for (witness, &segment) in self.witnesses.iter().enumerate() {
            let segment = segment as usize;
            let surplus = 1.0 - (SEGMENT_DRAWS / brightness.weight(segment)).min(1.0);
            let costs = &self.witness_costs[witness * labels..][..labels];
            let belief = self.labelling.belief(witness, &self.witness_costs);
            let best = lowest(belief);
            let own = |label: usize| brightness.albedo_part(segment, label, costs[label]);
            let excess = |(label, cost): (usize, &f32)| {
                (cost - belief[best] - surplus * (own(label) - own(best)).max(0.0)).max(0.0)
            };
            self.excess.extend(belief.iter().enumerate().map(excess));
        }
    }

    /// The least extra cost of each label of each witness over all constants, against the best constant.
    fn weigh_candidates(&mut self, brightness: &Brightness, best: f32, scene_draws: f32) {
        let draws: f32 = self.witnesses.iter().map(|&segment| brightness.weight(segment as usize)).sum();
        let tempering = scene_draws / (scene_draws + draws);
        let count = self.witnesses.len() * brightness.labels;
        self.marginals.clear();
        self.marginals.resize(count, f32::INFINITY);
        for (energy, excess) in self.energies.iter().zip(self.excess.chunks_exact(count.max(1))) {
            for (marginal, excess) in self.marginals.iter_mut().zip(excess) {
                *marginal = marginal.min(tempering * (energy - best) + excess);
            }
        }
    }

    fn measure_margins(&mut self, labels: usize) {
        for (marginals, &segment) in self.marginals.chunks_exact(labels).zip(&self.witnesses) {
            let own = usize::from(self.offset[segment as usize]);
            self.margin[segment as usize] = second_best(marginals, own).clamp(0.0, CERTAIN);
        }
    }

    /// Followers take the label that their own pixels and their decided neighbours favour; a follower is no surer than
    /// its own evidence or the surest neighbour that it agrees with. Three rounds let them follow one another.
    fn lead_followers(&mut self, ties: &[Tie], labels: usize) {
        let mut decided: Vec<bool> = self.place.iter().map(|&place| place != FOLLOWER).collect();
        for _ in 0..3 {
            let mut beliefs = self.costs.clone();
            let mut backed = vec![0.0_f32; decided.len() * labels];
            for tie in ties {
                for (from, to, step) in [(tie.from, tie.to, tie.step), (tie.to, tie.from, -tie.step)] {
                    let (from, to) = (from as usize, to as usize);
                    if self.place[to] != FOLLOWER || !decided[from] {
                        continue;
                    }
                    let label = i32::from(self.offset[from]) + step;
                    reward(&mut beliefs[to * labels..][..labels], label, tie.bonus);
                    if (0..labels as i32).contains(&label) {
                        let backing = &mut backed[to * labels + label as usize];
                        *backing = backing.max(self.margin[from]);
                    }
                }
            }
            for segment in 0..decided.len() {
                if self.place[segment] != FOLLOWER {
                    continue;
                }
                let at = segment * labels..(segment + 1) * labels;
                let (belief, own) = (&beliefs[at.clone()], &self.costs[at.clone()]);
                let label = (0..labels).fold(0, |best, k| if belief[k] < belief[best] { k } else { best });
                let alone = second_best(own, label) - own[label];
                let gap = second_best(belief, label) - belief[label];
                self.offset[segment] = label as u16;
                self.margin[segment] = gap.min(alone.max(backed[at][label])).clamp(0.0, CERTAIN);
            }
            decided.fill(true);
        }
    }
}

fn second_best(costs: &[f32], best: usize) -> f32 {
    let others = costs.iter().enumerate().filter(|(label, _)| *label != best);
    others.fold(f32::INFINITY, |second, (_, &cost)| second.min(cost))
}
