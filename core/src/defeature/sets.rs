//! Disjoint sets of triangles, segments or ends of strips.

/// Sets with path halving (Tarjan, van Leeuwen 1984); the lowest number is the root.
pub(crate) struct Sets {
    up: Vec<u32>,
}

impl Sets {
    pub(crate) fn new(count: usize) -> Self {
        Self { up: (0..count as u32).collect() }
    }

    pub(crate) fn root(&mut self, mut at: u32) -> u32 {
        while self.up[at as usize] != at {
            let above = self.up[self.up[at as usize] as usize];
            self.up[at as usize] = above;
            at = above;
        }
        at
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.up[a.max(b) as usize] = a.min(b);
    }

    /// Members of the sets whose roots pass a test, by roots.
    pub(crate) fn groups(mut self, is_wanted: impl Fn(u32) -> bool) -> Vec<Vec<u32>> {
        let mut members: Vec<(u32, u32)> = Vec::new();
        for at in 0..self.up.len() as u32 {
            let root = self.root(at);
            if is_wanted(root) {
                members.push((root, at));
            }
        }
        members.sort_unstable();
        members.chunk_by(|a, b| a.0 == b.0).map(|group| group.iter().map(|(_, at)| *at).collect()).collect()
    }
}
