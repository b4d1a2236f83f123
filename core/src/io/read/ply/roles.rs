//! Which elements of a PLY are its mesh.

use super::header::{Element, Header};
use crate::io::read::elements::layout::{Layout, Step};
use crate::io::read::finding::Rejection;
use crate::util::words::Counted;

/// What is read of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Role {
    Vertices,
    Faces,
    Strips,
    None,
}

/// An element with its role.
#[derive(Debug)]
pub(in crate::io) struct Part {
    pub(in crate::io) role: Role,
    pub(in crate::io) count: u64,
    pub(in crate::io) layout: Layout,
}

/// The elements with their roles, in the file's order.
///
/// # Errors
/// [`Rejection::Unreadable`] for what is no mesh: no vertices with coordinates, or no faces with indices.
pub(in crate::io) fn of(header: &Header) -> Result<Vec<Part>, Rejection> {
    let parts: Vec<Part> = header.elements.iter().map(part).collect::<Result<_, _>>()?;
    let mut vertices = parts.iter().filter(|part| part.role == Role::Vertices);
    let refuse = |reason: &str| Err(Rejection::Unreadable(format!("a PLY model {reason}")));
    let count = match (vertices.next(), vertices.next()) {
        (Some(first), None) => first.count,
        (None, _) => return refuse("without vertices"),
        _ => return refuse("with two elements of the name vertex"),
    };
    let faces = parts.iter().filter(|part| matches!(part.role, Role::Faces | Role::Strips)).map(|part| part.count);
    match faces.fold(0, u64::saturating_add) {
        0 if count == 0 => refuse("without vertices and faces"),
        0 => Err(Rejection::Unreadable(format!("a point cloud of {}, no faces", Counted(count, "point", "points")))),
        _ if count == 0 => refuse("without vertices"),
        _ => Ok(parts),
    }
}

fn part(element: &Element) -> Result<Part, Rejection> {
    let role = match element.name.as_slice() {
        b"vertex" => Role::Vertices,
        b"face" => Role::Faces,
        b"tristrips" => Role::Strips,
        _ => Role::None,
    };
    let (mut layout, mut axes, mut lists) = (Layout::default(), [0; 3], 0);
    for property in &element.properties {
        let name = property.name.as_slice();
        let axis = [b"x", b"y", b"z"].iter().position(|axis| name == *axis).filter(|_| role == Role::Vertices);
        layout.push(match (property.list, axis) {
            (None, Some(axis)) => {
                axes.get_mut(axis).into_iter().for_each(|seen| *seen += 1);
                Step::Coordinate(axis, property.kind)
            }
            (None, None) => Step::Skip { values: 1, bytes: property.kind.bytes() },
            (Some(length), _) => {
                let named = matches!(name, b"vertex_indices" | b"vertex_index") && matches!(role, Role::Faces | Role::Strips);
                if named && property.kind.is_float() {
                    return Err(Rejection::Unreadable("a PLY model whose indices of vertices have fractions".into()));
                }
                lists += usize::from(named);
                Step::List { length, item: property.kind, indices: named && lists == 1 }
            }
        });
    }
    let refuse = |reason: &str| Err(Rejection::Unreadable(format!("a PLY model whose {reason}")));
    match role {
        Role::Vertices if axes != [1; 3] => refuse("vertices do not have x, y and z once each"),
        // Faces of textures or colours alone.
        Role::Faces | Role::Strips if lists == 0 => Ok(Part { role: Role::None, count: element.count, layout }),
        _ => Ok(Part { role, count: element.count, layout }),
    }
}
