//! Numbered things that agree or disagree, merged pair by pair.

/// Sets of nodes, each even or odd against the root of its set, which is its smallest node.
#[derive(Default)]
pub(crate) struct Parity {
    parents: Vec<u32>,
    odd: Vec<bool>,
}

impl Parity {
    pub(crate) fn new(nodes: usize) -> Self {
        Self { parents: (0..nodes as u32).collect(), odd: vec![false; nodes] }
    }

    /// Forgets everything; keeps its memory.
    pub(crate) fn reset(&mut self, nodes: usize) {
        self.parents.clear();
        self.parents.extend(0..nodes as u32);
        self.odd.clear();
        self.odd.resize(nodes, false);
    }

    pub(crate) fn nodes(&self) -> usize {
        self.parents.len()
    }

    /// Root and parity against it. The path is made flat.
    pub(crate) fn find(&mut self, node: u32) -> (u32, bool) {
        let (mut root, mut odd) = (node, false);
        while self.parents[root as usize] != root {
            odd ^= self.odd[root as usize];
            root = self.parents[root as usize];
        }
        let (mut at, mut rest) = (node, odd);
        while self.parents[at as usize] != root && at != root {
            let (up, own) = (self.parents[at as usize], self.odd[at as usize]);
            self.parents[at as usize] = root;
            self.odd[at as usize] = rest;
            rest ^= own;
            at = up;
        }
        (root, odd)
    }

    /// Says that two nodes agree, or not; `false` if that contradicts what was said before.
    pub(crate) fn relate(&mut self, a: u32, b: u32, disagree: bool) -> bool {
        let ((ra, pa), (rb, pb)) = (self.find(a), self.find(b));
        let odd = pa ^ pb ^ disagree;
        if ra == rb {
            return !odd;
        }
        self.parents[ra.max(rb) as usize] = ra.min(rb);
        self.odd[ra.max(rb) as usize] = odd;
        true
    }
}
