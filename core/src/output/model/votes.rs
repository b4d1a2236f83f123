//! The attributes of new triangles, and the sets that they are in: those that most of the rim around them has, by its length.

use std::collections::{BTreeMap, HashMap};

use super::elements::{Element, Elements, local};
use super::inherit::{self, Attribute};
use super::plan::{Change, Fate, MeshText, Plan, UnitPlan};
use super::sets::{IN_NONE, Sets};
use crate::attributes::paint::Paint;
use crate::util::bits;
use crate::util::union_find;

/// The lengths of rim that speak for each choice.
#[derive(Default)]
struct Ballot {
    /// All of it.
    length: f64,
    /// By the attribute that is asked for, then by what it would be.
    choices: BTreeMap<Vec<u8>, BTreeMap<Vec<Attribute>, f64>>,
    /// By the class of sets.
    classes: BTreeMap<u32, f64>,
}

/// Attributes that new triangles take, and the class of the sets that they are in.
pub(super) type Taken = (Vec<Attribute>, u32);

impl Ballot {
    fn vote(&mut self, attributes: &[(Vec<u8>, Vec<Attribute>)], class: u32, length: f64) {
        self.length += length;
        *self.classes.entry(class).or_default() += length;
        for (asked, choice) in attributes {
            let choices = self.choices.entry(asked.clone()).or_default();
            *choices.entry(choice.clone()).or_default() += length;
        }
    }

    /// What wins of each attribute; nothing where most of the rim has none.
    fn winners(&self) -> Vec<Attribute> {
        let mut all = Vec::new();
        for choices in self.choices.values() {
            let without = self.length - choices.values().sum::<f64>();
            let best = longest(choices.iter()).filter(|(_, length)| *length >= without);
            all.extend(best.into_iter().flat_map(|(choice, _)| choice.iter().cloned()));
        }
        all
    }

    /// The class of sets that wins; that of none where most of the rim is in none.
    fn class(&self) -> u32 {
        let without = self.classes.get(&IN_NONE).copied().unwrap_or_default();
        let best = longest(self.classes.iter().filter(|(class, _)| **class != IN_NONE)).filter(|(_, length)| *length >= without);
        best.map_or(IN_NONE, |(class, _)| *class)
    }
}

/// The choice of the most length; the first of equals.
fn longest<'c, C>(choices: impl Iterator<Item = (&'c C, &'c f64)>) -> Option<(&'c C, f64)> {
    choices.fold(None, |best: Option<(&C, f64)>, (choice, length)| match best {
        Some((_, most)) if most >= *length => best,
        _ => Some((choice, *length)),
    })
}

/// The groups of new triangles of a unit that hang together.
struct Groups {
    /// By place among the faces of the plan: its group, for those that are new.
    of_face: Vec<Option<u32>>,
    /// By edge, the smaller vertex first.
    of_edge: HashMap<[u32; 2], u32>,
    /// A bit for each vertex that a new triangle has.
    vertices: Vec<u64>,
    ballots: Vec<Ballot>,
}

/// What the new triangles of a unit take, by place among the faces of its plan. O(n) in its triangles.
pub(super) fn count<'t>(
    (mesh, sets): (&MeshText<'t>, Option<&Sets<'t>>),
    plan: &Plan<'t>,
    unit: &UnitPlan<'t>,
    change: &Change<'_>,
    elements: &mut Elements<'t>,
) -> Vec<Taken> {
    let mut groups = Groups::of(change, unit, mesh.vertices.len() + plan.fresh.len());
    let mut faces = unit.faces.iter();
    change.each(|fate| {
        let (vertices, element) = match fate {
            Fate::Kept | Fate::Turned => {
                let Some(element) = elements.next() else { return };
                (plan.canonical(element.vertices), element)
            }
            Fate::Gone => {
                elements.next();
                return;
            }
            Fate::Moved(_) => {
                let (Some(element), Some(face)) = (elements.next(), faces.next()) else { return };
                (*face, element)
            }
            Fate::Part(of, _) => {
                let (Some(element), Some(face)) = (unit.parted.get(&of), faces.next()) else { return };
                (*face, element.clone())
            }
            Fate::New(_) => {
                faces.next();
                return;
            }
        };
        groups.ask(vertices, (&element, sets), |vertex| plan.position(mesh, vertex));
    });
    let winners: Vec<Taken> = groups.ballots.iter().map(|ballot| (ballot.winners(), ballot.class())).collect();
    let of = |group: &Option<u32>| group.and_then(|group| winners.get(group as usize)).cloned().unwrap_or_default();
    groups.of_face.iter().map(of).collect()
}

impl Groups {
    fn of(change: &Change<'_>, unit: &UnitPlan<'_>, vertices: usize) -> Self {
        let mut is_new = Vec::with_capacity(unit.faces.len());
        change.each(|fate| match fate {
            Fate::New(_) => is_new.push(true),
            Fate::Moved(_) | Fate::Part(..) => is_new.push(false),
            Fate::Kept | Fate::Turned | Fate::Gone => {}
        });
        let new: Vec<(usize, &[u32; 3])> = unit.faces.iter().enumerate().filter(|(k, _)| is_new.get(*k) == Some(&true)).collect();
        let mut at_vertex: HashMap<u32, usize> = HashMap::new();
        let mut joined: Vec<u32> = (0..new.len() as u32).collect();
        let mut bits = vec![0u64; vertices.div_ceil(64)];
        for (place, (_, face)) in new.iter().enumerate() {
            for vertex in **face {
                let other = *at_vertex.entry(vertex).or_insert(place);
                union_find::unite(&mut joined, place as u32, other as u32);
                if let Some(word) = bits.get_mut(vertex as usize / 64) {
                    *word |= 1 << (vertex % 64);
                }
            }
        }
        let (mut of_face, mut of_edge) = (vec![None; unit.faces.len()], HashMap::new());
        for (place, (k, face)) in new.iter().enumerate() {
            let group = union_find::find(&mut joined, place as u32);
            if let Some(own) = of_face.get_mut(*k) {
                *own = Some(group);
            }
            of_edge.extend(edges(**face).map(|edge| (edge, group)));
        }
        let ballots = new.iter().map(|_| Ballot::default()).collect();
        Self { of_face, of_edge, vertices: bits, ballots }
    }

    /// Lets a triangle that stays speak for each of its edges that is one of the rim.
    fn ask(
        &mut self,
        vertices: [u32; 3],
        (element, sets): (&Element<'_>, Option<&Sets<'_>>),
        position: impl Fn(u32) -> [f32; 3],
    ) {
        let at_rim = vertices.iter().filter(|vertex| bits::holds(&self.vertices, **vertex as usize)).count();
        if at_rim < 2 {
            return;
        }
        let mut choices = None;
        for edge in edges(vertices) {
            let Some(ballot) = self.of_edge.get(&edge).and_then(|group| self.ballots.get_mut(*group as usize)) else { continue };
            let [a, b] = edge.map(|vertex| position(vertex).map(f64::from));
            let length = [0, 1, 2].map(|k| (a[k] - b[k]) * (a[k] - b[k])).iter().sum::<f64>().sqrt();
            let class = || sets.map_or(IN_NONE, |sets| sets.class_of(element.number));
            let (attributes, class) = choices.get_or_insert_with(|| (of_one_kind(element), class()));
            ballot.vote(attributes, *class, length);
        }
    }
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}

/// The attributes of a triangle, each as if all of it were like the most of it.
fn of_one_kind(element: &Element<'_>) -> Vec<(Vec<u8>, Vec<Attribute>)> {
    let mut all = Vec::new();
    let given = |name: &[u8]| element.attributes.iter().find(|(own, _)| local(own) == name);
    let owned = |(name, value): &(&[u8], &[u8])| (name.to_vec(), value.to_vec());
    let property: Vec<Attribute> = [&b"pid"[..], b"p1"].into_iter().filter_map(given).map(owned).collect();
    if !property.is_empty() {
        all.push((b"pid".to_vec(), property));
    }
    for (name, value) in element.attributes.iter().filter(|(name, _)| inherit::is_paint(name)) {
        let Some(paint) = inherit::paint(value) else { continue };
        let most = paint
            .state_areas()
            .into_iter()
            .fold((0, 0.0), |most, (state, share)| if share > most.1 { (state, share) } else { most });
        if most.0 != 0 {
            let text = Paint::uniform(most.0).to_text().into_bytes();
            all.push((name.to_vec(), vec![(name.to_vec(), text)]));
        }
    }
    all
}
