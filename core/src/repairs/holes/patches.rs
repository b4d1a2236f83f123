//! Patches that are in the submesh, and loops as they see them.

use crate::algorithms::triangulate::{self};
use crate::contract::report::RepairName;
use crate::detect::holes::loops::Loop;
use crate::repairs::shared::collisions::Obstacle;
use crate::repairs::shared::work::Work;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::util::ids::NONE;

/// Name of the method that lets flat surface go on to where it meets other.
pub(crate) const EXTENDED: &str = "planes to where they meet";

/// Name of the method that closes a hole around its islands.
pub(crate) const ISLANDS: &str = "islands";

/// How loops were closed, for people; what stands in brackets after the method stays.
pub(crate) fn in_words(method: &str) -> String {
    const WORDS: [(&str, &str); 11] = [
        ("triangle", "by one triangle"),
        ("planar", "in their plane"),
        ("minimum_weight", "with the least bend"),
        ("least_area", "with the least area"),
        ("front", "inwards from the rim"),
        ("projected", "as seen from one side"),
        ("search", "by search"),
        ("zipped", "side to side"),
        ("annular", "by a strip between two rims"),
        ("slit", "as slits"),
        (ISLANDS, "around islands"),
    ];
    let (name, more) = method.split_at(method.find(" (").unwrap_or(method.len()));
    let words = WORDS.iter().find(|(known, _)| *known == name).map_or(name, |(_, words)| words);
    format!("{words}{more}")
}

/// How much of a guess a patch of planes is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planes {
    /// Nothing tells one of the planes but right angles.
    pub(crate) assumed: bool,
    /// What lies under the patch, seen from the middle of its loop's vertices.
    pub(crate) volume: f64,
    /// The volume by which another patch like it differs.
    pub(crate) in_doubt: f64,
    /// Planes meet in new vertices.
    pub(crate) reaches: bool,
}

/// A patch that is in the submesh.
#[derive(Debug)]
pub(crate) struct Placed {
    /// The loops it closes, by number.
    pub(crate) rims: Vec<u32>,
    pub(crate) method: &'static str,
    /// Its triangles are consecutive.
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// Of a patch that was shaped: the triangles that it was shaped from.
    pub(crate) coarse: Vec<[Vertex; 3]>,
    /// It was shaped more finely since it crossed another body.
    pub(crate) refined: bool,
    /// The surface that it came to grief on.
    pub(crate) obstacles: Vec<Obstacle>,
    /// Nothing else was found than a patch that crosses bodies which run into this one already.
    pub(crate) across: bool,
    /// It may cross anything, and is to be cut along that.
    pub(crate) to_be_cut: bool,
    /// A patch that does, with its method, while others are tried.
    pub(crate) spare: Option<(&'static str, Vec<[Vertex; 3]>)>,
    /// Of planes that go on to where they meet: what is to be said of the guess.
    pub(crate) planes: Option<Planes>,
}

impl Placed {
    pub(crate) fn triangles(&self) -> impl Iterator<Item = u32> + use<> {
        self.first..self.first + self.count
    }

    /// Its triangles that are left: those that were split since are elsewhere.
    pub(crate) fn living<'s>(&self, submesh: &'s Submesh) -> impl Iterator<Item = u32> + use<'s> {
        self.triangles().filter(|t| submesh.lives(*t))
    }

    /// Is it in, and crosses nothing?
    pub(crate) fn is_in(&self) -> bool {
        self.count > 0 && !self.across && !self.to_be_cut
    }

    pub(crate) fn holds(&self, t: u32) -> bool {
        (self.first..self.first + self.count).contains(&t)
    }

    pub(crate) fn put_in(work: &mut Work<'_>, rims: Vec<u32>, triangles: &[[Vertex; 3]], method: &'static str) -> Self {
        let mut placed = Self {
            rims,
            method,
            first: 0,
            count: 0,
            coarse: Vec::new(),
            refined: false,
            obstacles: Vec::new(),
            across: false,
            to_be_cut: false,
            planes: None,
            spare: None,
        };
        placed.replace(work, triangles);
        placed
    }

    /// Puts these triangles in, in place of those that were.
    pub(crate) fn replace(&mut self, work: &mut Work<'_>, triangles: &[[Vertex; 3]]) {
        self.triangles().for_each(|t| work.kill(t));
        (self.first, self.count) = (work.triangles.len() as u32, triangles.len() as u32);
        triangles.iter().for_each(|v| {
            work.add(*v, Origin::Added(RepairName::Fill), NONE);
        });
    }
}

/// The triangles of a patch by the vertices of the submesh.
pub(crate) fn of_submesh(rim: &Loop, patch: &triangulate::Patch) -> Vec<[Vertex; 3]> {
    patch.triangles.iter().map(|t| t.map(|i| rim.vertices[i as usize])).collect()
}

/// The vertices of some loops, one loop after the other.
pub(crate) fn concatenated(group: &[&Loop]) -> Vec<Vertex> {
    group.iter().flat_map(|rim| rim.vertices.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algorithms::triangulate::Method;

    #[test]
    fn no_name_of_a_method_is_told_to_people() {
        use Method::{Front, LeastArea, MinimumWeight, Planar, Projected, Search, Triangle, Zipped};
        let methods = [Front, LeastArea, MinimumWeight, Planar, Projected, Search, Triangle, Zipped].map(Method::name);
        for name in methods.into_iter().chain(["annular", "slit", ISLANDS]) {
            let words = in_words(name);
            assert!(words != name && words.contains(' ') && !words.contains('_'), "{words}");
            assert_eq!(in_words(&format!("{name} (shaped)")), format!("{words} (shaped)"));
        }
        assert_eq!(in_words(EXTENDED), EXTENDED);
    }
}
