//! Whose values new triangles take: those of the face that most of the rim around them says, by its length.

use std::collections::{BTreeMap, HashMap};

use super::made::{From, Made};
use crate::io::record::Point;
use crate::io::rows::Source;
use crate::util::union_find;

/// New triangles in groups that hang together, and what the faces around each say.
#[derive(Default)]
pub(super) struct Votes {
    /// By triangle that is made: its group, for new ones.
    group: Vec<Option<u32>>,
    /// By edge between two positions, the smaller number first.
    of_edge: HashMap<[u32; 2], u32>,
    /// By group: the length of rim that says so, and a face that does.
    ballots: HashMap<u32, BTreeMap<Vec<u8>, (f64, Source)>>,
}

impl Votes {
    /// No votes so far. O(n).
    pub(super) fn of(made: &[Made]) -> Self {
        let mut at_position: HashMap<u32, u32> = HashMap::new();
        let mut joined: Vec<u32> = (0..made.len() as u32).collect();
        let new = || (0u32..).zip(made).filter(|(_, made)| made.from == From::Rim);
        for (place, made) in new() {
            for number in made.corners {
                let other = *at_position.entry(number).or_insert(place);
                union_find::unite(&mut joined, place, other);
            }
        }
        let mut votes = Self { group: vec![None; made.len()], ..Self::default() };
        for (place, made) in new() {
            let group = union_find::find(&mut joined, place);
            if let Some(own) = votes.group.get_mut(place as usize) {
                *own = Some(group);
            }
            votes.of_edge.extend(edges(made.corners).map(|edge| (edge, group)));
        }
        votes
    }

    /// Lets a triangle vote for each of its edges that is one of a new triangle. `face`: what its face says, and whose values that are.
    pub(super) fn ask(&mut self, numbers: [Option<u32>; 3], points: &[Point], face: impl Fn() -> (Vec<u8>, Source)) {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (Some(from), Some(to)) = (numbers[from], numbers[to]) else { continue };
            let Some(group) = self.of_edge.get(&[from.min(to), from.max(to)]) else { continue };
            let at = |number: u32| points.get(number as usize).copied().unwrap_or_default().map(f64::from);
            let (a, b) = (at(from), at(to));
            let length = [0, 1, 2].map(|k| (a[k] - b[k]) * (a[k] - b[k])).iter().sum::<f64>().sqrt();
            let (says, source) = face();
            let source = Source { places: None, ..source };
            self.ballots.entry(*group).or_default().entry(says).or_insert((0.0, source)).0 += length;
        }
    }

    /// By triangle that is made: the face that won; the first of equals.
    pub(super) fn winners(&self) -> Vec<Option<Source>> {
        let winner = |group: &Option<u32>| {
            let choices = self.ballots.get(&(*group)?)?;
            let best = choices.values().fold(None, |best: Option<&(f64, Source)>, choice| match best {
                Some(most) if most.0 >= choice.0 => best,
                _ => Some(choice),
            });
            best.map(|(_, source)| source.clone())
        };
        self.group.iter().map(winner).collect()
    }
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}
