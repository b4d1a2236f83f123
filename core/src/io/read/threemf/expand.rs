//! What is built: each mesh as often as build items and components say, where they say.

use std::collections::HashMap;

use super::super::finding::Rejection;
use super::model::{Component, Content, Item, Model, Object, Place};
use super::roles::Role;
use super::transform::Transform;
use crate::util::words::Count;

/// Components in each other, at most.
const DEEPEST: usize = 32;
/// Objects of a build with all that is in them, each as often as it is built, at most. Those that hold others count as well, or a file of empty ones
/// would take the time of very many.
const MOST: u64 = 1_000_000;

/// What is known of an object with all that is in it.
#[derive(Clone, Copy, Default)]
struct Known {
    objects: u64,
    /// So many objects lie in each other.
    height: usize,
    /// It is on the way to the object that is looked at.
    open: bool,
}

/// An object before its components are looked at.
const OPENED: Known = Known { objects: 1, height: 1, open: true };

/// An object on the way down.
struct Level {
    place: Place,
    transform: Transform,
    next: usize,
}

impl Model {
    /// Refuses a build that has no end, leads nowhere, flattens something or is too large. Gives the number of its items that are mirror images.
    /// O(objects and components): each is looked at once.
    pub(super) fn check_build(&self) -> Result<u64, Rejection> {
        let mut known: HashMap<Place, Known> = HashMap::new();
        let (mut objects, mut mirrored) = (0u64, 0);
        for item in self.items() {
            self.check_transform(0, &item.component)?;
            let place = self.target(0, &item.component).ok_or_else(|| self.nowhere(0, &item.component))?;
            let all = self.measure(place, &mut known)?;
            objects = objects.saturating_add(all.objects);
            mirrored += u64::from(item.component.transform.mirrors());
            if objects > MOST {
                return Err(Rejection::Unreadable(format!("more than {} objects to be built", Count(MOST))));
            }
        }
        Ok(mirrored)
    }

    /// Counts what is in an object, and itself, with a stack of its own, since its depth is the file's choice.
    fn measure(&self, root: Place, known: &mut HashMap<Place, Known>) -> Result<Known, Rejection> {
        let mut stack = vec![(root, 0usize)];
        if let Some(done) = known.get(&root) {
            return Ok(*done);
        }
        known.insert(root, OPENED);
        while let Some((place, next)) = stack.last_mut() {
            let here = *place;
            let Some(component) = self.components(here).get(*next) else {
                stack.pop();
                let done = known.entry(here).or_default();
                done.open = false;
                let done = *done;
                if let Some((above, _)) = stack.last() {
                    join(known.entry(*above).or_default(), done);
                }
                continue;
            };
            *next += 1;
            self.check_transform(here.part, component)?;
            let below = self.target(here.part, component).ok_or_else(|| self.nowhere(here.part, component))?;
            let found = known.get(&below).copied();
            let height = found.map_or(1, |found| found.height);
            match found {
                Some(found) if found.open => return Err(self.refuse(below, "is a component of itself")),
                _ if stack.len() + height > DEEPEST => {
                    return Err(self.refuse(root, format!("has more than {DEEPEST} components in each other")));
                }
                Some(found) => join(known.entry(here).or_default(), found),
                None => {
                    known.insert(below, OPENED);
                    stack.push((below, 0));
                }
            }
        }
        Ok(known.get(&root).copied().unwrap_or_default())
    }

    /// Calls `each` for every object without components of a build item, with its transform and its role, in order. A build that was checked has an end.
    pub(crate) fn instances(&self, item: &Item, mut each: impl FnMut(Place, &Transform, Role)) {
        let Some(root) = self.target(0, &item.component) else { return };
        let id = self.object(root).map_or(0, |object| object.id);
        let mut meshes = 0;
        let mut stack = vec![Level { place: root, transform: item.component.transform, next: 0 }];
        while let Some(level) = stack.last_mut() {
            let (place, transform, next) = (level.place, level.transform, level.next);
            level.next += 1;
            let is_whole = self.object(place).is_some_and(|object| !matches!(object.content, Content::Components(_)));
            match self.components(place).get(next) {
                Some(component) => {
                    if let Some(below) = self.target(place.part, component).filter(|_| stack.len() <= DEEPEST) {
                        stack.push(Level { place: below, transform: component.transform.then(&transform), next: 0 });
                    }
                }
                None => {
                    if is_whole {
                        let own = self.object(place).map_or(0, |object| object.id);
                        each(place, &transform, self.roles.of(id, own, meshes));
                        meshes += 1;
                    }
                    stack.pop();
                }
            }
        }
    }

    fn components(&self, place: Place) -> &[Component] {
        match self.object(place).map(|object| &object.content) {
            Some(Content::Components(components)) => components,
            _ => &[],
        }
    }

    fn check_transform(&self, part: usize, component: &Component) -> Result<(), Rejection> {
        if !component.transform.flattens() {
            return Ok(());
        }
        let of = super::super::archive::shown(self.part_name(part));
        let reason = format!("the part {of} places object {} by a transform that flattens it", Count(component.object));
        Err(Rejection::Unreadable(reason))
    }

    fn nowhere(&self, part: usize, component: &Component) -> Rejection {
        let name = component.path.as_deref().unwrap_or_else(|| self.part_name(part));
        let name = super::super::archive::shown(name);
        Rejection::Unreadable(format!("object {} is to be built, and is not in the part {name}", Count(component.object)))
    }

    /// A refusal that names an object.
    pub(super) fn refuse(&self, place: Place, reason: impl std::fmt::Display) -> Rejection {
        let id = self.object(place).map_or(0, |object: &Object| object.id);
        let part = super::super::archive::shown(self.part_name(place.part));
        Rejection::Unreadable(format!("object {} of the part {part} {reason}", Count(id)))
    }

    fn part_name(&self, part: usize) -> &str {
        self.parts.get(part).map_or("", |part| part.name.as_str())
    }
}

fn join(above: &mut Known, below: Known) {
    above.objects = above.objects.saturating_add(below.objects);
    above.height = above.height.max(below.height + 1);
}
