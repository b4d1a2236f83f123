//! Milling tools.

/// The seven parameters of APT's `CUTTER` statement; lengths in millimetres, angles in degrees.
///
/// The outline, from the tip outwards: a line from the axis at `alpha` below the level, an arc of radius `corner` around the
/// point that is `e` from the axis and `f` above the tip, and a flank that leans outwards from the axis by `beta`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutter {
    /// Diameter, as if the corner were sharp, or of the shank.
    pub diameter: f64,
    /// Radius of the corner.
    pub corner: f64,
    /// From the axis to the centre of the corner.
    pub e: f64,
    /// From the tip to the centre of the corner, along the axis.
    pub f: f64,
    /// Between the lower end and a plane at right angles to the axis.
    pub alpha: f64,
    /// Between the flank and the axis.
    pub beta: f64,
    /// Height of the tool.
    pub height: f64,
}

/// The form of what cuts; lengths in millimetres, angles in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A cylinder, flat below.
    Flat,
    /// A cylinder with half a ball below.
    Ball,
    /// A cylinder with a rounded corner.
    BullNose {
        /// Radius of the corner.
        corner: f64,
    },
    /// A cone up to the diameter, then a cylinder.
    Taper {
        /// Diameter of the flat tip; 0 of a point.
        tip: f64,
        /// Between the flank and the axis.
        angle: f64,
    },
    /// A drill.
    Drill {
        /// Between the two sides of its point; 118° if nothing is known.
        angle: f64,
    },
    /// A shape that APT's seven parameters describe and that none of the others is.
    General(Cutter),
}

/// A tool.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Tool {
    /// As the program calls it.
    pub number: u32,
    /// The form of its cutting part.
    pub shape: Shape,
    /// Of the cylinder, in millimetres.
    pub diameter: f64,
    /// Of what cuts, in millimetres; infinite if unknown.
    pub length: f64,
    /// Where it is described: line of the file; 0 if elsewhere.
    pub line: u64,
    /// Whether its shape is a guess, because only its diameter is told.
    pub is_guess: bool,
}

impl Tool {
    /// A tool of unknown length.
    #[must_use]
    pub fn new(number: u32, shape: Shape, diameter: f64) -> Self {
        Self { number, shape, diameter, length: f64::INFINITY, line: 0, is_guess: false }
    }

    /// A tool of seven parameters; a simpler shape if they are one.
    #[must_use]
    pub fn from_cutter(number: u32, cutter: Cutter) -> Self {
        let Cutter { diameter, corner, e, f, alpha, beta, height } = cutter;
        let radius = 0.5 * diameter;
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * radius.abs().max(1e-9);
        let is_centred = near(e, radius - corner) || (e == 0.0 && (f == 0.0 || near(f, corner)));
        let shape = if alpha == 0.0 && beta == 0.0 && is_centred && near(corner, radius) {
            Shape::Ball
        } else if alpha == 0.0 && beta == 0.0 && corner == 0.0 && is_centred {
            Shape::Flat
        } else if alpha == 0.0 && beta == 0.0 && is_centred && corner > 0.0 && corner < radius {
            Shape::BullNose { corner }
        } else if alpha > 0.0 && alpha < 90.0 && beta == 0.0 && corner == 0.0 {
            Shape::Drill { angle: 180.0 - 2.0 * alpha }
        } else {
            Shape::General(cutter)
        };
        let length = if height > 0.0 { height } else { f64::INFINITY };
        Self { length, ..Self::new(number, shape, diameter) }
    }

    /// Its seven parameters.
    #[must_use]
    pub fn cutter(&self) -> Cutter {
        let radius = 0.5 * self.diameter;
        let flat = Cutter { diameter: self.diameter, corner: 0.0, e: radius, f: 0.0, alpha: 0.0, beta: 0.0, height: self.length };
        match self.shape {
            Shape::Flat => flat,
            Shape::Ball => Cutter { corner: radius, e: 0.0, f: radius, ..flat },
            Shape::BullNose { corner } => Cutter { corner, e: radius - corner, f: corner, ..flat },
            Shape::Taper { tip, angle } => Cutter { diameter: tip, e: 0.5 * tip, beta: angle, ..flat },
            Shape::Drill { angle } => {
                let alpha = 90.0 - 0.5 * angle;
                Cutter { alpha, f: radius * alpha.to_radians().tan(), ..flat }
            }
            Shape::General(cutter) => cutter,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each simple shape survives its seven parameters.
    #[test]
    fn shapes_and_parameters_agree() {
        for shape in [Shape::Flat, Shape::Ball, Shape::BullNose { corner: 1.0 }, Shape::Drill { angle: 118.0 }] {
            let tool = Tool::new(3, shape, 6.0);
            assert_eq!(Tool::from_cutter(3, tool.cutter()), tool);
        }
        let disc = Cutter { diameter: 22.918, corner: 0.1, e: 0.0, f: 0.1, alpha: 0.0, beta: -89.0, height: 0.2 };
        assert_eq!(Tool::from_cutter(0, disc).shape, Shape::General(disc));
    }
}
