//! Small files to begin with, by target: the forms that the tests of the whole program write, and odd ones that few programs write.

use crate::BETWEEN;
use crate::forms::{self, Form};
use crate::stl::{self, Triangle};
use crate::zip;

/// The seeds of all targets.
pub fn all() -> Vec<(&'static str, Vec<Vec<u8>>)> {
    let boxes = stl::cuboid([0.0, 0.5, -1.25], [10.0, 20.5, 30.75]);
    let write = |form| forms::write(form, &boxes);
    let text = stl::text("box", &boxes);
    let with = |first: Vec<Vec<u8>>, more: &[&str]| [first, more.iter().map(|seed| seed.as_bytes().to_vec()).collect()].concat();
    let binary_off = off_binary(&boxes);
    vec![
        ("stl", vec![stl::mesh(&boxes), stl::mesh(&boxes[..1]), text.clone().into(), write(Form::PlyBig), write(Form::Obj)]),
        ("stl_text", with(vec![text.clone().into(), text.replace('.', ",").into(), text.replace('\n', "\r").into()], &TEXT)),
        ("ply", with(vec![write(Form::PlyText), write(Form::PlyBinary), write(Form::PlyBig), ply_strips()], &PLY)),
        ("off", with(vec![write(Form::Off), binary_off], &OFF)),
        ("obj", with(vec![write(Form::Obj)], &OBJ)),
        ("amf", with(vec![write(Form::Amf)], &AMF)),
        ("amf_packed", with(vec![write(Form::Amf)], &AMF)),
        (
            "threemf",
            vec![
                write(Form::ThreeMf),
                write(Form::PackedAmf),
                project(&boxes),
                zip::write(&[("a/", b""), ("a/b.amf", b"<amf/>")], 0),
            ],
        ),
        ("threemf_model", models(&boxes)),
        ("threemf_parts", vec![parts(&boxes)]),
        ("iges", vec![iges(&IGES), iges(&[])]),
        ("step", STEP.map(|data| step(data).into_bytes()).to_vec()),
        ("fill", with(Vec::new(), &FILL)),
        ("gcode", with(Vec::new(), &GCODE)),
        ("apt", with(Vec::new(), &APT)),
        ("path_tools", with(Vec::new(), &TOOLS)),
    ]
}

/// Loops: in a plane, of four sides in space, of a circle and its chord.
const FILL: [&str; 3] = [
    r#"{"unit":"mm","curves":[{"line":[[0,0,0],[4,0,0]]},{"line":[[4,0,0],[0,3,0]]},{"line":[[0,3,0],[0,0,0]]}]}"#,
    r#"{"unit":"mm","curves":[{"degree":2,"knots":[0,0,0,1,1,1],"points":[[0,0,0],[2,0,1],[4,0,0]]},{"line":[[4,0,0],[4,4,1]]},{"degree":3,"knots":[0,0,0,0,1,1,1,1],"points":[[4,4,1],[3,4,2],[1,5,0],[0,4,0]]},{"line":[[0,4,0],[0,0,0]]}]}"#,
    r#"{"unit":"inch","curves":[{"degree":2,"knots":[0,0,0,1,1,1],"weights":[1,0.7071067811865476,1],"points":[[1,0,0],[1,1,0],[0,1,0]]},{"line":[[0,1,0],[1,0,0]]}]}"#,
];

const GCODE: [&str; 4] = [
    "%\nO1\nG21 G90 G17\nT1 M6 (flat 6 mm)\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG2 X10 Y0 I5 J0\nG3 X0 Y0 R5\nG41 D1 X5\nG40\nG81 X1 Y1 Z-2 R1\nG80\nM98 P2\nM30\nO2\nG91 X1\nM99\n%\n",
    "#1=0\no100 while [#1 lt 5]\nG1 X[#1*2] Y[sin[#1]] F50\n#1=[#1+1]\no100 endwhile\no<a> sub\nG1 Z[#1]\no<a> endsub\no<a> call [3]\nM2\n",
    "G20 G18\nG5 I0 J3 P0 Q-3 X1 Y1\nG5.2 X0 Y1 L3\nX2 Y2\nG5.3\nG68 X0 Y0 R45\nG51 X0 Y0 P2\n",
    "; T3 D=6 CR=3 - ball end mill\nN10 G0 X1. Y2.\nN20 G73 Z-3 R2 Q1\n$H\n",
];

const APT: [&str; 2] = [
    "PARTNO TEST\nUNITS/MM\nCUTTER/6,3,0,3,0,0,20\nLOADTL/1\nFROM/0,0,10\nRAPID\nGOTO/0,0,1\nFEDRAT/100\nGODLTA/1,2,-3\nCIRCLE/5,0,0,0,0,1,5\nGOTO/10,0,0\nTLAXIS/0,0,1\nMULTAX/ON\nGOTO/1,2,3,0,0,1\nFINI\n",
    "$$-> CUTTER / 0.5\nUNITS / INCHES\nGOTO / 1.0, 2.0, $\n 3.0\nCYCLE/DRILL,5,MMPM,100,2\nGOTO/1,1,0\nCYCLE/OFF\nFINI\n",
];

const TOOLS: [&str; 4] = [
    r#"{"units":"metric","nc-files":["a.nc"],"tools":{"1":{"shape":"ballnose","diameter":6,"length":20}},"workpiece":{"bounds":{"min":[0,0,0],"max":[1,1,1]}}}"#,
    "T1 P1 D6.0 Z20 ;flat\nT2 P2 D3 Z10 ;ball\n",
    "3=ball,d=6",
    "2=taper,d=1,angle=15,l=20",
];

/// Entities of an IGES: type, form, matrix, parameters.
type Entity<'a> = (u32, u32, u32, &'a str);

const IGES: [Entity<'_>; 8] = [
    (110, 0, 0, "0.,0.,0.,10.,0.,0."),
    (100, 0, 5, "0.,10.,5.,10.,0.,0.,5."),
    (124, 0, 0, "1.,0.,0.,0.,0.,1.,0.,0.,0.,0.,1.,0."),
    (126, 0, 0, "2,2,1,0,1,0,0.,0.,0.,1.,1.,1.,1.,.5,1.,0.,10.,0.,-5.,5.,0.,0.,0.,0.,0.,1.,0.,0.,1."),
    (102, 0, 0, "3,1,3,7"),
    (106, 12, 0, "2,3,0.,0.,0.,1.,0.,0.,1.,1.,0."),
    (104, 1, 0, "1.,0.,4.,0.,0.,-4.,0.,2.,0.,0.,1."),
    (112, 0, 0, "3,1,3,1,0.,1.,0.,1.,0.,0.,0.,1.,0.,0.,0.,0.,0.,0.,0.,1.,0.,0.,0.,1.,0.,0.,0.,0.,0.,0.,0."),
];

/// Fixed cards of these entities.
fn iges(entities: &[Entity<'_>]) -> Vec<u8> {
    let card = |data: &str, section: char, number: usize| format!("{data:<72}{section}{number:>7}\n");
    let mut text = card("by hand", 'S', 1);
    text += &card(",,4HPART,5Hp.igs,1Ha,1Hb,32,38,6,308,15,,1.0,2,2HMM,1,0.01;", 'G', 1);
    let (mut directory, mut parameters) = (String::new(), String::new());
    let mut line = 1;
    for (at, (kind, form, matrix, values)) in entities.iter().enumerate() {
        let (number, record) = (2 * at + 1, format!("{kind},{values};"));
        let lines: Vec<&[u8]> = record.as_bytes().chunks(64).collect();
        let first = format!("{kind:>8}{line:>8}{:>8}{:>8}{:>8}{:>8}{matrix:>8}{:>8}00000000", 0, 0, 0, 0, 0);
        directory += &card(&first, 'D', number);
        directory += &card(&format!("{kind:>8}{:>8}{:>8}{:>8}{form:>8}", 0, 0, lines.len()), 'D', number + 1);
        for part in lines {
            parameters += &card(&format!("{:<64}{number:>8}", String::from_utf8_lossy(part)), 'P', line);
            line += 1;
        }
    }
    (text + &directory + &parameters + &card("S      1G      1", 'T', 1)).into_bytes()
}

const STEP: [&str; 3] = [
    "#9=VECTOR('',#6,2.);#10=LINE('',#1,#9);#11=CIRCLE('',#7,1.);#12=TRIMMED_CURVE('',#11,(#2),(PARAMETER_VALUE(90.)),.T.,.CARTESIAN.);#13=(BOUNDED_CURVE()\
     B_SPLINE_CURVE(2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.)B_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),.UNSPECIFIED.)CURVE()GEOMETRIC_REPRESENTATION_ITEM()\
     RATIONAL_B_SPLINE_CURVE((1.,.5,1.))REPRESENTATION_ITEM(''));#14=COMPOSITE_CURVE('',(#15,#16),.F.);#15=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.T.,#12);\
     #16=COMPOSITE_CURVE_SEGMENT(.CONTINUOUS.,.F.,#13);#8=GEOMETRIC_CURVE_SET('a\\X2\\00E9\\X0\\''',(#10,#12,#13,#14));",
    "#9=VERTEX_POINT('',#1);#10=VERTEX_POINT('',#2);#11=VECTOR('',#6,1.);#12=LINE('',#1,#11);#13=EDGE_CURVE('',#9,#10,#12,.T.);#14=CIRCLE('',#7,1.);\
     #15=EDGE_CURVE('',#10,#9,#14,.F.);#16=ORIENTED_EDGE('',*,*,#13,.T.);#17=ORIENTED_EDGE('',*,*,#15,.T.);#18=EDGE_LOOP('',(#16,#17));\
     #19=FACE_OUTER_BOUND('',#18,.T.);#20=PLANE('',#7);#21=ADVANCED_FACE('',(#19),#20,.T.);#22=OPEN_SHELL('',(#21));#8=SHELL_BASED_SURFACE_MODEL('',(#22));",
    "#8=MAPPED_ITEM('',#9,#7);#9=REPRESENTATION_MAP(#7,#10);#10=SHAPE_REPRESENTATION('',(#8,#11),#90);#11=POLYLINE('',(#1,#2,#3,#1)); /* itself */",
];

/// A file of these instances besides some points, axes and units; `#8` is what is shown.
fn step(data: &str) -> String {
    format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nENDSEC;\nDATA;\n#1=CARTESIAN_POINT('',(0.,0.,0.));#2=CARTESIAN_POINT('',(1.,0.,0.));\
         #3=CARTESIAN_POINT('',(0.,1.E0,0.));#5=DIRECTION('',(0.,0.,1.));#6=DIRECTION('',(1.,0.,0.));#7=AXIS2_PLACEMENT_3D('',#1,#5,#6);\n{data}\n\
         #90=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#91))REPRESENTATION_CONTEXT('',''));\
         #91=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));#99=SHAPE_REPRESENTATION('',(#8),#90);\nENDSEC;\nEND-ISO-10303-21;\n"
    )
}

const TEXT: [&str; 2] = [
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1e0 0 0\nvertex 1 1 nan\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\nsolid b\n",
    "\u{feff}  SOLID \u{f6}\r\nFACET NORMAL 0 0 1 OUTER LOOP VERTEX 0 0 0 VERTEX 1 0 0 VERTEX 1,5 1 0 ENDLOOP ENDFACET",
];

const PLY: [&str; 3] = [
    "ply\r\nformat ascii 1.0\r\ncomment \u{e9}\r\nelement vertex 4\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\nelement face 1\r\n\
     property list uchar short vertex_index\r\nproperty list uchar float texcoord\r\nend_header\r\n0 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 nan\r\n4 0 1 2 3 2 .5 .5\r\n",
    "ply\nformat ascii 1.0\nobj_info x\nelement extra 1\nproperty list uint int a\nelement vertex 3\nproperty float32 z\nproperty float y\nproperty float x\n\
     element face 4294967295\nproperty uchar flags\nproperty list uint8 int32 vertex_indices\nend_header\n2 7 7\n0 0 0\n1 0 0\n1 1 0\n1 3 0 1 2\n",
    "ply\rformat ascii 1.0\relement vertex 5\rproperty int x\rproperty int y\rproperty int z\relement tristrips 1\rproperty list int int vertex_indices\r\
     end_header\r0 0 0\r1 0 0\r1 1 0\r0 1 0\r2 2 2\r7 0 1 2 3 -1 4 0\r",
];

const OFF: [&str; 4] = [
    "OFF # a comment\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3 0.5 0.5 0.5 1\n",
    "STCNOFF 3 1 0 0 0 0 0 0 1 1 1 1 1 0 0 1 0 0 0 0 1 1 1 1 1 0 0 0 1 0 0 0 1 1 1 1 1 0 0 3 0 1 2",
    "OFF4 3 0\r0 0 0\r1 0 0\r1 1 0\r0 1 0\r4 0 1 2 3\r3 0 1 9\r2 0 1\r",
    "4 2 5\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n",
];

const OBJ: [&str; 3] = [
    "o a\r\nv 0 0 0\r\nv 1 0 0 1.0\r\nv 1 1 0 .5 .5 .5\r\nvt 0 0\r\nvn 0 0 1\r\ng b\r\nusemtl c\r\ns off\r\nf 1/1/1 2/1/1 3//1\r\nf -3 -2 -1\r\nl 1 2\r\np 1\r\n",
    "v 0,5 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 0\nf 1 2 \\\n3 4\nf 1 5 2 3 4\ncurv 0 1 1 2\nf 1 2\nf 1 2 99\n",
    "# \u{e9}\rmtllib x.mtl\rv 1e400 nan 0\rv 1 0 0\rv 1 1 0\rf 1 2 3\rf 1/2 2/3 3/",
];

const AMF: [&str; 3] = [
    "<amf unit=\"inch\"><constellation id=\"9\"><instance objectid=\"1\"><deltax>5</deltax><rz>90</rz></instance><instance objectid=\"1\"/></constellation>\
     <object id=\"1\"><mesh><vertices><vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates><color><r>1</r></color></vertex><vertex><coordinates><x>1</x>\
     <y>0</y><z>0</z></coordinates></vertex><vertex><coordinates><x>1</x><y>1</y><z>0</z></coordinates></vertex></vertices><volume materialid=\"2\">\
     <metadata type=\"name\">a &amp; b</metadata><triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle></volume><volume><triangle><v1>2</v1><v2>1</v2>\
     <v3>0</v3></triangle></volume></mesh></object></amf>",
    "<?xml version=\"1.0\" encoding=\"utf-8\"?>\r\n<!-- a --><amf xmlns:x=\"y\"><object id='1'><mesh><vertices><vertex><coordinates><x> 0 </x><y><![CDATA[0]]></y>\
     <z>0</z></coordinates><normal><nx>0</nx></normal></vertex><edge/></vertices><volume><triangle><v1>0</v1><v2>0</v2><v3>9</v3></triangle></volume></mesh>\
     </object></amf>",
    "<!DOCTYPE amf [<!ENTITY a \"b\">]><amf><material id=\"1\"/><texture/><metadata type=\"&a;\">&#x41;</metadata><constellation id=\"1\"><instance objectid=\"1\"/>\
     </constellation></amf>",
];

/// Vertices, and two strips of them.
fn ply_strips() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n\
        property list int int vertex_indices\nend_header\n"
        .to_vec();
    bytes.extend([0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).as_flattened());
    bytes.extend([6i32, 0, 1, 2, -1, 3, 1].map(i32::to_le_bytes).as_flattened());
    bytes
}

fn off_binary(triangles: &[Triangle]) -> Vec<u8> {
    let (positions, faces) = forms::indexed(triangles);
    let mut bytes = b"OFF BINARY\n".to_vec();
    bytes.extend([positions.len() as u32, faces.len() as u32, 0].map(u32::to_be_bytes).as_flattened());
    bytes.extend(positions.as_flattened().iter().flat_map(|x| x.to_be_bytes()));
    for [a, b, c] in faces {
        bytes.extend([3, a as u32, b as u32, c as u32, 0].map(u32::to_be_bytes).as_flattened());
    }
    bytes
}

/// Models of one object, and of objects in objects.
fn models(triangles: &[Triangle]) -> Vec<Vec<u8>> {
    let indexed = forms::indexed(triangles);
    let painted = forms::mesh_of_model(&indexed, |k| {
        if k % 3 == 0 { " slic3rpe:mmu_segmentation=\"4C\" pid=\"1\" p1=\"0\"".into() } else { String::new() }
    });
    let simple = forms::model(&format!("<object id=\"1\" type=\"model\">{painted}</object>"), "<item objectid=\"1\"/>");
    let nested = forms::model(
        &format!(
            "<basematerials id=\"7\"><base name=\"a\" displaycolor=\"#FF0000\"/></basematerials><object id=\"1\" name=\"a &lt; b\">{painted}</object>\
             <object id=\"2\" type=\"support\"><components><component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 5 5 5\"/><component objectid=\"1\"/>\
             </components></object><object id=\"3\"><components><component objectid=\"2\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/></components></object>"
        ),
        "<item objectid=\"3\" printable=\"0\" transform=\"0 1 0 -1 0 0 0 0 1 0 0 0\"/><item objectid=\"1\"/>",
    );
    // Nothing is plain: other quotes, prefixes, comments, character data between elements, entities in numbers.
    let careful = "<?xml version='1.0'?><m:model unit='inch' xmlns:m='http://schemas.microsoft.com/3dmanufacturing/core/2015/02' requiredextensions=''>\
        <m:resources><m:object id='1'><m:mesh><m:vertices><!-- a --><m:vertex x='0' y='0' z='0'></m:vertex> <m:vertex z='1' x='&#49;' y='0'/><m:vertex x='1' y='1' \
        z='0'/></m:vertices><m:triangles><m:triangle v1='0' v2='1' v3='2'><?pi?></m:triangle></m:triangles></m:mesh></m:object></m:resources><m:build><m:item \
        objectid='1'/></m:build></m:model>";
    vec![simple.into(), nested.into(), careful.into()]
}

/// A slicer's project: objects in a part of their own, and volumes of one.
fn project(triangles: &[Triangle]) -> Vec<u8> {
    crate::package_of_parts(&parts(triangles))
}

fn parts(triangles: &[Triangle]) -> Vec<u8> {
    let mesh = forms::mesh_of_model(&forms::indexed(triangles), |_| String::new());
    let other = forms::model(&format!("<object id=\"5\">{mesh}</object>"), "");
    let objects = format!(
        "<object id=\"1\">{mesh}</object><object id=\"2\"><components><component p:path=\"/3D/Objects/a.model\" objectid=\"5\"/></components></object>"
    );
    let model = forms::model(&objects, "<item objectid=\"1\"/><item objectid=\"2\"/>").replacen(
        "<model ",
        "<model xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" requiredextensions=\"p\" ",
        1,
    );
    let relationships = "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship Target=\"/3D/Objects/a.model\" \
        Id=\"r\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>";
    let config = "<?xml version=\"1.0\" encoding=\"UTF-8\"?><config><object id=\"1\"><volume firstid=\"0\" lastid=\"5\"><metadata type=\"volume\" \
        key=\"volume_type\" value=\"ModelPart\"/></volume><volume firstid=\"6\" lastid=\"11\"><metadata key=\"modifier\" value=\"1\"/></volume></object></config>";
    let roles = "<config><object id=\"2\"><part id=\"5\" subtype=\"negative_part\"><mesh_stat/></part><part id=\"5\" subtype=\"normal_part\"/></object></config>";
    let sound = forms::parts(&model, &[]);
    let [types, rels] = [0, 1].map(|k| sound[k].1);
    [types, rels, model.as_bytes(), relationships.as_bytes(), other.as_bytes(), config.as_bytes(), roles.as_bytes()]
        .join(&BETWEEN)
}
