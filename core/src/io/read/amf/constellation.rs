//! Which objects are placed, and how often.

use std::collections::HashMap;

use super::super::finding::Rejection;
use super::document::{Document, Id, Item};
use super::placement::Placement;

/// Most instances of all, those in instances counted as often as they are placed.
const MOST: usize = 1_000_000;
/// Most constellations within each other.
const DEEPEST: usize = 32;

/// Objects and constellations as instances name them.
pub(super) struct Names {
    of: HashMap<Id, Item>,
    /// Objects and constellations with the id of an earlier one.
    pub(super) taken: u64,
    /// Instances of nothing.
    pub(super) lost: u64,
    /// Objects that an instance names, and constellations.
    named: [Vec<bool>; 2],
}

impl Names {
    /// The names in a document.
    pub(super) fn of(document: &Document) -> Self {
        let named = [vec![false; document.objects.len()], vec![false; document.constellations()]];
        let mut names = Self { of: HashMap::new(), taken: 0, lost: 0, named };
        for &item in &document.items {
            if let Some(id) = document.id(item) {
                let mut is_new = false;
                names.of.entry(id).or_insert_with(|| {
                    is_new = true;
                    item
                });
                names.taken += u64::from(!is_new);
            }
        }
        for instance in &document.instances {
            match names.item(instance.of) {
                Some(item) => names.name(item),
                None => names.lost += 1,
            }
        }
        names
    }

    fn item(&self, id: Option<Id>) -> Option<Item> {
        self.of.get(&id?).copied()
    }

    fn name(&mut self, item: Item) {
        let [objects, constellations] = &mut self.named;
        let flag = match item {
            Item::Object(at) => objects.get_mut(at),
            Item::Constellation(at) => constellations.get_mut(at),
        };
        flag.into_iter().for_each(|flag| *flag = true);
    }

    fn is_named(&self, item: Item) -> bool {
        let [objects, constellations] = &self.named;
        match item {
            Item::Object(at) => objects.get(at),
            Item::Constellation(at) => constellations.get(at),
        }
        .is_some_and(|named| *named)
    }
}

/// Visits every object as often as it is placed: objects and constellations that no instance names, in the document's order, those with their
/// instances. O(instances).
///
/// # Errors
/// Those of `visit`; a refusal of constellations that contain themselves, are too deep or place too much.
pub(super) fn each<E: From<Rejection>>(
    document: &Document,
    names: &Names,
    mut visit: impl FnMut(usize, &Placement) -> Result<(), E>,
) -> Result<(), E> {
    let refused = |reason: &str| Err(Rejection::Unreadable(reason.into()).into());
    let mut reached = vec![false; document.constellations()];
    let mut count = 0;
    for &top in document.items.iter().filter(|item| !names.is_named(**item)) {
        let mut path: Vec<(usize, usize, Placement)> = Vec::new();
        let mut next = Some((top, Placement::NONE));
        loop {
            match next.take() {
                Some((Item::Object(at), placement)) => visit(at, &placement)?,
                Some((Item::Constellation(at), placement)) => {
                    if path.iter().any(|(open, ..)| *open == at) {
                        return refused("a constellation contains itself");
                    }
                    if path.len() >= DEEPEST {
                        return refused("constellations are more than 32 deep");
                    }
                    reached.get_mut(at).into_iter().for_each(|reached| *reached = true);
                    path.push((at, 0, placement));
                }
                None => {}
            }
            let Some((at, done, around)) = path.last_mut() else { break };
            let Some(instance) = document.instance(*at, *done) else {
                path.pop();
                continue;
            };
            *done += 1;
            count += 1;
            if count > MOST {
                return refused("constellations of more than 1 000 000 instances");
            }
            next = names.item(instance.of).map(|item| (item, around.after(&instance.placement(document.radians))));
        }
    }
    // Whatever no top leads to goes round in a circle, or is named from there.
    if reached.contains(&false) { refused("a constellation contains itself") } else { Ok(()) }
}
