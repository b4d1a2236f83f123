//! Plots of the raw runs, as SVG: rate by size, memory by size, where Suture's time goes, small files.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::book::Book;
use super::child::Cost;
use super::error::Error;
use super::record::Input;
use super::sides::Side;
use super::statistics::{number, short, spaced};
use super::way::Way;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

const FONT: &str = "Helvetica, Arial, sans-serif";
const INK: RGBColor = RGBColor(40, 44, 52);
const PALE: RGBColor = RGBColor(222, 226, 232);
const SIZE: (u32, u32) = (960, 560);
/// Room on the right of a plot, where its lines are named.
const NAMES: i32 = 190;

/// One colour a tool, whatever the plot; blues and greens are Suture's.
fn colour(side: Side) -> RGBColor {
    match side {
        Side::Suture | Side::SutureOff | Side::SutureArrays | Side::Inspect | Side::Convert => RGBColor(0, 90, 181),
        Side::SutureNoSi | Side::InspectNoSi => RGBColor(0, 158, 142),
        Side::Cp | Side::CpSynced => RGBColor(120, 124, 132),
        Side::PymeshlabPlain | Side::PymeshlabPlainSi => RGBColor(230, 130, 0),
        Side::PymeshlabCompetent | Side::PymeshlabCompetentSi | Side::PymeshlabSolid => RGBColor(200, 60, 20),
        Side::PymeshlabArrays | Side::PymeshlabFormats => RGBColor(200, 60, 20),
        Side::Meshlib | Side::MeshlibDetect | Side::MeshlibSolid => RGBColor(140, 60, 170),
        Side::MeshlibArrays | Side::MeshlibFormats => RGBColor(140, 60, 170),
        Side::Pymeshfix | Side::PymeshfixArrays => RGBColor(190, 50, 120),
        Side::Admesh => RGBColor(110, 80, 40),
        Side::Trimesh | Side::TrimeshArrays | Side::TrimeshFormats => RGBColor(170, 150, 30),
        Side::Manifold3d | Side::Manifold3dUnion => RGBColor(90, 140, 60),
        Side::Lib3mf => RGBColor(60, 60, 70),
        Side::Tobj => RGBColor(160, 100, 80),
    }
}

/// The sides of the plots by size. Those with pymeshlab's search would lie on those without.
const TOOLS: [Side; 10] = [
    Side::CpSynced,
    Side::SutureNoSi,
    Side::Suture,
    Side::Meshlib,
    Side::PymeshlabPlain,
    Side::PymeshlabCompetent,
    Side::Pymeshfix,
    Side::Manifold3d,
    Side::Trimesh,
    Side::Admesh,
];

/// A named line of points.
struct Curve {
    name: String,
    colour: RGBColor,
    dashed: bool,
    points: Vec<(f64, f64)>,
}

/// Draws every plot for which there are runs; returns file names and captions.
pub(super) fn draw(book: &Book, folder: &Path) -> Result<Vec<(String, String)>, Error> {
    let mut drawn = Vec::new();
    let mut plot = |name: &str, caption: &str, paint: &dyn Fn(&Area) -> Drawn| -> Result<(), Error> {
        let path = folder.join(name);
        let area = SVGBackend::new(&path, SIZE).into_drawing_area();
        let painted = area.fill(&WHITE).map_err(Into::into).and_then(|()| paint(&area)).and_then(|()| Ok(area.present()?));
        painted.map_err(|error| Error::Plot { path: path.clone(), reason: error.to_string() })?;
        drawn.push((name.into(), caption.into()));
        Ok(())
    };
    let case = |name: &str| book.inputs().into_iter().filter(|input| input.case == name && input.files == 1).collect::<Vec<_>>();
    let mixed = case("mixed");
    let rates = curves(&mixed, |input, way| book.wall(input, way).map(|wall| input.triangles as f64 / 1e6 / wall.median));
    if !rates.is_empty() {
        plot("throughput.svg", "Speed by size: mixed defects, warm cache, output synced", &|area| {
            by_size(area, "Million triangles per second, by size of the mesh", "million triangles/s", &rates)
        })?;
    }
    let memory = memories(book, &mixed);
    if !memory.is_empty() {
        plot("memory.svg", "Peak memory by size: mixed defects", &|area| {
            by_size(area, "Peak memory in MB, by size of the mesh", "MB", &memory)
        })?;
    }
    let bars = stages(book, &mixed);
    if !bars.is_empty() {
        plot("stages.svg", "Where Suture's time goes: mixed defects, warm cache", &|area| columns(area, &bars))?;
    }
    let largest = mixed.iter().rev().find(|input| book.wall(input, &Way::plain(Side::PymeshlabPlain)).is_some());
    if let Some(input) = largest {
        let times = times(book, input);
        let title = format!("Seconds for one mesh of {} triangles with mixed defects", short(input.size));
        plot("times.svg", &format!("{title}, warm cache, output synced"), &|area| lengths(area, &title, &times))?;
    }
    Ok(drawn)
}

fn curves(inputs: &[&Input], value: impl Fn(&Input, &Way) -> Option<f64>) -> Vec<Curve> {
    let of_side = |side: Side| {
        let way = Way::plain(side);
        let points = inputs.iter().filter_map(|input| Some((input.triangles as f64, value(input, &way)?)));
        Curve { name: side.facts().name.into(), colour: colour(side), dashed: side == Side::CpSynced, points: points.collect() }
    };
    TOOLS.into_iter().map(of_side).filter(|curve| !curve.points.is_empty()).collect()
}

/// Resident memory of every tool, anonymous memory of suture, and the file itself.
fn memories(book: &Book, inputs: &[&Input]) -> Vec<Curve> {
    let peak = |value: fn(&Cost) -> Option<u64>| {
        move |input: &Input, way: &Way| {
            let bytes = book.spread(input, way, |cost| value(cost).map(|bytes| bytes as f64))?;
            Some(bytes.most / 1e6)
        }
    };
    let mut all = curves(inputs, peak(|cost| Some(cost.peak_resident_bytes)));
    all.retain(|curve| !curve.name.starts_with("cp"));
    if all.is_empty() {
        return all;
    }
    let anonymous = curves(inputs, peak(|cost| cost.peak_anonymous_bytes));
    all.extend(anonymous.into_iter().filter(|curve| curve.name.starts_with("suture")).map(|curve| Curve {
        name: format!("{}, anonymous", curve.name),
        dashed: true,
        ..curve
    }));
    let points = inputs.iter().map(|input| (input.triangles as f64, input.bytes as f64 / 1e6)).collect();
    all.push(Curve { name: "the file".into(), colour: colour(Side::Cp), dashed: true, points });
    all
}

/// The next power of ten, or half or double of one, around values.
fn bounds(values: impl Iterator<Item = f64> + Clone) -> std::ops::Range<f64> {
    let least = values.clone().fold(f64::INFINITY, f64::min);
    let most = values.fold(0.0, f64::max);
    let steps = |value: f64| [1.0, 2.0, 5.0, 10.0].map(|step| step * 10f64.powf(value.log10().floor()));
    let low = steps(least).into_iter().rev().find(|step| *step <= least * 0.98).unwrap_or(least / 2.0);
    let high = steps(most).into_iter().find(|step| *step >= most * 1.02).unwrap_or(most * 2.0);
    low..high
}

/// Curves over size, both axes logarithmic, each named at its end.
fn by_size(area: &Area, title: &str, unit: &str, curves: &[Curve]) -> Drawn {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let (across, up) = (bounds(points().map(|point| point.0)), bounds(points().map(|point| point.1)));
    let mut chart = ChartBuilder::on(area)
        .caption(title, (FONT, 20).into_font().color(&INK))
        .margin(16)
        .margin_right(NAMES)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(across.log_scale(), up.clone().log_scale())?;
    chart
        .configure_mesh()
        .bold_line_style(PALE)
        .light_line_style(WHITE)
        .axis_style(INK)
        .x_desc("triangles")
        .y_desc(unit)
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&|value| short(value.round() as u64))
        .y_label_formatter(&|value| axis(*value))
        .label_style((FONT, 14).into_font().color(&INK))
        .axis_desc_style((FONT, 15).into_font().color(&INK))
        .draw()?;
    for curve in curves {
        let style = curve.colour.stroke_width(if curve.dashed { 1 } else { 3 });
        if curve.dashed {
            chart.draw_series(DashedLineSeries::new(curve.points.iter().copied(), 6, 4, style))?;
        } else {
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), style))?;
        }
        let dot = if curve.dashed { 2 } else { 4 };
        chart.draw_series(curve.points.iter().map(|&point| Circle::new(point, dot, curve.colour.filled())))?;
    }
    let ends = curves.iter().filter_map(|curve| curve.points.last().map(|&end| chart.backend_coord(&end)));
    name_ends(area, curves, ends.collect())
}

/// Writes each curve's name at the right edge, as near to the height of its end as the others let it, with a thin line to it.
fn name_ends(area: &Area, curves: &[Curve], ends: Vec<(i32, i32)>) -> Drawn {
    const LINE: i32 = 18;
    let heights = apart(&ends.iter().map(|end| end.1).collect::<Vec<_>>(), LINE, 48, SIZE.1 as i32 - 70);
    let left = SIZE.0 as i32 - NAMES + 14;
    for ((curve, end), height) in curves.iter().zip(ends).zip(heights) {
        area.draw(&PathElement::new(vec![(end.0 + 6, end.1), (left - 4, height)], curve.colour.mix(0.5).stroke_width(1)))?;
        let style = (FONT, 14).into_font().color(&curve.colour);
        area.draw(&Text::new(curve.name.clone(), (left, height - 7), style))?;
    }
    Ok(())
}

/// Heights near the given ones, each at least `gap` from the others, between `top` and `bottom` as far as they fit.
fn apart(heights: &[i32], gap: i32, top: i32, bottom: i32) -> Vec<i32> {
    let mut order: Vec<_> = (0..heights.len()).collect();
    order.sort_by_key(|&at| heights[at]);
    let mut placed = heights.to_vec();
    let mut least = top;
    for &at in &order {
        placed[at] = heights[at].max(least);
        least = placed[at] + gap;
    }
    let mut most = bottom;
    for &at in order.iter().rev() {
        placed[at] = placed[at].min(most);
        most = placed[at] - gap;
    }
    placed
}

/// A label of an axis: no zeros behind what counts.
fn axis(value: f64) -> String {
    if value >= 1.0 { short(value.round() as u64) } else { format!("{}", (value * 1e6).round() / 1e6) }
}

/// Nanoseconds a triangle of each stage, for each size.
struct Column {
    name: String,
    parts: Vec<(String, f64)>,
}

fn stages(book: &Book, inputs: &[&Input]) -> Vec<Column> {
    let side = [Side::Suture, Side::SutureNoSi];
    let of = |input: &&Input| {
        let way = side.map(Way::plain).into_iter().find(|way| book.wall(input, way).is_some())?;
        let runs = book.runs(input, &way);
        // The run in the middle, since medians of stages need not add up.
        let mut runs: Vec<_> = runs.iter().filter(|run| !run.cost.stages.is_empty()).collect();
        runs.sort_by(|a, b| a.cost.wall_seconds.total_cmp(&b.cost.wall_seconds));
        let cost = &runs.get(runs.len() / 2)?.cost;
        let each = 1e9 / input.triangles as f64;
        let mut parts: Vec<_> = cost.stages.iter().map(|stage| (stage.name.replace('_', " "), stage.seconds * each)).collect();
        let rest = cost.wall_seconds * each - parts.iter().map(|part| part.1).sum::<f64>();
        parts.push(("process, sync".into(), rest.max(0.0)));
        Some(Column { name: short(input.size), parts })
    };
    // A process's own time would dwarf a small mesh's.
    inputs.iter().filter(|input| input.size >= 100_000).filter_map(of).collect()
}

const STAGES: [RGBColor; 8] = [
    RGBColor(120, 124, 132),
    RGBColor(0, 90, 181),
    RGBColor(0, 158, 142),
    RGBColor(230, 130, 0),
    RGBColor(200, 60, 20),
    RGBColor(140, 60, 170),
    RGBColor(170, 150, 30),
    RGBColor(200, 204, 210),
];

/// Stacked columns, one a size.
fn columns(area: &Area, columns: &[Column]) -> Drawn {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in columns.iter().flat_map(|column| &column.parts) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    // What is left comes last, in grey.
    names.sort_by_key(|name| *name == "process, sync");
    let paint = |name: &str| {
        let at = names.iter().position(|other| *other == name).unwrap_or(0);
        if at + 1 == names.len() { STAGES[STAGES.len() - 1] } else { STAGES[at % (STAGES.len() - 1)] }
    };
    let height = |column: &Column| column.parts.iter().map(|part| part.1).sum::<f64>();
    let most = columns.iter().map(height).fold(0.0, f64::max) * 1.08;
    let mut chart = ChartBuilder::on(area)
        .caption("Where Suture's time goes, by size of the mesh", (FONT, 20).into_font().color(&INK))
        .margin(16)
        .margin_right(NAMES)
        .x_label_area_size(48)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..columns.len() as f64, 0.0..most)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .bold_line_style(PALE)
        .light_line_style(WHITE)
        .axis_style(INK)
        .x_labels(0)
        .y_desc("nanoseconds a triangle")
        .x_desc("triangles")
        .y_label_formatter(&|value| spaced(value.round() as u64))
        .label_style((FONT, 14).into_font().color(&INK))
        .axis_desc_style((FONT, 15).into_font().color(&INK))
        .draw()?;
    for (at, column) in columns.iter().enumerate() {
        let mut base = 0.0;
        for (name, length) in &column.parts {
            let corners = [(at as f64 + 0.2, base), (at as f64 + 0.8, base + length)];
            chart.draw_series([Rectangle::new(corners, paint(name).filled())])?;
            base += length;
        }
        let (x, y) = chart.backend_coord(&(at as f64 + 0.5, base));
        let style = centred(14);
        area.draw(&Text::new(spaced(base.round() as u64), (x, y - 18), style.clone()))?;
        let foot = chart.backend_coord(&(at as f64 + 0.5, 0.0)).1;
        area.draw(&Text::new(column.name.clone(), (x, foot + 8), style))?;
    }
    let left = SIZE.0 as i32 - NAMES + 14;
    for (at, name) in names.iter().rev().enumerate() {
        let y = 80 + 24 * at as i32;
        area.draw(&Rectangle::new([(left, y), (left + 14, y + 14)], paint(name).filled()))?;
        area.draw(&Text::new(name.to_string(), (left + 22, y), (FONT, 14).into_font().color(&INK)))?;
    }
    Ok(())
}

fn centred(size: i32) -> TextStyle<'static> {
    use plotters::style::text_anchor::{HPos, Pos, VPos};
    (FONT, size).into_font().color(&INK).pos(Pos::new(HPos::Center, VPos::Top))
}

/// Seconds by tool.
fn times(book: &Book, input: &Input) -> Vec<(Side, f64)> {
    let sides = Side::ALL.into_iter().filter(|side| *side != Side::Cp && side.facts().writes && !side.is_of_arrays());
    let mut times: Vec<_> = sides.filter_map(|side| Some((side, book.wall(input, &Way::plain(side))?.median))).collect();
    times.sort_by(|a, b| a.1.total_cmp(&b.1));
    times
}

/// Bars from left to right on a logarithmic scale, each with its name and its seconds.
fn lengths(area: &Area, title: &str, times: &[(Side, f64)]) -> Drawn {
    let across = bounds(times.iter().map(|time| time.1));
    let start = across.start;
    let rows = times.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .caption(title, (FONT, 20).into_font().color(&INK))
        .margin(16)
        .margin_right(90)
        .x_label_area_size(48)
        .y_label_area_size(NAMES as u32)
        .build_cartesian_2d(across.log_scale(), rows..0.0)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .bold_line_style(PALE)
        .light_line_style(WHITE)
        .axis_style(INK)
        .x_desc("seconds, logarithmic")
        .y_labels(0)
        .x_labels(8)
        .x_label_formatter(&|value| axis(*value))
        .label_style((FONT, 14).into_font().color(&INK))
        .axis_desc_style((FONT, 15).into_font().color(&INK))
        .draw()?;
    for (at, &(side, seconds)) in times.iter().enumerate() {
        let row = at as f64;
        chart.draw_series([Rectangle::new([(start, row + 0.18), (seconds, row + 0.82)], colour(side).filled())])?;
        let (right, y) = chart.backend_coord(&(seconds, row + 0.5));
        let left = chart.backend_coord(&(start, row + 0.5)).0;
        area.draw(&Text::new(format!("{} s", number(seconds)), (right + 8, y - 7), (FONT, 14).into_font().color(&INK)))?;
        let style = {
            use plotters::style::text_anchor::{HPos, Pos, VPos};
            (FONT, 14).into_font().color(&INK).pos(Pos::new(HPos::Right, VPos::Center))
        };
        area.draw(&Text::new(side.facts().name, (left - 10, y), style))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::book::tests::{chapter, input};
    use super::*;

    #[test]
    fn names_do_not_lie_on_each_other() {
        assert_eq!(apart(&[100, 105, 300], 18, 0, 1000), [100, 118, 300]);
        assert_eq!(apart(&[105, 100], 18, 0, 1000), [118, 100]);
        // Pushed up from the bottom, and the one above with it.
        assert_eq!(apart(&[990, 995], 18, 0, 1000), [982, 1000]);
    }

    #[test]
    fn bounds_lie_around_the_values() {
        assert_eq!(bounds([1_000.0, 9_000_000.0].into_iter()), 500.0..10_000_000.0);
        assert_eq!(bounds([0.3, 30.0].into_iter()), 0.2..50.0);
    }

    #[test]
    fn every_plot_is_drawn_and_names_its_tools() {
        let folder = tempfile::tempdir().unwrap();
        let inputs = [input("mixed", 100_000), input("mixed", 1_000_000)];
        let runs = [(Side::Suture, 0.2, 0), (Side::PymeshlabPlain, 5.0, 0)];
        let book = Book { chapters: inputs.iter().map(|input| chapter(input, &runs)).collect() };
        let drawn = draw(&book, folder.path()).unwrap();
        let names: Vec<_> = drawn.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["throughput.svg", "memory.svg", "stages.svg", "times.svg"]);
        for (name, word) in [("throughput.svg", "pymeshlab-plain"), ("memory.svg", "the file"), ("stages.svg", "process, sync")] {
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            assert!(text.contains(word) && text.trim_end().ends_with("</svg>"), "{name}");
        }
    }
}
