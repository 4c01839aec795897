//! Rounds of contraction over a list of edges: every component picks its cheapest edge, the picked edges join
//! components, and what is left are the edges between the joined ones `[Boruvka1926]`.

const NO_EDGE: u64 = u64::MAX;

/// Edge between two components; `step` is the wrap offset of `to` minus that of `from`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Edge {
    pub from: u32,
    pub to: u32,
    pub cost: f32,
    pub step: i32,
}

impl Edge {
    /// Order of edges: cost, then position. The bits of costs that are not negative sort as the costs do.
    fn key(&self, index: usize) -> u64 {
        u64::from(self.cost.to_bits()) << 32 | index as u64
    }
}

/// What became of a component: a component of the next level (while joining: of the same), and the wrap offset in it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Member {
    pub root: u32,
    pub offset: i32,
}

/// The edges that are left, and what became of the components of each level. Buffers are kept for the next image.
#[derive(Debug, Default)]
pub(crate) struct Contraction {
    /// In the order of edge indices.
    edges: Vec<Edge>,
    levels: Vec<Vec<Member>>,
    depth: usize,
    /// Cheapest edge of each component as a sortable key.
    best: Vec<u64>,
    number: Vec<u32>,
}

impl Contraction {
    /// Starts with an empty first level, to be filled with what each component hangs on: itself or another.
    pub fn first_level(&mut self) -> &mut Vec<Member> {
        self.depth = 0;
        self.next_level()
    }

    fn next_level(&mut self) -> &mut Vec<Member> {
        if self.levels.len() == self.depth {
            self.levels.push(Vec::new());
        }
        self.depth += 1;
        let level = &mut self.levels[self.depth - 1];
        level.clear();
        level
    }

    /// Joins the components of the first level; gives their number, the list of edges between them to be filled in the
    /// order of edge indices, and what became of each component.
    pub fn join_first(&mut self) -> (usize, &mut Vec<Edge>, &[Member]) {
        let joined = join(&mut self.levels[0], &mut self.number);
        (joined, &mut self.edges, &self.levels[0])
    }

    /// Contracts until no edge is left; `components` are those that the edges join. Gives the number that remains.
    pub fn run(&mut self, mut components: usize) -> usize {
        while !self.edges.is_empty() {
            self.pick_edges(components);
            self.hang_components(components);
            components = join(&mut self.levels[self.depth - 1], &mut self.number);
            self.contract_edges();
        }
        components
    }

    /// The cheapest edge of each component; among equals the first in the list.
    fn pick_edges(&mut self, components: usize) {
        self.best.clear();
        self.best.resize(components, NO_EDGE);
        for (index, edge) in self.edges.iter().enumerate() {
            let key = edge.key(index);
            for end in [edge.from as usize, edge.to as usize] {
                self.best[end] = self.best[end].min(key);
            }
        }
    }

    /// Each component hangs on the one that its cheapest edge leads to; of two that picked the same edge the first is
    /// the root, and longer cycles there are none, since the order of edges is strict.
    fn hang_components(&mut self, components: usize) {
        self.next_level();
        let level = &mut self.levels[self.depth - 1];
        level.reserve_exact(components);
        for (node, &key) in self.best.iter().enumerate() {
            let node = node as u32;
            let Some(edge) = self.edges.get(key as u32 as usize) else {
                level.push(Member { root: node, offset: 0 });
                continue;
            };
            let forward = edge.from == node;
            let other = if forward { edge.to } else { edge.from };
            let step = if forward { -edge.step } else { edge.step };
            let root = node < other && self.best[other as usize] == key;
            level.push(if root { Member { root: node, offset: 0 } } else { Member { root: other, offset: step } });
        }
    }

    fn contract_edges(&mut self) {
        let level = &self.levels[self.depth - 1];
        let mut kept = 0;
        for index in 0..self.edges.len() {
            let Edge { from, to, cost, step } = self.edges[index];
            let (from, to) = (level[from as usize], level[to as usize]);
            let step = step + from.offset - to.offset;
            self.edges[kept] = Edge { from: from.root, to: to.root, cost, step };
            kept += usize::from(from.root != to.root);
        }
        self.edges.truncate(kept);
    }

    /// Carries roots and offsets of the last level back to the first, whose members it gives.
    pub fn resolve(&mut self) -> &mut [Member] {
        for level in (1..self.depth).rev() {
            let (lower, upper) = self.levels.split_at_mut(level);
            let upper = &upper[0];
            for member in &mut lower[level - 1] {
                let above = upper[member.root as usize];
                *member = Member { root: above.root, offset: member.offset + above.offset };
            }
        }
        &mut self.levels[0]
    }

    /// Bytes held by the buffers.
    pub fn bytes(&self) -> usize {
        let levels: usize = self.levels.iter().map(Vec::capacity).sum();
        levels * size_of::<Member>()
            + self.edges.capacity() * size_of::<Edge>()
            + self.best.capacity() * 8
            + self.number.capacity() * 4
    }
}

/// Replaces what each component hangs on by the number of its root among the roots; gives the number of roots.
fn join(level: &mut [Member], number: &mut Vec<u32>) -> usize {
    jump(level);
    number.clear();
    let mut roots = 0;
    number.extend(level.iter().enumerate().map(|(node, member)| {
        let own = roots;
        roots += u32::from(member.root as usize == node);
        own
    }));
    for member in level {
        member.root = number[member.root as usize];
    }
    roots as usize
}

/// Pointer jumping until each component hangs on its root, up and down the list in turn.
fn jump(level: &mut [Member]) {
    let hop = |level: &mut [Member], node: usize| {
        let Member { root, offset } = level[node];
        let above = level[root as usize];
        level[node] = Member { root: above.root, offset: offset + above.offset };
        u32::from(above.root != root)
    };
    loop {
        let mut moved = 0;
        for node in 0..level.len() {
            moved |= hop(level, node);
        }
        if moved == 0 {
            return;
        }
        for node in (0..level.len()).rev() {
            hop(level, node);
        }
    }
}
