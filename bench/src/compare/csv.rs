//! The results on real files as comma-separated values: one line a file and program, for others to hold theirs against.

use super::book::Book;
use super::made::Solved;

const HEAD: &str = "file,triangles,may_be_solid,fault_before,program,version,seconds,end,outcome,printable,fault_after,wraps,kept_share,distance_share,bodies_lost\n";

/// The table; empty if no real files were measured.
pub(super) fn real_files(book: &Book) -> String {
    let mut lines: Vec<&Solved> = book.last(|chapter| chapter.solved().collect());
    if lines.is_empty() {
        return String::new();
    }
    lines.sort_by(|a, b| (&a.file, a.side).cmp(&(&b.file, b.side)));
    lines.into_iter().map(row).fold(HEAD.into(), |text, row| text + &row)
}

fn row(line: &Solved) -> String {
    let report = line.report.as_ref();
    let or_empty = |value: Option<String>| value.unwrap_or_default();
    let fields = [
        line.file.clone(),
        line.triangles.to_string(),
        line.may_be_solid.to_string(),
        or_empty(line.before.clone()),
        line.side.facts().name.into(),
        line.program.clone(),
        format!("{:.4}", line.seconds),
        line.end.clone(),
        or_empty(report.map(|report| report.outcome.clone())),
        line.is_printable().to_string(),
        or_empty(line.after.as_ref().and_then(|after| after.fault()).map(|fault| fault.name().into())),
        or_empty(report.map(|report| report.wraps.to_string())),
        or_empty(line.change.map(|change| format!("{:.6}", change.kept))),
        or_empty(line.distance().map(|distance| format!("{distance:.8}"))),
        or_empty(line.bodies.map(|bodies| bodies.lost.to_string())),
    ];
    format!("{}\n", fields.map(|field| quoted(&field)).join(","))
}

/// As RFC 4180 has it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_needs_it_is_quoted() {
        assert_eq!(["a b", "a,b", "a\"b", ""].map(quoted), ["a b", "\"a,b\"", "\"a\"\"b\"", ""]);
        assert_eq!(real_files(&Book { chapters: Vec::new() }), "");
    }
}
