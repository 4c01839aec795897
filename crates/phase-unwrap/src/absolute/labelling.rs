//! The offsets of all segments together: sequential tree-reweighted message passing `[Kolmogorov2006]` over the graph
//! of segments, once for each candidate of the brightness constant.

use crate::image::borders::Tie;

/// The segment graph with its messages.
#[derive(Debug, Default)]
pub(crate) struct Labelling {
    labels: usize,
    /// Ties sorted by `from`, and for each segment the ties that end in it.
    ties: Vec<Tie>,
    first_from: Vec<u32>,
    into: Vec<u32>,
    first_into: Vec<u32>,
    /// Messages along each tie: to its `to` end, and to its `from` end.
    forward: Vec<f32>,
    backward: Vec<f32>,
    share: Vec<f32>,
    belief: Vec<f32>,
    outgoing: Vec<f32>,
    /// Offset of each segment after [`Labelling::solve`].
    pub offset: Vec<u16>,
}

impl Labelling {
    /// Takes the graph; ties must be sorted by `from` and run from the lower to the higher segment.
    pub fn set_graph(&mut self, segments: usize, labels: usize, ties: &[Tie]) {
        self.labels = labels;
        self.ties.clear();
        self.ties.extend_from_slice(ties);
        let mut from = vec![0_u32; segments + 1];
        let mut into = vec![0_u32; segments + 1];
        for tie in ties {
            from[tie.from as usize + 1] += 1;
            into[tie.to as usize + 1] += 1;
        }
        self.share.clear();
        self.share.extend((0..segments).map(|s| 1.0 / from[s + 1].max(into[s + 1]).max(1) as f32));
        for counts in [&mut from, &mut into] {
            for s in 0..segments {
                counts[s + 1] += counts[s];
            }
        }
        self.into = vec![0; ties.len()];
        let mut next = into.clone();
        for (index, tie) in ties.iter().enumerate() {
            let slot = &mut next[tie.to as usize];
            self.into[*slot as usize] = index as u32;
            *slot += 1;
        }
        self.first_from = from;
        self.first_into = into;
        self.offset.clear();
        self.offset.resize(segments, 0);
        self.belief.resize(labels, 0.0);
        self.outgoing.resize(labels, 0.0);
    }

    /// Minimises the energy for these costs; returns it. Messages start anew.
    pub fn solve(&mut self, costs: &[f32], sweeps: usize) -> f32 {
        for messages in [&mut self.forward, &mut self.backward] {
            messages.clear();
            messages.resize(self.ties.len() * self.labels, 0.0);
        }
        let segments = self.offset.len();
        for _ in 0..sweeps {
            for segment in 0..segments {
                self.gather(segment, costs);
                self.send_forward(segment);
            }
            for segment in (0..segments).rev() {
                self.gather(segment, costs);
                self.send_backward(segment);
            }
        }
        self.decode(costs);
        self.improve(costs);
        self.energy(costs)
    }

    /// Cost of each label of a segment with all messages that reach it.
    pub fn belief(&mut self, segment: usize, costs: &[f32]) -> &[f32] {
        self.gather(segment, costs);
        &self.belief
    }

    fn gather(&mut self, segment: usize, costs: &[f32]) {
        let labels = self.labels;
        self.belief.copy_from_slice(&costs[segment * labels..][..labels]);
        for slot in self.slots_into(segment) {
            let tie = self.into[slot] as usize;
            add(&mut self.belief, &self.forward[tie * labels..][..labels]);
        }
        for tie in self.ties_from(segment) {
            add(&mut self.belief, &self.backward[tie * labels..][..labels]);
        }
    }

    fn ties_from(&self, segment: usize) -> std::ops::Range<usize> {
        self.first_from[segment] as usize..self.first_from[segment + 1] as usize
    }

    /// Positions in `into` of the ties that end in a segment.
    fn slots_into(&self, segment: usize) -> std::ops::Range<usize> {
        self.first_into[segment] as usize..self.first_into[segment + 1] as usize
    }

    fn send_forward(&mut self, segment: usize) {
        let (labels, share) = (self.labels, self.share[segment]);
        for tie in self.ties_from(segment) {
            let slots = tie * labels..(tie + 1) * labels;
            remaining(&self.belief, share, &self.backward[slots.clone()], &mut self.outgoing);
            let Tie { step, bonus, .. } = self.ties[tie];
            message(&self.outgoing, step, bonus, &mut self.forward[slots]);
        }
    }

    fn send_backward(&mut self, segment: usize) {
        let (labels, share) = (self.labels, self.share[segment]);
        for slot in self.slots_into(segment) {
            let tie = self.into[slot] as usize;
            let slots = tie * labels..(tie + 1) * labels;
            remaining(&self.belief, share, &self.forward[slots.clone()], &mut self.outgoing);
            let Tie { step, bonus, .. } = self.ties[tie];
            message(&self.outgoing, -step, bonus, &mut self.backward[slots]);
        }
    }

    /// Labels in order of the segments, each given those before it.
    fn decode(&mut self, costs: &[f32]) {
        let labels = self.labels;
        for segment in 0..self.offset.len() {
            self.belief.copy_from_slice(&costs[segment * labels..][..labels]);
            for slot in self.slots_into(segment) {
                let tie = self.into[slot] as usize;
                let Tie { from, step, bonus, .. } = self.ties[tie];
                reward(&mut self.belief, i32::from(self.offset[from as usize]) + step, bonus);
            }
            for tie in self.ties_from(segment) {
                add(&mut self.belief, &self.backward[tie * labels..][..labels]);
            }
            self.offset[segment] = lowest(&self.belief) as u16;
        }
    }

    /// Single segments move as long as one gains.
    fn improve(&mut self, costs: &[f32]) {
        for _ in 0..10 {
            let mut moved = false;
            for segment in 0..self.offset.len() {
                self.conditional(segment, costs);
                let old = usize::from(self.offset[segment]);
                let new = lowest(&self.belief);
                if self.belief[new] < self.belief[old] {
                    self.offset[segment] = new as u16;
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
    }

    fn conditional(&mut self, segment: usize, costs: &[f32]) {
        self.belief.copy_from_slice(&costs[segment * self.labels..][..self.labels]);
        for slot in self.slots_into(segment) {
            let tie = self.into[slot] as usize;
            let Tie { from, step, bonus, .. } = self.ties[tie];
            reward(&mut self.belief, i32::from(self.offset[from as usize]) + step, bonus);
        }
        for tie in self.ties_from(segment) {
            let Tie { to, step, bonus, .. } = self.ties[tie];
            reward(&mut self.belief, i32::from(self.offset[to as usize]) - step, bonus);
        }
    }

    fn energy(&self, costs: &[f32]) -> f32 {
        let unary: f64 =
            self.offset.iter().zip(costs.chunks_exact(self.labels)).map(|(&k, c)| f64::from(c[usize::from(k)])).sum();
        let kept = |tie: &&Tie| {
            i32::from(self.offset[tie.to as usize]) - i32::from(self.offset[tie.from as usize]) == tie.step
        };
        let bonus: f64 = self.ties.iter().filter(kept).map(|tie| f64::from(tie.bonus)).sum();
        (unary - bonus) as f32
    }
}

fn add(sum: &mut [f32], term: &[f32]) {
    for (sum, term) in sum.iter_mut().zip(term) {
        *sum += term;
    }
}

/// Takes a bonus off the cost of a label, where there is that label.
pub(crate) fn reward(belief: &mut [f32], label: i32, bonus: f32) {
    if let Some(cost) = usize::try_from(label).ok().and_then(|label| belief.get_mut(label)) {
        *cost -= bonus;
    }
}

/// The share of a belief that one tie may carry, without what came along that tie.
fn remaining(belief: &[f32], share: f32, received: &[f32], out: &mut [f32]) {
    for ((out, belief), received) in out.iter_mut().zip(belief).zip(received) {
        *out = share * belief - received;
    }
}

/// Message for the potential `-bonus` where label(to) = label(from) + step, else 0.
fn message(outgoing: &[f32], step: i32, bonus: f32, message: &mut [f32]) {
    let free = outgoing.iter().copied().fold(f32::INFINITY, f32::min);
    for (label, out) in message.iter_mut().enumerate() {
        let tied = usize::try_from(label as i32 - step).ok().and_then(|from| outgoing.get(from));
        *out = tied.map_or(free, |cost| free.min(cost - bonus)) - free;
    }
}

/// The label of lowest cost.
pub(crate) fn lowest(costs: &[f32]) -> usize {
    let better = |best: usize, index: usize| if costs[index] < costs[best] { index } else { best };
    (0..costs.len()).fold(0, better)
}
