//! An open 3MF package: its objects, read when they are asked for.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::access::Bytes;
use super::archive::Archive;
use super::finding::{Finding, Rejection};
use super::opened::Opened;
use super::spool::Context;
use super::threemf::slicer::{Volume, Volumes};
use super::threemf::{Content, MeshRecords, Model, NoParts, Object, Place, Purpose};
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::util::parallel;
use crate::util::words::Counted;

/// The part that every package has.
pub(super) const CONTENT_TYPES: &str = "[Content_Types].xml";

/// An open package.
pub(crate) struct PackageFile {
    opened: Opened,
    path: PathBuf,
    input: Bytes,
    model: Model,
    /// Stretches of triangles that are bodies of their own to a slicer.
    volumes: Volumes,
    /// Objects that are no parts of the model to a slicer.
    no_parts: NoParts,
    findings: Vec<Finding>,
}

impl PackageFile {
    /// Does the file begin as an archive that holds a 3MF does? A file that cannot be read does not.
    fn is_package(path: &Path) -> bool {
        use std::io::Read;
        let mut head = [0; 4];
        // A pipe would block; no regular file does.
        let is_file = std::fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
        is_file && std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == *b"PK\x03\x04"
    }

    /// Opens a package; `None`: the file is none. O(text) in its models; each is unpacked into a spool.
    ///
    /// # Errors
    /// [`crate::Error`] of reading, with a reason that names the entry, the part or the object.
    pub(crate) fn open(path: &Path, limits: &Limits, progress: &dyn Progress) -> Result<Option<Self>> {
        if !Self::is_package(path) {
            return Ok(None);
        }
        let spool = limits.spool_folder();
        let (opened, input) = Opened::bytes(path, &spool, limits, progress)?;
        let context = Context { path, spool: &spool, limits, progress, passed: None };
        let reject = |rejection: Rejection| rejection.at(path);
        let archive = Archive::open(&input).map_err(reject)?;
        if archive.find(CONTENT_TYPES).is_none() {
            return Ok(None);
        }
        let model = parallel::in_pool(limits.threads, || Model::open(&input, &context))?;
        let volumes = Volumes::of(&model, &archive, &context)?;
        let no_parts = model.no_parts();
        let findings = [model.findings.clone(), left_alone(&model), told(&volumes, &no_parts)].concat();
        Ok(Some(Self { opened, path: path.to_owned(), input, model, volumes, no_parts, findings }))
    }

    /// The objects that are repaired: meshes of triangles that are printed, in the order of the parts and of their texts.
    pub(crate) fn meshes(&self) -> Vec<Place> {
        let is_repaired = |(place, object): &(Place, &Object)| is_repaired(object) && !self.no_parts.objects.contains(place);
        places(&self.model).filter(is_repaired).map(|(place, _)| place).collect()
    }

    /// Reads an object's mesh. O(text).
    ///
    /// # Errors
    /// As [`PackageFile::open`].
    pub(crate) fn read(&self, place: Place, limits: &Limits, progress: &dyn Progress) -> Result<MeshRecords> {
        let spool = limits.spool_folder();
        let context = Context { path: &self.path, spool: &spool, limits, progress, passed: None };
        parallel::in_pool(limits.threads, || self.model.records(place, &context))
    }

    /// The number and the name of an object, and the name of its part.
    pub(crate) fn names(&self, place: Place) -> (u32, String, String) {
        let part = self.model.parts.get(place.part).map(|part| part.name.clone()).unwrap_or_default();
        let object = self.model.object(place);
        (object.map_or(0, |object| object.id), object.map(|object| object.name.clone()).unwrap_or_default(), part)
    }

    /// An object that cannot be repaired, for this reason.
    pub(crate) fn refused(&self, place: Place, reason: &str) -> Error {
        let (id, _, part) = self.names(place);
        Error::Unreadable { path: self.path.clone(), reason: format!("object {id} of the part {part} {reason}") }
    }

    /// The text of a part, and what stands in it between the tags of the vertices and of the triangles of an object's mesh.
    pub(crate) fn mesh_at(&self, place: Place) -> (&[u8], Range<usize>, Range<usize>) {
        match self.model.object(place).map(|object| &object.content) {
            Some(Content::Mesh(mesh)) => (self.text(place.part), mesh.vertices.inner.clone(), mesh.triangles.inner.clone()),
            _ => (&[], 0..0, 0..0),
        }
    }

    /// Where the sets of an object's triangles stand in the text of its part, if it has any (3MF Core 1.3, section 4.1: Triangle Sets).
    pub(crate) fn sets_at(&self, place: Place) -> Option<Range<usize>> {
        const NAME: &[u8] = b"trianglesets";
        let Content::Mesh(mesh) = &self.model.object(place)?.content else { return None };
        let behind = mesh.triangles.whole.end;
        let text = self.text(place.part).get(behind..mesh.whole.end)?;
        let first = memchr::memmem::find(text, NAME)?;
        let from = memchr::memrchr(b'<', text.get(..first)?)?;
        let last = memchr::memmem::rfind(text, NAME)?;
        let to = last + memchr::memchr(b'>', text.get(last..)?)? + 1;
        Some(behind + from..behind + to)
    }

    /// The text of a part.
    pub(crate) fn text(&self, part: usize) -> &[u8] {
        self.model.parts.get(part).map_or(&[], |part| part.text())
    }

    /// The number of a part's entry in the archive.
    pub(crate) fn entry_of(&self, part: usize) -> Option<usize> {
        let name = &self.model.parts.get(part)?.name;
        self.model.entries.iter().position(|entry| entry.name == *name)
    }

    /// All volumes of the slicer's.
    pub(crate) fn volumes(&self) -> &Volumes {
        &self.volumes
    }

    /// A slicer cuts something of it away from something else.
    pub(crate) fn has_negative(&self) -> bool {
        self.no_parts.any_negative || self.volumes.all().iter().any(|volume| volume.is_negative)
    }

    /// The numbers of an object's volumes.
    pub(crate) fn volumes_at(&self, place: Place) -> Vec<usize> {
        let Some(id) = self.model.object(place).map(|object| object.id) else { return Vec::new() };
        let all = self.volumes.all().iter().enumerate();
        all.filter(|(_, volume)| volume.is_of(place.part, id)).map(|(number, _)| number).collect()
    }

    /// An object's volumes.
    pub(crate) fn volumes_of(&self, place: Place) -> Vec<&Volume> {
        self.volumes_at(place).into_iter().filter_map(|k| self.volumes.all().get(k)).collect()
    }

    /// The name of the unit of all coordinates.
    pub(crate) fn unit(&self) -> &'static str {
        self.model.unit().name()
    }

    /// The package has a digital signature.
    pub(crate) fn is_signed(&self) -> bool {
        self.model.signed
    }

    /// Oddities of the package, and what of it is no mesh to be repaired.
    pub(crate) fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// The whole file.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.input
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// As [`super::MeshFile::check_unchanged`].
    ///
    /// # Errors
    /// [`crate::Error::Changed`], [`crate::Error::Io`].
    pub(crate) fn check_unchanged(&self) -> Result<()> {
        self.opened.check_unchanged()
    }
}

/// All objects with their places.
fn places(model: &Model) -> impl Iterator<Item = (Place, &Object)> {
    model
        .parts
        .iter()
        .enumerate()
        .flat_map(|(part, of)| of.objects.iter().enumerate().map(move |(object, own)| (Place { part, object }, own)))
}

/// A mesh of triangles that is printed.
pub(super) fn is_repaired(object: &Object) -> bool {
    let is_printed = matches!(object.purpose, Purpose::Model | Purpose::SolidSupport);
    is_printed && matches!(&object.content, Content::Mesh(mesh) if !mesh.lattice && !mesh.triangles.inner.is_empty())
}

/// Volumes that only say where settings hold, or what is cut away.
fn told(volumes: &Volumes, objects: &NoParts) -> Vec<Finding> {
    let count = volumes.all().iter().filter(|volume| !volume.is_part).count() as u64 + objects.uses;
    let of = Counted(
        count,
        "volume of a slicer's is no part of the model: it needs no repair, and is left out in another format",
        "volumes of a slicer's are no parts of the model: they need no repair, and are left out in another format",
    );
    let text = of.to_string();
    (count > 0).then(|| Finding { harmless: true, ..Finding::flaw(text) }).into_iter().collect()
}

/// What stays as it is.
fn left_alone(model: &Model) -> Vec<Finding> {
    let count = |is: fn(&Object) -> bool| places(model).filter(|(_, object)| is(object)).count() as u64;
    let supports = count(|object| {
        matches!(object.content, Content::Mesh(_)) && !matches!(object.purpose, Purpose::Model | Purpose::SolidSupport)
    });
    let foreign = count(|object| match &object.content {
        Content::Mesh(mesh) => mesh.lattice,
        Content::Foreign(_) => true,
        Content::Components(_) | Content::Nothing => false,
    });
    let line = |count: u64, words: &str| {
        let objects = Counted(count, "object stays as it is", "objects stay as they are");
        (count > 0).then(|| Finding { harmless: true, ..Finding::flaw(format!("{objects}: {words}")) })
    };
    let unprinted = model.items().iter().filter(|item| !item.printable).count() as u64;
    let unprinted = (unprinted > 0).then(|| {
        let text = format!("{} of the build not to be printed, and repaired all the same", Counted(unprinted, "item", "items"));
        Finding { harmless: true, ..Finding::flaw(text) }
    });
    [
        unprinted,
        line(supports, "support, surface or other, which needs to be no solid"),
        line(foreign, "no mesh of triangles alone"),
    ]
    .into_iter()
    .flatten()
    .collect()
}
