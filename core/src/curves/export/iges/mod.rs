//! IGES: lines of 80 columns, first what each entity is and where its parameters stand, then these.

mod entities;
mod global;
mod plan;
mod record;

use std::io::{self, Write};

use self::plan::{Item, Plan};
use self::record::Record;
use super::error::ExportError;
use super::model::{Body, Header};
use super::parametric;

/// Columns of parameters on a line; behind them is the entity that they belong to.
const WIDTH: usize = 64;
/// Lines of a section, at most.
const MOST: usize = 9_999_999;

/// Writes a body.
pub(super) fn write(body: &Body, header: &Header<'_>, sink: &mut impl Write) -> Result<(), ExportError> {
    let global = global::section(body, header)?;
    let rings = parametric::rings(body);
    let plan = Plan::of(body, &rings);
    let mut counts = Vec::with_capacity(plan.items.len());
    for item in &plan.items {
        let mut record = Record::new(WIDTH, |_| Ok(()));
        entities::parameters(body, item, &mut record)?;
        counts.push(record.finish()?);
    }
    if counts.iter().sum::<usize>() > MOST || 2 * counts.len() > MOST {
        return Err(ExportError::TooLong);
    }
    let starts = start(header, sink)?;
    for (at, line) in global.iter().enumerate() {
        writeln!(sink, "{line:<72}G{:>7}", at + 1)?;
    }
    directory(&plan, &counts, sink)?;
    let mut lines = 0;
    for (number, item) in plan.items.iter().enumerate() {
        let mut record = Record::new(WIDTH, |line| {
            lines += 1;
            writeln!(sink, "{line:<WIDTH$}{:>8}P{lines:>7}", 2 * number + 1)
        });
        entities::parameters(body, item, &mut record)?;
        record.finish()?;
    }
    let ends = format!("S{starts:>7}G{:>7}D{:>7}P{lines:>7}", global.len(), 2 * plan.items.len());
    writeln!(sink, "{ends:<72}T{:>7}", 1)?;
    Ok(())
}

/// The first section: words for people; gives its lines.
fn start(header: &Header<'_>, sink: &mut impl Write) -> io::Result<usize> {
    let words = global::ascii(&format!("{} {}", header.name, header.system));
    let words: String = words.trim().chars().take(72).collect();
    writeln!(sink, "{words:<72}S{:>7}", 1)?;
    Ok(1)
}

/// Two lines for each entity: type, first line of its parameters, status; weight and colour of lines, how many lines, form.
fn directory(plan: &Plan<'_>, counts: &[usize], sink: &mut impl Write) -> io::Result<()> {
    let mut first = 1;
    for (number, (item, count)) in plan.items.iter().zip(counts).enumerate() {
        let (kind, status, sequence) = (item.kind(), item.status(), 2 * number + 1);
        writeln!(sink, "{kind:>8}{first:>8}{0:>8}{0:>8}{0:>8}{0:>8}{0:>8}{0:>8}{status}D{sequence:>7}", 0)?;
        writeln!(sink, "{kind:>8}{0:>8}{0:>8}{count:>8}{0:>8}{1:>8}{1:>8}{1:>8}{0:>8}D{2:>7}", 0, "", sequence + 1)?;
        first += count;
    }
    Ok(())
}

impl Item<'_> {
    /// Number of its type.
    fn kind(&self) -> u32 {
        match self {
            Self::Surface(_) => 128,
            Self::Curve { .. } | Self::Parametric { .. } | Self::Bridge(_) => 126,
            Self::Composite { .. } => 102,
            Self::OnSurface { .. } => 142,
            Self::Trimmed { .. } => 144,
        }
    }

    /// Visible or not, whether it depends on others, and what it is for: each two digits; the last two say that others do not
    /// inherit.
    fn status(&self) -> &'static str {
        match self {
            Self::Trimmed { .. } => "00000000",
            Self::Parametric { .. } | Self::Bridge(_) | Self::Composite { is_parametric: true, .. } => "00010500",
            _ => "00010000",
        }
    }
}
