//! Evaluation of single observations into flat memory.

use crate::linearised::layout::{HELD, Layout, Place};
use crate::{Error, Jacobians, Observation};
use observation_equations::TapeMemory;

/// Whether derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Want {
    Residuals,
    Jacobians,
}

/// What went wrong in one observation, before its name is known.
pub(crate) struct Failure {
    component: usize,
    kind: FailureKind,
}

enum FailureKind {
    Model(String),
    NotFinite(&'static str, f64),
}

impl Failure {
    fn model(reason: String) -> Self {
        Self { component: 0, kind: FailureKind::Model(reason) }
    }

    pub(crate) fn name(self, group: &str, observation: usize) -> Error {
        let (group, component) = (group.to_owned(), self.component);
        match self.kind {
            FailureKind::Model(reason) => Error::Evaluation { group, observation, reason },
            FailureKind::NotFinite(what, value) => Error::NotFinite { group, observation, component, what, value },
        }
    }

    fn check(values: &[f64], width: usize, what: &'static str) -> Result<(), Self> {
        // Zero times anything that is not finite is NaN: eight sums without branches, that do not wait for each other.
        let (eights, rest) = values.as_chunks::<8>();
        let mut sums = [0.0; 8];
        for eight in eights {
            sums.iter_mut().zip(eight).for_each(|(sum, value)| *sum += value * 0.0);
        }
        sums.iter_mut().zip(rest).for_each(|(sum, value)| *sum += value * 0.0);
        if sums.iter().sum::<f64>() == 0.0 {
            return Ok(());
        }
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(()),
            Some(index) => Err(Self { component: index / width, kind: FailureKind::NotFinite(what, values[index]) }),
        }
    }
}

/// Memory for one observation at a time, allocated once a chunk.
pub(crate) struct Scratch<'v> {
    layout: &'v Layout,
    values: &'v [f64],
    want: Want,
    parameters: Vec<&'v [f64]>,
    full: Vec<f64>,
    tape: TapeMemory,
}

impl<'v> Scratch<'v> {
    pub(crate) fn new(layout: &'v Layout, values: &'v [f64], want: Want) -> Self {
        Self { layout, values, want, parameters: Vec::with_capacity(8), full: Vec::new(), tape: TapeMemory::default() }
    }

    /// Writes the residual and, where wanted, the compact Jacobian.
    pub(crate) fn evaluate(
        &mut self,
        observation: &dyn Observation,
        place: &Place,
        residual: &mut [f64],
        compact: &mut [f64],
    ) -> Result<(), Failure> {
        let named = self.layout.named(place);
        self.parameters.clear();
        let values = named.iter().map(|named| &self.values[self.layout.block_values(named.block as usize)]);
        self.parameters.extend(values);
        if self.want == Want::Residuals {
            let done = observation.evaluate(&self.parameters, residual, None);
            done.map_err(|failure| Failure::model(failure.to_string()))?;
            return Failure::check(residual, 1, "the residual");
        }
        let data = if place.direct {
            &mut *compact
        } else {
            self.full.resize(self.layout.widest, 0.0);
            &mut self.full[..place.dimension * place.full]
        };
        data.fill(0.0);
        let (width, dimension, tape) = (place.full, place.dimension, &mut self.tape);
        let mut jacobians = Jacobians::new(data, named, [dimension, width], tape);
        let done = observation.evaluate(&self.parameters, residual, Some(&mut jacobians));
        done.map_err(|failure| Failure::model(failure.to_string()))?;
        let Some(data) = jacobians.written() else {
            return Err(Failure::model("a Jacobian of the wrong shape was written".to_owned()));
        };
        Failure::check(residual, 1, "the residual")?;
        Failure::check(data, place.full.max(1), "a derivative")?;
        if !place.direct {
            self.compress(place, compact);
        }
        Ok(())
    }

    /// Keeps the free parameters' columns and adds up those of a block that is named twice.
    fn compress(&self, place: &Place, compact: &mut [f64]) {
        compact.fill(0.0);
        let layout = self.layout;
        for named in layout.named(place) {
            let Some(part) = layout.parts(place).iter().find(|part| part.block == named.block) else { continue };
            let columns = layout.block_columns(named.block as usize).iter().enumerate();
            for (component, &column) in columns.filter(|(_, column)| **column != HELD) {
                let (from, to) =
                    (named.start as usize + component, part.offset as usize + column - part.column as usize);
                for row in 0..place.dimension {
                    compact[row * place.width + to] += self.full[row * place.full + from];
                }
            }
        }
    }
}
