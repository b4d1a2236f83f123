//! Places of a report, for people and for the view that can be turned: defects that were found, regions that were changed, surface that was lost or invented, loops
//! that stayed open, walls that are thin. Without a script they are a list; the script makes a button of each.

use maud::{Markup, html};
use suture_core::Report;
use suture_core::report::{LoopClass, RegionMethod};
use suture_core::words::triangles;
use suture_store::JobId;

use crate::html::report::{key, method};
use crate::say::plain;
use crate::units::{show_count, show_number, show_point};

/// Places of a kind that are listed.
const MOST: usize = 100;

type Corners = [[f32; 3]; 2];

/// Places of one kind.
struct Group {
    /// Its class, by which it has its colour.
    class: &'static str,
    title: &'static str,
    /// In which of the two meshes they are.
    side: &'static str,
    places: Vec<(Corners, String)>,
}

fn groups(report: &Report, is_pair: bool) -> [Group; 6] {
    let skin = |changes: &[suture_core::report::SkinPlace]| -> Vec<(Corners, String)> {
        changes.iter().map(|place| (place.bounds, format!("{} square units", show_number(place.area)))).collect()
    };
    let (lost, invented) =
        report.skin.as_ref().map_or((Vec::new(), Vec::new()), |s| (skin(&s.lost.places), skin(&s.invented.places)));
    let is_left = |how: RegionMethod| how == RegionMethod::Left;
    let regions = |left: bool| {
        report.regions.listed.iter().filter(move |region| is_left(region.method) == left).map(|region| {
            let why = region.reason.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
            (region.bounds, format!("{}, {}{why}", method(region.method), triangles(region.count)))
        })
    };
    let open =
        report.loops_left.iter().map(|left| ([left.at; 2], format!("loop of {} edges: {}", show_count(left.edges), left.reason)));
    let found = report.loops.listed.iter();
    let found = found.map(|hole| ([hole.at; 2], format!("{} of {} edges", opening(hole.class), show_count(hole.vertices))));
    let thin = report.thin_walls.iter().flat_map(|walls| &walls.places);
    let thin = thin.map(|place| ([place.at; 2], format!("{} units thick", show_number(place.thickness))));
    [
        Group { class: "lost", title: "Surface that was lost", side: "before", places: lost },
        Group { class: "invented", title: "Surface that was invented", side: "after", places: invented },
        Group { class: "open", title: "Left as it was", side: "after", places: open.chain(regions(true)).collect() },
        Group { class: "changed", title: "Regions that were changed", side: "after", places: regions(false).collect() },
        Group { class: "found", title: "Openings that were found", side: "before", places: found.collect() },
        Group { class: "thin", title: "Thin walls", side: if is_pair { "after" } else { "before" }, places: thin.collect() },
    ]
}

/// A kind of opening for people who do not know how openings are sorted.
fn opening(class: LoopClass) -> String {
    match class {
        LoopClass::Simple => "hole".into(),
        other => format!("opening ({})", other.name().replace('_', " ")),
    }
}

/// The place of the view, and the list beside it.
pub(super) fn view(id: JobId, report: &Report, is_pair: bool) -> Markup {
    let groups = groups(report, is_pair);
    let all: usize = groups.iter().map(|group| group.places.len()).sum();
    html! {
        section aria-labelledby="places" {
            h2 id="places" { "Places" }
            noscript { p { "With JavaScript, the places below can be seen in a view that can be turned. The pictures above need none." } }
            div class="view" data-view=(id) data-sides=(if is_pair { "before after" } else { "before" }) {
                div class="stage" {}
                div class="places" {
                    @if all == 0 { p { "The report names no place." } }
                    @for group in groups.iter().filter(|group| !group.places.is_empty()) { (listed(group)) }
                }
            }
        }
    }
}

fn listed(group: &Group) -> Markup {
    let numbers = |corners: &Corners| corners.as_flattened().iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    html! {
        h3 { (key(group.class, group.title)) }
        ol { @for (corners, words) in group.places.iter().take(MOST) {
            li data-box=(numbers(corners)) data-kind=(group.class) data-side=(group.side) { (plain(words)) ", at " (show_point(&middle(corners))) }
        } }
        @if group.places.len() > MOST { p { "The report names " (show_count((group.places.len() - MOST) as u64)) " more." } }
    }
}

fn middle([lo, hi]: &Corners) -> [f32; 3] {
    std::array::from_fn(|k| lo[k].midpoint(hi[k]))
}
