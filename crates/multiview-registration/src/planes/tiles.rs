//! The extent of a shared plane as a grid of tiles.

/// What is known of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Tile {
    /// Nobody saw the shared plane there.
    Outside,
    /// Beside a seen one: the shared plane may end there.
    Rim,
    /// Seen.
    Core,
}

/// Tiles of a shared plane.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tiles {
    size_m: f64,
    low: [i64; 2],
    columns: usize,
    rows: usize,
    kinds: Vec<Tile>,
    /// Number of the first tile among those of all shared planes.
    pub first: usize,
}

/// Most tiles of a side.
const MOST: usize = 4000;

impl Tiles {
    /// Tiles with one of these places in them, and those beside.
    pub(crate) fn around(places: &[[f64; 2]], size_m: f64) -> Self {
        let cell = |place: &[f64; 2]| place.map(|value| (value / size_m).floor() as i64);
        let ends = |axis: usize| {
            let all = places.iter().map(|place| cell(place)[axis]);
            (all.clone().min().unwrap_or(0) - 1, all.max().unwrap_or(0) + 1)
        };
        let (across, along) = (ends(0), ends(1));
        let columns = ((across.1 - across.0 + 1) as usize).min(MOST);
        let rows = ((along.1 - along.0 + 1) as usize).min(MOST);
        let mut tiles = Self {
            size_m,
            low: [across.0, along.0],
            columns,
            rows,
            kinds: vec![Tile::Outside; columns * rows],
            first: 0,
        };
        for place in places {
            let [column, row] = cell(place);
            for (c, r) in (-1..2).flat_map(|c| (-1..2).map(move |r| (c, r))) {
                if let Some(index) = tiles.index_of([column + c, row + r]) {
                    tiles.kinds[index] = tiles.kinds[index].max(if (c, r) == (0, 0) { Tile::Core } else { Tile::Rim });
                }
            }
        }
        tiles
    }

    /// A single tile around the origin.
    pub(crate) fn one(size_m: f64) -> Self {
        Self { size_m, low: [0; 2], columns: 1, rows: 1, kinds: vec![Tile::Core], first: 0 }
    }

    pub(crate) fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Their numbers among those of all shared planes.
    pub(crate) fn numbers(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.len()
    }

    fn index_of(&self, cell: [i64; 2]) -> Option<usize> {
        let (column, row) = (cell[0] - self.low[0], cell[1] - self.low[1]);
        let inside = column >= 0 && row >= 0 && column < self.columns as i64 && row < self.rows as i64;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// The tile at this place, counted over all shared planes, and what is known of it.
    pub fn at(&self, place: [f64; 2]) -> (usize, Tile) {
        let index = self.index_of(place.map(|value| (value / self.size_m).floor() as i64));
        index.map_or((0, Tile::Outside), |index| (self.first + index, self.kinds[index]))
    }

    /// Column and row of a tile, counted over all shared planes.
    pub(crate) fn place_of(&self, tile: usize) -> [usize; 2] {
        let own = tile.saturating_sub(self.first);
        [own % self.columns.max(1), own / self.columns.max(1)]
    }

    /// Lowest and highest place along both axes of the plane, metre.
    pub(crate) fn ends(&self) -> [[f64; 2]; 2] {
        let end = |axis: usize, count: usize| {
            [self.low[axis] as f64 * self.size_m, (self.low[axis] + count as i64) as f64 * self.size_m]
        };
        [end(0, self.columns), end(1, self.rows)]
    }

    /// Whether a disc around this place may touch the tiles.
    pub(crate) fn near(&self, place: [f64; 2], radius_m: f64) -> bool {
        place.iter().zip(self.ends()).all(|(at, [low, high])| (low - radius_m..=high + radius_m).contains(at))
    }
}
