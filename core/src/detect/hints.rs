//! Hints: what a person may want to know of a good file, too, and no repair changes. They decide nothing.

use crate::contract::hint::{Hint, HintKind};
use crate::contract::report::{Defects, ThinWalls};
use crate::contract::settings::Profile;
use crate::util::words::{At, Count, Short};

/// A part that encloses less, in mm³, may be drawn in inches; the bounds at which PrusaSlicer asks (`volume_threshold_inches`, a cube of about
/// two, and `volume_threshold_meters`).
const MAY_BE_INCHES: f64 = 9.0;
/// Likewise in metres.
const MAY_BE_METRES: f64 = 0.001;
/// Slicers and their previews are slow with more triangles (OrcaSlicer's option `--mtcpp` refuses a plate by such a count).
const MANY_TRIANGLES: u64 = 1_000_000;

/// The hints of a mesh with these counts.
pub(crate) fn hints(defects: &Defects, profile: &Profile) -> Vec<Hint> {
    let extents = defects.bounds.map(|[lo, hi]| [0, 1, 2].map(|k| f64::from(hi[k]) - f64::from(lo[k])));
    let mut hints: Vec<Hint> = Vec::new();
    if let Some(extents) = extents {
        hints.extend(scale(defects, extents));
        hints.extend(room(extents, profile.build_volume_mm));
    }
    if defects.triangles > MANY_TRIANGLES {
        let text = format!("it has {} triangles: slicers are slow with more than a million", Count(defects.triangles));
        hints.push(Hint { kind: HintKind::ManyTriangles, text });
    }
    hints
}

/// Was it drawn in other units? An STL does not say; printers take them for millimetres.
fn scale(defects: &Defects, extents: [f64; 3]) -> Option<Hint> {
    let of_box = extents.iter().product::<f64>();
    // An open surface encloses nothing certain, but no more than its box.
    let volume = if defects.boundary_edges == 0 { defects.volume.abs() } else { of_box };
    const METRES: (&str, f64) = ("metres", 1000.0);
    const INCHES: (&str, f64) = ("inches", 25.4);
    let (kind, (unit, factor), (other, other_factor)) = match volume {
        v if v <= 0.0 || v.is_nan() => return None,
        v if v < MAY_BE_METRES => (HintKind::Metres, METRES, INCHES),
        v if v < MAY_BE_INCHES => (HintKind::Inches, INCHES, METRES),
        _ => return None,
    };
    let size = |factor: f64| extents.map(|extent| Short(extent * factor).to_string()).join(" × ");
    let (now, then, otherwise) = (size(1.0), size(factor), size(other_factor));
    // Of parts of one model, a small one may look like inches where all are in metres.
    let text = format!(
        "it is {now} mm; was it drawn in {unit}? Then it is {then} mm, and has to be scaled by {factor} (drawn in {other}: {otherwise} mm, by {other_factor}); nothing is scaled here"
    );
    Some(Hint { kind, text })
}

/// Is there room for it in the printer? 0 in a direction: there is, however long it is.
fn room(extents: [f64; 3], printer: [f64; 3]) -> Option<Hint> {
    let has = |printer: f64, extent: f64| printer == 0.0 || extent <= printer;
    if (0..3).all(|k| has(printer[k], extents[k])) {
        return None;
    }
    const TURNS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let fits_turned = TURNS.iter().any(|turn| (0..3).all(|k| has(printer[k], extents[turn[k]])));
    let words = if fits_turned { "as it lies, but does if it is turned" } else { "however it is turned by right angles" };
    let [x, y, z] = extents.map(Short);
    let shown = printer.map(|side| if side == 0.0 { "any".to_owned() } else { Short(side).to_string() }).join(" × ");
    let text = format!("it is {x} × {y} × {z} mm and does not fit into {shown} mm (`build_volume_mm`) {words}");
    Some(Hint { kind: HintKind::BuildVolume, text })
}

/// The hint on walls that were looked for, if some are thin, or why it was not looked for them.
pub(crate) fn walls(found: &Result<ThinWalls, String>) -> Option<Hint> {
    let text = match found {
        Err(why) => format!("thin walls were not looked for: {why}"),
        Ok(found) => {
            let thinnest = found.places.first()?;
            let percent = found.share * 100.0;
            let share = if percent < 1.0 { "less than 1".to_owned() } else { format!("about {}", percent.round()) };
            let (minimum, thickness) = (Short(found.minimum), Short(thinnest.thickness));
            format!(
                "walls are thinner than {minimum} mm (`thin_wall_mm`) at {share} % of the surface; the thinnest measured is {thickness} mm at {}",
                At(thinnest.at)
            )
        }
    };
    Some(Hint { kind: HintKind::ThinWalls, text })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(extents: [f32; 3], volume: f64, boundary_edges: u64) -> Defects {
        Defects {
            bounds: Some([[1.0; 3], extents.map(|x| x + 1.0)]),
            volume,
            boundary_edges,
            triangles: 12,
            ..Defects::default()
        }
    }

    fn kinds(defects: &Defects, build_volume_mm: [f64; 3]) -> Vec<HintKind> {
        hints(defects, &Profile { build_volume_mm, ..Profile::default() }).into_iter().map(|hint| hint.kind).collect()
    }

    #[test]
    fn units_are_doubted_by_volume() {
        let any = [0.0; 3];
        assert_eq!(kinds(&of([2.0, 2.0, 2.0], 8.0, 0), any), [HintKind::Inches]);
        assert_eq!(kinds(&of([2.0, 2.0, 2.0], -8.0, 0), any), [HintKind::Inches], "inside out");
        assert_eq!(kinds(&of([3.0, 3.0, 2.0], 10.0, 0), any), []);
        // A thin large part encloses little, and is as large as it should be; it is asked about all the same, as slicers do.
        assert_eq!(kinds(&of([0.1, 0.1, 0.05], 0.0004, 0), any), [HintKind::Metres]);
        // Open: its volume says nothing, its box does.
        assert_eq!(kinds(&of([20.0, 20.0, 20.0], 0.5, 3), any), []);
        assert_eq!(kinds(&of([1.0, 1.0, 1.0], 0.0, 3), any), [HintKind::Inches]);
        assert_eq!(kinds(&of([0.0, 1.0, 1.0], 0.0, 3), any), [], "flat");
        assert_eq!(kinds(&Defects::default(), any), []);
        let text = &hints(&of([2.0, 1.0, 0.5], 1.0, 0), &Profile::default())[0].text;
        assert!(text.contains("2 × 1 × 0.5 mm; was it drawn in inches? Then it is 50.8 × 25.4 × 12.7 mm"), "{text}");
    }

    #[test]
    fn the_printer_may_be_too_small() {
        let part = of([300.0, 100.0, 50.0], 1e6, 0);
        assert_eq!(kinds(&part, [0.0; 3]), []);
        assert_eq!(kinds(&part, [300.0, 200.0, 200.0]), []);
        assert_eq!(kinds(&part, [250.0, 250.0, 0.0]), [HintKind::BuildVolume], "it does not stand by itself");
        let text = |printer| hints(&part, &Profile { build_volume_mm: printer, ..Profile::default() })[0].text.clone();
        assert!(text([250.0, 210.0, 310.0]).ends_with("as it lies, but does if it is turned"));
        assert!(
            text([250.0, 250.0, 0.0]).contains("into 250 × 250 × any mm")
                && text([250.0, 250.0, 0.0]).ends_with("if it is turned")
        );
        assert!(text([250.0, 210.0, 220.0]).ends_with("however it is turned by right angles"));
    }

    #[test]
    fn thin_walls_are_told_of_with_the_thinnest() {
        let found = |share: f64, places: &str| {
            serde_json::from_str(&format!(r#"{{"minimum": 0.8, "points": 9, "share": {share}, "places": [{places}]}}"#)).unwrap()
        };
        let place = r#"{"at": [1.0, 2.5, -3.0], "thickness": 0.31}"#;
        let text = |found: Result<ThinWalls, String>| walls(&found).map(|hint| hint.text);
        let told = text(Ok(found(0.034, place))).unwrap();
        assert!(told.contains("thinner than 0.8 mm") && told.contains("about 3 %"), "{told}");
        assert!(told.ends_with("is 0.31 mm at [1, 2.5, -3]"), "{told}");
        assert!(text(Ok(found(0.001, place))).unwrap().contains("less than 1 %"));
        assert_eq!(text(Ok(found(0.0, ""))), None);
        assert!(text(Err("for a reason".into())).unwrap().ends_with("not looked for: for a reason"));
    }

    #[test]
    fn more_than_a_million_triangles_are_many() {
        let many = |triangles| kinds(&Defects { triangles, ..of([50.0; 3], 1e5, 0) }, [0.0; 3]);
        assert_eq!(many(1_000_000), []);
        assert_eq!(many(1_000_001), [HintKind::ManyTriangles]);
    }
}
