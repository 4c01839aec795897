//! Numbers whose derivatives follow from what was done to them.
// An operation is a few instructions; calling one would cost more than it does.
#![allow(clippy::inline_always)]

use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::Real;

/// A dual number: a value and its derivative with respect to **one** other number, a variable or a sum, product or quotient
/// of two that stands on a [`Tape`].
///
/// Functions of one number only change the derivative. Where two numbers meet, the result is written on the tape with its
/// two derivatives and is from then on a number of its own. Read backwards, by the chain rule, the tape has the derivatives
/// with respect to all variables, at a cost that hardly depends on how many there are.
#[derive(Debug, Clone, Copy)]
pub struct Dual<'t> {
    value: f64,
    slope: f64,
    /// With respect to which number the slope is.
    number: u32,
    /// A constant has none.
    tape: Option<&'t Tape<'t>>,
}

/// What was done to variables, in order.
#[derive(Debug)]
pub struct Tape<'m> {
    variables: u32,
    entries: List<'m, Entry>,
    further: List<'m, (u32, f64)>,
}

/// The two numbers that one was made from, and its derivatives with respect to them.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    from: [u32; 2],
    slopes: [f64; 2],
}

/// In place of the first number: the new one was made from as many as the second says, which stand in a list of their own.
const SEVERAL: u32 = u32::MAX;

/// A list in memory that was there before. What it has no room for is counted.
#[derive(Debug)]
struct List<'m, E: Copy> {
    count: Cell<usize>,
    places: &'m [Cell<E>],
}

impl<'m, E: Copy + Default> List<'m, E> {
    fn new(memory: &'m mut [E]) -> Self {
        Self { count: Cell::new(0), places: Cell::from_mut(memory).as_slice_of_cells() }
    }

    /// Gives the place of the first one in the list.
    #[inline(always)]
    fn push<const K: usize>(&self, elements: [E; K]) -> usize {
        let index = self.count.get();
        self.count.set(index + K);
        if let Some(places) = self.places.get(index..).and_then(|rest| rest.first_chunk::<K>()) {
            for k in 0..K {
                places[k].set(elements[k]);
            }
        }
        index
    }

    /// How many elements have no room.
    fn lacks(&self) -> usize {
        self.count.get().saturating_sub(self.places.len())
    }
}

impl<'m> Tape<'m> {
    fn new(variables: usize, memory: &'m mut TapeMemory) -> Self {
        let (entries, further) = (List::new(&mut memory.entries), List::new(&mut memory.further));
        Self { variables: variables as u32, entries, further }
    }

    /// Gives the new number.
    #[inline(always)]
    fn note(&self, entry: Entry) -> u32 {
        self.variables + self.entries.push([entry]) as u32
    }
}

/// Memory of tapes, used again from observation to observation.
#[derive(Debug, Default)]
pub struct TapeMemory {
    entries: Vec<Entry>,
    further: Vec<(u32, f64)>,
    /// Derivatives of all results with respect to each number; zero while not in use.
    derivatives: Vec<f64>,
}

impl TapeMemory {
    /// The values of a function of some variables; `give` gets the derivatives, for each variable those of all results.
    #[inline(always)]
    pub(crate) fn differentiate<const D: usize, E>(
        &mut self,
        variables: usize,
        function: impl for<'t> Fn(&'t Tape<'t>) -> Result<[Dual<'t>; D], E>,
        give: impl FnOnce(&[[f64; D]]),
    ) -> Result<[f64; D], E> {
        let (ends, entries, further) = loop {
            let tape = Tape::new(variables, self);
            let ends = function(&tape)?.map(End::new);
            let (entries, further) = (tape.entries.count.get(), tape.further.count.get());
            if tape.entries.lacks() + tape.further.lacks() == 0 {
                break (ends, entries, further);
            }
            // Never less than before: observations of another kind may want it.
            self.entries.resize(self.entries.len().max(2 * entries), Entry::default());
            self.further.resize(self.further.len().max(2 * further), (0, 0.0));
        };
        let wanted = (variables + entries) * D;
        if self.derivatives.len() < wanted {
            self.derivatives.resize(wanted, 0.0);
        }
        let (derivatives, _) = self.derivatives[..wanted].as_chunks_mut::<D>();
        let (entries, further) = (&self.entries[..entries], &self.further[..further]);
        if !read_backwards::<D, true>(entries, further, &ends, derivatives) {
            derivatives.fill([0.0; D]);
            read_backwards::<D, false>(entries, further, &ends, derivatives);
        }
        give(&derivatives[..variables]);
        // What is cleared now can be read at once when it is next wanted: not so where it is still on its way to memory.
        derivatives[..variables].as_flattened_mut().fill(0.0);
        Ok(ends.map(|end| end.value))
    }
}

/// A result.
#[derive(Clone, Copy)]
struct End {
    value: f64,
    slope: f64,
    number: Option<u32>,
}

impl End {
    #[inline(always)]
    fn new(dual: Dual<'_>) -> Self {
        Self { value: dual.value, slope: dual.slope, number: dual.tape.map(|_| dual.number) }
    }
}

/// Leaves the derivatives with respect to the variables, and zeros behind them.
///
/// Numbers of which no result was made may have derivatives that are not finite, and zero times infinity would spoil the
/// others. To pass over them takes time, so that it is only done where `HURRY` gives false.
#[inline(always)]
fn read_backwards<const D: usize, const HURRY: bool>(
    entries: &[Entry],
    further: &[(u32, f64)],
    ends: &[End; D],
    derivatives: &mut [[f64; D]],
) -> bool {
    for (row, end) in ends.iter().enumerate() {
        if let Some(number) = end.number {
            derivatives[number as usize][row] = end.slope;
        }
    }
    let (mut rest, mut further) = (derivatives, further);
    // Zero times what is not finite is not zero.
    let mut doubt = [0.0; 2];
    for &Entry { from: [first, second], slopes } in entries.iter().rev() {
        let Some((own, before)) = rest.split_last_mut() else { break };
        doubt[0] += slopes[0] * 0.0;
        doubt[1] += slopes[1] * 0.0;
        let has_share = HURRY || own.iter().any(|derivative| *derivative != 0.0);
        if first == SEVERAL {
            let (others, several) = further.split_at(further.len().saturating_sub(second as usize));
            further = others;
            for &(number, slope) in several.iter().filter(|_| has_share) {
                doubt[0] += slope * 0.0;
                add(&mut before[number as usize], slope, own);
            }
        } else if has_share {
            add(&mut before[first as usize], slopes[0], own);
            add(&mut before[second as usize], slopes[1], own);
        }
        *own = [0.0; D];
        rest = before;
    }
    doubt[0] + doubt[1] == 0.0
}

#[inline(always)]
fn add<const D: usize>(target: &mut [f64; D], slope: f64, own: &[f64; D]) {
    // Element by element in place would keep them from being computed side by side.
    *target = std::array::from_fn(
        #[inline(always)]
        |row| target[row] + slope * own[row],
    );
}

impl Dual<'_> {
    /// A function of two numbers with its derivatives.
    #[inline(always)]
    fn combine(self, other: Self, value: f64, own: f64, others: f64) -> Self {
        let slopes = [own * self.slope, others * other.slope];
        match (self.tape, other.tape) {
            (Some(tape), Some(_)) if self.number != other.number => {
                let number = tape.note(Entry { from: [self.number, other.number], slopes });
                Self { value, slope: 1.0, number, tape: Some(tape) }
            }
            (Some(_), Some(_)) => Self { value, slope: slopes[0] + slopes[1], ..self },
            (Some(_), None) => Self { value, slope: slopes[0], ..self },
            (None, _) => Self { value, slope: slopes[1], ..other },
        }
    }
}

impl From<f64> for Dual<'_> {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self { value, slope: 0.0, number: 0, tape: None }
    }
}

impl<'t> Real for Dual<'t> {
    type Tape = &'t Tape<'t>;

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }
    #[inline(always)]
    fn variable(value: f64, index: usize, tape: &'t Tape<'t>) -> Self {
        Self { value, slope: 1.0, number: index as u32, tape: Some(tape) }
    }
    #[inline(always)]
    fn apply(self, value: f64, slope: f64) -> Self {
        Self { value, slope: slope * self.slope, ..self }
    }
    #[inline(always)]
    fn function_of<const K: usize>(numbers: [Self; K], value: f64, slopes: [f64; K]) -> Self {
        let Some(tape) = numbers.iter().find_map(|number| number.tape) else { return Self::from(value) };
        // Constants have the number of the first variable, and no share in the result.
        tape.further.push::<K>(std::array::from_fn(
            #[inline(always)]
            |k| (numbers[k].number, numbers[k].tape.map_or(0.0, |_| slopes[k] * numbers[k].slope)),
        ));
        let number = tape.note(Entry { from: [SEVERAL, K as u32], slopes: [0.0; 2] });
        Self { value, slope: 1.0, number, tape: Some(tape) }
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let square = x.value * x.value + self.value * self.value;
        self.combine(x, self.value.atan2(x.value), x.value / square, -self.value / square)
    }
}

/// Sums, differences, products and quotients of two dual numbers, and of one with a constant.
macro_rules! operator {
    ($trait:ident, $method:ident, |$a:ident, $b:ident| $value:expr, $own:expr, $others:expr) => {
        impl $trait for Dual<'_> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.value, other.value);
                self.combine(other, $value, $own, $others)
            }
        }
        impl $trait<f64> for Dual<'_> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, $b: f64) -> Self {
                let $a = self.value;
                self.apply($value, $own)
            }
        }
    };
}
operator!(Add, add, |a, b| a + b, 1.0, 1.0);
operator!(Sub, sub, |a, b| a - b, 1.0, -1.0);
operator!(Mul, mul, |a, b| a * b, b, a);
operator!(Div, div, |a, b| a / b, 1.0 / b, -a / b / b);

impl Neg for Dual<'_> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.apply(-self.value, -1.0)
    }
}

#[cfg(test)]
mod tests;
