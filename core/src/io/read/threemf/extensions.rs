//! Namespaces of 3MF, and which of them are understood.

use super::super::archive::shown;
use super::super::xml::Element;
use crate::util::legible::legible;

const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
/// The namespace of the draft 0.93, whose meshes, components and builds are the same.
const DRAFT: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01";
pub(super) const PRODUCTION: &str = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06";
pub(super) const BEAM_LATTICE: &str = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02";

/// Extensions that a file may require.
const UNDERSTOOD: [&str; 10] = [
    CORE,
    PRODUCTION,
    // An object with a lattice is refused by itself.
    BEAM_LATTICE,
    "http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07",
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
    "http://schemas.3mf.io/3dmanufacturing/production/alternatives/2021/04",
    // What is encrypted is refused by itself.
    "http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04",
    "http://schemas.3mf.io/3dmanufacturing/trianglesets/2021/07",
];

/// Parts of the URIs of extensions that are known, and what they give instead of triangles.
const KNOWN: [(&str, &str); 5] = [
    ("/boolean", "Booleans"),
    ("/displacement", "displacement"),
    ("/volumetric", "volumetric data"),
    ("/implicit", "implicit functions"),
    ("/levelset", "level sets"),
];

/// This element of 3MF Core.
pub(super) fn is_core(element: &Element<'_>, name: &str) -> bool {
    element.name == name && in_core(element)
}

/// An element of 3MF Core.
pub(super) fn in_core(element: &Element<'_>) -> bool {
    element.namespace.as_deref() == Some(CORE) || in_draft(element)
}

/// An element of the draft.
pub(super) fn in_draft(element: &Element<'_>) -> bool {
    element.namespace.as_deref() == Some(DRAFT)
}

/// This extension may be required.
pub(super) fn is_understood(namespace: &str) -> bool {
    UNDERSTOOD.contains(&namespace)
}

/// An extension for people.
pub(super) fn words(namespace: &str) -> String {
    let known = KNOWN.iter().find(|(part, _)| namespace.contains(part));
    known.map_or_else(|| shown(namespace), |(_, name)| format!("{name} ({})", legible(namespace)))
}

/// What an object is made of, by the first element in it that is neither a mesh nor components.
pub(super) fn content(name: &str) -> Option<&'static str> {
    Some(match name {
        "booleanshape" => "Booleans of other objects",
        "displacementmesh" => "a mesh with displacement",
        "levelset" => "a level set",
        "beamlattice" => "a beam lattice",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fuzzer's find: the name of a known extension with more around it.
    #[test]
    fn words_have_no_control_characters() {
        for namespace in ["http://schemas.micr\u{1f}soft.com/3dmanufacturing/displacement/2022/07", "\u{7}\n"] {
            assert!(!words(namespace).contains(char::is_control), "{:?}", words(namespace));
        }
    }
}
