//! The kinds of repairs, as reports name them.

use serde::{Deserialize, Serialize};

/// A kind of repair. Several steps of the pipeline may account for one kind. `core/REPORT.md` says what each does.
///
/// In JSON it is the variant's name in `snake_case`. Names of reports of schema 1 are read, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RepairName {
    /// Triangles with a repeated corner, or of no area, were removed.
    Degenerate,
    /// Triangles on the vertices of another triangle were removed.
    Duplicate,
    /// Walls that bodies had in common were removed: these bodies are one body now.
    CommonWall,
    /// Surface that lay on other surface, facing the same way, was removed.
    #[serde(alias = "lap")]
    Overlap,
    /// Sheets that hang from a closed surface, or cross a body, were removed.
    Surplus,
    /// Boundary vertices within the weld tolerance were moved to one position.
    ToleranceWeld,
    /// Rims that run along each other were joined, farther apart than the weld tolerance.
    Sew,
    /// Edges were split at vertices that lie on them.
    TJunction,
    /// Boundary vertices were merged across a narrow gap.
    Zip,
    /// Triangles of slits whose two sides run past each other were removed.
    #[serde(alias = "overrun")]
    SlitSides,
    /// Open specks were dropped.
    Debris,
    /// Parts that are seen from behind were turned.
    #[serde(alias = "facing")]
    Visibility,
    /// Triangles were turned to agree with their neighbours.
    Orient,
    /// Lone sheets were thickened, or given a base.
    SheetSolids,
    /// Rims of open shapes got a skirt down into the surface that they stand on.
    #[serde(alias = "seat")]
    Skirt,
    /// Boundary loops were closed.
    Fill,
    /// Lone sheets were dropped.
    Sheets,
    /// Components that were inside out were turned.
    Outward,
    /// Bodies in the material of others became cavities.
    Hollow,
    /// Triangles that crossed were cut along each other.
    #[serde(alias = "resolve")]
    SelfIntersection,
    /// Tiny bodies and voids that cutting left were dropped.
    Dust,
    /// Nothing was changed: these crossings were left.
    #[serde(alias = "crossings left")]
    SelfIntersectionsLeft,
    /// Bodies that lay in the material of others were removed.
    #[serde(alias = "swallowed")]
    Enclosed,
    /// Surface that cannot be seen from outside was removed.
    Hidden,
    /// Surfaces that shared an edge or a vertex got vertices of their own.
    #[serde(alias = "separated")]
    Separate,
    /// Places that nothing else made valid were cut out and closed anew.
    Rebuild,
    /// A region was replaced by a surface around the space that it encloses.
    Wrap,
    /// Features below the sizes that the profile names were removed, and the faces around them continued.
    Defeature,
    /// Residue of a tool, between its passes, was moved onto the surface that was meant.
    Residue,
    /// Waves shorter than the profile wants them were smoothed.
    Smooth,
    /// Triangles were made fewer, within a proved distance.
    Simplify,
}

impl RepairName {
    /// Every kind, in the order of the pipeline.
    pub const ALL: &'static [Self] = &[
        Self::Degenerate,
        Self::Duplicate,
        Self::CommonWall,
        Self::Overlap,
        Self::Surplus,
        Self::ToleranceWeld,
        Self::Sew,
        Self::TJunction,
        Self::Zip,
        Self::SlitSides,
        Self::Debris,
        Self::Visibility,
        Self::Orient,
        Self::SheetSolids,
        Self::Skirt,
        Self::Fill,
        Self::Sheets,
        Self::Outward,
        Self::Hollow,
        Self::SelfIntersection,
        Self::Dust,
        Self::SelfIntersectionsLeft,
        Self::Enclosed,
        Self::Hidden,
        Self::Separate,
        Self::Rebuild,
        Self::Wrap,
        Self::Defeature,
        Self::Residue,
        Self::Smooth,
        Self::Simplify,
    ];

    /// Words for its work, which follow "by".
    pub fn doing(self) -> &'static str {
        match self {
            Self::Degenerate => "removing triangles of no area",
            Self::Duplicate => "removing copies of triangles",
            Self::CommonWall => "removing walls in common",
            Self::Overlap => "removing surface that lay on other surface",
            Self::Surplus => "removing surplus sheets",
            Self::ToleranceWeld => "joining corners that nearly met",
            Self::Sew => "sewing rims together",
            Self::TJunction => "splitting edges",
            Self::Zip => "closing narrow gaps",
            Self::SlitSides => "taking slits apart",
            Self::Debris => "dropping specks",
            Self::Visibility => "turning what was seen from behind",
            Self::Orient => "turning triangles",
            Self::SheetSolids => "making solids of sheets",
            Self::Skirt => "letting rims down to what they stand on",
            Self::Fill => "closing holes",
            Self::Sheets => "dropping sheets",
            Self::Outward => "turning bodies outward",
            Self::Hollow => "making bodies cavities",
            Self::SelfIntersection => "cutting along crossings",
            Self::Dust => "dropping dust",
            Self::SelfIntersectionsLeft => "leaving crossings",
            Self::Enclosed => "removing bodies within others",
            Self::Hidden => "removing hidden surface",
            Self::Separate => "separating surfaces that met",
            Self::Rebuild => "cutting places out and closing them anew",
            Self::Wrap => "wrapping regions",
            Self::Defeature => "removing small features",
            Self::Residue => "removing what a tool left",
            Self::Smooth => "smoothing",
            Self::Simplify => "simplifying",
        }
    }

    /// The name in a report.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Degenerate => "degenerate",
            Self::Duplicate => "duplicate",
            Self::CommonWall => "common_wall",
            Self::Overlap => "overlap",
            Self::Surplus => "surplus",
            Self::ToleranceWeld => "tolerance_weld",
            Self::Sew => "sew",
            Self::TJunction => "t_junction",
            Self::Zip => "zip",
            Self::SlitSides => "slit_sides",
            Self::Debris => "debris",
            Self::Visibility => "visibility",
            Self::Orient => "orient",
            Self::SheetSolids => "sheet_solids",
            Self::Skirt => "skirt",
            Self::Fill => "fill",
            Self::Sheets => "sheets",
            Self::Outward => "outward",
            Self::Hollow => "hollow",
            Self::SelfIntersection => "self_intersection",
            Self::Dust => "dust",
            Self::SelfIntersectionsLeft => "self_intersections_left",
            Self::Enclosed => "enclosed",
            Self::Hidden => "hidden",
            Self::Separate => "separate",
            Self::Rebuild => "rebuild",
            Self::Wrap => "wrap",
            Self::Defeature => "defeature",
            Self::Residue => "residue",
            Self::Smooth => "smooth",
            Self::Simplify => "simplify",
        }
    }
}

impl std::fmt::Display for RepairName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::RepairName;

    /// The order of the variants is that of the list, so that none is missing between two others.
    #[test]
    fn every_kind_is_listed_once() {
        assert!(RepairName::ALL.iter().enumerate().all(|(place, name)| *name as usize == place));
        assert_eq!(*RepairName::ALL.last().unwrap(), RepairName::Simplify);
    }

    #[test]
    fn reports_of_schema_1_are_read() {
        let read = |name: &str| serde_json::from_value::<RepairName>(name.into()).map(RepairName::as_str).ok();
        let renamed = [
            ("lap", "overlap"),
            ("overrun", "slit_sides"),
            ("facing", "visibility"),
            ("seat", "skirt"),
            ("resolve", "self_intersection"),
            ("crossings left", "self_intersections_left"),
            ("swallowed", "enclosed"),
            ("separated", "separate"),
            ("t_junction", "t_junction"),
        ];
        for (before, now) in renamed {
            assert_eq!((read(before), read(now)), (Some(now), Some(now)));
        }
        assert_eq!(read("no repair"), None);
    }
}
