//! 3MF packages for tests.

use super::super::archive::build::{Member, member, zip};

/// Namespaces of core and production, declared.
pub(super) const DECLARED: &str = "xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02' \
    xmlns:p='http://schemas.microsoft.com/3dmanufacturing/production/2015/06'";

/// A tetrahedron as a mesh.
pub(super) const TETRAHEDRON: &str = r#"<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="0" y="1" z="0"/>
    <vertex x="0" y="0" z="1"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>
    <triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/></triangles></mesh>"#;

/// A model part with these objects and this build.
pub(super) fn model(objects: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<model unit='millimeter' {DECLARED}><resources>{objects}</resources><build>{build}</build></model>"
    )
}

/// A package whose start part is this, with others.
pub(super) fn package(start: impl AsRef<[u8]>, others: &[(&str, &str)]) -> Vec<u8> {
    let types = "<Types xmlns='http://schemas.openxmlformats.org/package/2006/content-types'/>";
    let relationships = "<Relationships xmlns='http://schemas.openxmlformats.org/package/2006/relationships'>\
        <Relationship Id='r' Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel' Target='/3D/3dmodel.model'/></Relationships>";
    let own = [member("[Content_Types].xml", types), member("_rels/.rels", relationships), member("3D/3dmodel.model", start)];
    let others = others.iter().map(|(name, text)| member(name, text));
    zip(&own.into_iter().chain(others).collect::<Vec<Member>>())
}
