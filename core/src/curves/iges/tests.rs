use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;

use crate::curves::curve::{Curve, Id, Role, Shape};
use crate::curves::network::{Network, ReadError};
use crate::curves::read::read;
use crate::curves::vector::distance;

/// An entity of a file: type, form, number of its matrix, status, parameters behind the type. Entities are numbered 1, 3, 5, …
type Entity<'a> = (u32, u32, u32, u32, &'a str);

/// Cards of a section: data, and the number of the first.
fn cards(section: char, data: &[String]) -> String {
    data.iter().enumerate().map(|(at, data)| format!("{data:<72}{section}{:>7}\n", at + 1)).collect()
}

fn chunks(text: &str, width: usize) -> Vec<String> {
    text.as_bytes().chunks(width).map(|part| String::from_utf8_lossy(part).into_owned()).collect()
}

/// A file of fixed cards, as the standard has it.
fn fixed(global: &str, entities: &[Entity<'_>]) -> String {
    let record = global.as_bytes().iter().rev().find(|byte| !byte.is_ascii_whitespace()).copied().map_or(';', char::from);
    let delimiter = if global.starts_with("1H") { global.as_bytes()[2] as char } else { ',' };
    let (mut directory, mut parameters) = (Vec::new(), Vec::new());
    for (at, (kind, form, matrix, status, values)) in entities.iter().enumerate() {
        let number = 2 * at + 1;
        let lines = chunks(&format!("{kind}{delimiter}{values}{record}"), 64);
        let first = parameters.len() + 1;
        directory.push(format!("{kind:>8}{first:>8}{:>8}{:>8}{:>8}{:>8}{matrix:>8}{:>8}{status:>08}", 0, 0, 0, 0, 0));
        directory.push(format!("{kind:>8}{:>8}{:>8}{:>8}{form:>8}{:>16}{:>8}{:>8}", 0, 0, lines.len(), "", "LABEL", number));
        parameters.extend(lines.into_iter().map(|line| format!("{line:<64}{number:>8}")));
    }
    let start = cards('S', &["by hand".into()]);
    let global = cards('G', &chunks(global, 72));
    start + &global + &cards('D', &directory) + &cards('P', &parameters) + &cards('T', &["S      1G      1".into()])
}

const MM: &str = ",,4HPART,8Hpart.igs,4Hhand,4Hhand,32,38,6,308,15,,1.0,2,2HMM,1,0.01,13H000101.000000,1.0D-5,100.;";

fn network(entities: &[Entity<'_>]) -> Network {
    read(fixed(MM, entities).as_bytes()).unwrap()
}

fn one(entity: Entity<'_>) -> Curve {
    let network = network(&[entity]);
    assert_eq!((network.curves.len(), &network.findings[..]), (1, &[][..]));
    network.curves.into_iter().next().unwrap()
}

fn texts(network: &Network) -> Vec<String> {
    network.findings.iter().map(|finding| format!("{}: {}", finding.line, finding.text)).collect()
}

#[test]
fn each_curve_is_what_its_parameters_say() {
    let line = one((110, 0, 0, 0, "0.,0.,0.,1.D1,2.5E0,-.5"));
    assert_eq!((line.shape.ends(), line.source.id), ([[0.0; 3], [10.0, 2.5, -0.5]], Id::Directory(1)));
    assert_eq!((line.name.as_deref(), line.source.line), (Some("LABEL(1)"), 4));
    // A quarter of a circle of radius 2 at the height 3.
    let arc = one((100, 0, 0, 0, "3.,1.,1.,3.,1.,1.,3."));
    assert!((arc.shape.length(1e-9) - PI).abs() < 1e-12 && distance(arc.shape.point(FRAC_PI_2), [1.0, 3.0, 3.0]) < 1e-15);
    // Half an ellipse, x²/4 + y² = 1, from the right to the left.
    let ellipse = one((104, 1, 0, 0, ".25,0.,1.,0.,0.,-1.,0.,2.,0.,-2.,0."));
    assert!((ellipse.shape.length(1e-12) - 0.5 * 9.688_448_220_547_675).abs() < 1e-10);
    assert_eq!(one((104, 3, 0, 0, "1.,0.,0.,0.,-4.,0.,0.,-2.,1.,4.,4.")).shape.kind(), "conic");
    let path = one((106, 12, 0, 0, "2,3,0.,0.,0.,1.,0.,0.,1.,1.,1."));
    assert_eq!(path.shape, Shape::Polyline(vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0; 3]]));
    let closed = one((106, 63, 0, 0, "1,3,7.,0.,0.,1.,0.,1.,1."));
    assert_eq!(closed.shape.ends(), [[0.0, 0.0, 7.0]; 2]);
    // x = t, y = t², z = 0 on [0, 1], then x = 1 + t, y = 1 + 2 t on [1, 3]: both lengths are known.
    let cubic = one((112, 0, 0, 0, "3,1,2,2,0.,1.,3.,0.,1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,0.,1.,1.,0.,0.,1.,2.,0.,0.,0.,0.,0.,0."));
    let expected = 0.5 * 5.0_f64.sqrt() + 0.25 * 2.0_f64.asinh() + 2.0 * 5.0_f64.sqrt();
    assert!((cubic.shape.length(1e-12) - expected).abs() < 1e-11);
    // A quarter of a circle as a rational B-spline.
    let spline =
        one((126, 0, 0, 0, "2,2,1,0,0,0,0.,0.,0.,1.,1.,1.,1.,.7071067811865476,1.,1.,0.,0.,1.,1.,0.,0.,1.,0.,0.,1.,0.,0.,1."));
    assert!((spline.shape.length(1e-12) - FRAC_PI_2).abs() < 1e-12);
}

/// A matrix that turns x to y and shifts, placed by another one that doubles.
#[test]
fn matrices_are_applied_nested() {
    let matrix = (124, 0, 3, 0, "0.,-1.,0.,5.,1.,0.,0.,0.,0.,0.,1.,0.");
    let outer = (124, 0, 0, 0, "2.,0.,0.,0.,0.,2.,0.,0.,0.,0.,2.,1.");
    let network = network(&[matrix, outer, (110, 0, 1, 0, "0.,0.,0.,1.,0.,0.")]);
    assert_eq!(network.curves[0].shape.ends(), [[10.0, 0.0, 1.0], [10.0, 2.0, 1.0]]);
    let circle = self::network(&[(124, 0, 1, 0, "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0."), (110, 0, 1, 0, "0.,0.,0.,1.,0.,0.")]);
    assert_eq!(circle.curves.len(), 1);
    assert!(texts(&circle)[0].contains("an entity is read without its matrix"));
}

/// A triangle of a plane: 144 with a 142 whose curve in space is a 102, and one in the space of parameters, which is no curve.
fn trimmed() -> Vec<Entity<'static>> {
    vec![
        (144, 0, 0, 0, "5,1,0,3"),
        (142, 0, 0, 10000, "1,5,15,7,2"),
        (108, 0, 0, 10000, "0.,0.,1.,0.,0,0.,0.,0.,0."),
        (102, 0, 0, 10000, "3,9,11,13"),
        (110, 0, 0, 10000, "0.,0.,0.,1.,0.,0."),
        (110, 0, 0, 10000, "1.,0.,0.,0.,1.,0."),
        (110, 0, 0, 10000, "0.,1.,0.,0.,0.,0."),
        (102, 0, 0, 10500, "1,17"),
        (110, 0, 0, 10500, "0.,0.,0.,1.,0.,0."),
        (110, 0, 0, 0, "7.,7.,7.,8.,8.,8."),
    ]
}

#[test]
fn faces_have_their_loops() {
    let network = network(&trimmed());
    let [face] = &network.faces[..] else { panic!() };
    assert_eq!((face.entity.as_str(), face.surface.as_str(), face.outer.len(), face.inner.len()), ("144", "108", 3, 0));
    let roles: Vec<Role> = network.curves.iter().map(|curve| curve.role).collect();
    assert_eq!(roles, [Role::Edge, Role::Edge, Role::Edge, Role::Free]);
    let found = texts(&network);
    assert_eq!(found, ["8: not read: 1 × 108 (plane)", "20: not read: 1 × curve in the space of parameters of a surface"]);
}

/// A card of parameters is lost: the curve that it belongs to is named, the others are read.
#[test]
fn damage_costs_nothing_of_what_is_whole() {
    let text = fixed(MM, &trimmed());
    let lines: Vec<&str> = text.lines().collect();
    for lost in 0..lines.len() {
        let rest: Vec<&str> = lines.iter().enumerate().filter(|(at, _)| *at != lost).map(|(_, line)| *line).collect();
        let network = read(rest.join("\n").as_bytes()).unwrap();
        let least = if matches!(lines[lost].as_bytes()[72], b'D' | b'P') { 3 } else { 4 };
        assert!(network.curves.len() >= least, "line {lost}: {} curves, {:?}", network.curves.len(), texts(&network));
        // Lines that cost nothing need no word: of the start, of units that are the usual ones, of a plane that is not read.
        let is_whole = network.curves.len() == 4
            && network.faces.first().is_some_and(|face| face.outer.len() == 3 && !face.surface.is_empty());
        if !is_whole {
            assert!(
                network.findings.iter().any(|finding| !finding.text.starts_with("not read")),
                "line {lost}: {:?}",
                texts(&network)
            );
        }
    }
}

#[test]
fn every_kind_of_line_is_read() {
    let text = fixed(MM, &trimmed());
    let whole = read(text.as_bytes()).unwrap();
    let shapes = |network: &Network| network.curves.iter().map(|curve| curve.shape.clone()).collect::<Vec<_>>();
    let crlf = text.replace('\n', "\r\n");
    let old = text.replace('\n', "\r");
    let records = text.replace('\n', "");
    let lower = text.replace("D     ", "d     ").replace("P     ", "p     ");
    let mark = format!("\u{feff}{text}");
    // Blanks before the letter of the section were squeezed, so columns are wrong.
    let squeezed: String =
        text.lines().map(|line| if line.as_bytes()[72] == b'P' { squeeze(line) } else { format!("{line}\n") }).collect();
    for other in [crlf, old, records, lower, mark, squeezed] {
        let network = read(other.as_bytes()).unwrap();
        assert_eq!((shapes(&network), network.faces.len()), (shapes(&whole), 1), "{}", &other[..400]);
    }
}

fn squeeze(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ") + "\n"
}

/// Other delimiters, strings that contain them, and comments behind the end of a record.
#[test]
fn delimiters_are_those_of_the_file() {
    let global = "1H/ /1H#/4HA/B#/8Hpart.igs/4Hhand/4Hhand/32/38/6/308/15//1.0/1/4HINCH/1/0.01/13H000101.000000/1.0D-5/100.#";
    let global = global.replace("/ /", "//");
    let text = fixed(&global, &[(110, 0, 0, 0, "0./0./0./1./0./0.#a comment, with ; and #")]);
    let network = read(text.as_bytes()).unwrap();
    assert_eq!((network.unit.name.as_str(), network.unit.millimetres, network.resolution), ("inch", 25.4, Some(1e-5)));
    assert_eq!(network.curves[0].shape.ends(), [[0.0; 3], [1.0, 0.0, 0.0]]);
}

#[test]
fn units_are_told() {
    let unit = |global: &str| {
        let network = read(fixed(global, &[(110, 0, 0, 0, "0.,0.,0.,1.,0.,0.")]).as_bytes()).unwrap();
        (network.unit.name.clone(), network.unit.millimetres, texts(&network))
    };
    let with =
        |scale: &str, flag: &str, name: &str| unit(&format!(",,,,,,32,38,6,308,15,,{scale},{flag},{name},1,0.01,,1.D-5,1.;"));
    assert_eq!(with("1.", "2", "2HMM"), ("mm".into(), 1.0, vec![]));
    assert_eq!(with("1.", "6", ""), ("m".into(), 1000.0, vec![]));
    assert_eq!(with("1.", "3", "2HCM").1, 10.0);
    let (_, factor, found) = with("0.5", "2", "2HMM");
    assert_eq!((factor, &found[..]), (2.0, &["2: the model has a scale, which counts in its unit: 0.5".to_owned()][..]));
    let (name, factor, found) = with("1.", "2", "4HINCH");
    assert_eq!((name.as_str(), factor), ("mm", 1.0));
    assert_eq!(found, ["2: unit and its name differ: flag 2, name INCH; the flag counts"]);
    assert!(with("1.", "", "").2[0].contains("the unit is unknown"));
}

/// A subfigure with a line, placed twice, once within another one that is scaled.
#[test]
fn subfigures_are_placed() {
    let entities = [
        (308, 0, 0, 20200, "0,4HLINE,1,3"),
        (110, 0, 0, 10000, "0.,0.,0.,1.,0.,0."),
        (408, 0, 0, 0, "1,0.,5.,0.,1."),
        (308, 0, 0, 20200, "1,4HBOTH,1,9"),
        (408, 0, 0, 10000, "1,1.,0.,0.,2."),
        (408, 0, 0, 0, "7,0.,0.,1.,10."),
    ];
    let network = network(&entities);
    let ends: Vec<_> = network.curves.iter().map(|curve| curve.shape.ends()).collect();
    assert_eq!(ends, [[[0.0, 5.0, 0.0], [1.0, 5.0, 0.0]], [[10.0, 0.0, 1.0], [30.0, 0.0, 1.0]]]);
    // One that contains itself ends.
    let round =
        self::network(&[(308, 0, 0, 0, "0,1HA,2,3,5"), (408, 0, 0, 0, "1,1.,0.,0.,1."), (110, 0, 0, 0, "0.,0.,0.,1.,0.,0.")]);
    assert!(round.curves.len() <= 64 && !round.curves.is_empty());
}

/// Two faces of a solid that share an edge: the same curve, the same vertices.
#[test]
fn edges_of_solids_have_vertices() {
    let entities = [
        (502, 1, 0, 10000, "3,0.,0.,0.,1.,0.,0.,0.,1.,0."),
        (504, 1, 0, 10000, "3,5,1,1,1,2,7,1,2,1,3,9,1,3,1,1"),
        (110, 0, 0, 10000, "0.,0.,0.,1.,0.,0."),
        (110, 0, 0, 10000, "1.,0.,0.,0.,1.,0."),
        (110, 0, 0, 10000, "0.,1.,0.,0.,0.,0."),
        (508, 1, 0, 10000, "3,0,3,1,1,0,0,3,2,1,0,0,3,3,1,0"),
        (510, 1, 0, 0, "15,1,1,11"),
        (190, 0, 0, 10000, "0,0"),
    ];
    let network = network(&entities);
    assert_eq!(network.faces[0].outer.len(), 3);
    let vertices: Vec<_> = network.curves.iter().map(|curve| curve.vertices.unwrap()).collect();
    assert_eq!(vertices, [[0, 1], [1, 2], [2, 0]]);
}

#[test]
fn the_compressed_form_is_read() {
    let text = cards('C', &[String::new()]) + &cards('S', &["by hand".into()]) + &cards('G', &chunks(MM, 72));
    let data = "D1@1_124@9_00000000@15_0;\n124,1.,0.,0.,5.,0.,1.,0.,0.,\n0.,0.,1.,0.;\nD3@1_110@7_1;\n110,0.,0.,0.,1.,0.,0.;\nD5@7_0;\n110,0.,0.,0.,2.,0.,0.;\n";
    let end = cards('T', &["S      1G      1".into()]);
    let network = read((text + data + &end).as_bytes()).unwrap();
    let ends: Vec<_> = network.curves.iter().map(|curve| curve.shape.ends()).collect();
    assert_eq!(ends, [[[5.0, 0.0, 0.0], [6.0, 0.0, 0.0]], [[0.0; 3], [2.0, 0.0, 0.0]]]);
    assert_eq!(network.findings, []);
}

/// Announced counts that are not there, degrees beyond all bounds, numbers that are none.
#[test]
fn what_is_damaged_is_named_with_its_line() {
    let why = |entity: Entity<'_>| texts(&network(&[entity, (110, 0, 0, 0, "0.,0.,0.,1.,0.,0.")])).join("; ");
    assert_eq!(
        why((126, 0, 0, 0, "900000000,3,0,0,1,0,0.,1.")),
        "4: damaged and not read: D1 of type 126, 900000000 are announced, 0 are there"
    );
    assert!(why((126, 0, 0, 0, "1,77,0,0,1,0,0.,0.,1.,1.,1.,1.,0.,0.,0.,1.,1.,1.,0.,1.")).contains("are announced, there are"));
    assert!(why((110, 0, 0, 0, "0.,0.,zero,1.,0.,0.")).contains("parameter 3 is no number"));
    assert!(why((110, 0, 0, 0, "0.,0.")).contains("parameter 3 of 2 is missing"));
    assert!(why((100, 0, 0, 0, "0.,1.,1.,1.,1.,1.,1.")).contains("an arc without radius"));
    assert!(why((102, 0, 0, 0, "2,1,3")).contains("or it contains itself"));
    assert!(why((110, 1, 0, 0, "0.,0.,0.,1.,0.,0.")).contains("not read: 1 × 110 (unbounded line)"));
    assert_eq!(read(b"S      1\n").unwrap_err(), ReadError::Unknown("S      1".into()));
    let empty = fixed(MM, &[]);
    assert!(matches!(read(empty.as_bytes()), Err(ReadError::NoDirectory(_))));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_damage_is_too_much(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12), cut in any::<prop::sample::Index>()) {
        let mut text = fixed(MM, &trimmed()).into_bytes();
        for (at, byte) in changes {
            let at = at.index(text.len());
            text[at] = byte;
        }
        let _ = read(&text);
        text.truncate(cut.index(text.len()));
        let _ = read(&text);
    }
}
