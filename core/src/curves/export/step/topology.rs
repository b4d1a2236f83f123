//! Vertices, edges, faces and shells (ISO 10303-42, section 5).

use std::io::{self, Write};

use super::geometry;
use super::text::Instances;
use crate::curves::export::model::{EdgeUse, Face};
use crate::curves::export::natural::Whole;
use crate::curves::export::shells::Shell;

/// Numbers of what is written so far.
struct Written {
    surfaces: Vec<u64>,
    vertices: Vec<Option<u64>>,
    edges: Vec<Option<u64>>,
    /// The context of curves of parameters.
    plane: Option<u64>,
}

/// Writes all shells; gives solids, and surface models of those that are open.
pub(super) fn shells<W: Write>(
    whole: &Whole<'_>,
    shells: &[Shell],
    tolerance: f64,
    instances: &mut Instances<'_, W>,
) -> io::Result<(Vec<u64>, Vec<u64>)> {
    let mut surfaces = Vec::with_capacity(whole.faces.len());
    for (face, _) in &whole.faces {
        surfaces.push(geometry::surface(&face.surface, tolerance, instances)?);
    }
    let (vertices, edges) = (vec![None; whole.vertices.len()], vec![None; whole.edges.len()]);
    let mut written = Written { surfaces, vertices, edges, plane: None };
    let users = users(whole);
    let (mut solids, mut open) = (Vec::new(), Vec::new());
    for shell in shells {
        let mut faces = Vec::with_capacity(shell.faces.len());
        for number in &shell.faces {
            let Some((face, loops)) = whole.faces.get(*number) else { continue };
            let mut bounds = Vec::with_capacity(loops.len());
            for (ring, uses) in loops.iter().enumerate() {
                bounds.push(bound(whole, uses, ring == 0, &users, &mut written, instances)?);
            }
            faces.push(advanced(face, &bounds, written.surfaces.get(*number).copied().unwrap_or(0), instances)?);
        }
        let shell_id = instances.put(|record| {
            record.say(if shell.is_closed { "CLOSED_SHELL(''," } else { "OPEN_SHELL(''," });
            record.references(&faces);
            record.say(")");
        })?;
        if shell.is_closed {
            solids.push(instances.say(&format!("MANIFOLD_SOLID_BREP('',#{shell_id})"))?);
        } else {
            open.push(shell_id);
        }
    }
    let mut models = Vec::new();
    if !open.is_empty() {
        models.push(instances.put(|record| {
            record.say("SHELL_BASED_SURFACE_MODEL('',");
            record.references(&open);
            record.say(")");
        })?);
    }
    Ok((solids, models))
}

/// Uses of each edge: face and use.
type Users<'a> = Vec<Vec<(usize, &'a EdgeUse)>>;

fn users<'a>(whole: &'a Whole<'_>) -> Users<'a> {
    let mut users: Users<'a> = vec![Vec::new(); whole.edges.len()];
    for (face, (_, loops)) in whole.faces.iter().enumerate() {
        for one in loops.iter().flat_map(|ring| ring.iter()) {
            if let Some(users) = users.get_mut(one.edge) {
                users.push((face, one));
            }
        }
    }
    users
}

fn advanced<W: Write>(face: &Face, bounds: &[u64], surface: u64, instances: &mut Instances<'_, W>) -> io::Result<u64> {
    instances.put(|record| {
        record.say("ADVANCED_FACE('',");
        record.references(bounds);
        record.say(",");
        record.reference(surface);
        record.say(",");
        record.truth(face.is_same_sense);
        record.say(")");
    })
}

fn bound<W: Write>(
    whole: &Whole<'_>,
    uses: &[EdgeUse],
    is_outer: bool,
    users: &Users<'_>,
    written: &mut Written,
    instances: &mut Instances<'_, W>,
) -> io::Result<u64> {
    let mut oriented = Vec::with_capacity(uses.len());
    for one in uses {
        let edge = edge(whole, one.edge, users, written, instances)?;
        oriented.push(instances.put(|record| {
            record.say("ORIENTED_EDGE('',*,*,");
            record.reference(edge);
            record.say(",");
            record.truth(!one.is_reversed);
            record.say(")");
        })?);
    }
    let ring = instances.put(|record| {
        record.say("EDGE_LOOP('',");
        record.references(&oriented);
        record.say(")");
    })?;
    let name = if is_outer { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
    instances.say(&format!("{name}('',#{ring},.T.)"))
}

/// An edge, written where it is used first.
fn edge<W: Write>(
    whole: &Whole<'_>,
    number: usize,
    users: &Users<'_>,
    written: &mut Written,
    instances: &mut Instances<'_, W>,
) -> io::Result<u64> {
    if let Some(&Some(known)) = written.edges.get(number) {
        return Ok(known);
    }
    // A body that was checked has them all.
    let Some(edge) = whole.edges.get(number) else { return Ok(0) };
    let mut ends = [0; 2];
    for (id, end) in ends.iter_mut().zip(edge.ends) {
        *id = vertex(whole, end, written, instances)?;
    }
    let curve = geometry::curve(&edge.curve, 3, instances)?;
    let curve = on_surfaces(curve, users.get(number).map(Vec::as_slice).unwrap_or_default(), written, instances)?;
    let [start, end] = ends;
    let id = instances.say(&format!("EDGE_CURVE('',#{start},#{end},#{curve},.T.)"))?;
    if let Some(known) = written.edges.get_mut(number) {
        *known = Some(id);
    }
    Ok(id)
}

fn vertex<W: Write>(
    whole: &Whole<'_>,
    number: usize,
    written: &mut Written,
    instances: &mut Instances<'_, W>,
) -> io::Result<u64> {
    if let Some(&Some(known)) = written.vertices.get(number) {
        return Ok(known);
    }
    let place = geometry::point(&whole.vertices.get(number).copied().unwrap_or_default(), instances)?;
    let id = instances.say(&format!("VERTEX_POINT('',#{place})"))?;
    if let Some(known) = written.vertices.get_mut(number) {
        *known = Some(id);
    }
    Ok(id)
}

/// The curve of an edge with its curves of parameters, two at most: both sides of a seam, or one on each of two faces. As it is,
/// if it has none.
fn on_surfaces<W: Write>(
    curve: u64,
    users: &[(usize, &EdgeUse)],
    written: &mut Written,
    instances: &mut Instances<'_, W>,
) -> io::Result<u64> {
    let mut pcurves = Vec::with_capacity(2);
    let mut faces = Vec::with_capacity(2);
    for (face, one) in users {
        let (Some(parametric), true) = (&one.pcurve, pcurves.len() < 2) else { continue };
        let plane = match written.plane {
            Some(plane) => plane,
            None => instances.say(
                "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('2D SPACE',''))",
            )?,
        };
        written.plane = Some(plane);
        let flat = geometry::curve(parametric, 2, instances)?;
        let definition = instances.say(&format!("DEFINITIONAL_REPRESENTATION('',(#{flat}),#{plane})"))?;
        let surface = written.surfaces.get(*face).copied().unwrap_or(0);
        pcurves.push(instances.say(&format!("PCURVE('',#{surface},#{definition})"))?);
        faces.push(*face);
    }
    if pcurves.is_empty() {
        return Ok(curve);
    }
    let is_seam = pcurves.len() == 2 && faces.first() == faces.last();
    instances.put(|record| {
        record.say(if is_seam { "SEAM_CURVE(''," } else { "SURFACE_CURVE(''," });
        record.reference(curve);
        record.say(",");
        record.references(&pcurves);
        record.say(",.CURVE_3D.)");
    })
}
