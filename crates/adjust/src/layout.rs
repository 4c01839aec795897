use crate::{Adjustment, Error, Observation, Result};

/// Column of a held parameter.
pub(crate) const HELD: usize = usize::MAX;

/// Unknowns of a dense normal matrix of 1.8 GB.
const LARGEST: usize = 15_000;

/// Where everything lies in flat memory: values, columns, rows and Jacobian entries.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Per block, and at the end the total.
    pub(crate) values: Vec<usize>,
    /// Start of each block's tangent components in `columns`, and at the end the total.
    pub(crate) tangent: Vec<usize>,
    /// Column of each tangent component, or [`HELD`].
    pub(crate) columns: Vec<usize>,
    /// Number of unknowns.
    pub(crate) unknowns: usize,
    /// Number of rows (components of all observations).
    pub(crate) rows: usize,
    /// One per observation.
    pub(crate) observations: Vec<Place>,
    /// One per constraint.
    pub(crate) constraints: Vec<Place>,
    /// Number of rows of the constraints.
    pub(crate) constraint_rows: usize,
    /// For the free parameters of each observation: place in its full Jacobian row, and column. Sorted by column.
    pub(crate) active: Vec<(usize, usize)>,
    /// Length of the compact Jacobians of all observations.
    pub(crate) jacobian: usize,
    /// Widest full Jacobian (elements) and largest dimension of any observation.
    pub(crate) widest: usize,
}

/// Where one observation (or constraint) lies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) row: usize,
    pub(crate) dimension: usize,
    /// Range in [`Layout::active`].
    pub(crate) active: (usize, usize),
    /// Start of its compact Jacobian, `dimension × active`, row-major.
    pub(crate) jacobian: usize,
}

impl Place {
    pub(crate) fn width(&self) -> usize {
        self.active.1 - self.active.0
    }

    pub(crate) fn rows(&self) -> std::ops::Range<usize> {
        self.row..self.row + self.dimension
    }

    pub(crate) fn jacobian_range(&self) -> std::ops::Range<usize> {
        self.jacobian..self.jacobian + self.dimension * self.width()
    }
}

impl Layout {
    /// Checks the start values and lays everything out.
    pub(crate) fn new(adjustment: &Adjustment<'_>) -> Result<Self> {
        let mut layout = Self::of_blocks(adjustment)?;
        for stored in &adjustment.observations {
            let place = layout.place(stored.observation.as_ref(), layout.rows);
            layout.rows += place.dimension;
            layout.observations.push(place);
        }
        for constraint in &adjustment.constraints {
            let place = layout.place(constraint.as_ref(), layout.constraint_rows);
            layout.constraint_rows += place.dimension;
            layout.constraints.push(place);
        }
        Ok(layout)
    }

    fn of_blocks(adjustment: &Adjustment<'_>) -> Result<Self> {
        if adjustment.observations.is_empty() {
            return Err(Error::NoObservations);
        }
        let (mut values, mut tangent, mut columns) = (vec![0], vec![0], Vec::new());
        let mut unknowns = 0;
        for (index, block) in adjustment.blocks.iter().enumerate() {
            block.check(index, &block.values)?;
            values.push(values[index] + block.values.len());
            tangent.push(tangent[index] + block.tangent_dimension());
            for &held in &block.held {
                columns.push(if held { HELD } else { unknowns });
                unknowns += usize::from(!held);
            }
        }
        if unknowns > LARGEST {
            return Err(Error::TooLarge { unknowns, limit: LARGEST });
        }
        Ok(Self {
            values,
            tangent,
            columns,
            unknowns,
            rows: 0,
            observations: Vec::with_capacity(adjustment.observations.len()),
            constraints: Vec::new(),
            constraint_rows: 0,
            active: Vec::new(),
            jacobian: 0,
            widest: 0,
        })
    }

    fn place(&mut self, observation: &dyn Observation, row: usize) -> Place {
        let (start, dimension) = (self.active.len(), observation.dimension());
        let mut width = 0;
        for block in observation.blocks() {
            for index in self.tangent[block.0]..self.tangent[block.0 + 1] {
                let column = self.columns[index];
                if column != HELD {
                    self.active.push((width, column));
                }
                width += 1;
            }
        }
        self.active[start..].sort_by_key(|&(_, column)| column);
        let place = Place { row, dimension, active: (start, self.active.len()), jacobian: self.jacobian };
        self.jacobian += dimension * place.width();
        self.widest = self.widest.max(dimension * width.max(1));
        place
    }

    /// Columns of the tangent components of a block.
    pub(crate) fn block_columns(&self, block: usize) -> &[usize] {
        &self.columns[self.tangent[block]..self.tangent[block + 1]]
    }

    /// Where the values of a block lie.
    pub(crate) fn block_values(&self, block: usize) -> std::ops::Range<usize> {
        self.values[block]..self.values[block + 1]
    }

    /// Free parameters of an observation: place in its full Jacobian row, and column.
    pub(crate) fn active(&self, place: &Place) -> &[(usize, usize)] {
        &self.active[place.active.0..place.active.1]
    }

    /// `out = values ⊞ step` for all blocks; `step` is in columns.
    pub(crate) fn step(&self, adjustment: &Adjustment<'_>, values: &[f64], step: &[f64], out: &mut [f64]) {
        let mut tangent = Vec::new();
        for (index, block) in adjustment.blocks.iter().enumerate() {
            let (range, columns) = (self.block_values(index), self.block_columns(index));
            if columns.iter().all(|&column| column == HELD) {
                out[range.clone()].copy_from_slice(&values[range]);
                continue;
            }
            tangent.clear();
            tangent.extend(columns.iter().map(|&column| if column == HELD { 0.0 } else { step[column] }));
            block.manifold.plus(&values[range.clone()], &tangent, &mut out[range]);
        }
    }
}
