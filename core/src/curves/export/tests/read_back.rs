use proptest::prelude::*;

use super::samples::{all, body, can, cuboid, hill, octant, plate, used, whole};
use crate::curves::curve::{Curve, Role, Shape, Spline};
use crate::curves::export::{Body, BodyError, ExportError, Header, write_iges, write_step};
use crate::curves::{Network, Unit, read};

const HEADER: Header<'_> = Header { name: "part", time: Some("2026-11-28T07:15:00"), system: "suture" };

fn iges(body: &Body) -> String {
    let mut bytes = Vec::new();
    write_iges(body, &HEADER, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn step(body: &Body) -> String {
    let mut bytes = Vec::new();
    write_step(body, &HEADER, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn spline(curve: &Curve) -> &Spline {
    let Shape::Spline(spline) = &curve.shape else { panic!() };
    spline
}

/// The oddities that our own reader tells, but for surfaces, which it does not keep.
fn oddities(network: &Network) -> Vec<&str> {
    let texts = network.findings.iter().map(|finding| finding.text.as_str());
    let is_expected = |text: &&str| text.contains("surface") || text.contains("space of parameters");
    texts.filter(|text| !is_expected(text)).collect()
}

#[test]
fn edges_of_step_read_back_bit_by_bit() {
    for body in [plate(false), plate(true), cuboid(), can(), octant(false), octant(true)] {
        let network = read(step(&body).as_bytes()).unwrap();
        assert_eq!(oddities(&network), Vec::<&str>::new());
        // The resolution goes through metres and back.
        assert!((network.resolution.unwrap() - body.tolerance).abs() < 1e-20);
        assert_eq!(network.faces.len(), body.faces.len());
        for (face, read) in body.faces.iter().zip(&network.faces) {
            assert_eq!((face.outer.len(), face.inner.len()), (read.outer.len(), read.inner.len()));
            for (one, read) in face.outer.iter().zip(&read.outer) {
                let (written, found) = (&body.edges[one.edge].curve, &network.curves[read.curve]);
                assert_eq!((spline(found), read.is_reversed, found.role), (written, one.is_reversed, Role::Edge));
            }
        }
        assert_eq!(network.curves.len(), body.edges.len());
    }
}

#[test]
fn curves_of_iges_read_back_bit_by_bit() {
    for body in [plate(false), plate(true), cuboid(), can(), octant(true)] {
        let network = read(iges(&body).as_bytes()).unwrap();
        assert_eq!(oddities(&network), Vec::<&str>::new());
        assert_eq!((network.faces.len(), network.resolution), (body.faces.len(), Some(body.tolerance)));
        for (face, read) in body.faces.iter().zip(&network.faces) {
            for (one, read) in face.outer.iter().zip(&read.outer) {
                let (written, found) = (&body.edges[one.edge].curve, spline(&network.curves[read.curve]));
                if one.is_reversed {
                    let points: Vec<_> = written.points().iter().rev().copied().collect();
                    assert_eq!(found.points(), points);
                } else {
                    assert_eq!(found, written);
                }
            }
        }
    }
}

/// Columns of each line, pointers of the directory, and the counts of the last line (IGES 5.3, section 2.2).
#[test]
fn iges_has_its_columns() {
    for (name, body) in all() {
        let text = iges(&body);
        assert!(text.lines().all(|line| line.len() == 80 && line.is_ascii()), "{name}");
        let of = |section: u8| text.lines().filter(|line| line.as_bytes()[72] == section).collect::<Vec<_>>();
        let (directory, parameters) = (of(b'D'), of(b'P'));
        let number = |line: &str, field: usize| line[8 * field..8 * field + 8].trim().parse::<usize>().unwrap();
        let mut next = 1;
        for (entity, pair) in directory.chunks(2).enumerate() {
            let (first, count) = (number(pair[0], 1), number(pair[1], 3));
            assert_eq!(first, next, "{name}");
            let own = &parameters[first - 1..first - 1 + count];
            assert!(own.iter().all(|line| line[64..72].trim() == (2 * entity + 1).to_string()), "{name}");
            let kind = own[0].split(',').next().unwrap();
            assert_eq!((kind, own[count - 1][..64].trim_end().ends_with(';')), (pair[0][..8].trim(), true), "{name}");
            next += count;
        }
        let ends = format!("S{:>7}G{:>7}D{:>7}P{:>7}", of(b'S').len(), of(b'G').len(), directory.len(), parameters.len());
        assert_eq!(text.lines().last().unwrap(), format!("{ends:<72}T{:>7}", 1), "{name}");
    }
}

/// Every reference of a STEP file is to an instance that stands before it.
#[test]
fn step_refers_backwards() {
    for (name, body) in all() {
        let text = step(&body).replace(",\n", ",");
        for (number, line) in text.lines().filter(|line| line.starts_with('#')).enumerate() {
            let (id, rest) = line.split_once('=').unwrap();
            assert_eq!(id, format!("#{}", number + 1), "{name}");
            for reference in rest.split('#').skip(1) {
                let digits: String = reference.chars().take_while(char::is_ascii_digit).collect();
                assert!((1..=number).contains(&digits.parse().unwrap()), "{name}: {line}");
            }
        }
    }
}

/// Faces that hang together are a shell: closed where each edge is used twice.
#[test]
fn closed_shells_are_solids() {
    let solids = |body: &Body| step(body).matches("MANIFOLD_SOLID_BREP").count();
    let found: Vec<_> = all().iter().map(|(name, body)| (*name, solids(body))).filter(|(_, count)| *count > 0).collect();
    let expected = ["sphere", "torus", "torus_turned", "cuboid", "can", "octant", "octant_pcurves", "several"];
    assert_eq!(found, expected.map(|name| (name, 1)));
}

#[test]
fn a_header_says_what_it_is_told() {
    let body = body(vec![whole(hill(), true)]);
    let header = Header { name: "Lüfter 'A'", ..Header::default() };
    let mut bytes = Vec::new();
    write_step(&body, &header, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains("FILE_NAME('L\\X2\\00FC\\X0\\fter ''A''','',(''),(''),'','','');"), "{text}");
    let mut bytes = Vec::new();
    write_iges(&body, &header, &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains("1H,,1H;,10HL?fter 'A',10HL?fter 'A',,,32,38,6,308,17,"), "{text}");
}

#[test]
fn what_is_no_body_is_refused() {
    let why = |change: fn(&mut Body)| {
        let mut body = plate(true);
        change(&mut body);
        write_step(&body, &HEADER, &mut Vec::new()).unwrap_err().to_string()
    };
    assert!(why(|body| body.faces.clear()).ends_with("no face"));
    assert!(why(|body| body.vertices[2][0] = f64::NAN).ends_with("vertex 2 is not finite"));
    assert!(why(|body| body.vertices[2][0] = 9.0).ends_with("edge 1: its curve does not end at its vertex"));
    assert!(why(|body| body.edges[3].ends = [3, 77]).ends_with("edge 3: its end is no vertex"));
    assert!(why(|body| body.faces[0].outer.swap(0, 1)).contains("face 0, loop 0: an edge does not begin"));
    assert!(why(|body| body.faces[0].inner[0].push(used(99, false, None))).contains("face 0, loop 1: an edge is not there"));
    assert!(why(|body| body.faces[0].surface.points[1].truncate(1)).contains("rows of control points differ"));
    assert!(why(|body| body.faces[0].surface.weights = Some(vec![vec![0.0; 2]; 2])).contains("weights are not"));
    assert!(why(|body| body.tolerance = 0.0).contains("lengths above 0"));
    let mut cubits = plate(true);
    cubits.unit = Unit { name: "cubit".into(), millimetres: 457.2 };
    assert!(matches!(write_iges(&cubits, &HEADER, &mut Vec::new()), Err(ExportError::Unit(_))));
    let network = read(step(&cubits).as_bytes()).unwrap();
    assert_eq!((network.unit.name.as_str(), network.unit.millimetres), ("cubit", 457.2));
    let error = write_iges(&Body { faces: Vec::new(), ..cubits }, &HEADER, &mut Vec::new());
    assert!(matches!(error, Err(ExportError::Body(BodyError::Empty))));
}

/// Curves of parameters that a body lacks are those that it would have: of sides of a surface, and of all curves in a plane.
#[test]
fn curves_of_parameters_are_found() {
    assert_eq!(step(&octant(false)), step(&octant(true)));
    assert_eq!(iges(&octant(false)), iges(&octant(true)));
    assert_eq!(step(&plate(false)).matches("PCURVE(").count(), 5);
    let mut bare = can();
    bare.faces[0].outer.iter_mut().for_each(|one| one.pcurve = None);
    assert_eq!(step(&bare), step(&can()));
    // Of a patch that is bent up at its last corner, two sides are still edges; the other edges are off it.
    let mut bent = plate(false);
    bent.faces[0].surface.points[1][1][2] = 0.5;
    assert_eq!(step(&bent).matches("PCURVE(").count(), 2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Each number of a surface is in the file, in its place, to the last bit.
    #[test]
    fn surfaces_read_back_bit_by_bit(numbers in prop::collection::vec(any::<f64>(), 60), weights in prop::collection::vec(1e-3..1e3_f64, 20), is_rational in any::<bool>()) {
        let mut surface = hill();
        let coordinate = |at: usize| Some(numbers[at]).filter(|x| x.is_finite() && x.abs() < 1e100).unwrap_or(0.1 * at as f64);
        for (at, point) in surface.points.iter_mut().flatten().enumerate() {
            *point = [coordinate(3 * at), coordinate(3 * at + 1), coordinate(3 * at + 2)];
        }
        surface.weights = is_rational.then(|| weights.chunks(4).map(<[f64]>::to_vec).collect());
        let text = iges(&body(vec![whole(surface.clone(), true)]));
        let lines = text.lines().filter(|line| line.as_bytes()[72] == b'P' && line[64..72].trim() == "1");
        let record: String = lines.map(|line| line[..64].trim_end()).collect();
        let values = record.trim_end_matches(';').split(',').map(|word| word.replace('D', "e").parse::<f64>().unwrap());
        let values: Vec<f64> = values.collect();
        let of = |i: usize, j: usize| surface.weights.as_ref().map_or(1.0, |weights| weights[i][j]);
        let mut expected = vec![128.0, 4.0, 3.0, 3.0, 3.0];
        prop_assert_eq!(&values[..5], &expected[..]);
        expected = surface.knots.concat();
        let places: Vec<(usize, usize)> = (0..4).flat_map(|j| (0..5).map(move |i| (i, j))).collect();
        expected.extend(places.iter().map(|&(i, j)| of(i, j)));
        expected.extend(places.iter().flat_map(|&(i, j)| surface.points[i][j]));
        expected.extend([0.0, 1.0, 0.0, 1.0]);
        prop_assert_eq!(values[10..].iter().map(|x| x.to_bits()).collect::<Vec<_>>(), expected.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
        let text = step(&body(vec![whole(surface.clone(), true)]));
        let points = text.lines().filter_map(|line| line.split_once("CARTESIAN_POINT('',(")?.1.strip_suffix("));"));
        let points: Vec<u64> = points.take(20).flat_map(|point| point.split(',')).map(|word| word.parse::<f64>().unwrap().to_bits()).collect();
        let expected: Vec<u64> = surface.points.iter().flatten().flatten().map(|x| x.to_bits()).collect();
        prop_assert_eq!(points, expected);
        let weights = text.replace('\n', "").split_once("RATIONAL_B_SPLINE_SURFACE((").map(|(_, rest)| {
            let (list, _) = rest.split_once("))").unwrap();
            list.split(',').map(|word| word.trim_matches(|c| c == '(' || c == ')').parse::<f64>().unwrap()).collect::<Vec<_>>()
        });
        prop_assert_eq!(weights, surface.weights.map(|weights| weights.concat()));
    }
}
