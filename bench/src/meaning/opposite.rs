//! The walls between two holes of one outline are missing: of a bore, or of a pin.

use super::draft::{Draft, Entry};
use super::mesh::Mesh;
use super::random::Chance;
use super::shapes::{LOWER, Outline, P, UPPER, cuboid, rectangle, regular, star};

pub(super) const FAMILIES: [Entry; 2] = [
    ("bore-walls-lost", "a plate whose bores, slots or windows have lost their walls", false, bores),
    ("pin-walls-lost", "two plates with pins between them, which have lost their walls", false, pins),
];

/// A shape of about this radius, at a place.
fn section(chance: &mut Chance, radius: f64, at: P) -> Outline {
    match chance.count(0, 3) {
        0 => regular(chance.count(16, 40)).placed(radius, at),
        1 => regular(chance.count(3, 8)).placed(radius, at),
        2 => star(chance.count(4, 7), 0.6).placed(radius, at),
        _ => rectangle(1.8 * radius, chance.from(0.8, 1.6) * radius).placed(1.0, at),
    }
}

/// Up to three shapes side by side on a plate of 40 by 20.
fn sections(chance: &mut Chance) -> Vec<Outline> {
    let count = chance.count(1, 3);
    let place = |k: usize| 36.0 * ((k as f64 + 0.5) / count as f64 - 0.5);
    (0..count)
        .map(|k| {
            let (radius, beside) = (chance.from(2.5, 5.0), chance.from(-3.0, 3.0));
            section(chance, radius, [place(k), beside])
        })
        .collect()
}

/// The plate with holes of these shapes.
fn holed(sections: &[Outline]) -> Outline {
    sections.iter().fold(rectangle(40.0, 20.0), |plate, hole| plate.without(hole))
}

fn bores(chance: &mut Chance) -> Draft {
    let (sections, high) = (sections(chance), chance.from(2.0, 18.0));
    let plate = holed(&sections);
    let sides = rectangle(40.0, 20.0).walls(0.0, high);
    let damaged = plate.end(0.0, LOWER).turned().and(&plate.end(high, UPPER)).and(&sides);
    Draft::of(damaged, plate.prism(0.0, high)).within(0.01)
}

/// A plate from one height to another, with holes in its upper end.
fn footed(plate: &Outline, low: f64, high: f64) -> Mesh {
    cuboid([-20.0, -10.0, low], [20.0, 10.0, high]).only(|face| face.part != 5).and(&plate.end(high, 5))
}

fn pins(chance: &mut Chance) -> Draft {
    let (sections, apart) = (sections(chance), chance.from(4.0, 20.0));
    let (thick, over) = (chance.from(1.5, 4.0), chance.from(1.5, 4.0));
    let plate = holed(&sections);
    let lower = footed(&plate, -thick, 0.0);
    let upper = footed(&plate, -over, 0.0).map(|[x, y, z]| [x, y, apart - z]).turned();
    let damaged = lower.and(&upper);
    let walls = sections.iter().fold(Mesh(Vec::new()), |all, section| all.and(&section.walls(0.0, apart)));
    Draft::of(damaged.clone(), damaged.and(&walls)).within(0.01)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_meant_is_what_is_drawn() {
        for seed in 0..20 {
            let of_bores = bores(&mut Chance::new(seed, 0)).intended.volume();
            let of_pins = pins(&mut Chance::new(seed, 0)).intended.volume();
            assert!(of_bores > 0.5 * 800.0 && of_bores < 800.0 * 18.0, "{of_bores}");
            assert!(of_pins > 800.0 * 3.0, "{of_pins}");
        }
    }
}
