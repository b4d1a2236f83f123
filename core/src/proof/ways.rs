//! Ways of edges that were found already: the triangle beyond an edge takes it from here.

use crate::proof::chain::Pair;
use crate::util::ids::NONE;

/// Places for ways; where two edges have one place, the later one has it.
const PLACES: usize = 1 << 12;

/// The way of an edge: its ends, the smaller vertex first, and where its pairs begin and end.
#[derive(Clone, Copy)]
struct Way {
    ends: [u32; 2],
    pairs: [u32; 2],
}

/// The ways of edges that were kept last.
#[derive(Default)]
pub(super) struct Ways {
    places: Vec<Way>,
    pairs: Vec<Pair>,
}

#[inline]
fn place([v, w]: [u32; 2]) -> usize {
    let mixed = (u64::from(v) << 32 | u64::from(w)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed >> 40) as usize % PLACES
}

impl Ways {
    /// The pairs between the ends of an edge, if they are kept.
    #[inline]
    pub(super) fn of(&self, ends: [u32; 2]) -> Option<&[Pair]> {
        let way = self.places.get(place(ends)).filter(|way| way.ends == ends)?;
        self.pairs.get(way.pairs[0] as usize..way.pairs[1] as usize)
    }

    /// Keeps what is between the ends of an edge.
    pub(super) fn keep(&mut self, ends: [u32; 2], pairs: &[Pair]) {
        if self.places.is_empty() {
            self.places = vec![Way { ends: [NONE; 2], pairs: [0; 2] }; PLACES];
        }
        let start = self.pairs.len() as u32;
        self.pairs.extend_from_slice(pairs);
        self.places[place(ends)] = Way { ends, pairs: [start, self.pairs.len() as u32] };
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::proof::surface::Spot;

    /// More edges than places: each is what was kept of it, or nothing, and most of the last ones are there.
    #[test]
    fn a_way_is_that_of_its_edge_or_none() {
        let mut ways = Ways::default();
        assert!(ways.of([0, 1]).is_none());
        let pair = |face: u32| Pair { place: DVec3::ZERO, spot: Spot { face, shares: [1.0, 0.0, 0.0] }, off: 0.0 };
        let edges: Vec<[u32; 2]> = (0..2 * PLACES as u32).map(|v| [v, v + 7]).collect();
        for ends in &edges {
            ways.keep(*ends, &vec![pair(ends[0]); (ends[0] % 3) as usize]);
        }
        let mut kept = 0;
        for ends in &edges {
            let Some(pairs) = ways.of(*ends) else { continue };
            assert!(pairs.len() == (ends[0] % 3) as usize && pairs.iter().all(|pair| pair.spot.face == ends[0]));
            kept += 1;
        }
        assert!(ways.of(edges[edges.len() - 1]).is_some() && ways.of([7, 9]).is_none());
        assert!(kept > PLACES / 2 && kept <= PLACES, "{kept}");
    }
}
