//! The changes of a package: new texts of its parts.

use std::collections::BTreeMap;
use std::fs::File;
use std::ops::Range;
use std::path::Path;

use memmap2::Mmap;

use super::corners::Triangles;
use super::section::section;
use super::units::{self, UnitOf};
use crate::contract::error::{Error, Result};
use crate::engine::clock::Clock;
use crate::engine::files::{self, Made};
use crate::engine::making;
use crate::engine::together::Section;
use crate::engine::work::Work;
use crate::io::read::slicer::{self, Config};
use crate::io::read::{Archive, MeshFile, MeshRecords, PackageFile, Place};
use crate::io::record::Record;
use crate::io::write_behind::{self, Nameless, WriteBehind};
use crate::output::archive;
use crate::output::edit::Edit;
use crate::output::model::{self, Account, Change, MeshText, Unit};

/// A new text of a part, as far as it is written.
struct NewText {
    file: File,
    behind: WriteBehind,
    /// Up to here, the old text is in it.
    at: usize,
}

/// An object that was repaired: what it should be in the output.
pub(super) struct Expected {
    pub(super) place: Place,
    /// The triangles of its meshes, one after the other.
    pub(super) units: Vec<Triangles>,
}

/// Repairs the objects of a package one after the other.
pub(super) struct Maker<'a> {
    package: &'a PackageFile,
    work: Work<'a>,
    /// By number of the part.
    texts: BTreeMap<usize, NewText>,
    account: Account,
    expected: Vec<Expected>,
    /// The triangles of each volume of the slicer's, as they are now.
    volumes: Vec<Range<u64>>,
    /// Objects whose sets of triangles are left out.
    objects_without_sets: u64,
}

/// What a package becomes.
pub(super) struct Changed {
    /// New content by number of the entry.
    content: BTreeMap<usize, Mmap>,
    /// New texts of the parts that hold volumes.
    configs: Vec<(usize, Vec<u8>)>,
    pub(super) account: Account,
    /// Objects whose sets of triangles are left out.
    pub(super) objects_without_sets: u64,
    pub(super) expected: Vec<Expected>,
}

/// A unit that was repaired.
struct Mended {
    made: Made,
    /// The judged result; `None`: nothing was written, and the mesh stays as it came.
    result: Option<MeshFile>,
    /// Holds its bytes.
    _spool: Nameless,
}

impl<'a> Maker<'a> {
    pub(super) fn new(package: &'a PackageFile, work: Work<'a>) -> Self {
        let volumes = package.volumes().all().iter().map(|volume| volume.triangles.clone()).collect();
        let (texts, expected) = (BTreeMap::new(), Vec::new());
        Self { package, work, texts, account: Account::default(), expected, volumes, objects_without_sets: 0 }
    }

    /// Repairs the meshes of an object, and writes what came of them into the text of its part.
    pub(super) fn object(&mut self, place: Place, sections: &mut Vec<Section>, clock: &mut Clock) -> Result<()> {
        let read = self.package.read(place, self.work.limits, self.work.progress)?;
        clock.stage("read");
        let units = units::of(self.package, place, &read)?;
        if units.is_empty() {
            self.expect(place, &[], &[], &read);
            return Ok(());
        }
        let mut mended = Vec::with_capacity(units.len());
        for unit in &units {
            mended.push(if unit.is_repaired { Some(self.mend(unit, &read, sections, clock)?) } else { None });
        }
        self.expect(place, &units, &mended, &read);
        let all: Vec<Unit<'_>> = units.iter().zip(&mended).map(|(unit, mended)| what_became(unit, mended.as_ref())).collect();
        let text = mesh_text(self.package, place, &read);
        let is_edited = all.iter().any(|unit| unit.change.is_some());
        let same = units_as_they_are(&units, &read);
        if !is_edited && model::is_numbered_once(&text, &same) {
            self.account.kept += read.with_any;
            return Ok(());
        }
        // Vertices of units that stay are numbered anew beside those of others.
        let all: Vec<Unit<'_>> =
            all.iter().zip(&same).map(|(unit, same)| if unit.change.is_some() { *unit } else { *same }).collect();
        self.write(place, &text, &all)?;
        clock.stage("emit");
        Ok(())
    }

    fn mend(&self, unit: &UnitOf, read: &MeshRecords, sections: &mut Vec<Section>, clock: &mut Clock) -> Result<Mended> {
        let Work { limits, progress, .. } = self.work;
        let (mesh, _held) = units::spooled(self.package, unit, read, self.work)?;
        let spool = Nameless::new(limits)?;
        let made = making::make(mesh, &spool.path(), true, self.work, clock)?;
        sections.push(section(self.package, unit, made.report.clone(), &read.parsed.findings));
        let result = if made.report.output.is_some() { Some(files::open(&spool.path(), limits, progress)?) } else { None };
        Ok(Mended { made, result, _spool: spool })
    }

    /// Notes what the object should be in the output.
    fn expect(&mut self, place: Place, units: &[UnitOf], mended: &[Option<Mended>], read: &MeshRecords) {
        let threads = self.work.limits.threads;
        let of = |(unit, mended): (&UnitOf, &Option<Mended>)| {
            let result = mended.as_ref().and_then(|mended| mended.result.as_ref());
            Triangles::of(result.map_or_else(|| records_of(unit, read), MeshFile::records), threads)
        };
        self.expected.push(Expected { place, units: units.iter().zip(mended).map(of).collect() });
    }

    fn write(&mut self, place: Place, text: &MeshText<'_>, units: &[Unit<'_>]) -> Result<()> {
        let (limits, path) = (self.work.limits, self.package.path());
        let folder = limits.spool_folder();
        let spooling = || Error::io(&folder, "spooling");
        let new = match self.texts.entry(place.part) {
            std::collections::btree_map::Entry::Occupied(there) => there.into_mut(),
            std::collections::btree_map::Entry::Vacant(free) => {
                let (file, behind) = write_behind::nameless(&folder, limits)?;
                free.insert(NewText { file, behind, at: 0 })
            }
        };
        let progress = self.work.progress;
        let behind = &new.behind;
        let mut sink = |bytes: &[u8]| {
            if progress.cancelled() {
                return Err(Error::cancelled(path, "writing"));
            }
            behind.append(bytes).map_err(spooling())
        };
        let written = model::write(text, units, new.at, &mut sink)?;
        new.at = written.at;
        self.objects_without_sets += u64::from(written.is_without_sets);
        self.account.add(written.account);
        let (own, mut at) = (self.package.volumes_at(place), 0);
        for (volume, triangles) in own.iter().zip(&written.triangles) {
            if let Some(range) = self.volumes.get_mut(*volume) {
                *range = at..at + triangles;
            }
            at += triangles;
        }
        if self.package.volumes().stand_in_meshes() {
            let volumes = || own.iter().filter_map(|k| Some((self.package.volumes().all().get(*k)?, self.volumes.get(*k)?)));
            let places = || volumes().flat_map(|(volume, _)| &volume.places);
            if places().any(|place| place.start < new.at) {
                return Err(self.package.refused(place, "has sets of triangles behind the volumes of its slicer"));
            }
            let to = places().map(|place| place.end).max().unwrap_or(new.at);
            sink(&slicer::renumbered(text.text, new.at..to, volumes()))?;
            new.at = to;
        }
        Ok(())
    }

    /// Ends the texts.
    pub(super) fn finish(self) -> Result<Changed> {
        let folder = self.work.limits.spool_folder();
        let spooling = || Error::io(&folder, "spooling");
        let mut content = BTreeMap::new();
        for (part, new) in self.texts {
            let text = self.package.text(part);
            for rest in text.get(new.at..).unwrap_or_default().chunks(1 << 20) {
                new.behind.append(rest).map_err(spooling())?;
            }
            new.behind.finish().map_err(spooling())?;
            // SAFETY: the file has no name, this is its only handle, and it is not written to any more.
            let map = unsafe { Mmap::map(&new.file) }.map_err(Error::io(&folder, "mapping"))?;
            let entry = self
                .package
                .entry_of(part)
                .ok_or_else(|| Error::io(self.package.path(), "writing")(std::io::ErrorKind::NotFound.into()))?;
            content.insert(entry, map);
        }
        let volumes = self.package.volumes();
        let is_renumbered = volumes.all().iter().map(|volume| &volume.triangles).ne(&self.volumes);
        let renumbered =
            |of: &Config| (of.entry, slicer::renumbered(&of.text, 0..of.text.len(), of.volumes.iter().zip(&self.volumes)));
        let configs = volumes.configs.iter().filter(|_| is_renumbered && !volumes.stand_in_meshes()).map(renumbered).collect();
        let objects_without_sets = self.objects_without_sets;
        Ok(Changed { content, configs, account: self.account, objects_without_sets, expected: self.expected })
    }
}

impl Changed {
    /// The package stays as it came.
    pub(super) fn is_none(&self) -> bool {
        self.content.is_empty() && self.configs.is_empty()
    }

    /// Writes the package to the new file `output`.
    pub(super) fn write(&self, package: &PackageFile, output: &Path, work: Work<'_>) -> Result<()> {
        let archive = Archive::open(package.bytes()).map_err(|rejection| rejection.at(package.path()))?;
        let replaced = |entry: usize| {
            let config = || self.configs.iter().find(|(own, _)| *own == entry).map(|(_, text)| text.as_slice());
            self.content.get(&entry).map(|map| &map[..]).or_else(config)
        };
        archive::write(&archive, replaced, output, work.limits, work.progress)
    }
}

fn records_of<'r>(unit: &UnitOf, read: &'r MeshRecords) -> &'r [Record] {
    read.parsed.records.all().get(unit.triangles.clone()).unwrap_or_default()
}

fn mesh_text<'t>(package: &'t PackageFile, place: Place, read: &'t MeshRecords) -> MeshText<'t> {
    let (text, vertices_within, triangles) = package.mesh_at(place);
    MeshText { text, vertices_within, triangles, vertices: read.vertices(), sets: package.sets_at(place) }
}

fn what_became<'u>(unit: &UnitOf, mended: Option<&'u Mended>) -> Unit<'u> {
    let change = mended.filter(|mended| mended.result.is_some()).map(|mended| Change {
        came: mended.made.mesh.as_it_came(),
        now: mended.made.mesh.records(),
        edit: &mended.made.edit,
    });
    let is_other = |change: &Change<'_>| !change.edit.is_empty() || change.came != change.now;
    Unit { triangles: unit.triangles.len(), change: change.filter(is_other) }
}

/// Units that nothing was done to, as units whose vertices are numbered anew.
fn units_as_they_are<'u>(units: &[UnitOf], read: &'u MeshRecords) -> Vec<Unit<'u>> {
    let of = |unit: &UnitOf| {
        let records = records_of(unit, read);
        let change = unit.is_repaired.then_some(Change { came: records, now: records, edit: Edit::none() });
        Unit { triangles: records.len(), change }
    };
    units.iter().map(of).collect()
}
