//! All that a 3MF package builds, as one mesh.
//!
//! **In:** a model, and which of its objects are wanted.
//! **Out:** the records of each object where build items and components place it, in the order of the build.
//! **Promise:** each object is read once, however often it is placed. Copies are bounded by the size of the file.

use std::collections::HashMap;
use std::ops::Range;

use super::binary;
use super::finding::{Finding, Loss, Rejection};
use super::limits::most_copies;
use super::parsed::{Besides, Parsed};
use super::rounding::Rounding;
use super::spool::{Context, Items, Spool};
use super::threemf::roles::Role;
use super::threemf::slicer::Volume;
use super::threemf::{MeshRecords, Model, Object, Place, Transform};
use crate::contract::error::Result;
use crate::io::record::{self, Record};
use crate::util::words::Counted;

/// A warning of volumes that are left out.
const NEGATIVE: &str = "negative volumes of a slicer's project are among them: what they cut away is solid in the result";
/// Records that are placed at once.
const PLACED: usize = 16 << 10;
/// Findings of objects that are told one by one.
const TOLD: usize = 16;

/// The mesh of a build in a file of so many bytes, of the objects that are `wanted`, without those of a slicer's `volumes` that are no part of it. Call it within a pool of threads.
///
/// # Errors
/// Those of reading an object, [`crate::Error::Unreadable`] without a triangle, [`crate::Error::Refused`] for too many copies.
pub(super) fn mesh(
    (model, volumes): (&Model, &[Volume]),
    wanted: fn(&Object) -> bool,
    bytes: usize,
    context: &Context<'_>,
) -> Result<Parsed> {
    let mut times: HashMap<Place, u64> = HashMap::new();
    each(model, wanted, |place, _| {
        *times.entry(place).or_default() += 1;
        Ok(())
    })?;
    let mut reading = Reading { model, context, findings: Vec::new(), unsaid: Vec::new(), coloured: 0 };

    let (mut kept, mut where_kept, mut copies) = (context.records()?, HashMap::new(), 0u64);
    let mut again: Vec<(Place, u64)> = times.into_iter().filter(|(_, times)| *times > 1).collect();
    again.sort_unstable();
    for (place, times) in again {
        let from = kept.count() as usize;
        let records = reading.read(place)?.parsed.records;
        for range in parts(model, volumes, place, records.all().len()) {
            kept.append(records.all().get(range).unwrap_or_default())?;
        }
        let here = from..kept.count() as usize;
        copies = copies.saturating_add((times - 1).saturating_mul(here.len() as u64));
        where_kept.insert(place, here);
    }
    if copies > most_copies(bytes) {
        return Err(Rejection::Copies(most_copies(bytes)).at(context.path));
    }
    let kept = kept.map()?;

    let mut placing = Placing { context, spool: context.records()?, rounding: Rounding::default() };
    each(model, wanted, |place, transform| match where_kept.get(&place) {
        Some(range) => placing.add(&kept, range.clone(), transform),
        None => {
            let records = reading.read(place)?.parsed.records;
            parts(model, volumes, place, records.all().len())
                .into_iter()
                .try_for_each(|range| placing.add(&records, range, transform))
        }
    })?;
    let Placing { spool, rounding, .. } = placing;
    if spool.count() == 0 {
        return Err(binary::no_triangles().at(context.path));
    }
    let coloured = reading.coloured;
    Ok(Parsed {
        records: spool.map()?,
        findings: [model.findings.clone(), reading.findings()].concat(),
        header: binary::header_of(b""),
        rounding: rounding.if_any(),
        besides: Besides {
            unit: Some(model.unit().name()),
            title: model.title(),
            coloured,
            left_out: left_out(model, volumes, wanted),
            ..Besides::default()
        },
    })
}

/// The triangles of an object that are parts of the model, where a slicer's volumes are all of its triangles, one behind the other; else all.
fn parts(model: &Model, volumes: &[Volume], place: Place, triangles: usize) -> Vec<Range<usize>> {
    let id = model.object(place).map(|object| object.id);
    let own = || volumes.iter().filter(|volume| id.is_some_and(|id| volume.is_of(place.part, id)));
    let mut end = 0;
    let follows = |volume: &Volume| std::mem::replace(&mut end, volume.triangles.end) == volume.triangles.start;
    let fits = own().all(follows) && end == triangles as u64;
    if !fits {
        return std::iter::once(0..triangles).collect();
    }
    own().filter(|volume| volume.is_part).map(|volume| volume.triangles.start as usize..volume.triangles.end as usize).collect()
}

/// Tells of volumes that only say where settings hold, or what is cut away, and of objects that are not wanted.
fn left_out(model: &Model, volumes: &[Volume], wanted: fn(&Object) -> bool) -> Vec<String> {
    let no_parts = model.no_parts();
    let count = volumes.iter().filter(|volume| !volume.is_part).count() as u64 + no_parts.uses;
    let any_negative = no_parts.any_negative || volumes.iter().any(|volume| volume.is_negative);
    let of = Counted(
        count,
        "volume of a slicer's that is no part of the model, left out",
        "volumes of a slicer's that are no parts of the model, left out",
    );
    let mut others = 0;
    for item in model.items() {
        let is_other = |place, role| role == Role::Part && model.object(place).is_some_and(|object| !wanted(object));
        model.instances(item, |place, _, role| others += u64::from(is_other(place, role)));
    }
    let objects = Counted(
        others,
        "object of the build that is support, surface or no mesh of triangles, left out",
        "objects of the build that are support, surface or no meshes of triangles, left out",
    );
    let counted =
        [(count, of), (others, objects)].into_iter().filter(|(count, _)| *count > 0).map(|(_, words)| words.to_string());
    counted.chain(any_negative.then(|| NEGATIVE.to_owned())).collect()
}

/// Calls `place` for each object that is wanted, where it is built, until it fails.
fn each(model: &Model, wanted: fn(&Object) -> bool, mut place: impl FnMut(Place, &Transform) -> Result<()>) -> Result<()> {
    let mut done = Ok(());
    for item in model.items() {
        model.instances(item, |at, transform, role| {
            if done.is_ok() && role == Role::Part && model.object(at).is_some_and(wanted) {
                done = place(at, transform);
            }
        });
    }
    done
}

/// Objects that are read, and what is odd about them.
struct Reading<'a> {
    model: &'a Model,
    context: &'a Context<'a>,
    findings: Vec<Finding>,
    /// Beyond those: at most one for each way in which they weigh.
    unsaid: Vec<(Finding, u64)>,
    /// Triangles with paint, colours or materials, once for each object.
    coloured: u64,
}

impl Reading<'_> {
    fn read(&mut self, place: Place) -> Result<MeshRecords> {
        let mut read = self.model.records(place, self.context)?;
        self.coloured += read.with_any;
        std::mem::take(&mut read.parsed.findings).into_iter().for_each(|finding| self.note(finding));
        Ok(read)
    }

    fn note(&mut self, finding: Finding) {
        if self.findings.contains(&finding) {
            return;
        }
        if self.findings.len() < TOLD {
            return self.findings.push(finding);
        }
        match self.unsaid.iter_mut().find(|(of, _)| (of.harmless, of.loss) == (finding.harmless, finding.loss)) {
            Some((_, count)) => *count += 1,
            None => self.unsaid.push((finding, 1)),
        }
    }

    fn findings(self) -> Vec<Finding> {
        let unsaid = self.unsaid.into_iter().map(|(finding, count)| {
            let kind = match finding.loss {
                Loss::None => "other objects",
                Loss::IfOpen | Loss::Certain => "other objects, of which triangles are lost",
            };
            Finding { text: format!("{} of {kind}", Counted(count, "more oddity", "more oddities")), ..finding }
        });
        self.findings.into_iter().chain(unsaid).collect()
    }
}

/// Objects on their way to where they are built.
struct Placing<'a> {
    context: &'a Context<'a>,
    spool: Spool<'a, 50>,
    rounding: Rounding,
}

impl Placing<'_> {
    fn add(&mut self, of: &Items<50>, range: Range<usize>, transform: &Transform) -> Result<()> {
        let records = of.all().get(range).unwrap_or_default();
        for chunk in records.chunks(PLACED) {
            let placed: Vec<Record> = chunk.iter().map(|record| placed(record, transform, &mut self.rounding)).collect();
            self.spool.append(&placed)?;
            of.let_go();
        }
        self.context.at(self.spool.count(), self.spool.count())
    }
}

fn placed(record: &Record, transform: &Transform, rounding: &mut Rounding) -> Record {
    if transform.is_identity() {
        return *record;
    }
    let [a, b, c] = record::corners(record).map(|corner| transform.apply(corner.map(f64::from)).map(|x| rounding.of_double(x)));
    // A mirror image is turned inside out.
    record::encode(if transform.mirrors() { [a, c, b] } else { [a, b, c] }, record::attribute(record))
}
