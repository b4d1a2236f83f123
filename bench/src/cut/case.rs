//! The parts that can be made.

use super::cutter::Cutter;
use super::surface::Surface;

/// A part to be made. Lengths are in millimetres.
///
/// The first and the last row of the part's border are nearly straight seen from above: waves of a free form are far longer than the step
/// and lower than the tool's radius. A tool whose flat end does not fit the surface's hollows is lifted there, and leaves more.
/// Fewer than two passes count as two, and an odd number of cells as the next even one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// The surface that is meant.
    pub surface: Surface,
    /// The tool.
    pub cutter: Cutter,
    /// The way from pass to pass, measured along the surface.
    pub step: f64,
    /// The number of passes.
    pub passes: usize,
    /// The length of a pass.
    pub length: f64,
    /// Cells of the grid between two passes, an even number.
    pub cells: usize,
    /// Each coordinate of a vertex moves at random by up to so much.
    pub noise: f64,
    /// Whether cuts join the ends of passes; the tool is lifted over the part otherwise.
    pub zigzag: bool,
}

impl Case {
    /// The number of strips between passes.
    pub(super) fn strips(&self) -> usize {
        self.passes.max(2) - 1
    }

    /// Half the number of cells in a strip: as many lie on each side of the cusp.
    pub(super) fn half(&self) -> usize {
        self.cells.div_ceil(2).max(1)
    }

    /// The length of what the passes cover, measured across them.
    pub(super) fn width(&self) -> f64 {
        self.strips() as f64 * self.step
    }
}

const fn case(
    name: &'static str,
    surface: Surface,
    (radius, corner): (f64, f64),
    step: f64,
    cells: usize,
    noise: f64,
    zigzag: bool,
) -> Case {
    Case { name, surface, cutter: Cutter { radius, corner }, step, passes: 12, length: 24.0, cells, noise, zigzag }
}

/// Parts by which the search for residue was developed.
pub const CASES: [Case; 27] = [
    case("floor ball 0.5", Surface::Plane(0.0), (3.0, 3.0), 0.5, 8, 0.0, false),
    case("floor ball 1", Surface::Plane(0.0), (3.0, 3.0), 1.0, 8, 0.0, false),
    case("floor ball 1 zigzag", Surface::Plane(0.0), (3.0, 3.0), 1.0, 8, 0.0, true),
    case("floor ball 2", Surface::Plane(0.0), (3.0, 3.0), 2.0, 12, 0.0, false),
    case("floor ball 1 noise", Surface::Plane(0.0), (3.0, 3.0), 1.0, 8, 0.0005, false),
    case("floor ball 1.5 coarse", Surface::Plane(0.0), (3.0, 3.0), 1.5, 4, 0.0, false),
    case("floor flat 1", Surface::Plane(0.0), (3.0, 0.0), 1.0, 8, 0.0, false),
    case("floor bull 1", Surface::Plane(0.0), (3.0, 1.0), 1.0, 8, 0.0, false),
    case("floor bull 4.6", Surface::Plane(0.0), (3.0, 1.0), 4.6, 16, 0.0, false),
    case("slope 10 ball 1", Surface::Plane(10.0), (3.0, 3.0), 1.0, 8, 0.0, false),
    case("slope 30 flat 0.5", Surface::Plane(30.0), (3.0, 0.0), 0.5, 8, 0.0, false),
    case("slope 30 bull 1", Surface::Plane(30.0), (3.0, 1.0), 1.0, 8, 0.0, false),
    case("slope 15 bull 0.8", Surface::Plane(15.0), (3.0, 0.5), 0.8, 8, 0.0, true),
    case("wall 60 ball 1", Surface::Plane(60.0), (3.0, 3.0), 1.0, 8, 0.0, false),
    case("wall 80 ball 1", Surface::Plane(80.0), (3.0, 3.0), 1.0, 8, 0.0002, true),
    case("wall 85 flat 1", Surface::Plane(85.0), (3.0, 0.0), 1.0, 8, 0.0, false),
    case("wall 60 flat 0.5", Surface::Plane(60.0), (2.0, 0.0), 0.5, 8, 0.0, false),
    case("wall 70 bull 1", Surface::Plane(70.0), (3.0, 0.8), 1.0, 8, 0.0, false),
    case("wall 45 flat noise", Surface::Plane(45.0), (3.0, 0.0), 0.6, 8, 0.0005, false),
    case("cone 70 ball 1", Surface::Cone(20.0, 70.0), (3.0, 3.0), 1.0, 8, 0.0, false),
    case("cone 60 flat 0.5", Surface::Cone(15.0, 60.0), (2.0, 0.0), 0.5, 8, 0.0, false),
    case("cone 75 bull 1", Surface::Cone(20.0, 75.0), (3.0, 1.0), 1.0, 8, 0.0, false),
    case("free ball 0.5", Surface::Free(1.0, 20.0), (2.0, 2.0), 0.5, 8, 0.0, false),
    case("free ball 1", Surface::Free(1.5, 30.0), (3.0, 3.0), 1.0, 8, 0.0, false),
    case("free ball 1 zigzag noise", Surface::Free(1.5, 30.0), (3.0, 3.0), 1.0, 8, 0.0003, true),
    case("free ball 1.5", Surface::Free(1.0, 40.0), (3.0, 3.0), 1.5, 10, 0.0, false),
    case("free bull 0.5", Surface::Free(1.0, 40.0), (2.0, 1.0), 0.5, 8, 0.0, false),
];

/// Parts with other tools, steps and surfaces, which nobody looked at while the search for residue was written.
pub const FRESH: [Case; 6] = [
    case("fresh floor ball 1.3 zigzag", Surface::Plane(0.0), (2.5, 2.5), 1.3, 10, 0.0003, true),
    case("fresh slope 22 bull 0.9", Surface::Plane(22.0), (4.0, 1.5), 0.9, 8, 0.0, false),
    case("fresh wall 75 ball 0.7", Surface::Plane(75.0), (1.5, 1.5), 0.7, 8, 0.0, true),
    case("fresh cone 50 ball 0.85", Surface::Cone(14.0, 50.0), (2.2, 2.2), 0.85, 8, 0.0, false),
    case("fresh free ball 0.75", Surface::Free(0.8, 18.0), (2.8, 2.8), 0.75, 8, 0.0, false),
    case("fresh free bull 0.7", Surface::Free(4.0, 120.0), (3.0, 0.8), 0.7, 8, 0.0, false),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_cases_share_a_name_or_a_task() {
        let all: Vec<Case> = CASES.into_iter().chain(FRESH).collect();
        for (n, a) in all.iter().enumerate() {
            for b in &all[..n] {
                assert_ne!(a.name, b.name);
                assert_ne!(Case { name: "", ..*a }, Case { name: "", ..*b }, "{} and {}", a.name, b.name);
            }
        }
    }

    #[test]
    fn fresh_parts_have_tools_and_surfaces_of_their_own() {
        for fresh in FRESH {
            assert!(CASES.iter().all(|case| case.step != fresh.step), "{}", fresh.name);
            let is_same = |case: &&Case| case.surface == fresh.surface && case.surface != Surface::Plane(0.0);
            assert!(!CASES.iter().any(|case| is_same(&case)), "{}", fresh.name);
            assert!((0.0..=fresh.cutter.radius).contains(&fresh.cutter.corner) && fresh.cells % 2 == 0, "{}", fresh.name);
        }
    }
}
