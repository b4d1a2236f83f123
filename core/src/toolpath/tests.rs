//! Damaged files: no panic, bounded time, and the same result twice.

use super::{Options, Program, ReadError, project, read, tools};
use proptest::prelude::*;
use std::time::{Duration, Instant};

const GCODE: &str = "%\nO0001 (T1 D=2. CR=1. - ball end mill)\nN10 G21 G90 G17 G54 T1 M6\nG0 X1 Y-2.5 Z5\n\
        G41 D1 G1 X5 Y5 F100\nG3 X0 Y10 I-5 J0\n\
    X-3 Y9 R4\nG40 G0 Z5\nG98 G83 X1 Y1 Z-3 R2 Q1 L2\nG80\n#1=[2**3+SIN[#2]]\n#<a>=1\nO1 while [#<a> lt 4]\n\
        G91 G1 X[#<a>*2]\n#<a>=[#<a>+1]\n\
    O1 endwhile\nG90 G5 X1 Y1 I1 J1 P1 Q1\nG5.2 P1 L3 X0 Y1\nX2 Y2\nX3 Y0\nG5.3\nG6.2 P3 X1 Y1 R1 K0\nX2 Y1 R1 K0\n\
        X3 Y3 R1 K0\nK1\nK1\nK1\nG51 X0 Y0 P2\n\
    G68 X0 Y0 R45\nG16 G1 X5 Y90\nG15 G69 G50 G10 L2 P2 X5\nG55 G92 X1\nG28 Z0\nG53 G0 Z0\nM98 P20 L2\nM30\n\
    O0020\nG91 G1 X1\nM99\n%\n";

const APT: &str = "PARTNO A\nUNITS/MM\n$$-> CUTTER / 10.0\nLOADTL/1\nCUTTER/0.75,0.125,0.25,0.125,0,0,2.25\n\
        FROM/0,0,5\nRAPID\nGOTO/1,2,3,0,0.6,0.8\n\
    GODLTA/4,-2, $\n-1\nCIRCLE/0,0,0,0,0,1,5\nGOTO/3,4,0\nINDIRV/0,1,0\n\
        TLON,GOFWD/(CIRCLE/0,0,0,5),ON,(LINE/0,0,0,0,5,0)\nMULTAX/ON\n\
    CYCLE/DRILL,DEPTH,5,CLEAR,1\nGOTO/1,1,1\nCYCLE/OFF\nTLDATA/MILL,10,1,75,0,0\nGOHOME\nFINI\n";

const PROJECT: &str = r#"{"units":"metric","tools":{"1":{"shape":"conical","length":15.0,"diameter":12.5}},"workpiece":{"bounds":
    {"min":[-2.5,-2.5,-6],"max":[97.5,97.5,0]}},"files":["wave.tpl"]}"#;

fn attempt(bytes: &[u8]) -> Result<Program, ReadError> {
    let options = Options { moves_max: 20_000, steps_max: 20_000, ..Options::default() };
    let start = Instant::now();
    let result = read(bytes, &options);
    assert!(start.elapsed() < Duration::from_secs(5), "{}", String::from_utf8_lossy(bytes));
    result
}

/// The examples are whole, so that what follows tests more than refusals.
#[test]
fn examples_are_read() {
    for text in [GCODE, APT] {
        let program = attempt(text.as_bytes()).expect(text);
        assert!(program.moves.len() > 7 && program.header.unread == 0, "{:?}", program.header);
    }
    assert!(project::read(PROJECT.as_bytes()).is_ok());
}

#[test]
fn every_prefix_is_read_or_refused() {
    for text in [GCODE, APT] {
        for end in 0..text.len() {
            let _ = attempt(&text.as_bytes()[..end]);
        }
    }
    for end in 0..PROJECT.len() {
        assert!(project::read(&PROJECT.as_bytes()[..end]).is_err());
    }
}

/// Without each of its lines, and with each of its lines twice.
#[test]
fn lines_are_lost_and_doubled() {
    for text in [GCODE, APT] {
        let lines: Vec<&str> = text.lines().collect();
        for index in 0..lines.len() {
            let mut fewer = lines.clone();
            fewer.remove(index);
            let _ = attempt(fewer.join("\n").as_bytes());
            let mut more = lines.clone();
            more.insert(index, lines[index]);
            let _ = attempt(more.join("\r").as_bytes());
        }
    }
}

/// Long numbers, deep brackets, long lines, huge values.
#[test]
fn extremes_are_bounded() {
    let many = |text: &str, count: usize| text.repeat(count);
    for text in [
        format!("G1 X{}", many("9", 100_000)),
        format!("G1 X{}1{}", many("[", 100_000), many("]", 100_000)),
        format!("G1 X{}1", many("-", 100_000)),
        format!("G1 X{}1", many("#", 100_000)),
        format!("G1 X[1{}]", many("+1", 100_000)),
        format!("G1 X[{}]", many("sin[", 100_000)),
        format!("G21 {}", many("G1 ", 100_000)),
        format!("G21\n{}", many("(", 100_000)),
        format!("G21\nO<{}> call", many("a", 100_000)),
        format!("G21 G0 X1 Y1 Z1\n{}", many("G91 G1 X99999999999999999999999999999999 F1\n", 1000)),
        format!("GOTO/{}", many("1,", 100_000)),
        format!("GOTO/1,2,3\n{}", many("GODLTA/ $\n", 100_000)),
        format!("G21 G0 X0 Y0 Z0\nG5.2 L3 P1 X1\n{}G5.3", many("X5 Y5\n", 10_000)),
    ] {
        let _ = attempt(text.as_bytes());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    /// Bytes changed anywhere.
    #[test]
    fn changed_bytes_are_read_or_refused(
        is_apt: bool,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        let mut bytes = if is_apt { APT } else { GCODE }.as_bytes().to_vec();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let first = attempt(&bytes);
        prop_assert_eq!(first, attempt(&bytes));
    }

    /// Letters and signs of the language in any order.
    #[test]
    fn any_words_are_read_or_refused(text in "(?i)([GMXYZIJKRPQLFTDHNO#=<>\\[\\]+*/@^%();0-9. \n\
        -]|G[0-9]{1,2}|O1 |sub|call|while|if|\\[[0-9]\\]){0,200}") {
        let _ = attempt(text.as_bytes());
        let _ = attempt(format!("G21 G0 X1 Y1 Z1\n{text}").as_bytes());
    }

    /// Tools in any words.
    #[test]
    fn any_tool_is_read_or_refused(text in "[0-9a-z=,. -]{0,40}") {
        let _ = tools::parse(&text);
        let _ = tools::parse(&format!("3=bull,d=6,{text}"));
    }
}
