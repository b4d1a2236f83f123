//! The part, its units, and the representation of its shape (ISO 10303-41, -43).

use std::io::{self, Write};

use super::text::{Instances, quoted};
use crate::curves::Unit;
use crate::curves::export::model::Header;

/// Units of length that are metres with a prefix, by their millimetres.
const METRES: [(f64, &str); 6] =
    [(1.0, ".MILLI."), (1000.0, "$"), (10.0, ".CENTI."), (1e-3, ".MICRO."), (1e6, ".KILO."), (1e-6, ".NANO.")];

/// Everything before the first instance.
pub(super) fn header(header: &Header<'_>, sink: &mut impl Write) -> io::Result<()> {
    let [name, time, system] = [header.name, header.time.unwrap_or_default(), header.system].map(quoted);
    writeln!(sink, "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');")?;
    writeln!(sink, "FILE_NAME({name},{time},(''),(''),{system},{system},'');")?;
    writeln!(sink, "FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;")
}

/// The part; gives the definition of its shape.
pub(super) fn part<W: Write>(header: &Header<'_>, instances: &mut Instances<'_, W>) -> io::Result<u64> {
    let name = quoted(header.name);
    let application = instances.say("APPLICATION_CONTEXT('core data for automotive mechanical design processes')")?;
    instances
        .say(&format!("APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"))?;
    let context = instances.say(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"))?;
    let product = instances.say(&format!("PRODUCT({name},{name},'',(#{context}))"))?;
    instances.say(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#{product}))"))?;
    let formation = instances.say(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"))?;
    let context = instances.say(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"))?;
    let definition = instances.say(&format!("PRODUCT_DEFINITION('design','',#{formation},#{context})"))?;
    instances.say(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"))
}

/// Units of length, plane and solid angle, and the tolerance; gives the context.
pub(super) fn context<W: Write>(unit: &Unit, tolerance: f64, instances: &mut Instances<'_, W>) -> io::Result<u64> {
    let length = length(unit, instances)?;
    let angle = instances.say("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")?;
    let solid = instances.say("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")?;
    let uncertainty = instances.put(|record| {
        record.say("UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(");
        record.real(tolerance);
        record.say(&format!("),#{length},'distance_accuracy_value','')"));
    })?;
    instances.say(&format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{uncertainty}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('',''))"
    ))
}

/// A metre with a prefix, or any other length by its millimetres.
fn length<W: Write>(unit: &Unit, instances: &mut Instances<'_, W>) -> io::Result<u64> {
    let metric = METRES.into_iter().find(|(size, _)| (size / unit.millimetres - 1.0).abs() <= 1e-12);
    if let Some((_, prefix)) = metric {
        return instances.say(&format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))"));
    }
    let exponents = instances.say("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")?;
    let base = instances.say("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")?;
    let measure = instances.put(|record| {
        record.say("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(");
        record.real(unit.millimetres);
        record.say(&format!("),#{base})"));
    })?;
    // The usual name, by which readers know it.
    let name = if (unit.millimetres / 25.4 - 1.0).abs() <= 1e-12 { "INCH" } else { unit.name.as_str() };
    let name = quoted(name);
    instances.say(&format!("(CONVERSION_BASED_UNIT({name},#{measure})LENGTH_UNIT()NAMED_UNIT(#{exponents}))"))
}

/// Representations of a part: of its solids, of its surfaces, or of both, related by one of axes alone.
pub(super) fn shape<W: Write>(
    part: u64,
    context: u64,
    solids: &[u64],
    surfaces: &[u64],
    instances: &mut Instances<'_, W>,
) -> io::Result<()> {
    let origin = instances.say("CARTESIAN_POINT('',(0.,0.,0.))")?;
    let axis = instances.say("DIRECTION('',(0.,0.,1.))")?;
    let first = instances.say("DIRECTION('',(1.,0.,0.))")?;
    let axes = instances.say(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{axis},#{first})"))?;
    let mut representations = Vec::new();
    let kinds = [("ADVANCED_BREP_SHAPE_REPRESENTATION", solids), ("MANIFOLD_SURFACE_SHAPE_REPRESENTATION", surfaces)];
    for (kind, items) in kinds.into_iter().filter(|(_, items)| !items.is_empty()) {
        representations.push(instances.put(|record| {
            record.say(&format!("{kind}('',"));
            let all: Vec<u64> = std::iter::once(axes).chain(items.iter().copied()).collect();
            record.references(&all);
            record.say(&format!(",#{context})"));
        })?);
    }
    let whole = match representations.as_slice() {
        &[single] => single,
        several => {
            let whole = instances.say(&format!("SHAPE_REPRESENTATION('',(#{axes}),#{context})"))?;
            for other in several {
                instances.say(&format!("SHAPE_REPRESENTATION_RELATIONSHIP('','',#{whole},#{other})"))?;
            }
            whole
        }
    };
    instances.say(&format!("SHAPE_DEFINITION_REPRESENTATION(#{part},#{whole})"))?;
    Ok(())
}
