//! A mesh in memory as an edit leaves it: vertices, faces, where each face comes from, and its records.
//!
//! Most faces are untouched, so their vertices are known from the input's faces: positions are looked up for what is new, not for each
//! corner of the result. The result's records take the place of the input's.

use crate::contract::report::FaceOrigin;
use crate::engine::mesh::{Mesh, MeshError, MeshView};
use crate::geometry::position::canonical;
use crate::io::record::{self, Point, Record};
use crate::output::edit::{Edit, Step};
use crate::topology::vertex_table::Weld;
use crate::util::ids::NONE;

/// A mesh as an edit leaves it.
pub(crate) struct EditedMesh {
    /// Each position is one vertex, numbered by first appearance.
    pub(crate) mesh: Mesh,
    /// By face.
    pub(crate) origins: Vec<FaceOrigin>,
    layout: Layout,
    /// Of the input; its records have them, and the mesh does not.
    has_negative_zeros: bool,
}

/// As the mesh has it: without −0.0, normal and attribute.
fn plain(record: &Record) -> Record {
    record::assemble([0.0; 3], record::corners(record).map(canonical), 0)
}

/// How the input's records become those of the result.
#[derive(Default)]
struct Layout {
    /// Stretches that move: where from, where to, how many. Ascending; none moves to a higher place.
    moves: Vec<(usize, usize, usize)>,
    /// Records that are new, and their places. Ascending.
    fresh: Vec<(usize, Record)>,
}

impl EditedMesh {
    /// Of a mesh, its records and an edit of these. `positions` is how many positions the faces' corners have, if all of them are finite.
    /// O(vertices + faces + edit).
    ///
    /// # Errors
    /// [`MeshError::TooManyVertices`].
    pub(crate) fn of(input: MeshView<'_>, records: &[Record], positions: Option<u64>, edit: &Edit) -> Result<Self, MeshError> {
        let count = edit.output_records(records.len()) as usize;
        let mut numbers = Numbers::of(input, positions, edit.new_records().map(record::corners));
        let (mut faces, mut origins) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut layout = Layout::default();
        // The next record of the input.
        let mut at = 0;
        let walked: Result<(), std::convert::Infallible> = edit.walk(records, |step| {
            match step {
                Step::Untouched(run) => {
                    let run = at..at + run.len();
                    if faces.len() < at {
                        layout.moves.push((at, faces.len(), run.len()));
                    }
                    origins.extend(run.clone().map(|face| FaceOrigin::Input(face as u32)));
                    faces.extend(input.faces()[run.clone()].iter().map(|face| numbers.of_face(*face)));
                    at = run.end;
                }
                Step::Changed(place, record, from) => {
                    layout.fresh.push((faces.len(), record));
                    faces.push(match from {
                        FaceOrigin::Flipped(_) => {
                            let [a, b, c] = input.faces()[place as usize];
                            numbers.of_face([a, c, b])
                        }
                        _ => numbers.of_corners(record::corners(&record)),
                    });
                    origins.push(from);
                    at += 1;
                }
                Step::Deleted(places) => at += places.len(),
                Step::Added(record, from) => {
                    layout.fresh.push((faces.len(), *record));
                    faces.push(numbers.of_corners(record::corners(record)));
                    origins.push(from);
                }
            }
            Ok(())
        });
        let Ok(()) = walked;
        let has_negative_zeros = input.vertices().as_flattened().iter().any(|x| *x == 0.0 && x.is_sign_negative());
        let vertices = numbers.vertices.len();
        u32::try_from(vertices).map_err(|_| MeshError::TooManyVertices { vertices })?;
        Ok(Self { mesh: Mesh::of_parts(numbers.vertices, faces), origins, layout, has_negative_zeros })
    }

    /// Makes the input's records those of the result: what [`MeshView::records`] makes of the mesh.
    pub(crate) fn apply(&mut self, records: &mut Vec<Record>) {
        let Layout { moves, fresh } = std::mem::take(&mut self.layout);
        for (from, to, count) in moves {
            records.copy_within(from..from + count, to);
        }
        records.truncate(self.origins.len());
        if self.has_negative_zeros {
            records.iter_mut().for_each(|record| *record = plain(record));
        }
        for (place, record) in fresh {
            let record = plain(&record);
            match records.get_mut(place) {
                Some(old) => *old = record,
                None => records.push(record),
            }
        }
    }
}

/// Vertices of the result, numbered by first appearance.
struct Numbers<'m> {
    input: &'m [Point],
    /// By vertex of the input: the first one at its position, which stands for it. Empty: no two share a position.
    first_at: Vec<u32>,
    /// By vertex of the input: the vertex of the result, or `NONE` before its first appearance.
    known: Vec<u32>,
    /// The positions of what is new; by position, the vertex of the input that stands there and the vertex of the result, or `NONE`.
    new: Weld,
    standing: Vec<u32>,
    known_new: Vec<u32>,
    vertices: Vec<Point>,
}

impl<'m> Numbers<'m> {
    fn of(input: MeshView<'m>, positions: Option<u64>, new_corners: impl Iterator<Item = [Point; 3]>) -> Self {
        let vertices = input.vertices();
        let used = used(input);
        let count = used.iter().filter(|used| **used).count() as u64;
        let first_at = if Some(count) == positions { Vec::new() } else { first_at(vertices) };
        let mut new = Weld::default();
        new.reset(0);
        new_corners.flatten().for_each(|p| {
            new.vertex(p);
        });
        let count = new.positions().len();
        let mut standing = vec![NONE; count];
        // One without faces may share the position of another.
        for (v, p) in vertices.iter().enumerate().filter(|(v, _)| used[*v]) {
            // A position that is not finite equals no other.
            if let Some(place) = new.find(*p) {
                standing[place as usize] = standing[place as usize].min(first_at.get(v).copied().unwrap_or(v as u32));
            }
        }
        let (known, known_new) = (vec![NONE; vertices.len()], vec![NONE; count]);
        Self { input: vertices, first_at, known, new, standing, known_new, vertices: Vec::with_capacity(vertices.len()) }
    }

    /// The vertices of an untouched face of the input.
    fn of_face(&mut self, face: [u32; 3]) -> [u32; 3] {
        face.map(|v| match self.known[v as usize] {
            NONE => self.of_vertex(v),
            known => known,
        })
    }

    /// That of a vertex of the input which has not appeared yet, although another one at its position may have.
    #[inline(never)]
    fn of_vertex(&mut self, v: u32) -> u32 {
        let first = self.first_at.get(v as usize).map_or(v, |first| *first) as usize;
        if self.known[first] == NONE {
            self.known[first] = self.vertices.len() as u32;
            self.vertices.push(canonical(self.input[first]));
        }
        self.known[v as usize] = self.known[first];
        self.known[first]
    }

    /// The vertices at the positions of something new.
    fn of_corners(&mut self, corners: [Point; 3]) -> [u32; 3] {
        corners.map(|p| {
            let place = self.new.vertex(p) as usize;
            match (self.standing[place], self.known_new[place]) {
                (NONE, NONE) => {
                    self.known_new[place] = self.vertices.len() as u32;
                    self.vertices.push(canonical(p));
                    self.known_new[place]
                }
                (NONE, known) => known,
                (v, _) => self.of_vertex(v),
            }
        })
    }
}

/// By vertex: it has faces.
fn used(mesh: MeshView<'_>) -> Vec<bool> {
    let mut used = vec![false; mesh.vertices().len()];
    mesh.faces().as_flattened().iter().for_each(|v| used[*v as usize] = true);
    used
}

/// By vertex the first one at its position; one whose position is not finite stands for itself.
fn first_at(vertices: &[Point]) -> Vec<u32> {
    let mut weld = Weld::default();
    weld.reset(vertices.len());
    // By number in the weld.
    let mut first = Vec::new();
    let at = vertices.iter().enumerate().map(|(v, p)| {
        if !p.iter().all(|x| x.is_finite()) {
            return v as u32;
        }
        let number = weld.vertex(*p) as usize;
        if number == first.len() {
            first.push(v as u32);
        }
        first[number]
    });
    at.collect()
}
