//! Namespaces of 3MF, and which of them are understood.

pub(super) const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
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

/// This extension may be required.
pub(super) fn is_understood(namespace: &str) -> bool {
    UNDERSTOOD.contains(&namespace)
}

/// An extension for people.
pub(super) fn words(namespace: &str) -> String {
    let known = KNOWN.iter().find(|(part, _)| namespace.contains(part));
    known.map_or_else(|| super::super::archive::shown(namespace), |(_, name)| format!("{name} ({namespace})"))
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
