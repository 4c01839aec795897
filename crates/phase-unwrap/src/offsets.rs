//! Absolute offsets: brightness and borders together, over all candidates of the brightness constant.

use crate::SpatialOptions;
use crate::borders::Tie;
use crate::brightness::Brightness;
use crate::labelling::Labelling;

/// Spacing of the candidates of the logarithm of the constant: half the sharper default scale.
const SPACING: f32 = 0.2;
/// Candidates whose energy is further than this from the best cannot change a confidence that is above a half.
const RELEVANT: f32 = 12.0;
/// Gap in nats of a segment that has only one possible label.
const CERTAIN: f32 = 30.0;

/// Offsets of the segments with their margins.
#[derive(Debug, Default)]
pub(crate) struct Offsets {
    /// Wrap offset of each segment.
    pub offset: Vec<u16>,
    /// Cost, in nats, of the best solution in which the segment has another offset.
    pub margin: Vec<f32>,
    /// Logarithm of the constant found or given; `None` without any amplitude.
    pub log_constant: Option<f32>,
    labelling: Labelling,
    costs: Vec<f32>,
    marginals: Vec<f32>,
}

impl Offsets {
    pub fn find(&mut self, brightness: &Brightness, ties: &[Tie], segments: usize, options: &SpatialOptions) {
        self.labelling.set_graph(segments, brightness.labels, ties);
        self.marginals.clear();
        self.marginals.resize(segments * brightness.labels, f32::INFINITY);
        let mut best = f32::INFINITY;
        for (log_constant, sweeps) in self.candidates(brightness, options) {
            brightness.costs(log_constant, &options.albedo, &mut self.costs);
            let energy = self.labelling.solve(&self.costs, sweeps);
            self.collect_marginals(energy);
            if energy < best {
                best = energy;
                self.offset.clone_from(&self.labelling.offset);
                self.log_constant = brightness.span().map(|_| log_constant);
            }
        }
        self.measure_margins(best, brightness.labels);
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
        let coarse: Vec<(f32, f32)> = (0..count)
            .map(|index| {
                let log_constant = low + SPACING * index as f32;
                brightness.costs(log_constant, &options.albedo, &mut self.costs);
                (log_constant, self.labelling.solve(&self.costs, COARSE_SWEEPS))
            })
            .collect();
        let best = coarse.iter().fold(f32::INFINITY, |best, c| best.min(c.1));
        coarse.iter().filter(|c| c.1 <= best + RELEVANT).map(|c| (c.0, SWEEPS)).collect()
    }

    fn collect_marginals(&mut self, energy: f32) {
        let segments = self.labelling.offset.len();
        let labels = self.marginals.len() / segments.max(1);
        for (segment, marginals) in self.marginals.chunks_exact_mut(labels).enumerate() {
            let belief = self.labelling.belief(segment, &self.costs);
            let lowest = belief.iter().copied().fold(f32::INFINITY, f32::min);
            for (marginal, belief) in marginals.iter_mut().zip(belief) {
                *marginal = marginal.min(energy + belief - lowest);
            }
        }
    }

    fn measure_margins(&mut self, best: f32, labels: usize) {
        self.margin.clear();
        for (marginals, &offset) in self.marginals.chunks_exact(labels).zip(&self.offset) {
            let others = marginals.iter().enumerate().filter(|(label, _)| *label != usize::from(offset));
            let second = others.fold(f32::INFINITY, |second, (_, &m)| second.min(m));
            self.margin.push((second - best).clamp(0.0, CERTAIN));
        }
    }
}
