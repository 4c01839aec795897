use std::ops::Range;

use crate::{Adjustment, Error, Observation, Result};
use observation_equations::Named;

/// Column of a held parameter.
pub(crate) const HELD: usize = usize::MAX;

/// Where everything lies in flat memory: values, columns, rows and Jacobian entries.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Per block, and at the end the total.
    values: Vec<usize>,
    /// Start of each block's tangent components in `columns`, and at the end the total.
    tangent: Vec<usize>,
    /// Column of each tangent component, or [`HELD`]. The free components of a block follow each other.
    columns: Vec<usize>,
    /// First column of each block's free components, and at the end the number of unknowns.
    first: Vec<usize>,
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
    /// Blocks as the observations name them.
    named: Vec<Named>,
    /// Blocks with free parameters, of each observation sorted by column and without repetition.
    parts: Vec<Part>,
    /// Length of the compact Jacobians of all observations and constraints.
    pub(crate) jacobian: usize,
    /// Widest full Jacobian (elements) of any observation.
    pub(crate) widest: usize,
}

/// Where one observation (or constraint) lies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) row: usize,
    pub(crate) dimension: usize,
    /// Free parameters: width of its compact Jacobian.
    pub(crate) width: usize,
    /// Start of its compact Jacobian, `dimension × width`, row-major.
    pub(crate) jacobian: usize,
    /// Columns of its full Jacobian, as the model writes it.
    pub(crate) full: usize,
    /// Whether full and compact Jacobian are the same but for the order of blocks.
    pub(crate) direct: bool,
    named: (usize, usize),
    parts: (usize, usize),
}

/// A block in the compact Jacobian of an observation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    pub(crate) block: u32,
    /// First column of the block.
    pub(crate) column: u32,
    /// Number of columns.
    pub(crate) width: u32,
    /// Where they begin in a compact row.
    pub(crate) offset: u32,
}

impl Part {
    pub(crate) fn columns(&self) -> Range<usize> {
        self.column as usize..(self.column + self.width) as usize
    }

    pub(crate) fn entries(&self) -> Range<usize> {
        self.offset as usize..(self.offset + self.width) as usize
    }
}

impl Place {
    pub(crate) fn rows(&self) -> Range<usize> {
        self.row..self.row + self.dimension
    }

    pub(crate) fn jacobian_range(&self) -> Range<usize> {
        self.jacobian..self.jacobian + self.dimension * self.width
    }

    /// Where its parts lie among those of all observations.
    pub(crate) fn part_range(&self) -> Range<usize> {
        self.parts.0..self.parts.1
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
        let (mut values, mut tangent, mut columns, mut first) = (vec![0], vec![0], Vec::new(), vec![0]);
        let mut unknowns = 0;
        for (index, block) in adjustment.blocks.iter().enumerate() {
            block.check(index, &block.values)?;
            values.push(values[index] + block.values.len());
            tangent.push(tangent[index] + block.tangent_dimension());
            for &held in &block.held {
                columns.push(if held { HELD } else { unknowns });
                unknowns += usize::from(!held);
            }
            first.push(unknowns);
        }
        Ok(Self {
            values,
            tangent,
            columns,
            first,
            unknowns,
            rows: 0,
            observations: Vec::with_capacity(adjustment.observations.len()),
            constraints: Vec::new(),
            constraint_rows: 0,
            named: Vec::new(),
            parts: Vec::new(),
            jacobian: 0,
            widest: 0,
        })
    }

    fn place(&mut self, observation: &dyn Observation, row: usize) -> Place {
        let (first_named, first_part) = (self.named.len(), self.parts.len());
        let (mut full, mut direct) = (0, true);
        for block in observation.blocks() {
            let tangent = self.tangent[block.index() + 1] - self.tangent[block.index()];
            let free = self.free(block.index());
            direct &= free.len() == tangent;
            self.named.push(Named { block: block.index() as u32, start: full as u32, width: tangent as u32 });
            full += tangent;
            if !free.is_empty() {
                let (column, width) = (free.start as u32, free.len() as u32);
                self.parts.push(Part { block: block.index() as u32, column, width, offset: 0 });
            }
        }
        self.parts[first_part..].sort_by_key(|part| part.column);
        let count = self.parts.len();
        remove_repeated(&mut self.parts, first_part);
        direct &= count == self.parts.len();
        let mut width = 0;
        for part in &mut self.parts[first_part..] {
            part.offset = width;
            width += part.width;
        }
        if direct {
            // The model writes where the compact Jacobian wants it.
            for named in &mut self.named[first_named..] {
                let part = self.parts[first_part..].iter().find(|part| part.block == named.block);
                named.start = part.map_or(0, |part| part.offset);
            }
        }
        let (named, parts) = ((first_named, self.named.len()), (first_part, self.parts.len()));
        let (dimension, width) = (observation.dimension(), width as usize);
        let place = Place { row, dimension, width, jacobian: self.jacobian, full, direct, named, parts };
        self.jacobian += dimension * width;
        self.widest = self.widest.max(dimension * full.max(1));
        place
    }

    /// Columns of the tangent components of a block, [`HELD`] where they have none.
    pub(crate) fn block_columns(&self, block: usize) -> &[usize] {
        &self.columns[self.tangent[block]..self.tangent[block + 1]]
    }

    /// Columns of the free components of a block.
    pub(crate) fn free(&self, block: usize) -> Range<usize> {
        self.first[block]..self.first[block + 1]
    }

    /// The block that a column belongs to.
    pub(crate) fn block_of(&self, column: usize) -> usize {
        self.first.partition_point(|&first| first <= column) - 1
    }

    /// Number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        self.first.len() - 1
    }

    /// Where the values of a block lie.
    pub(crate) fn block_values(&self, block: usize) -> Range<usize> {
        self.values[block]..self.values[block + 1]
    }

    /// The blocks of an observation as it names them.
    pub(crate) fn named(&self, place: &Place) -> &[Named] {
        &self.named[place.named.0..place.named.1]
    }

    /// The blocks in the compact Jacobian of an observation.
    pub(crate) fn parts(&self, place: &Place) -> &[Part] {
        &self.parts[place.part_range()]
    }

    /// The parts of all observations and constraints.
    pub(crate) fn all_parts(&self) -> &[Part] {
        &self.parts
    }

    /// Columns of the entries of a compact row.
    pub(crate) fn columns(&self, place: &Place) -> impl Iterator<Item = usize> + Clone {
        self.parts(place).iter().flat_map(Part::columns)
    }

    /// `out = values ⊞ step` for all blocks; `step` is in columns.
    pub(crate) fn step(&self, adjustment: &Adjustment<'_>, values: &[f64], step: &[f64], out: &mut [f64]) {
        let mut tangent = Vec::new();
        for (index, block) in adjustment.blocks.iter().enumerate() {
            let (range, columns, free) = (self.block_values(index), self.block_columns(index), self.free(index));
            if free.is_empty() {
                out[range.clone()].copy_from_slice(&values[range]);
            } else if free.len() == columns.len() {
                block.manifold.plus(&values[range.clone()], &step[free], &mut out[range]);
            } else {
                tangent.clear();
                tangent.extend(columns.iter().map(|&column| if column == HELD { 0.0 } else { step[column] }));
                block.manifold.plus(&values[range.clone()], &tangent, &mut out[range]);
            }
        }
    }
}

/// Keeps one of the parts of a block that an observation names twice: its Jacobians add up.
fn remove_repeated(parts: &mut Vec<Part>, first: usize) {
    let mut kept = first;
    for index in first..parts.len() {
        if kept == first || parts[kept - 1].block != parts[index].block {
            parts[kept] = parts[index];
            kept += 1;
        }
    }
    parts.truncate(kept);
}
