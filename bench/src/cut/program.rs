//! The tool path of a case: its passes, the cuts that join them, and its G-code.

use std::fmt::Write;

use super::case::Case;
use super::lift::lifted;
use super::pass::Pass;
use super::surface::Surface;
use crate::space::Vector;

/// The height of rapid moves, far over every part.
const CLEAR: f64 = 100.0;

/// The length of moves that follow a free form.
const MOVE: f64 = 0.25;

/// The length of a move of the tip, at most: where the surface turns, the tip goes around the point that it touches, and farther than that.
const LONGEST: f64 = 2.0 * MOVE;

/// More moves than any pass has: even a length without end gives an end.
const MOST_MOVES: f64 = 1e5;

/// The passes of a case, in order.
pub(super) fn passes(case: &Case) -> Vec<Pass> {
    let tip = |u: f64, v: f64| case.cutter.tip(case.surface.at(u, v));
    let pass = |k: usize| {
        let u = k as f64 * case.step;
        match case.surface {
            Surface::Plane(_) => Pass::Lines(vec![tip(u, 0.0), tip(u, case.length)]),
            Surface::Free(..) => {
                let count = (case.length / MOVE).ceil().clamp(1.0, MOST_MOVES);
                let tips: Vec<Vector> = (0..=count as usize).map(|j| tip(u, case.length * j as f64 / count)).collect();
                Pass::Lines(lifted(case.cutter, case.surface, &tips, LONGEST))
            }
            Surface::Cone(radius, _) => {
                let tip = tip(u, 0.0);
                Pass::Arc { radius: tip[0], z: tip[2], angles: [0.0, case.length / radius] }
            }
        }
    };
    (0..=case.strips()).map(pass).collect()
}

/// G-code of passes, every other one backwards, and the cuts that join them.
pub(super) fn program(case: &Case, passes: &[Pass]) -> (String, Vec<Pass>) {
    let mut path = Path { code: String::from("%\nG21 G90 G17\nT1 M6\n"), links: Vec::new(), last: None, zigzag: case.zigzag };
    path.line(format_args!("G0 Z{CLEAR}"));
    for (k, pass) in passes.iter().enumerate() {
        let is_back = k % 2 == 1;
        match pass {
            Pass::Lines(points) if is_back => path.lines(points.iter().rev()),
            Pass::Lines(points) => path.lines(points.iter()),
            Pass::Arc { radius, z, angles } => {
                let at = |angle: f64| [radius * angle.cos(), radius * angle.sin(), *z];
                path.arc(angles.map(at), is_back);
            }
        }
    }
    path.line(format_args!("G0 Z{CLEAR}\nM30\n%"));
    (path.code, path.links)
}

/// The program so far.
struct Path {
    code: String,
    links: Vec<Pass>,
    /// Where the last pass ended.
    last: Option<Vector>,
    zigzag: bool,
}

impl Path {
    fn line(&mut self, words: std::fmt::Arguments<'_>) {
        // Text in memory takes all that is written.
        let _ = writeln!(self.code, "{words}");
    }

    fn cut(&mut self, to: Vector) {
        self.line(format_args!("G1 X{:.4} Y{:.4} Z{:.4} F900", to[0], to[1], to[2]));
    }

    /// Goes to where a pass begins.
    fn begin(&mut self, at: Vector) {
        match self.last {
            Some(before) if self.zigzag => {
                self.cut(at);
                self.links.push(Pass::Lines(vec![before, at]));
            }
            _ => self.line(format_args!("G0 Z{CLEAR}\nG0 X{:.4} Y{:.4}\nG0 Z{:.4}", at[0], at[1], at[2])),
        }
    }

    fn lines<'a>(&mut self, mut points: impl Iterator<Item = &'a Vector>) {
        let Some(first) = points.next() else { return };
        self.begin(*first);
        self.last = Some(*first);
        for p in points {
            self.cut(*p);
            self.last = Some(*p);
        }
    }

    /// An arc about the Z axis, counter-clockwise between two points, or back.
    fn arc(&mut self, ends: [Vector; 2], is_back: bool) {
        let ([to, from], word) = if is_back { (ends, "G2") } else { ([ends[1], ends[0]], "G3") };
        self.begin(from);
        self.line(format_args!("{word} X{:.5} Y{:.5} I{:.5} J{:.5} F900", to[0], to[1], -from[0], -from[1]));
        self.last = Some(to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::CASES;
    use super::*;

    fn count(code: &str, word: &str) -> usize {
        code.lines().filter(|line| line.starts_with(word)).count()
    }

    #[test]
    fn passes_are_cut_one_after_the_other() {
        for case in CASES {
            let passes = passes(&case);
            let (code, links) = program(&case, &passes);
            assert_eq!(passes.len(), case.passes, "{}", case.name);
            assert_eq!(links.len(), if case.zigzag { case.passes - 1 } else { 0 }, "{}", case.name);
            let plunges = if case.zigzag { 1 } else { case.passes };
            assert_eq!(count(&code, "G0 X"), plunges, "{}", case.name);
            let moves = passes.iter().map(|pass| if let Pass::Lines(points) = pass { points.len() - 1 } else { 0 });
            assert_eq!(count(&code, "G1 "), moves.sum::<usize>() + links.len(), "{}", case.name);
            let is_cone = matches!(case.surface, Surface::Cone(..));
            assert_eq!([count(&code, "G2 "), count(&code, "G3 ")], if is_cone { [6, 6] } else { [0, 0] }, "{}", case.name);
        }
    }

    /// X and Y of each move in the plane.
    fn ends(code: &str) -> Vec<[f64; 2]> {
        let number = |line: &str, letter: char| {
            let word = line.split(' ').find_map(|word| word.strip_prefix(letter));
            word.and_then(|word| word.parse::<f64>().ok())
        };
        code.lines().filter_map(|line| Some([number(line, 'X')?, number(line, 'Y')?])).collect()
    }

    #[test]
    fn every_other_pass_goes_back() {
        let cutter = super::super::cutter::Cutter { radius: 3.0, corner: 0.0 };
        let floor = Case {
            name: "",
            surface: Surface::Plane(0.0),
            cutter,
            step: 2.0,
            passes: 3,
            length: 5.0,
            cells: 2,
            noise: 0.0,
            zigzag: true,
        };
        let (code, _) = program(&floor, &passes(&floor));
        assert_eq!(ends(&code), [[0.0, 0.0], [0.0, 5.0], [2.0, 5.0], [2.0, 0.0], [4.0, 0.0], [4.0, 5.0]]);
        // The tip of a flat end stands its radius nearer to the axis than the wall that it touches; a quarter of a turn is one radius
        // times π/2 long. The second pass lies cos 60° of the step farther out.
        let cone = Case { surface: Surface::Cone(20.0, 60.0), length: 10.0 * std::f64::consts::PI, passes: 2, ..floor };
        let (code, _) = program(&cone, &passes(&cone));
        assert_eq!(ends(&code), [[17.0, 0.0], [0.0, 17.0], [0.0, 18.0], [18.0, 0.0]]);
        let arcs: Vec<&str> = code.lines().filter(|line| line.contains('I')).collect();
        assert!(arcs[0].starts_with("G3 ") && arcs[0].contains(" I-17.00000 J"), "{arcs:?}");
        assert!(arcs[1].starts_with("G2 ") && arcs[1].contains(" J-18.00000 "), "{arcs:?}");
    }
}
