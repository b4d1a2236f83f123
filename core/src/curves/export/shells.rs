//! Which faces hang together, and which of them close.

use super::natural::Whole;

/// Faces that hang together by edges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Shell {
    /// In their order.
    pub(super) faces: Vec<usize>,
    /// Whether each edge is used twice, once in each direction.
    pub(super) is_closed: bool,
}

/// Shells in the order of their first faces. O(edges used), but for a factor that never exceeds 5.
pub(super) fn shells(whole: &Whole<'_>) -> Vec<Shell> {
    let faces = whole.faces.len();
    let mut parents: Vec<usize> = (0..faces).collect();
    let mut first_user: Vec<Option<usize>> = vec![None; whole.edges.len()];
    let mut counts: Vec<[u32; 2]> = vec![[0; 2]; whole.edges.len()];
    for (face, (_, loops)) in whole.faces.iter().enumerate() {
        for one in loops.iter().flat_map(|ring| ring.iter()) {
            if let Some([forth, back]) = counts.get_mut(one.edge) {
                *(if one.is_reversed { back } else { forth }) += 1;
            }
            let Some(user) = first_user.get_mut(one.edge) else { continue };
            let other = *user.get_or_insert(face);
            let (a, b) = (root(&mut parents, face), root(&mut parents, other));
            // The lower number is the root, so that it is that of the first face.
            if let Some(parent) = parents.get_mut(a.max(b)) {
                *parent = a.min(b);
            }
        }
    }
    let mut shells: Vec<Shell> = Vec::new();
    let mut place: Vec<Option<usize>> = vec![None; faces];
    for face in 0..faces {
        let Some(place) = place.get_mut(root(&mut parents, face)) else { continue };
        let at = *place.get_or_insert(shells.len());
        if at == shells.len() {
            shells.push(Shell { faces: Vec::new(), is_closed: true });
        }
        if let Some(shell) = shells.get_mut(at) {
            shell.faces.push(face);
        }
    }
    for shell in &mut shells {
        let uses = shell.faces.iter().filter_map(|face| whole.faces.get(*face)).flat_map(|(_, loops)| loops);
        shell.is_closed = uses.flat_map(|ring| ring.iter()).all(|one| counts.get(one.edge) == Some(&[1, 1]));
    }
    shells
}

fn root(parents: &mut [usize], mut of: usize) -> usize {
    while let Some(&next) = parents.get(of).filter(|next| **next != of) {
        let after = parents.get(next).copied().unwrap_or(next);
        if let Some(parent) = parents.get_mut(of) {
            *parent = after;
        }
        of = after;
    }
    of
}
