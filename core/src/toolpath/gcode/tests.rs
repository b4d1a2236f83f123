use super::super::{Dialect, Kind, Move, Options, Program, ReadError, Rotary, Shape, Units, read, tools};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn program(text: &str) -> Program {
    read(text.as_bytes(), &Options::default()).expect(text)
}

fn moves(text: &str) -> Vec<Move> {
    program(text).moves.iter().collect()
}

fn ends(text: &str) -> Vec<[f64; 3]> {
    moves(text).iter().map(|one| one.to.map(|value| (value * 1e9).round() / 1e9 + 0.0)).collect()
}

fn refusal(text: &str) -> String {
    match read(text.as_bytes(), &Options::default()) {
        Err(error @ (ReadError::Refused { .. } | ReadError::TooMany { .. })) => error.to_string(),
        other => panic!("{text}: {other:?}"),
    }
}

/// Letters, numbers and spaces as controls write them.
#[test]
fn words_are_tolerant() {
    let expected = [[1.0, -0.5, 3.0], [1.0, 2.5, 3.0]];
    for text in [
        "G21 G0 X1 Y-.5 Z3\nG1 Y2.5 F100",
        "g21g0x1.y-0.50z+3\r\ng1y2.5f1e+02\r\n",
        "N10 G21 G00 X 1 Y - 0.5 Z3 (a)\nN20 G01 Y 2 . 5 ;b\n",
    ] {
        assert_eq!(ends(text), expected, "{text}");
    }
    let inches = program("G20\nG0 X1 Y0 Z0\nG1 X2 F1\n");
    assert_eq!((inches.moves.get(1).map(|one| one.to[0]), inches.header.units), (Some(50.8), Units::Inches));
    assert_eq!(inches.header.travel.feed, 25.4);
}

/// The first moves begin where nobody knows; later ones are rapids.
#[test]
fn places_are_known_once_they_are_told() {
    let program = program("G21 G0 Z5\nG0 X0 Y0\nG0 X10\nG1 Z0\nG28\nG0 Z5\nG0 X0 Y0\nG0 Z1\n");
    let kinds: Vec<_> = program.moves.iter().map(|one| one.kind).collect();
    let (unknown, rapid) = (Kind::Reference, Kind::Rapid);
    assert_eq!(kinds, [unknown, unknown, rapid, Kind::Feed, unknown, unknown, unknown, rapid]);
    assert_eq!(program.header.travel.rapid, 14.0);
}

/// A quarter, a full circle, a helix of two turns and arcs by radius, in each plane.
#[test]
fn arcs_turn_as_told() {
    let sweep = |text: &str| match moves(text).last().map(|one| one.kind) {
        Some(Kind::Arc { sweep, .. }) => sweep,
        other => panic!("{other:?}"),
    };
    let at = "G21 G0 X10 Y0 Z0\n";
    for (code, expected) in [
        ("G3 X0 Y10 I-10", FRAC_PI_2),
        ("G2 X0 Y10 I-10", -1.5 * PI),
        ("G3 I-10", TAU),
        ("G2 I-10 Z-5 P2", -2.0 * TAU),
        ("G3 X0 Y10 R10", FRAC_PI_2),
        ("G3 X0 Y10 R-10", 1.5 * PI),
        ("G90.1 G3 X0 Y10 I0 J0", FRAC_PI_2),
        ("G18 G2 X20 Z10 I10", -1.5 * PI),
        ("G19 G3 Y10 Z10 K10", FRAC_PI_2),
    ] {
        assert!((sweep(&format!("{at}{code} F1")) - expected).abs() < 1e-9, "{code}");
    }
    let odd = program("G21 G0 X10 Y20 Z0\nG3 X0 Y30 I0 J20 F1\n");
    assert!(odd.header.findings.iter().any(|finding| finding.text.contains("fit as an absolute centre")));
    assert!(refusal("G21 G0 X0 Y0 Z0\nG2 X10 Y0 I3").contains("line 2: an arc begins"));
}

/// Offsets: the frame is that of the first cut; others count relative to it.
#[test]
fn offsets_are_relative_to_the_first_cut() {
    assert_eq!(ends("G21 G10 L2 P1 X100\nG54 G0 X0 Y0 Z0\nG1 X1 F1\n")[1], [1.0, 0.0, 0.0]);
    let two = ends("G21 G10 L2 P1 X100\nG10 L2 P2 X150 Y1\nG54 G0 X0 Y0 Z0\nG1 X1 F1\nG55 G1 X1 Y0\n");
    assert_eq!(two[2], [51.0, 1.0, 0.0]);
    assert_eq!(
        ends("G21 G0 X0 Y0 Z0\nG1 X5 F1\nG92 X0\nG1 X5\nG92.1\nG1 X1\n"),
        [[0.0; 3], [5.0, 0.0, 0.0], [10.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    );
    assert_eq!(ends("G21 G0 X0 Y0 Z0\nG1 X0 F1\nG52 X7\nG1 X1\nG43 H1 Z2\n")[2..], [[8.0, 0.0, 0.0], [8.0, 0.0, 2.0]]);
}

/// Scaling, mirroring and rotation, polar coordinates.
#[test]
fn places_are_transformed() {
    assert_eq!(
        ends("G21 G0 X0 Y0 Z0\nG51 X0 Y0 Z0 I2 J-2 K1\nG1 X1 Y1 F1\nG50\nG1 X1\n")[1..],
        [[2.0, -2.0, 0.0], [1.0, -2.0, 0.0]]
    );
    assert_eq!(ends("G21 G0 X0 Y0 Z0\nG68 X1 Y0 R90\nG1 X3 Y0 F1\nG69\nG1 X0 Y0\n")[1..], [[1.0, 2.0, 0.0], [0.0; 3]]);
    assert_eq!(ends("G21 G0 X0 Y0 Z0\nG16 G1 X10 Y90 F1\nY180\nG15\n")[1..], [[0.0, 10.0, 0.0], [-10.0, 0.0, 0.0]]);
    assert_eq!(ends("G21 G0 X0 Y0 Z0\nG1 @5 ^90 F1\n")[1], [0.0, 5.0, 0.0]);
    let flipped = moves("G21 G0 X10 Y0 Z0\nG51 X0 Y0 Z0 I1 J-1 K1\nG3 X0 Y10 I-10 F1\n");
    assert!(matches!(flipped[1].kind, Kind::Arc { sweep, .. } if (sweep + FRAC_PI_2).abs() < 1e-9));
}

/// A row of holes; the second line repeats the cycle, and `G99` stays low.
#[test]
fn cycles_drill() {
    let text = "G21 G90 G0 X0 Y0 Z10\nG98 G81 X1 Y1 Z-2 R3 F50\nX2\nG80 G0 X0\n";
    let depths: Vec<_> = moves(text).iter().map(|one| one.to[2]).collect();
    assert_eq!(depths, [10.0, 10.0, 3.0, -2.0, 10.0, 10.0, 3.0, -2.0, 10.0, 10.0]);
    let pecks = moves("G21 G0 X0 Y0 Z3\nG99 G83 X1 Z-4 R3 Q3 F50\n").iter().filter(|one| one.is_cut()).count();
    assert_eq!(pecks, 3);
    let row = program("G21 G0 X0 Y0 Z3\nG99 G91 G81 X1 Y0 Z-4 R0 L5 F50\n");
    assert_eq!((row.header.feeds, row.header.cut.map(|cut| cut[1][0])), (5, Some(5.0)));
    assert!(refusal("G21 G0 X0 Y0 Z3\nG83 X1 Z-4 R3").contains("positive Q"));
}

/// Parameters, conditions, loops and subprograms of LinuxCNC, and those of Fanuc's control.
#[test]
fn programs_flow() {
    let text = "O100 sub\nG1 X[#1] Y[#2*2] F1\nO101 if [#1 gt 2]\nO100 return [7]\nO101 endif\nO100 endsub [5]\n\
        G21 G0 X0 Y0 Z0\n#<i>=1\n\
        O1 while [#<i> le 3]\nO100 call [#<i>] [1]\n#<i>=[#<i>+1]\nO1 endwhile\nG1 X#<_value>\nO2 do\n#<i>=[#<i>-1]\n\
        O2 while [#<i> gt 0]\n\
        G1 Y#<i>\nO3 repeat [2]\nG91 G1 Z1\nO3 endrepeat\nM2\nG1 X99\n";
    let expected = [
        [0.0; 3],
        [1.0, 2.0, 0.0],
        [2.0, 2.0, 0.0],
        [3.0, 2.0, 0.0],
        [7.0, 2.0, 0.0],
        [7.0, 0.0, 0.0],
        [7.0, 0.0, 1.0],
        [7.0, 0.0, 2.0],
    ];
    assert_eq!(ends(text), expected);
    let fanuc = program(
        "%\nO0001 (MAIN)\nG21 G0 X0 Y0 Z0\nM98 P20 L3\nM98 P30002\nM97 P900 L2\nM30\nN900 G91 G1 Y1 F1\nM99\nO0020\n\
        G91 G1 X1 F1\nM99\nO0002\nG91 G1 Z1\nM99\n%\n",
    );
    assert_eq!(fanuc.header.dialect, Dialect::Fanuc);
    assert_eq!(fanuc.moves.iter().last().map(|one| one.to), Some([3.0, 2.0, 3.0]));
    assert_eq!(ends("G21 G0 X0 Y0 Z0\nM98 P7\nM30\n:7\nG1 X1 F1\nM99\n").len(), 2);
    let chain = "O1 if [0]\nG1 X1\nO1 elseif [1]\nG1 X2\nO1 else\nG1 X3\nO1 endif\n";
    assert_eq!(ends(&format!("G21 G0 X0 Y0 Z0 F1\n{chain}"))[1..], [[2.0, 0.0, 0.0]]);
}

/// Loops and recursion without an end.
#[test]
fn endless_programs_are_refused() {
    let options = Options { steps_max: 10_000, ..Options::default() };
    for text in [
        "G21\nO1 while [1]\nO1 endwhile\n",
        "G21\nO1 do\n#1=[#1+1]\nO1 while [1]\n",
        "G21\nO1 repeat [1000000000]\nG1 X1 F1\nO1 endrepeat\n",
    ] {
        assert!(matches!(read(text.as_bytes(), &options), Err(ReadError::TooMany { .. })), "{text}");
    }
    assert!(refusal("G21\nO1 sub\nO1 call\nO1 endsub\nO1 call\n").contains("recursion"));
    assert!(refusal("O1 G21\nM98 P1\n").contains("recursion"));
    let few = Options { moves_max: 100, ..Options::default() };
    assert!(matches!(read(b"G21 G0 X0 Y0 Z1\nG81 X1 Z0 R1 L1000000 F1", &few), Err(ReadError::TooMany { .. })));
    assert_eq!(program("G21\nG0 X1\nM99\n").moves.len(), 1);
}

/// Refusals name the code and its line.
#[test]
fn refusals_have_names() {
    for (code, word) in [
        ("G38.2 Z-1", "probing"),
        ("G33 Z1 K1", "threading"),
        ("G76 P1 Z1", "threading"),
        ("G7", "lathe"),
        ("G71 P1 Q2 D1", "lathe"),
        ("G12 I1", "circular pocket"),
        ("G65 P1", "macro"),
        ("G1 A5", "rotary axis"),
        ("G1 U5", "second linear axis"),
        ("G41 D1 X1", "diameter of tool 1"),
        ("G54.1 P301", "work offset"),
        ("G987", "not known"),
        ("IF [#1 EQ 1] GOTO 10", "Fanuc"),
        ("O<x> call", "not in this file"),
        ("#1=#<x>", "before it is set"),
        ("G1 X[1/0]", "division"),
        ("G1 X9 ,R1", "rounded"),
    ] {
        let text = refusal(&format!("G21 G0 X0 Y0 Z0\n{code} F1\n"));
        assert!(text.starts_with("line 2: ") && text.contains(word), "{text}");
    }
    let lathe = "G21 G18\nG0 X10 Z1\nG1 Z-5 F1\nX12\n";
    assert!(refusal(lathe).contains("lathe"));
}

/// Splines are lines within the tolerance; a quarter of a circle as a NURBS is a circle.
#[test]
fn splines_become_lines() {
    let circle =
        moves("G21 G0 X10 Y0 Z0\nG6.2 P3 X10 Y0 R1 K0\nX10 Y10 R0.70710678118 K0\nX0 Y10 R1 K0\nK1\nK1\nK1\nG1 X0 Y0 F1\n");
    let on = &circle[1..circle.len() - 1];
    assert!(on.len() > 20 && on.iter().all(|one| (one.to[0].hypot(one.to[1]) - 10.0).abs() < 1e-6));
    assert!(on.iter().all(|one| (one.point(0.5)[0].hypot(one.point(0.5)[1]) - 10.0).abs() < 0.0011));
    let cubic = ends("G21 G0 X0 Y0 Z0\nG5 X10 Y10 I3 J0 P-3 Q0 F1\nG5 X12 Y12 P0 Q-1\nG5.1 X14 Y10 I1 J1\n");
    assert_eq!(cubic.last(), Some(&[14.0, 10.0, 0.0]));
    assert!(cubic.contains(&[10.0, 10.0, 0.0]) && cubic.contains(&[5.0, 5.0, 0.0]));
    let nurbs = ends("G21 G0 X0 Y0 Z0 F1\nG5.2 P1 L3 X0 Y1\nX2 Y2\nX3 Y0\nG5.3\nG1 X9\n");
    assert_eq!(nurbs[nurbs.len() - 2..], [[3.0, 0.0, 0.0], [9.0, 0.0, 0.0]]);
}

/// A square with a tool of 2 mm on its right, then on its left: by hand.
#[test]
fn compensation_is_beside_the_path() {
    let text = "G21 G0 X-5 Y-5 Z0\nG42 D1 G1 X0 Y-5 F1\nY0\nX10\nY10\nG40\nG0 Z5\n";
    let options = Options { tools: vec![tools::parse("1=flat,d=2").expect("a tool")], ..Options::default() };
    let program = read(text.as_bytes(), &options).expect(text);
    let points: Vec<_> = program.moves.iter().map(|one| one.to.map(|value| (value * 1e9).round() / 1e9 + 0.0)).collect();
    // The corner at (0, 0) turns right, to the inside; the others are gone around. Behind G40 the tool goes to the programmed
    // place.
    let expected = [
        [-5.0, -5.0, 0.0],
        [0.0, -6.0, 0.0],
        [1.0, -5.0, 0.0],
        [1.0, -1.0, 0.0],
        [10.0, -1.0, 0.0],
        [11.0, 0.0, 0.0],
        [11.0, 10.0, 0.0],
        [10.0, 10.0, 5.0],
    ];
    assert_eq!(points, expected);
}

/// The tool's axis of five axes: by a head, and by a table that turns the other way.
#[test]
fn rotary_axes_turn_the_tool() {
    let axis = |rotary| {
        let options = Options { rotary: Some(rotary), ..Options::default() };
        read(b"G21 G0 X0 Y0 Z0\nG1 A90 C90 F1\n", &options).expect("a program").moves.get(1).map(|one| one.axis.map(f64::round))
    };
    assert_eq!(axis(Rotary::Head), Some([1.0, 0.0, 0.0]));
    assert_eq!(axis(Rotary::Table), Some([1.0, 0.0, 0.0]));
}

/// Tools of comments, of changes and of T alone.
#[test]
fn tools_are_told() {
    let text =
        "(T1 D=6. CR=3. - ball end mill)\n(T2 D=4. CR=0. - flat end mill)\nG21\nT1 M6\nT2\nG0 X0 Y0 Z0\nG1 X1 F1\nM6\nG1 X2\n";
    let program = program(text);
    assert_eq!(program.header.used, [1, 2]);
    let shapes: Vec<_> = program.header.tools.iter().map(|tool| (tool.number, tool.shape, tool.diameter)).collect();
    assert_eq!(shapes, [(1, Shape::Ball, 6.0), (2, Shape::Flat, 4.0)]);
    assert_eq!(program.moves.iter().map(|one| one.tool).collect::<Vec<_>>(), [1, 1, 2]);
}

/// Dialects, checksums, units of comments, letters alone.
#[test]
fn oddities_are_findings() {
    let marlin = program("N1 G21*14\nN2 G1 X1 Y0 Z0 E2*0\n");
    assert_eq!(marlin.header.dialect, Dialect::Marlin);
    assert!(marlin.header.findings.iter().any(|finding| finding.line == 2 && finding.text.contains("checksum")));
    let inch = program("(OUTPUT IN ABSOLUTE INCHES)\nG0 X1 Y0 Z0\n");
    assert_eq!((inch.header.units, inch.header.has_units), (Units::Inches, false));
    let damaged = program("G21\nG0 X1 Y0 Z0\nG1 X~\nG1 X2 F1\n");
    assert_eq!((damaged.header.unread, damaged.moves.len()), (1, 2));
    assert_eq!(program("[WinCNC]\nG0 X1 Y2 Z3 [a comment]\n").header.dialect, Dialect::WinCnc);
    assert_eq!(program("%\nG21\nG0 X1 Y0 Z0\n%\nG0 X9\n").moves.len(), 1);
}
