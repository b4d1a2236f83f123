//! The review: what a good result has changed beyond the profile's limits, so that a person must look at it.
//!
//! Each function returns what rules of fidelity measure ([`crate::detect::fidelity`]), with a line for people where that is beyond the limit. No
//! line means that nobody need look.

use crate::contract::report::{Defects, Region, SheetDropped, Skin, SkinChange, Volumes, Wrap};
use crate::contract::settings::{Bodies, Profile};
use crate::detect::fidelity::Measured;
use crate::geometry::sums::Bounds;
use crate::util::words::{Count, Counted, Short, span};

/// What the repairs know and a person would want to, beside what can be counted in the result.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evidence {
    /// Bodies that lay in the material of others.
    pub(crate) enclosed: Enclosed,
    /// Guesses that may be wrong, each a line for people.
    pub(crate) doubts: Vec<String>,
    /// Patches that explain changes.
    pub(crate) explained: Explained,
    /// What the profile asked to be added: it is no reason for a person to look.
    pub(crate) asked: Asked,
    /// Rims of lone sheets that stay open.
    pub(crate) open_sheets: u64,
}

/// Changes that nobody need look at.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Explained {
    /// Area of patches that nothing speaks against.
    pub(crate) area: f64,
    /// The area of the largest of them, and the box around it.
    pub(crate) largest: Option<(f64, Bounds)>,
    /// Around such as reach beyond their loops.
    pub(crate) reached: Bounds,
    /// Around the surface that was left when specks were dropped; `None` if none were.
    pub(crate) without_specks: Option<Bounds>,
}

impl Explained {
    /// The box of the surface as it was, with what is explained: on each side, where specks reached farther, only what was left of them.
    fn surface(&self, was: &Bounds) -> Bounds {
        let mut surface = *was;
        if let Some(left) = self.without_specks.filter(|left| !left.is_empty()) {
            for k in 0..3 {
                surface.lo[k] = surface.lo[k].max(left.lo[k]);
                surface.hi[k] = surface.hi[k].min(left.hi[k]);
            }
        }
        surface.add(&self.reached);
        surface
    }
}

/// Surface that was added to a file because its profile asked for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    pub(crate) bounds: Bounds,
    /// In the file's units, squared.
    pub(crate) area: f64,
}

impl Default for Asked {
    fn default() -> Self {
        Self { bounds: Bounds::EMPTY, area: 0.0 }
    }
}

/// A smaller share of new surface is not told of.
const TOLD_SHARE: f64 = 0.01;

/// Words on openings that were closed where nothing speaks against that, and the share of the surface that is new: no reason to ask a person, but if one is asked for another
/// reason, they are to know.
pub(crate) fn closed_openings(explained: &Explained, after: &Defects) -> Option<(f64, String)> {
    let share = if after.area > 0.0 { explained.area / after.area } else { 0.0 };
    let (largest, bounds) = explained.largest.filter(|_| share > TOLD_SHARE)?;
    let (percent, of_largest) = (share * 100.0, largest / after.area * 100.0);
    let place = span([bounds.lo, bounds.hi]);
    Some((
        share,
        format!(
            "openings were closed by new surface, {percent:.1} % of all: the largest by {of_largest:.1} %, {place}; is it meant to be open there?"
        ),
    ))
}

/// Words on lone sheets that keep a file from being good.
pub(crate) fn open_sheets(count: u64) -> Option<String> {
    (count > 0).then(|| {
        let rims = Counted(count, "open rim", "open rims");
        format!(
            "{rims} of surface without thickness (lone sheets), which bounds no material; `sheets` in the profile makes solids of it: \"thicken\" walls, \"base\" blocks"
        )
    })
}

/// Bodies that lay in the material of others.
#[derive(Clone, Debug, Default)]
pub(crate) struct Enclosed {
    pub(crate) bodies: u64,
    /// What the bodies enclose less their cavities, which lies in the bodies around them as well. In the file's units, cubed.
    pub(crate) volume: f64,
    /// Where they were.
    pub(crate) regions: Vec<Region>,
    /// Of that volume, bodies that nothing crosses and that lay wholly in the material of another one: each may have been meant for a cavity.
    pub(crate) filled: f64,
    /// What copies of shells enclosed that went before it was measured what is meant.
    pub(crate) copied: f64,
    /// The largest body in the material of others that stays, since nobody knows if it is to go.
    pub(crate) left: Option<Bounds>,
    /// Beyond this box, there is nothing but cavities that poke out.
    pub(crate) outline: Option<Bounds>,
    /// The volume that the surface meant to enclose before anything was closed, cut or removed; `None` if nobody knows.
    pub(crate) meant: Option<f64>,
}

/// A result and what it was made of.
pub(crate) struct Change<'a> {
    pub(crate) before: &'a Defects,
    /// The box of the input's surface, triangles of no area left out.
    pub(crate) surface: &'a Bounds,
    pub(crate) evidence: &'a Evidence,
    pub(crate) after: &'a Defects,
    pub(crate) volumes: Option<&'a Volumes>,
    pub(crate) skin: Option<&'a Skin>,
    pub(crate) sheets: &'a [SheetDropped],
    pub(crate) wraps: &'a [Wrap],
    /// What the file itself has lost, each a line for people.
    pub(crate) missing: &'a [String],
}

/// The measurements of all rules of fidelity, in the order of the table.
pub(crate) fn measure(change: &Change<'_>, profile: &Profile) -> Vec<Measured> {
    let mut all = counts(change, profile);
    all.push(noted("guesses", &change.evidence.doubts));
    let volumes = volumes(change.volumes, profile);
    // Of the two rules on bodies, this one counts more of them, and says where the largest was: two numbers would only puzzle.
    if volumes.iter().any(|measured| measured.rule == "bodies_outside" && !measured.words.is_empty()) {
        all.iter_mut().filter(|measured| measured.rule == "bodies").for_each(|measured| measured.words.clear());
    }
    all.extend(volumes);
    all.push(cavities(change, profile));
    all.extend(skin(change.skin, profile));
    all.extend(sheets(change.before, change.sheets, profile));
    all.push(wraps(change.wraps, profile));
    all.push(noted("missing", change.missing));
    all
}

/// A rule that is beyond its limit as soon as there is a line.
fn noted(rule: &'static str, lines: &[String]) -> Measured {
    Measured { rule, figure: Some(lines.len() as f64), limit: 0.0, words: lines.to_vec() }
}

fn measured(rule: &'static str, figure: Option<f64>, limit: f64, words: impl FnOnce(f64) -> String) -> Measured {
    let words = figure.filter(|figure| *figure > limit).map(words).into_iter().collect();
    Measured { rule, figure, limit, words }
}

/// The surface that wraps have replaced.
fn wraps(wraps: &[Wrap], profile: &Profile) -> Measured {
    let done = || wraps.iter().filter(|wrap| wrap.left.is_none());
    let moved = Short(done().map(|wrap| wrap.moved).fold(0.0, f64::max));
    measured("wrapped", Some(done().map(|wrap| wrap.area_share).sum()), profile.wrap_review_share, |share| {
        format!("{:.1} % of the surface was replaced by wraps, and moved by up to {moved}", share * 100.0)
    })
}

/// The rules that count something.
fn counts(change: &Change<'_>, profile: &Profile) -> Vec<Measured> {
    let Change { before, evidence, after, .. } = change;
    let enclosed = &evidence.enclosed;
    let filled = if after.volume > 0.0 { enclosed.filled / after.volume } else { 0.0 };
    let swallowed = measured("swallowed", Some(filled), profile.max_volume_change, |share| {
        format!(
            "bodies that lay wholly in the material of others are gone, {:.1} % of the volume; if one was meant for a cavity, it is filled",
            share * 100.0
        )
    });
    let all = before.bodies + before.nested_positive;
    let gone = all.saturating_sub(after.bodies + after.nested_positive + enclosed.bodies);
    let bodies = measured("bodies", Some(gone as f64), f64::from(profile.max_bodies_lost), |gone| {
        format!("{} of {} bodies were lost", Count(gone), Count(all))
    });
    vec![volume(change, profile), swallowed, area(change, profile), outline(change, profile), bodies]
}

/// The change of the area. A patch that nothing speaks against is no change of what was there.
fn area(change: &Change<'_>, profile: &Profile) -> Measured {
    let (before, after) = (change.before.area, change.after.area);
    let share = |after: f64| (after - before) / before;
    let (all, unexplained) = (share(after), share(after - change.evidence.explained.area));
    measured("area", (before > 0.0).then_some(all.abs().min(unexplained.abs())), profile.max_area_change, |_| {
        format!("the area changed by {:.1} %, from {} to {}", all * 100.0, Short(before), Short(after))
    })
}

/// The largest move of a side of the box. Where a cavity pokes out of the box of all else, it may open that as far as it likes.
fn outline(change: &Change<'_>, profile: &Profile) -> Measured {
    let surface = change.evidence.explained.surface(change.surface);
    let most = change.after.bounds.map(|[lo, hi]| {
        let outline = change.evidence.enclosed.outline.unwrap_or(surface);
        let before_lo: [f32; 3] =
            std::array::from_fn(|k| if outline.lo[k] > surface.lo[k] { outline.lo[k].max(lo[k]) } else { surface.lo[k] });
        let before_hi: [f32; 3] =
            std::array::from_fn(|k| if outline.hi[k] < surface.hi[k] { outline.hi[k].min(hi[k]) } else { surface.hi[k] });
        let pairs = before_lo.iter().zip(lo).chain(before_hi.iter().zip(hi));
        pairs.map(|(a, b)| (f64::from(*a) - f64::from(b)).abs()).fold(0.0, f64::max)
    });
    let diagonal = surface.diagonal();
    let share = most.map(|most| if most > 0.0 { most / diagonal } else { 0.0 });
    measured("box", share, profile.max_box_change_relative, |_| {
        format!("the bounding box moved by {}", Short(most.unwrap_or(0.0)))
    })
}

/// The change of the volume. What lay in the material of others was counted twice.
fn volume(change: &Change<'_>, profile: &Profile) -> Measured {
    let Change { before, evidence, after, .. } = change;
    let enclosed = &evidence.enclosed;
    // The volume of an open or incoherent surface depends on the origin, and duplicates count twice.
    let has_volume = before.boundary_edges + before.unbalanced_edges + before.nonmanifold_edges + before.inverted_components == 0;
    let meant = if has_volume { Some(before.volume - enclosed.copied) } else { enclosed.meant };
    // Cavities that overlap count twice as well, so that a body may seem to enclose less than nothing.
    let meant = meant.filter(|meant| meant.max(meant - enclosed.volume) > 0.0);
    let once = meant.map(|meant| meant - enclosed.volume);
    let share = once.map(|once| if once > 0.0 { (after.volume - once).abs() / once } else { f64::INFINITY });
    measured("volume", share, profile.max_volume_change, |share| {
        let (twice, after) = (Short(enclosed.volume), Short(after.volume));
        match (meant, once) {
            (Some(meant), Some(once)) if once <= 0.0 => {
                let meant = Short(meant);
                format!("the file enclosed {meant}; of that, {twice} was counted twice, and the result encloses {after}")
            }
            (_, once) => {
                format!("the volume changed by {:.1} %, from {} to {after}", share * 100.0, Short(once.unwrap_or(0.0)))
            }
        }
    })
}

/// The volume that left the model of its bodies.
fn volumes(volumes: Option<&Volumes>, profile: &Profile) -> [Measured; 2] {
    let lost = volumes.map(|v| v.lost as f64);
    let outside = volumes.map(|v| if v.volume > 0.0 { v.outside / v.volume } else { 0.0 });
    let bodies = measured("bodies_outside", lost, f64::from(profile.max_bodies_lost), |lost| {
        let largest = volumes
            .and_then(|v| v.listed.first())
            .map_or(String::new(), |body| format!(", the largest {} of {} units³", span(body.bounds), Short(body.volume)));
        format!("{} of {} bodies are not inside the result{largest}", Count(lost), Count(volumes.map_or(0, |v| v.bodies)))
    });
    let volume = measured("volume_outside", outside, profile.max_volume_change, |share| {
        format!("about {:.1} % of what the bodies enclosed is outside of the result", share * 100.0)
    });
    [bodies, volume]
}

/// The cavities that are filled, unless that is asked for.
fn cavities(change: &Change<'_>, profile: &Profile) -> Measured {
    let all = change.after.volume;
    let volumes = change.volumes.filter(|_| profile.bodies != Bodies::Visible);
    let filled = volumes.map(|volumes| if all > 0.0 { volumes.filled / all } else { 0.0 });
    measured("cavities_filled", filled, profile.max_cavities_filled, |share| {
        let largest = change
            .volumes
            .and_then(|v| v.filled_listed.first())
            .map_or(String::new(), |cavity| format!(", the largest {}", span(cavity.bounds)));
        format!("cavities of {:.1} % of the volume are filled by what else lies there{largest}", share * 100.0)
    })
}

/// The surface that can be seen, and was lost or invented.
fn skin(skin: Option<&Skin>, profile: &Profile) -> [Measured; 2] {
    let words = |change: &SkinChange, what: &str, from: &str| {
        let by: Vec<&str> = change.causes.iter().take(3).map(|cause| cause.repair.doing()).collect();
        let place = change.places.first().map_or(String::new(), |place| format!(", most of it {}", span(place.bounds)));
        let share = change.share * 100.0;
        let (by, farthest) = (by.join(", "), Short(change.farthest));
        format!("{what} by {by}: {share:.2} % of the surface, up to {farthest} away from {from}{place}")
    };
    let of = |rule, change: Option<&SkinChange>, limit, what, from| {
        measured(rule, change.map(|change| change.share), limit, |_| {
            change.map_or(String::new(), |change| words(change, what, from))
        })
    };
    let (lost, invented) = (skin.map(|skin| &skin.lost), skin.map(|skin| &skin.invented));
    [
        of("skin_lost", lost, profile.max_skin_lost, "visible surface was lost", "the result"),
        of("skin_invented", invented, profile.max_skin_invented, "visible surface was invented", "all that was there"),
    ]
}

/// What was dropped of sheets: they may have been meant for walls, unless there is material all around them.
fn sheets(before: &Defects, dropped: &[SheetDropped], profile: &Profile) -> [Measured; 2] {
    let dropped: Vec<&SheetDropped> = dropped.iter().filter(|sheet| !sheet.in_material).collect();
    let share = |area: f64| if before.area > 0.0 { area / before.area } else { 0.0 };
    let all: f64 = dropped.iter().map(|sheet| sheet.area).sum();
    // Nothing tells against one that crosses nothing and is not hidden but that it is open.
    let free: f64 = dropped.iter().filter(|sheet| !sheet.crosses && !sheet.hidden).map(|sheet| sheet.area).sum();
    let largest = dropped.first().map_or(String::new(), |sheet| format!(", the largest {}", span(sheet.bounds)));
    let count = Count(dropped.len());
    let words =
        |share: f64| format!("open sheets dropped that bound nothing, {count} of {:.1} % of the area{largest}", share * 100.0);
    let of_all = measured("sheets", Some(share(all)), profile.max_sheets_share, words);
    // One line is enough.
    let is_told = !of_all.words.is_empty();
    let mut of_free = measured("free_sheets", Some(share(free)), profile.debris_area_share, |_| words(share(all)));
    of_free.words.retain(|_| !is_told);
    [of_all, of_free]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::report::SelfIntersections;

    /// The counts of a unit cube.
    fn cube() -> Defects {
        let self_intersections = Some(SelfIntersections::default());
        Defects {
            triangles: 12,
            bodies: 1,
            volume: 1.0,
            bounds: Some([[0.0; 3], [1.0; 3]]),
            self_intersections,
            ..Defects::default()
        }
    }

    /// The lines on what can be counted.
    fn counted(before: &Defects, surface: &Bounds, evidence: &Evidence, after: &Defects, profile: &Profile) -> Vec<String> {
        let change =
            Change { before, surface, evidence, after, volumes: None, skin: None, sheets: &[], wraps: &[], missing: &[] };
        counts(&change, profile).into_iter().flat_map(Measured::concerns).collect()
    }

    /// Every rule of the table is measured, and nothing else.
    #[test]
    fn each_rule_is_measured() {
        let cube = cube();
        let change = Change {
            before: &cube,
            surface: &BOX,
            evidence: &Evidence::default(),
            after: &cube,
            volumes: None,
            skin: None,
            sheets: &[],
            wraps: &[],
            missing: &[],
        };
        let rules: Vec<&str> = measure(&change, &Profile::default()).iter().map(|measured| measured.rule).collect();
        assert_eq!(rules, crate::detect::fidelity::FIDELITY_RULES.map(|rule| rule.id));
    }

    fn of(enclosed: &Enclosed) -> Evidence {
        Evidence { enclosed: enclosed.clone(), ..Evidence::default() }
    }

    #[test]
    fn what_is_explained_is_no_change() {
        let concerns = |explained: Explained, before: Defects, after: Defects, surface: Bounds| {
            let evidence = Evidence { explained, ..Evidence::default() };
            counted(&before, &surface, &evidence, &after, &Profile::default()).len()
        };
        // A flat box without top and bottom: its sides are a tenth of it.
        let (sides, whole) = (Defects { area: 1.0, ..cube() }, Defects { area: 10.0, ..cube() });
        let explained = |area: f64| Explained { area, ..Explained::default() };
        assert_eq!(concerns(explained(9.0), sides.clone(), whole.clone(), BOX), 0);
        assert_eq!(concerns(explained(7.0), sides, whole, BOX), 1, "twice as much as there was is not explained");
        // A speck beside the cube, which is gone.
        let with_speck = Bounds { hi: [9.0, 1.0, 1.0], ..BOX };
        let left = Explained { without_specks: Some(BOX), ..Explained::default() };
        assert_eq!(concerns(left, cube(), cube(), with_speck), 0);
        assert_eq!(concerns(Explained::default(), cube(), cube(), with_speck), 1);
        // A corner that stands out.
        let corner = Defects { bounds: Some([[0.0; 3], [2.0, 1.0, 1.0]]), ..cube() };
        let reached = Bounds { lo: [2.0, 1.0, 1.0], hi: [2.0, 1.0, 1.0] };
        assert_eq!(concerns(Explained { reached, ..Explained::default() }, cube(), corner.clone(), BOX), 0);
        assert_eq!(concerns(Explained::default(), cube(), corner, BOX), 1);
    }

    const BOX: Bounds = Bounds { lo: [0.0; 3], hi: [1.0; 3] };

    #[test]
    fn review_begins_beyond_the_limits() {
        let profile =
            Profile { max_volume_change: 0.25, max_box_change_relative: 0.25, max_bodies_lost: 1, ..Profile::default() };
        let concerns = |before: Defects, after: Defects| counted(&before, &BOX, &Evidence::default(), &after, &profile).len();
        // The volume may change by just a quarter either way.
        for (volume, count) in [(1.25, 0), (0.75, 0), (1.26, 1), (0.74, 1)] {
            assert_eq!(concerns(cube(), Defects { volume, ..cube() }), count, "volume {volume}");
        }
        // A quarter of the diagonal is 0.433.
        for (x, count) in [(1.43, 0), (1.44, 1), (0.57, 0), (0.56, 1)] {
            assert_eq!(concerns(cube(), Defects { bounds: Some([[0.0; 3], [x, 1.0, 1.0]]), ..cube() }), count, "side {x}");
        }
        for (bodies, nested_positive, count) in [(2, 0, 0), (1, 0, 1), (1, 1, 0)] {
            assert_eq!(concerns(Defects { bodies: 3, ..cube() }, Defects { bodies, nested_positive, ..cube() }), count);
        }
    }

    #[test]
    fn the_box_of_a_cavity_that_pokes_out_does_not_count() {
        let surface = Bounds { lo: [0.0; 3], hi: [1.0, 1.0, 2.0] };
        let outline = Some(Bounds { lo: [f32::NEG_INFINITY; 3], hi: [f32::INFINITY, f32::INFINITY, 1.0] });
        let concerns = |outline: Option<Bounds>, hi: [f32; 3]| {
            let enclosed = Enclosed { outline, ..Enclosed::default() };
            let evidence = Evidence { enclosed, ..Evidence::default() };
            let after = Defects { bounds: Some([[0.0; 3], hi]), ..cube() };
            counted(&cube(), &surface, &evidence, &after, &Profile::default()).len()
        };
        assert_eq!([concerns(None, [1.0; 3]), concerns(outline, [1.0; 3])], [1, 0]);
        // It has opened the top. Nothing has opened a side, and nothing may grow.
        assert_eq!([[1.0, 1.0, 0.5], [0.5, 1.0, 1.0], [1.0, 1.0, 1.5]].map(|hi| concerns(outline, hi)), [0, 1, 1]);
    }

    #[test]
    fn a_broken_file_is_held_against_what_it_meant_to_enclose() {
        let open = Defects { boundary_edges: 3, volume: 0.1, ..cube() };
        let concerns = |meant: f64, volume: f64| {
            let enclosed = Enclosed { meant: Some(meant), volume, ..Enclosed::default() };
            counted(&open, &BOX, &of(&enclosed), &cube(), &Profile::default()).join(" ")
        };
        assert_eq!(concerns(1.2, 0.0), "");
        assert!(concerns(3.0, 0.0).contains("66.7 %"), "{}", concerns(3.0, 0.0));
        assert_eq!(concerns(1.5, 0.5), "", "half of it counted twice");
        // A cavity that was turned into a body: the two have more in common than the file encloses.
        assert!(concerns(0.2, 0.6).contains("counted twice"));
    }

    #[test]
    fn a_large_body_in_the_material_of_another_may_be_a_cavity() {
        let before = Defects { bodies: 1, nested_positive: 1, volume: 1.3, ..cube() };
        for (filled, count) in [(0.24, 0), (0.26, 1)] {
            let enclosed = Enclosed { bodies: 1, volume: 0.3, filled, ..Enclosed::default() };
            assert_eq!(counted(&before, &BOX, &of(&enclosed), &cube(), &Profile::default()).len(), count, "{filled}");
        }
    }

    #[test]
    fn the_volume_of_what_enclosed_none_is_not_compared() {
        let open = Defects { boundary_edges: 3, volume: 0.1, ..cube() };
        assert!(counted(&open, &BOX, &Evidence::default(), &cube(), &Profile::default()).is_empty());
        let inside_out = Defects { inverted_components: 1, volume: -1.0, ..cube() };
        assert!(counted(&inside_out, &BOX, &Evidence::default(), &cube(), &Profile::default()).is_empty());
    }

    #[test]
    fn what_lay_in_others_is_neither_lost_nor_a_change_of_volume() {
        let before = Defects { bodies: 1, nested_positive: 2, volume: 1.5, ..cube() };
        let enclosed = Enclosed { bodies: 2, volume: 0.5, ..Enclosed::default() };
        let concerns = |enclosed: &Enclosed| counted(&before, &BOX, &of(enclosed), &cube(), &Profile::default());
        assert!(concerns(&enclosed).is_empty(), "{:?}", concerns(&enclosed));
        assert_eq!(concerns(&Enclosed::default()).len(), 2, "the volume, and the bodies");
    }

    #[test]
    fn the_area_may_grow_by_as_much_as_the_profile_says() {
        let profile = Profile { max_area_change: 0.25, ..Profile::default() };
        let concerns = |area: f64| {
            let before = Defects { area: 6.0, ..cube() };
            counted(&before, &BOX, &Evidence::default(), &Defects { area, ..cube() }, &profile).len()
        };
        assert_eq!([7.5, 7.6, 4.5, 4.4].map(concerns), [0, 1, 0, 1]);
    }

    #[test]
    fn bodies_that_left_the_model_need_review() {
        let profile = Profile { max_volume_change: 0.25, max_bodies_lost: 1, ..Profile::default() };
        let concerns = |lost: u64, outside: f64| {
            let all = Volumes { bodies: 9, points: 9, volume: 4.0, outside, lost, ..Volumes::default() };
            volumes(Some(&all), &profile).into_iter().flat_map(Measured::concerns).count()
        };
        assert_eq!([concerns(0, 0.0), concerns(1, 1.0), concerns(2, 1.0), concerns(0, 1.01)], [0, 0, 1, 1]);
    }

    #[test]
    fn dropped_sheets_need_review_beyond_a_share_of_the_area() {
        let before = Defects { area: 600.0, ..cube() };
        let dropped = |area: f64, crosses: bool| {
            let sheet =
                SheetDropped { bounds: [[0.0; 3], [1.0; 3]], area, triangles: 2, crosses, hidden: false, in_material: false };
            let profile = Profile { max_sheets_share: 0.25, debris_area_share: 0.125, ..Profile::default() };
            sheets(&before, &[sheet.clone(), sheet], &profile).into_iter().flat_map(Measured::concerns).next()
        };
        let concern = |area: f64| dropped(area, true);
        assert_eq!(concern(75.0), None);
        assert_eq!(dropped(37.5, false), None, "next to nothing");
        assert!(dropped(37.6, false).is_some(), "it crosses nothing");
        assert!(concern(75.1).is_some_and(|words| words.contains("2 of 25.0 %")));
        assert!(sheets(&before, &[], &Profile::default()).into_iter().all(|measured| measured.concerns().is_empty()));
    }
}
