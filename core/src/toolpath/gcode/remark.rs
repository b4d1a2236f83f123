//! Remarks of comments about tools: those of Fusion and HSM (`T1 D=6. CR=3. - ball end mill`), of FreeCAD (`TC: 6mm Endmill`), of
//! Haas posts (`TOOL 1 .875 FINISH ENDMILL`) and others, word by word.

/// The form that words name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Flat,
    Ball,
    Bull,
    Taper,
    Drill,
}

/// A description of a tool.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Remark {
    pub(super) number: Option<u32>,
    /// And millimetres in its unit, if that is said.
    pub(super) diameter: Option<(f64, Option<f64>)>,
    pub(super) corner: Option<f64>,
    pub(super) length: Option<f64>,
    /// In degrees.
    pub(super) angle: Option<f64>,
    pub(super) shape: Option<Form>,
}

/// Longer comments are prose.
const LONGEST: usize = 200;

/// A number and millimetres in its unit, where one is attached: `6mm`, `.25in`, `1/4"`, `30deg`.
fn quantity(word: &str) -> Option<(f64, Option<f64>)> {
    let (text, unit) = if let Some(text) = word.strip_suffix("mm") {
        (text, Some(1.0))
    } else if let Some(text) = ["inch", "in", "\""].into_iter().find_map(|unit| word.strip_suffix(unit)) {
        (text, Some(25.4))
    } else {
        (word.strip_suffix("deg").unwrap_or(word), None)
    };
    if !text.bytes().next()?.is_ascii_digit() && !text.starts_with(['.', '-']) {
        return None;
    }
    let value = match text.split_once('/') {
        Some((top, bottom)) => top.parse::<f64>().ok()? / bottom.parse::<f64>().ok().filter(|bottom| *bottom != 0.0)?,
        None => text.parse::<f64>().ok()?,
    };
    (value.is_finite() && value.abs() < 1e6).then_some((value, unit))
}

fn form(text: &str) -> Option<Form> {
    let has = |words: &[&str]| words.iter().any(|word| text.contains(word));
    if has(&["ball"]) {
        Some(Form::Ball)
    } else if has(&["bull"]) {
        Some(Form::Bull)
    } else if has(&["chamfer", "v-bit", "vbit", "v bit", "engrav", "conical", "taper"]) {
        Some(Form::Taper)
    } else if has(&["drill"]) {
        Some(Form::Drill)
    } else if has(&["mill", "flat", "cylind", "router"]) {
        Some(Form::Flat)
    } else {
        None
    }
}

/// Whether a comment may be about a tool; most are not, and this is fast.
fn is_candidate(comment: &[u8]) -> bool {
    let has = |word: &[u8]| comment.windows(word.len()).any(|part| part.eq_ignore_ascii_case(word));
    matches!(comment, [b't' | b'T', b'0'..=b'9', ..]) || has(b"tool") || has(b"cutter") || has(b"tc")
}

/// Reads a comment; `None` if it is about no tool. O(length), up to 200 bytes.
pub(super) fn read(comment: &[u8]) -> Option<Remark> {
    if comment.len() > LONGEST || !is_candidate(comment) {
        return None;
    }
    let text: String = comment.iter().map(|byte| char::from(byte.to_ascii_lowercase())).collect();
    let text = text.replace([':', '=', ',', ';', '(', ')', '*', '[', ']', '{', '}', '#'], " ");
    let words: Vec<&str> = text.split_ascii_whitespace().filter(|word| !matches!(*word, "-" | "|")).take(40).collect();
    let first = *words.first()?;
    let is_tool = words.iter().any(|word| matches!(*word, "tool" | "cutter" | "tc")) || number_of(first).is_some();
    if !is_tool {
        return None;
    }
    let mut remark = Remark { shape: form(&text), ..Remark::default() };
    let mut loose = None;
    let mut at = 0;
    while let Some(word) = words.get(at) {
        let next = words.get(at + 1).and_then(|word| quantity(word));
        match *word {
            "tool" | "number" | "no" | "no." | "nr" if remark.number.is_none() => {
                if let Some(number) = words.get(at + 1).and_then(|word| word.parse().ok()) {
                    remark.number = Some(number);
                    at += 1;
                }
            }
            "d" | "dia" | "dia." | "diam" | "diam." | "diameter" => {
                at += usize::from(next.is_some());
                remark.diameter = next.or(loose.take()).or(remark.diameter);
            }
            "cr" | "corner" => remark.corner = take(next, &mut at).or(remark.corner),
            "length" => remark.length = take(next, &mut at).or(remark.length),
            "taper" => remark.angle = take(next, &mut at).or(remark.angle),
            // Depths and the like, of Fusion's comments.
            "zmin" | "r" | "h" | "operation" => at += usize::from(next.is_some()),
            _ => {
                if let Some(number) = number_of(word).filter(|_| remark.number.is_none()) {
                    remark.number = Some(number);
                } else if let Some(diameter) = word.strip_prefix('d').and_then(quantity) {
                    remark.diameter = remark.diameter.or(Some(diameter));
                } else if let Some(angle) = included_angle(word, words.get(at + 1).copied()) {
                    // Between the two flanks; a taper's is between one and the axis.
                    remark.angle = Some(if remark.shape == Some(Form::Drill) { angle } else { 0.5 * angle });
                    at += usize::from(!word.ends_with("deg"));
                } else {
                    loose = loose.or(with_unit(word, words.get(at + 1).copied()));
                }
            }
        }
        at += 1;
    }
    let is_likely = |(value, unit): &(f64, Option<f64>)| *value > 0.0 && (unit.is_some() || remark.number.is_some());
    remark.diameter = remark.diameter.or(loose.filter(is_likely).filter(|_| remark.shape.is_some()));
    remark.diameter = remark.diameter.filter(|(value, _)| *value > 0.0);
    (remark.number.is_some() || remark.diameter.is_some() || remark.length.is_some()).then_some(remark)
}

fn take(next: Option<(f64, Option<f64>)>, at: &mut usize) -> Option<f64> {
    *at += usize::from(next.is_some());
    next.map(|(value, _)| value)
}

/// An angle in degrees: `90deg`, `90 deg`.
fn included_angle(word: &str, next: Option<&str>) -> Option<f64> {
    let is_angle = word.ends_with("deg") || matches!(next, Some("deg" | "degree" | "degrees"));
    is_angle.then(|| quantity(word)).flatten().map(|(value, _)| value).filter(|angle| (1.0..=180.0).contains(angle))
}

/// A quantity whose unit may be the next word.
fn with_unit(word: &str, next: Option<&str>) -> Option<(f64, Option<f64>)> {
    let (value, unit) = quantity(word)?;
    let later = match next {
        Some("mm") => Some(1.0),
        Some("in" | "inch" | "\"") => Some(25.4),
        _ => None,
    };
    Some((value, unit.or(later)))
}

/// The number of `t12`.
fn number_of(word: &str) -> Option<u32> {
    let digits = word.strip_prefix('t')?;
    (!digits.is_empty() && digits.len() < 7 && digits.bytes().all(|byte| byte.is_ascii_digit())).then(|| digits.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    type Expected = (Option<u32>, Option<(f64, Option<f64>)>, Option<Form>);

    #[test]
    fn comments_name_tools() {
        let cases: [(&str, Expected); 12] = [
            ("TOOL - 1 DIA. OFF. - 1 LEN. - 1 DIA. - .5", (Some(1), Some((0.5, None)), None)),
            ("T1 | 1/2 FLAT ENDMILL | H1", (Some(1), Some((0.5, None)), Some(Form::Flat))),
            ("Tool: V-Bit {90 deg 1.25\"}", (None, Some((1.25, Some(25.4))), Some(Form::Taper))),
            ("T1 D=6. CR=3. - ZMIN=-5. - ball end mill", (Some(1), Some((6.0, None)), Some(Form::Ball))),
            ("T2  D=3.175 CR=0. TAPER=30deg - ZMIN=-1. - chamfer mill", (Some(2), Some((3.175, None)), Some(Form::Taper))),
            ("TC: 6mm Endmill", (None, Some((6.0, Some(1.0))), Some(Form::Flat))),
            ("TOOL 1 .875 FINISH ENDMILL", (Some(1), Some((0.875, None)), Some(Form::Flat))),
            ("TOOL: T1 = 10.0 dia. ENDMILLM1000:REG", (Some(1), Some((10.0, None)), Some(Form::Flat))),
            ("*** TOOL DIAMETER = 0.500000 ***", (None, Some((0.5, None)), None)),
            ("*** TOOL NUMBER = 3 ***", (Some(3), None, None)),
            ("and Cutter is assumed to be a 10mm ball nose", (None, Some((10.0, Some(1.0))), Some(Form::Ball))),
            ("Tool: 1/4\" end mill", (None, Some((0.25, Some(25.4))), Some(Form::Flat))),
        ];
        for (comment, (number, diameter, shape)) in cases {
            let remark = read(comment.as_bytes()).unwrap_or_default();
            assert_eq!((remark.number, remark.diameter, remark.shape), (number, diameter, shape), "{comment}");
        }
        for comment in
            ["FIRST TOOL NOT IN SPINDLE", "OPERATION 1 ROUGHING", "tool dia doesn't have to be exact", "drill six holes", ""]
        {
            assert_eq!(read(comment.as_bytes()), None, "{comment}");
        }
    }
}
