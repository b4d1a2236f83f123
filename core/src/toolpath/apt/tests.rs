use super::super::{Kind, Options, Program, ReadError, Shape, read};

fn program(text: &str) -> Program {
    read(text.as_bytes(), &Options::default()).expect(text)
}

/// Points, increments, an arc, an axis and a tool of a small file, as Creo and NCL write them.
#[test]
fn points_arcs_and_tools() {
    let program = program(
        "$$* Pro/CLfile\n$$-> CUTTER / 10.000000\nPARTNO / A\nUNITS / MM\nLOADTL / 3\nFEDRAT / 100., MMPM\nRAPID\n\
        GOTO / 0, 0, 5\n\
         GOTO / 10, 0, 0\nCIRCLE / 0, 0, 0, $\n 0, 0, 1, 10\nGOTO / 0, 10, 0\nGODLTA / 0, 0, 2\n\
         GODLTA/5\nTLAXIS/0,1,0\nGODLTA/3\nFINI\nGOTO/9,9,9\n",
    );
    let moves: Vec<_> = program.moves.iter().collect();
    assert_eq!(moves.iter().map(|one| one.line).collect::<Vec<_>>(), [8, 9, 12, 13, 14, 16]);
    assert_eq!(moves[0].kind, Kind::Reference);
    assert!(matches!(moves[2].kind, Kind::Arc { sweep, .. } if (sweep - std::f64::consts::FRAC_PI_2).abs() < 1e-12));
    assert_eq!((moves[5].to, moves[5].axis, moves[5].tool), ([0.0, 13.0, 7.0], [0.0, 1.0, 0.0], 3));
    assert_eq!(program.header.tools.len(), 1);
    assert_eq!((program.header.tools[0].shape, program.header.tools[0].diameter), (Shape::Flat, 10.0));
}

/// A cycle drills along the tool's axis; inches are converted.
#[test]
fn cycles_drill() {
    let program = program(
        "UNITS/INCHES\nFROM/0,0,1\nCYCLE/DRILL,FEDTO,0.5,RAPTO,0.1,IPM,3\nGOTO/1,0,0\nGOTO/2,0,0\nCYCLE/OFF\nRAPID\nGOTO/0,0,1\n",
    );
    let header = &program.header;
    assert_eq!((header.rapids, header.feeds, header.references), (5, 2, 0));
    assert_eq!(header.cut.map(|cut| (cut[0][2], cut[1][2])), Some((-12.7, 2.54)));
}

/// Statements that move the tool otherwise are refused by name; unknown ones are counted.
#[test]
fn the_rest_is_named() {
    for text in
        ["GOTO/1,2,3\nTRACUT/M1\n", "GOTO/1,2,3\nL1=LINE/1,2,3\n", "FROM/1,2\n", "GOTO/0,0,0\nCIRCLE/0,0,0,0,0,1,5\nGOTO/9,9,9\n"]
    {
        assert!(matches!(read(text.as_bytes(), &Options::default()), Err(ReadError::Refused { .. })), "{text}");
    }
    let program = program("GOTO/1,2,3\nWHAT/3\nWHAT/4\n");
    assert!(program.header.findings.iter().any(|finding| finding.text == "not read: 2 × WHAT"));
}

/// The way of CATIA: a circle up to a line from its centre, and where to go at first.
#[test]
fn catia_has_its_own_arcs() {
    let text = "UNITS/MM\nFROM/10,0,0\nINDIRV/0,-1,0\nTLON,GOFWD/(CIRCLE/0,0,0,$\n10),ON,(LINE/0,0,0,$\n0,10,0)\n";
    let moves: Vec<_> = program(text).moves.iter().collect();
    assert!(matches!(moves[0].kind, Kind::Arc { sweep, .. } if (sweep - 1.5 * std::f64::consts::PI).abs() < 1e-9), "{moves:?}");
}

/// Paths of NX: a mill's data, paint, a cycle with a way back that is a word; a second system of coordinates is refused.
#[test]
fn nx_has_its_own_words() {
    let text = "TOOL PATH/CAVITY_MILL,TOOL,MILL\nTLDATA/MILL,10.0,2.0,50.0,0.0,0.0\nMSYS/0,0,0,1,0,0,0,1,0\n\
        $$ centerline data\nPAINT/PATH\n\
        LOAD/TOOL,62,ADJUST,62\nRAPID\nGOTO/0,0,50\nFEDRAT/MMPM,500\nGOTO/0,0,0\n\
        CYCLE/DRILL,RAPTO,1,FEDTO,-10,RTRCTO,AUTO,MMPM,250\nGOTO/5,0,0\n";
    let program = program(text);
    assert_eq!(program.header.unread, 0, "{:?}", program.header.findings);
    assert_eq!((program.header.tools[0].number, program.header.tools[0].shape), (62, Shape::BullNose { corner: 2.0 }));
    assert_eq!(program.header.cut.map(|cut| cut[0][2]), Some(-10.0));
    let second = format!("{text}MSYS/0,0,9,1,0,0,0,1,0\n");
    assert!(matches!(read(second.as_bytes(), &Options::default()), Err(ReadError::Refused { line: 13, .. })));
}
