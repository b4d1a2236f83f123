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

/// Beside a line, a quarter of a circle, and half an ellipse; the last one with a distance that grows along a line.
#[test]
fn offset_curves_are_read() {
    // Those beside which they go are read before them.
    let free = |network: &Network| network.curves.iter().find(|curve| curve.role == Role::Free).unwrap().shape.clone();
    let line = network(&[(130, 0, 0, 0, "3,1,0,0,0,2.,0.,0.,0.,0.,0.,1.,0.,1."), (110, 0, 0, 10000, "0.,0.,0.,4.,0.,0.")]);
    assert_eq!((free(&line).ends(), texts(&line)), ([[0.0, 2.0, 0.0], [4.0, 2.0, 0.0]], vec![]));
    assert_eq!((line.curves[0].role, line.curves[1].source.id), (Role::Generator, Id::Directory(1)));
    let arc = network(&[(130, 0, 0, 0, "3,1,0,0,0,.5,0.,0.,0.,0.,0.,1.,0.,9."), (100, 0, 0, 10000, "0.,0.,0.,2.,0.,0.,2.")]);
    assert!((free(&arc).kind() == "circle") && (free(&arc).length(1e-12) - 0.75 * PI).abs() < 1e-12);
    // The ellipse x²/4 + y² = 1, outward by 1: at its ends on both axes the distance is seen.
    let half =
        [(130, 0, 0, 0, "3,1,0,0,0,-1.,0.,0.,0.,0.,0.,1.,0.,0."), (104, 1, 0, 10000, ".25,0.,1.,0.,0.,-1.,0.,2.,0.,-2.,0.")];
    let ellipse = network(&half);
    let shape = free(&ellipse);
    let [low, high] = shape.domain();
    assert!(
        distance(shape.ends()[0], [3.0, 0.0, 0.0]) < 1e-9 && distance(shape.point(0.5 * (low + high)), [0.0, 2.0, 0.0]) < 1e-5
    );
    assert!(texts(&ellipse)[0].starts_with("4: an odd curve: D1: beside another one; fitted within"), "{:?}", texts(&ellipse));
    let tapered = network(&[(130, 0, 0, 0, "3,2,0,0,1,0.,0.,2.,4.,0.,0.,1.,0.,1."), (110, 0, 0, 10000, "0.,0.,0.,4.,0.,0.")]);
    assert_eq!(free(&tapered).ends(), [[0.0; 3], [4.0, 2.0, 0.0]]);
    // A composite of both: its second half alone, by its parameters; and one that goes beside itself.
    let path = [
        (130, 0, 0, 0, "3,1,0,0,0,1.,0.,0.,0.,0.,0.,1.,1.,2."),
        (102, 0, 0, 10000, "2,5,7"),
        (110, 0, 0, 10000, "0.,0.,0.,4.,0.,0."),
        (110, 0, 0, 10000, "4.,0.,0.,4.,4.,0."),
    ];
    assert_eq!(free(&network(&path)), Shape::Line([[3.0, 0.0, 0.0], [3.0, 4.0, 0.0]]));
    let round = network(&[(130, 0, 0, 0, "1,1,0,0,0,1.,0.,0.,0.,0.,0.,1.,0.,1."), (110, 0, 0, 0, "0.,0.,0.,4.,0.,0.")]);
    assert!(texts(&round)[0].contains("one within itself"), "{:?}", texts(&round));
}

/// A line in two columns of three, turned by a quarter and scaled, without two of them; a subfigure around a circle, two of its
/// four places.
#[test]
fn arrays_place_their_instances() {
    let quarter = FRAC_PI_2.to_string();
    let rows = format!("3,2.,10.,0.,1.,2,3,5.,7.,{quarter},2,1,2,6");
    let array = network(&[(412, 0, 0, 0, rows.as_str()), (110, 0, 0, 10000, "0.,0.,0.,1.,0.,0.")]);
    assert_eq!(texts(&array), Vec::<String>::new());
    let starts: Vec<_> = array.curves.iter().map(|curve| curve.shape.ends()[0]).collect();
    // Up is to the left now, across is up: places 1, 3, 4 and 5.
    let expected = [[10.0, 0.0, 1.0], [-4.0, 0.0, 1.0], [10.0, 5.0, 1.0], [3.0, 5.0, 1.0]];
    assert!(starts.len() == 4 && starts.iter().zip(expected).all(|(start, expected)| distance(*start, expected) < 1e-12));
    // None is turned.
    let [start, end] = array.curves[0].shape.ends();
    assert_eq!([end[0] - start[0], end[1] - start[1]], [2.0, 0.0]);
    let circle = format!("3,4,0.,0.,0.,2.,0.,{quarter},2,0,2,3");
    let figure = [
        (414, 0, 0, 0, circle.as_str()),
        (308, 0, 0, 20200, "0,4HLINE,1,5"),
        (110, 0, 0, 10000, "0.,0.,0.,1.,0.,0."),
        (412, 0, 0, 0, "1,1.,0.,0.,100.,1,2,0.,50.,0.,0,0"),
    ];
    let nested = network(&figure);
    let starts: Vec<_> = nested.curves.iter().map(|curve| curve.shape.ends()[0]).collect();
    let expected = [[0.0, 2.0, 100.0], [-2.0, 0.0, 100.0], [0.0, 52.0, 100.0], [-2.0, 50.0, 100.0]];
    assert!(starts.len() == 4 && starts.iter().zip(expected).all(|(start, expected)| distance(*start, expected) < 1e-12));
    // More places than there may be, in an array that repeats itself.
    let round = network(&[(412, 0, 0, 0, "1,1.,0.,0.,0.,100000,100000,1.,1.,0.,0,0"), (110, 0, 0, 0, "0.,0.,0.,1.,0.,0.")]);
    assert_eq!(round.curves.len(), 1);
}

/// Pairs, triples, and triples with vectors; what goes to and fro is no path.
#[test]
fn copious_points_are_paths_where_they_lie_so() {
    let path = |form: u32, values: &str| network(&[(106, form, 0, 0, values)]);
    let pairs = path(1, "1,3,7.,0.,0.,1.,0.,1.,1.");
    assert_eq!(pairs.curves[0].shape, Shape::Polyline(vec![[0.0, 0.0, 7.0], [1.0, 0.0, 7.0], [1.0, 1.0, 7.0]]));
    assert!(texts(&pairs)[0].contains("an odd curve: D1: 3 points, read as a polyline"), "{:?}", texts(&pairs));
    let triples = path(2, "2,2,0.,0.,0.,1.,2.,3.");
    assert_eq!(triples.curves[0].shape.ends(), [[0.0; 3], [1.0, 2.0, 3.0]]);
    let vectors = path(3, "3,2,0.,0.,0.,0.,0.,1.,1.,2.,3.,0.,0.,1.");
    assert_eq!(vectors.curves[0].shape.ends(), [[0.0; 3], [1.0, 2.0, 3.0]]);
    let cloud = path(1, "1,4,0.,0.,0.,5.,0.,0.,1.,5.,1.");
    assert_eq!(texts(&cloud), ["0: the file has no curve in space", "4: not read: 1 × 106 (points)"]);
}

/// The same entities in the compressed form: of each directory entry the fields that differ from those of the entry before, then
/// the parameters on lines of `width`.
fn compressed(entities: &[Entity<'_>], width: usize) -> String {
    let mut fields: [String; 21] = Default::default();
    let mut data = String::new();
    for (at, (kind, form, matrix, status, values)) in entities.iter().enumerate() {
        let number = 2 * at + 1;
        let mut head = format!("D{number}");
        let own = [(1, kind.to_string()), (7, matrix.to_string()), (9, format!("{status:08}")), (15, form.to_string())];
        for (field, value) in own.into_iter().chain([(18, "LABEL".to_owned()), (19, number.to_string())]) {
            if fields[field] != value {
                head += &format!("@{field}_{value}");
                fields[field] = value;
            }
        }
        data += &format!("{head};\n");
        chunks(&format!("{kind},{values};"), width).iter().for_each(|line| data += &format!("{line}\n"));
    }
    let head = cards('C', &[String::new()]) + &cards('S', &["by hand".into()]) + &cards('G', &chunks(MM, 72));
    head + &data + &cards('T', &["S      1G      2".into()])
}

/// All that a network has but for lines, which differ between both forms.
fn without_lines(mut network: Network) -> Network {
    network.curves.iter_mut().for_each(|curve| curve.source.line = 0);
    network.faces.iter_mut().for_each(|face| face.source.line = 0);
    network.findings.iter_mut().for_each(|finding| finding.line = 0);
    network.findings.sort();
    network
}

proptest! {
    #[test]
    fn both_forms_say_the_same(picks in prop::collection::vec(0_usize..8, 1..20), width in 20_usize..72) {
        // Each stands on its own, or refers to the first two.
        let pool = [
            (110, 0, 1, 10000, "0.,0.,0.,1.D1,2.5E0,-.5"),
            (100, 0, 0, 0, "3.,1.,1.,3.,1.,1.,3."),
            (106, 12, 0, 1010100, "2,3,0.,0.,0.,1.,0.,0.,1.,1.,1."),
            (126, 0, 1, 0, "1,1,0,0,1,0,0.,0.,1.,1.,1.,1.,0.,0.,0.,1.,1.,1.,0.,1.,0.,0.,0."),
            (144, 0, 0, 0, "1,0,0,0"),
            (130, 0, 0, 0, "3,1,0,0,0,2.,0.,0.,0.,0.,0.,1.,0.,1."),
            (412, 0, 1, 0, "3,1.,0.,0.,0.,2,1,1.,0.,0.,0,0"),
            (999, 3, 0, 0, "1,2HAB,,3"),
        ];
        let mut entities: Vec<Entity<'_>> = vec![
            (124, 0, 0, 10000, "1.,0.,0.,5.,0.,1.,0.,0.,0.,0.,1.,0."),
            (110, 0, 0, 10000, "0.,0.,0.,4.,0.,0."),
        ];
        entities.extend(picks.into_iter().map(|pick| pool[pick]));
        let both = [fixed(MM, &entities), compressed(&entities, width)].map(|text| without_lines(read(text.as_bytes()).unwrap()));
        prop_assert_eq!(&both[0], &both[1]);
    }
}

/// A B-spline surface (128) that is a plane from (0, 0, 1) to (4, 2, 1) over parameters from 0 to 1, and a boundary of parameters
/// alone: a rectangle as a composite of four lines. Then the same on a cylinder: drawn (122), turned (120), and ruled (118),
/// where one side is a helix.
#[test]
fn boundaries_of_parameters_alone_are_composed() {
    let face = |surface: (u32, u32, u32, u32, &'static str), more: &[Entity<'static>]| {
        let mut entities: Vec<Entity<'static>> = vec![
            (144, 0, 0, 0, "5,1,0,3"),
            (142, 0, 0, 10000, "0,5,7,0,1"),
            surface,
            (102, 0, 0, 10500, "3,9,11,13"),
            (110, 0, 0, 10500, "0.25,0.,0.,0.75,0.,0."),
            (110, 0, 0, 10500, "0.75,0.,0.,0.75,1.,0."),
            (110, 0, 0, 10500, "0.75,1.,0.,0.25,0.,0."),
        ];
        entities.extend(more);
        let network = network(&entities);
        assert_eq!(network.faces[0].outer.len(), 3, "{:?}", texts(&network));
        let shapes: Vec<Shape> = network.faces[0].outer.iter().map(|one| network.curves[one.curve].shape.clone()).collect();
        for (one, next) in shapes.iter().zip(shapes.iter().cycle().skip(1)) {
            assert!(distance(one.ends()[1], next.ends()[0]) < 1e-9);
        }
        (shapes, texts(&network))
    };
    let plane = "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,1.,4.,0.,1.,0.,2.,1.,4.,2.,1.,0.,1.,0.,1.";
    let (shapes, found) = face((128, 0, 0, 10000, plane), &[]);
    let triangle = [[1.0, 0.0, 1.0], [3.0, 0.0, 1.0], [3.0, 2.0, 1.0]];
    assert_eq!(shapes, [0, 1, 2].map(|at| Shape::Line([triangle[at], triangle[(at + 1) % 3]])));
    assert!(found[0].ends_with("alone: D3 of type 142; its curves are composed exactly"), "{found:?}");
    // Half a circle of radius 2, drawn up by 3: a quarter, a line, and a helix back.
    let arc = (100, 0, 0, 10000, "0.,0.,0.,2.,0.,-2.,0.");
    let (drawn, found) = face((122, 0, 0, 10000, "15,2.,0.,3."), &[arc]);
    assert_eq!((drawn[0].kind(), drawn[1].kind()), ("circle", "line"));
    assert!((drawn[2].length(1e-9) - PI.hypot(3.0)).abs() < 1e-4 && found[0].contains("fitted within"), "{found:?}");
    // The same from a line that is turned by half a circle; its parameter comes first, so here 0.25 to 0.75 is upwards.
    let line = (110, 0, 0, 10000, "2.,0.,0.,2.,0.,3.");
    let (turned, _) = face((120, 0, 0, 10000, "15,17,0.,3.141592653589793"), &[(110, 0, 0, 10000, "0.,0.,0.,0.,0.,1."), line]);
    assert_eq!(turned[0], Shape::Line([[2.0, 0.0, 0.75], [2.0, 0.0, 2.25]]));
    assert!((turned[1].length(1e-12) - 2.0).abs() < 1e-12 && turned[1].kind() == "circle");
    let upper = (100, 0, 0, 10000, "3.,0.,0.,2.,0.,-2.,0.");
    let (ruled, _) = face((118, 1, 0, 10000, "15,17,0,0"), &[arc, upper]);
    assert!((ruled[0].length(1e-9) - PI).abs() < 1e-4 && distance(ruled[2].ends()[0], drawn[2].ends()[0]) < 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Offsets, arrays, boundaries of parameters: whatever is damaged, it ends.
    #[test]
    fn no_damage_of_what_is_made_of_others_is_too_much(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12)) {
        let entities = [
            (144, 0, 0, 0, "5,1,0,3"),
            (142, 0, 0, 10000, "0,5,7,0,1"),
            (128, 0, 0, 10000, "1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,1.,4.,0.,1.,0.,2.,1.,4.,2.,2.,0.,1.,0.,1."),
            (102, 0, 0, 10500, "2,9,11"),
            (110, 0, 0, 10500, "0.25,0.,0.,0.75,1.,0."),
            (100, 0, 0, 10500, "0.,.5,.5,.75,.5,.5,.75"),
            (130, 0, 0, 0, "15,2,0,0,1,1.,0.,2.,1.,0.,0.,1.,0.,0."),
            (104, 1, 0, 10000, ".25,0.,1.,0.,0.,-1.,0.,2.,0.,-2.,0."),
            (412, 0, 0, 0, "15,2.,10.,0.,1.,2,3,5.,7.,0.5,2,1,2,6"),
            (414, 0, 0, 0, "17,4,0.,0.,0.,2.,0.,1.,2,0,2,3"),
        ];
        let mut text = fixed(MM, &entities).into_bytes();
        for (at, byte) in changes {
            let at = at.index(text.len());
            // Digits are changed into others, so that what is read is often still a file.
            text[at] = if text[at].is_ascii_digit() { b'0' + byte % 10 } else { byte };
        }
        let _ = read(&text);
    }
}
