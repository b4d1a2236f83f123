use std::f64::consts::{FRAC_PI_2, PI, TAU};

use proptest::prelude::*;

use super::text::decoded;
use crate::curves::curve::{Id, Role, Shape};
use crate::curves::network::{Network, ReadError};
use crate::curves::read::read;
use crate::curves::vector::distance;

/// A file with the usual beginning; instances from #1 on are free, units are #900 (millimetres, degrees) and #910 (inches).
fn file(data: &str) -> String {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{data}
#900=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#904))GLOBAL_UNIT_ASSIGNED_CONTEXT((#901,#902))REPRESENTATION_CONTEXT('',''));
#901=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#902=(CONVERSION_BASED_UNIT('DEGREE',#903)NAMED_UNIT(#906)PLANE_ANGLE_UNIT());
#903=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.0174532925199433),#905);
#904=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-5),#901,'distance_accuracy_value','');
#905=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#906=DIMENSIONAL_EXPONENTS(0.,0.,0.,0.,0.,0.,0.);
#910=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#911))REPRESENTATION_CONTEXT('',''));
#911=(CONVERSION_BASED_UNIT('INCH',#912)LENGTH_UNIT()NAMED_UNIT(#906));
#912=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#901);
ENDSEC;\nEND-ISO-10303-21;\n"
    )
}

/// Points at the corners of a unit square and more, axes, and a set of the items given.
fn set(items: &str, data: &str) -> Network {
    let text = format!(
        "#1=CARTESIAN_POINT('',(0.,0.,0.));\n#2=CARTESIAN_POINT('',(1.,0.,0.));\n#3=CARTESIAN_POINT('',(1.,1.,0.));\n#4=CARTESIAN_POINT('',(0.,1.,0.));
#5=DIRECTION('',(0.,0.,1.));\n#6=DIRECTION('',(1.,0.,0.));\n#7=AXIS2_PLACEMENT_3D('',#1,#5,#6);\n#8=VECTOR('',#6,2.);\n#9=LINE('',#1,#8);
#10=CIRCLE('',#7,1.);\n#11=DIRECTION('',(0.,1.,0.));
#800=SHAPE_REPRESENTATION('',(#801),#900);\n#801=GEOMETRIC_CURVE_SET('',({items}));\n{data}"
    );
    read(file(&text).as_bytes()).unwrap()
}

fn one(items: &str, data: &str) -> Shape {
    let network = set(items, data);
    assert_eq!((network.curves.len(), texts(&network)), (1, vec![]));
    network.curves[0].shape.clone()
}

fn texts(network: &Network) -> Vec<String> {
    network.findings.iter().map(|finding| format!("{}: {}", finding.line, finding.text)).collect()
}

#[test]
fn each_curve_is_what_its_instance_says() {
    let circle = one("#10", "");
    assert!((circle.length(1e-9) - TAU).abs() < 1e-14);
    let ellipse = one("#20", "#20=ELLIPSE('',#7,2.,1.);");
    assert!((ellipse.length(1e-12) - 9.688_448_220_547_675).abs() < 1e-11);
    assert_eq!(one("#20", "#20=POLYLINE('',(#1,#2,#3));").length(1e-9), 2.0);
    let spline = "('',2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.";
    let with = |rest: &str| one("#20", &format!("#20={rest};")).to_spline().unwrap();
    let knots = with(&format!("B_SPLINE_CURVE_WITH_KNOTS{spline},(3,3),(0.,1.),.UNSPECIFIED.)"));
    assert_eq!(knots.knots(), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(with(&format!("BEZIER_CURVE{spline})")).points(), knots.points());
    assert_eq!(with(&format!("QUASI_UNIFORM_CURVE{spline})")).knots(), knots.knots());
    // Uniform: begins and ends in the middle of its control polygon.
    assert_eq!(one("#20", &format!("#20=UNIFORM_CURVE{spline});")).ends(), [[0.5, 0.0, 0.0], [1.0, 0.5, 0.0]]);
    // A quarter of a circle, as a complex instance.
    let arc = "#20=(BOUNDED_CURVE()B_SPLINE_CURVE(2,(#2,#3,#4),.UNSPECIFIED.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),.UNSPECIFIED.)CURVE()GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE((1.,0.7071067811865476,1.))REPRESENTATION_ITEM('arc'));";
    let network = set("#20", arc);
    assert_eq!((network.curves[0].name.as_deref(), network.curves[0].source.id), (Some("arc"), Id::Instance(20)));
    assert!((network.curves[0].shape.length(1e-12) - FRAC_PI_2).abs() < 1e-12);
}

#[test]
fn curves_are_trimmed_by_points_or_parameters() {
    let trimmed = |of: &str, from: &str, to: &str, sense: &str, by: &str| {
        one(
            "#20",
            &format!(
                "#20=TRIMMED_CURVE('',{of},({from}),({to}),.{sense}.,.{by}.);\n#21=PARABOLA('',#7,1.);\n#22=HYPERBOLA('',#7,1.,1.);"
            ),
        )
    };
    let line = trimmed("#9", "PARAMETER_VALUE(0.5)", "PARAMETER_VALUE(2.)", "T", "PARAMETER");
    assert_eq!(line.ends(), [[1.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
    // Degrees, by the unit of the context: a quarter, and the other three.
    let quarter = trimmed("#10", "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(90.)", "T", "PARAMETER");
    assert!((quarter.length(1e-9) - FRAC_PI_2).abs() < 1e-12);
    let rest = trimmed("#10", "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(90.)", "F", "PARAMETER");
    assert!((rest.length(1e-9) - 1.5 * PI).abs() < 1e-12 && distance(rest.ends()[0], [1.0, 0.0, 0.0]) < 1e-12);
    let by_points = trimmed("#10", "#2", "#4", "T", "CARTESIAN");
    assert!((by_points.length(1e-9) - FRAC_PI_2).abs() < 1e-12);
    // y² = 4 x, from (0, 0) to (1, 2); x² − y² = 1 from parameter 0 to 1.
    let parabola = trimmed("#21", "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(1.)", "T", "PARAMETER");
    let [x, y, _] = parabola.point(0.3);
    assert!((y * y - 4.0 * x).abs() < 1e-14 && distance(parabola.ends()[1], [1.0, 2.0, 0.0]) < 1e-15);
    let [x, y, _] = trimmed("#22", "PARAMETER_VALUE(0.)", "PARAMETER_VALUE(1.)", "T", "PARAMETER").point(0.7);
    assert!((x * x - y * y - 1.0).abs() < 1e-14 && y > 0.0);
}

/// A composite of a line and a quarter circle against its direction: two curves.
#[test]
fn composites_are_taken_apart() {
    let data = "#20=COMPOSITE_CURVE('',(#21,#22),.F.);\n#21=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#23);\n#22=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.F.,#24);
#23=TRIMMED_CURVE('',#9,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);\n#24=TRIMMED_CURVE('',#10,(#2),(#4),.T.,.CARTESIAN.);";
    let network = set("#20", data);
    assert_eq!((network.curves.len(), texts(&network)), (2, vec![]));
    let round = set("#20", "#20=COMPOSITE_CURVE('',(#21),.F.);\n#21=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#20);");
    assert!(texts(&round).iter().any(|text| text.contains("one within itself")));
}

/// Beside a line without ends, a circle, and half an ellipse: to the left, as seen against the normal.
#[test]
fn offset_curves_are_read() {
    let circle = one("#20", "#20=OFFSET_CURVE_3D('',#10,0.25,.F.,#5);");
    assert!((circle.kind() == "circle") && (circle.length(1e-12) - 1.5 * PI).abs() < 1e-12);
    let line = "#20=TRIMMED_CURVE('',#21,(PARAMETER_VALUE(0.5)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);\n#21=OFFSET_CURVE_3D('',#9,3.,.F.,#5);";
    assert_eq!(one("#20", line).ends(), [[1.0, 3.0, 0.0], [2.0, 3.0, 0.0]]);
    let network = set(
        "#20",
        "#20=OFFSET_CURVE_3D('',#21,-1.,.F.,#5);\n#21=TRIMMED_CURVE('',#22,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(180.)),.T.,.PARAMETER.);\n#22=ELLIPSE('',#7,2.,1.);",
    );
    let shape = &network.curves[0].shape;
    // Its parameter is that of the ellipse in the file's unit, degrees.
    assert!(distance(shape.ends()[0], [3.0, 0.0, 0.0]) < 1e-9 && distance(shape.point(90.0), [0.0, 2.0, 0.0]) < 2e-5);
    assert!(texts(&network)[0].contains("a curve beside another one is fitted: #20: within"), "{:?}", texts(&network));
}

/// A line that counts to 1 (its vector is 2 long) and a quarter of a circle that counts 90 degrees: from the middle of the one to
/// the middle of the other. A segment that tells its length counts that.
#[test]
fn composites_are_trimmed_by_parameters() {
    let data = |segment: &str, to: &str| {
        format!(
            "#20=TRIMMED_CURVE('',#21,(PARAMETER_VALUE(0.5)),(PARAMETER_VALUE({to})),.T.,.PARAMETER.);\n#21=COMPOSITE_CURVE('',(#22,#23),.F.);
#22=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#24);\n{segment};\n#24=TRIMMED_CURVE('',#25,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(1.)),.T.,.PARAMETER.);
#25=LINE('',#26,#27);\n#26=CARTESIAN_POINT('',(1.,-2.,0.));\n#27=VECTOR('',#11,2.);\n#28=TRIMMED_CURVE('',#10,(#2),(#4),.T.,.CARTESIAN.);"
        )
    };
    let middle = [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0];
    for data in [
        data("#23=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#28)", "46."),
        data("#23=REPARAMETRISED_COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#28,4.)", "3."),
    ] {
        let [start, end] = one("#20", &data).ends();
        assert!(distance(start, [1.0, -1.0, 0.0]) < 1e-12 && distance(end, middle) < 1e-12, "{start:?} {end:?}");
    }
}

/// Curves of parameters alone (angles are degrees): on a plane a circle stays one; on a cylinder of radius 2 lines along a
/// parameter are exact, with or without ends, and a helix is fitted; on a B-spline surface that is a plane everything is exact.
#[test]
fn curves_of_parameters_alone_are_composed() {
    let data = |surface: &str, curve: &str| {
        format!(
            "#20=PCURVE('',#21,#22);\n#21={surface};\n#22=DEFINITIONAL_REPRESENTATION('',(#23),#24);\n#23={curve};
#24=(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('',''));
#30=CARTESIAN_POINT('',(0.,1.));\n#31=CARTESIAN_POINT('',(90.,1.));\n#32=CARTESIAN_POINT('',(90.,4.));\n#33=DIRECTION('',(1.,0.));\n#34=DIRECTION('',(0.,1.));
#35=VECTOR('',#33,1.);\n#36=VECTOR('',#34,1.);\n#37=LINE('',#30,#35);\n#38=AXIS2_PLACEMENT_2D('',#30,#34);\n#39=CARTESIAN_POINT('',(0.5,0.5));"
        )
    };
    let on_plane = one("#20", &data("PLANE('',#7)", "CIRCLE('',#38,0.5)"));
    assert_eq!(on_plane.kind(), "circle");
    assert!(distance(on_plane.ends()[0], [0.0, 1.5, 0.0]) < 1e-15);
    let cylinder = "CYLINDRICAL_SURFACE('',#7,2.)";
    let around = one("#20", &data(cylinder, "POLYLINE('',(#30,#31))"));
    assert!(around.kind() == "circle" && (around.length(1e-12) - PI).abs() < 1e-12);
    assert!((one("#20", &data(cylinder, "LINE('',#31,#35)")).length(1e-12) - 4.0 * PI).abs() < 1e-12);
    let upwards = data(cylinder, "LINE('',#31,#36)")
        + "\n#40=EDGE_CURVE('',#41,#42,#20,.T.);\n#41=VERTEX_POINT('',#43);\n#42=VERTEX_POINT('',#44);\n#43=CARTESIAN_POINT('',(0.,2.,1.));\n#44=CARTESIAN_POINT('',(0.,2.,3.));";
    assert_eq!(one("#40", &upwards), Shape::Line([[0.0, 2.0, 1.0], [0.0, 2.0, 3.0]]));
    let network = set("#20", &data(cylinder, "POLYLINE('',(#30,#32))"));
    assert!((network.curves[0].shape.length(1e-9) - PI.hypot(3.0)).abs() < 1e-5);
    assert!(texts(&network)[0].contains("in the space of parameters alone is fitted: #20: within"), "{:?}", texts(&network));
    let spline = "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#1,#4),(#2,#3)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,2.),.UNSPECIFIED.)";
    let ellipse = one(
        "#20",
        &data(spline, "TRIMMED_CURVE('',#25,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(90.)),.T.,.PARAMETER.)")
            .replace("#24=(", "#25=CIRCLE('',#26,0.25);\n#26=AXIS2_PLACEMENT_2D('',#39,$);\n#24=("),
    );
    assert_eq!((ellipse.kind(), ellipse.ends()[0]), ("ellipse", [0.75, 0.25, 0.0]));
}

/// A boundary of a cylinder (CURVE_BOUNDED_SURFACE) whose segments are curves of parameters; a line turned and a circle drawn are
/// the same one.
#[test]
fn surfaces_are_bounded_by_curves_of_parameters() {
    let of = |surface: &str, across: &str| {
        let pcurve = |id: u32, ends: &str| {
            format!(
                "#{id}=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#{});\n#{}=PCURVE('',#21,#{});\n#{}=DEFINITIONAL_REPRESENTATION('',(#{}),#24);\n#{}=POLYLINE('',({ends}));\n",
                id + 1,
                id + 1,
                id + 2,
                id + 2,
                id + 3,
                id + 3
            )
        };
        let ring = pcurve(40, "#30,#31") + &pcurve(50, "#31,#32") + &pcurve(60, "#32,#33") + &pcurve(70, "#33,#30");
        let points = if across.is_empty() { [(0, 1), (90, 1), (90, 4), (0, 4)] } else { [(0, 0), (90, 0), (90, 1), (0, 1)] };
        let points: String =
            points.iter().enumerate().map(|(at, (u, v))| format!("#{}=CARTESIAN_POINT('',({u}.,{v}.));\n", 30 + at)).collect();
        let network = set(
            "#20",
            &format!(
                "#20=CURVE_BOUNDED_SURFACE('',#21,(#22),.F.);\n#21={surface};\n#22=OUTER_BOUNDARY_CURVE('',(#40,#50,#60,#70),.F.);\n#24=(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('',''));\n{points}{ring}{across}"
            ),
        );
        assert_eq!((texts(&network), network.faces[0].outer.len()), (vec![], 4));
        network.curves.iter().map(|curve| (curve.shape.kind(), (1e6 * curve.shape.length(1e-12)).round())).collect::<Vec<_>>()
    };
    let (round, up) = (("circle", (1e6 * FRAC_PI_2).round()), ("line", 3e6));
    assert_eq!(of("CYLINDRICAL_SURFACE('',#7,1.)", ""), [round, up, round, up]);
    let drawn = "#80=VECTOR('',#5,3.);";
    assert_eq!(of("SURFACE_OF_LINEAR_EXTRUSION('',#10,#80)", drawn), [round, up, round, up]);
    let turned = "#80=AXIS1_PLACEMENT('',#1,#5);\n#81=CARTESIAN_POINT('',(1.,0.,3.));\n#82=POLYLINE('',(#2,#81));";
    assert_eq!(of("SURFACE_OF_REVOLUTION('',#82,#80)", turned), [round, up, round, up]);
}

/// A half disc: an edge that is a line and one that is half of a circle; the second one runs against its curve.
fn face() -> &'static str {
    "#1=CARTESIAN_POINT('',(-1.,0.,0.));\n#2=CARTESIAN_POINT('',(1.,0.,0.));\n#3=VERTEX_POINT('',#1);\n#4=VERTEX_POINT('',#2);
#5=CARTESIAN_POINT('',(0.,0.,0.));\n#6=DIRECTION('',(0.,0.,1.));\n#7=DIRECTION('',(1.,0.,0.));\n#8=AXIS2_PLACEMENT_3D('',#5,#6,#7);
#9=VECTOR('',#7,1.);\n#10=LINE('',#1,#9);\n#11=CIRCLE('',#8,1.);\n#12=EDGE_CURVE('',#3,#4,#10,.T.);\n#13=EDGE_CURVE('',#3,#4,#11,.F.);
#14=ORIENTED_EDGE('',*,*,#12,.T.);\n#15=ORIENTED_EDGE('',*,*,#13,.F.);\n#16=EDGE_LOOP('',(#14,#15));\n#17=FACE_OUTER_BOUND('',#16,.T.);
#18=PLANE('',#8);\n#19=ADVANCED_FACE('',(#17),#18,.T.);\n#20=OPEN_SHELL('',(#19));\n#21=SHELL_BASED_SURFACE_MODEL('',(#20));\n"
}

#[test]
fn edges_are_cut_at_their_vertices() {
    let text = file(&(face().to_owned() + "#22=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#21),#900);"));
    let network = read(text.as_bytes()).unwrap();
    assert_eq!(texts(&network), Vec::<String>::new());
    let [line, arc] = &network.curves[..] else { panic!() };
    assert_eq!((line.vertices, arc.vertices, line.role), (Some([0, 1]), Some([0, 1]), Role::Edge));
    assert!((arc.shape.length(1e-9) - PI).abs() < 1e-12 && distance(arc.shape.ends()[0], [-1.0, 0.0, 0.0]) < 1e-12);
    // Against the circle from left to right is over the top.
    let [low, high] = arc.shape.domain();
    assert!(distance(arc.shape.point(0.5 * (low + high)), [0.0, 1.0, 0.0]) < 1e-12);
    let uses: Vec<(usize, bool)> = network.faces[0].outer.iter().map(|one| (one.curve, one.is_reversed)).collect();
    assert_eq!(uses, [(0, false), (1, true)]);
    assert_eq!((network.unit.millimetres, network.resolution), (1.0, Some(1e-5)));
}

/// The half disc, in inches, twice in an assembly in millimetres: shifted, and turned by a quarter.
#[test]
fn assemblies_are_placed() {
    let data = face().to_owned()
        + "#22=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#21),#910);\n#23=SHAPE_REPRESENTATION('',(#8),#910);\n#24=SHAPE_REPRESENTATION_RELATIONSHIP('','',#23,#22);
#30=SHAPE_REPRESENTATION('',(#31,#32),#900);\n#31=AXIS2_PLACEMENT_3D('',#33,#6,#7);\n#32=AXIS2_PLACEMENT_3D('',#5,#6,#34);\n#33=CARTESIAN_POINT('',(100.,0.,0.));\n#34=DIRECTION('',(0.,1.,0.));
#40=ITEM_DEFINED_TRANSFORMATION('','',#8,#31);\n#41=(REPRESENTATION_RELATIONSHIP('','',#23,#30)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#40)SHAPE_REPRESENTATION_RELATIONSHIP());
#42=ITEM_DEFINED_TRANSFORMATION('','',#8,#32);\n#43=(REPRESENTATION_RELATIONSHIP('','',#23,#30)REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#42)SHAPE_REPRESENTATION_RELATIONSHIP());";
    let network = read(file(&data).as_bytes()).unwrap();
    assert_eq!(texts(&network), Vec::<String>::new());
    // The unit is that of the first representation in the file.
    assert_eq!((network.unit.name.as_str(), network.curves.len(), network.faces.len()), ("INCH", 4, 2));
    let ends: Vec<_> = network.curves.iter().map(|curve| curve.shape.ends()).collect();
    let shift = 100.0 / 25.4;
    assert!(distance(ends[0][0], [shift - 1.0, 0.0, 0.0]) < 1e-12 && distance(ends[2][0], [0.0, -1.0, 0.0]) < 1e-12, "{ends:?}");
    assert_eq!(network.curves[2].vertices, Some([2, 3]));
}

#[test]
fn mapped_items_are_placed() {
    let data = face().to_owned()
        + "#22=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#21),#900);\n#30=SHAPE_REPRESENTATION('',(#31),#900);\n#31=MAPPED_ITEM('',#32,#33);
#32=REPRESENTATION_MAP(#8,#22);\n#33=AXIS2_PLACEMENT_3D('',#34,#6,#7);\n#34=CARTESIAN_POINT('',(0.,0.,9.));";
    let network = read(file(&data).as_bytes()).unwrap();
    assert_eq!((network.curves.len(), network.curves[0].shape.ends()[0]), (2, [-1.0, 0.0, 9.0]));
}

/// Lost representations, a lost quote, a lost semicolon, comments, and the end that is cut off.
#[test]
fn damage_costs_nothing_of_what_is_whole() {
    let lost = read(file(face()).as_bytes()).unwrap();
    assert_eq!((lost.curves.len(), lost.faces.len()), (2, 1));
    assert!(texts(&lost).iter().any(|text| text.contains("nothing leads to it; read where it is: #19")));
    let whole = file(&(face().to_owned() + "#22=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#21),#900);"));
    let quote = whole.replace("#9=VECTOR('',", "#9=VECTOR(',");
    let network = read(quote.as_bytes()).unwrap();
    assert_eq!((network.curves.len(), network.curves[0].shape.kind()), (1, "circle"));
    assert!(texts(&network).iter().any(|text| text.starts_with("16: a string without an end: #9")), "{:?}", texts(&network));
    let semicolon = whole.replace("#10=LINE('',#1,#9);", "#10=LINE('',#1,#9)");
    assert_eq!(read(semicolon.as_bytes()).unwrap().curves.len(), 2);
    let comments = whole.replace("#9=", "/* it's #9=; */ #9 = /* */ ").replace("CIRCLE", "circle");
    let network = read(comments.as_bytes()).unwrap();
    assert_eq!((network.curves.len(), texts(&network)), (2, vec![]));
    let cut = &whole[..whole.find("#18=").unwrap()];
    let network = read(cut.as_bytes()).unwrap();
    assert_eq!(network.curves.len(), 2);
    assert!(texts(&network)[0].contains("it may be cut off"));
    assert_eq!(read(b"ISO-10303-21;\nDATA;\nENDSEC;\n"), Err(ReadError::NoData));
}

#[test]
fn what_is_damaged_is_named_with_its_line() {
    let why = |data: &str| texts(&set("#20", data)).join("; ");
    assert!(why("#20=CIRCLE('',#99,1.);").contains("21: damaged and not read: #20: #99 is not in the file"));
    assert!(why("#20=CIRCLE('',#7,0.);").contains("an arc without radius"));
    assert!(why("#20=POLYLINE('',(#1));").contains("less than two points"));
    assert!(
        why("#20=B_SPLINE_CURVE_WITH_KNOTS('',1,(#1,#2),.U.,.F.,.F.,(2,2000000000),(0.,1.),.U.);")
            .contains("2000000002 knots where 4 are needed")
    );
    assert!(why("#20=OFFSET_CURVE_3D('',#10,1.,.F.,#5);").contains("an offset circle without radius"));
    assert!(why(&format!("#20=POLYLINE('',{}#1{});", "(".repeat(40), ")".repeat(40))).contains("more than 32 within each other"));
    assert!(why("#20=TRIMMED_CURVE('',#20,(#1),(#2),.T.,.CARTESIAN.);").contains("one within itself"));
}

#[test]
fn strings_are_decoded() {
    assert_eq!(decoded(b"it''s \\X\\E4 \\X2\\00FC03A9\\X0\\ \\X4\\0001F600\\X0\\ \\S\\d \\PA\\ \\\\"), "it's ä üΩ 😀 ä  \\");
    assert_eq!(decoded("ä\u{3a9}".as_bytes()), "äΩ");
    assert_eq!(decoded(b"\\X2\\D83DDE00\\X0\\ \\X2\\12"), "😀 12");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_damage_is_too_much(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12), cut in any::<prop::sample::Index>()) {
        let mut text = file(&(face().to_owned() + "#22=MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#21),#900);")).into_bytes();
        for (at, byte) in changes {
            let at = at.index(text.len());
            text[at] = byte;
        }
        let _ = read(&text);
        text.truncate(cut.index(text.len()));
        let _ = read(&text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Offsets, composites that are trimmed, curves of parameters: whatever is damaged, it ends.
    #[test]
    fn no_damage_of_what_is_made_of_others_is_too_much(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12)) {
        let text = file(
            "#1=CARTESIAN_POINT('',(0.,0.,0.));\n#2=CARTESIAN_POINT('',(1.,0.,0.));\n#3=CARTESIAN_POINT('',(1.,1.,0.));\n#4=CARTESIAN_POINT('',(0.,1.,0.5));
#5=DIRECTION('',(0.,0.,1.));\n#6=DIRECTION('',(1.,0.,0.));\n#7=AXIS2_PLACEMENT_3D('',#1,#5,#6);\n#8=ELLIPSE('',#7,2.,1.);\n#9=OFFSET_CURVE_3D('',#8,0.5,.F.,#5);
#10=TRIMMED_CURVE('',#9,(PARAMETER_VALUE(0.)),(PARAMETER_VALUE(90.)),.T.,.PARAMETER.);\n#11=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#10);
#12=COMPOSITE_CURVE('',(#11,#11),.F.);\n#13=TRIMMED_CURVE('',#12,(PARAMETER_VALUE(3.)),(PARAMETER_VALUE(95.)),.T.,.PARAMETER.);
#14=B_SPLINE_SURFACE_WITH_KNOTS('',1,1,((#1,#4),(#2,#3)),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.);\n#15=PCURVE('',#14,#16);
#16=DEFINITIONAL_REPRESENTATION('',(#17),#18);\n#17=POLYLINE('',(#19,#20));\n#18=(REPRESENTATION_CONTEXT('',''));\n#19=CARTESIAN_POINT('',(0.,0.2));\n#20=CARTESIAN_POINT('',(0.9,1.));
#21=CYLINDRICAL_SURFACE('',#7,2.);\n#22=PCURVE('',#21,#16);\n#800=SHAPE_REPRESENTATION('',(#801),#900);\n#801=GEOMETRIC_CURVE_SET('',(#9,#13,#15,#22));",
        );
        let mut text = text.into_bytes();
        let whole = read(&text).unwrap();
        prop_assert_eq!(whole.curves.len(), 4, "{:?}", texts(&whole));
        for (at, byte) in changes {
            let at = at.index(text.len());
            text[at] = if text[at].is_ascii_digit() { b'0' + byte % 10 } else { byte };
        }
        let _ = read(&text);
    }
}
