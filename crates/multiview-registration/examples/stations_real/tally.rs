//! All sets in a line.

/// What was counted.
#[derive(Default)]
pub struct Tally {
    sets: usize,
    stations: usize,
    placed: usize,
    squares: f64,
    /// Intruders, and how many of them were named.
    pub intruders: [usize; 2],
}

impl Tally {
    /// A set without an intruder: its stations, how many are placed, and the worst of these in millimetre.
    pub fn add(&mut self, stations: usize, placed: usize, worst_mm: f64) {
        self.sets += 1;
        self.stations += stations;
        self.placed += placed;
        self.squares += worst_mm.powi(2);
    }

    pub fn print(&self) {
        let Self { sets, stations, placed, squares, intruders: [all, named] } = self;
        let rms = (squares / *sets as f64).sqrt();
        println!(
            "all: {sets} runs answered, {placed} of {stations} stations placed, worst ones {rms:.1} mm rms; {named} of {all} intruders named"
        );
    }
}
