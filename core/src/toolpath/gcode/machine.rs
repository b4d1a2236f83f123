//! The state of the machine: modes, offsets, position.

use super::fault::{Fault, refused};
use crate::toolpath::model::Plane;
use crate::toolpath::options::Rotary;
use crate::toolpath::vector::{Point, add, sub};

/// Work coordinate systems: nine, and 300 of `G54.1`.
const SYSTEMS: usize = 309;

/// The motion that lines without a code of their own continue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum Motion {
    /// After `G80`.
    #[default]
    None,
    Rapid,
    Feed,
    /// `G2`, clockwise.
    Clockwise,
    /// `G3`.
    Counter,
    /// `G5`.
    Cubic,
    /// `G5.1`.
    Quadratic,
    /// `G5.2` until `G5.3`.
    Nurbs,
    /// `G6.2`.
    Knotted,
    /// `G33.1`: down and back at the speed of the spindle.
    Tap,
    /// `G73`, `G74`, `G81` to `G89`.
    Cycle(u16),
}

/// How a modal state is saved by `M70`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modes {
    pub(super) motion: Motion,
    pub(super) plane: Plane,
    pub(super) is_absolute: bool,
    pub(super) is_arc_absolute: bool,
    /// Millimetres in a unit of the program.
    pub(super) unit: f64,
    /// In millimetres a minute, or as it is with `G93`.
    pub(super) feed: f64,
    pub(super) is_inverse_time: bool,
    /// `G98`: cycles return to where they began, not to R.
    pub(super) is_initial_return: bool,
    /// The number of the work coordinate system, from 0.
    pub(super) system: usize,
    /// `G16`.
    pub(super) is_polar: bool,
}

/// `G51`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scaling {
    pub(super) centre: Point,
    pub(super) by: Point,
}

/// `G68`, in the plane X Y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rotation {
    pub(super) centre: Point,
    pub(super) sin: f64,
    pub(super) cos: f64,
}

/// The machine.
#[derive(Debug)]
pub(super) struct Machine {
    pub(super) modes: Modes,
    pub(super) saved: Vec<Modes>,
    /// Where the tool is, as the program would write it, in millimetres.
    pub(super) position: Point,
    /// Where the tool is.
    pub(super) place: Point,
    /// Which axes stand where the program says.
    pub(super) known: [bool; 3],
    pub(super) offsets: Vec<Point>,
    /// Degrees by which a system is turned (`G10 L2 R`).
    pub(super) turned: Vec<f64>,
    pub(super) offset_92: Point,
    pub(super) is_92_on: bool,
    pub(super) offset_52: Point,
    pub(super) scaling: Option<Scaling>,
    pub(super) rotation: Option<Rotation>,
    pub(super) speed: f64,
    /// A, B, C in degrees, and the direction of the tool that they make.
    pub(super) angles: Point,
    pub(super) axis: Point,
    pub(super) home: [Point; 2],
}

impl Machine {
    pub(super) fn new(unit: f64, is_initial_return: bool) -> Self {
        let modes = Modes {
            motion: Motion::None,
            plane: Plane::Xy,
            is_absolute: true,
            is_arc_absolute: false,
            unit,
            feed: 0.0,
            is_inverse_time: false,
            is_initial_return,
            system: 0,
            is_polar: false,
        };
        Self {
            modes,
            saved: Vec::new(),
            position: [0.0; 3],
            place: [0.0; 3],
            known: [false; 3],
            offsets: vec![[0.0; 3]; SYSTEMS],
            turned: vec![0.0; SYSTEMS],
            offset_92: [0.0; 3],
            is_92_on: true,
            offset_52: [0.0; 3],
            scaling: None,
            rotation: None,
            speed: 0.0,
            angles: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            home: [[0.0; 3]; 2],
        }
    }

    /// After a change of angles: the direction of the tool.
    pub(super) fn point_tool(&mut self, rotary: Rotary) {
        let sign = if rotary == Rotary::Head { 1.0 } else { -1.0 };
        let [a, b, c] = self.angles.map(|angle| (sign * angle).to_radians().sin_cos());
        let [x, y, z] = [0.0, -a.0, a.1];
        let [x, z] = [x * b.1 + z * b.0, z * b.1 - x * b.0];
        self.axis = [x * c.1 - y * c.0, x * c.0 + y * c.1, z];
    }

    fn shift(&self) -> Point {
        let offset_92 = if self.is_92_on { self.offset_92 } else { [0.0; 3] };
        add(offset_92, self.offset_52)
    }

    fn turn(&self, backwards: bool) -> Option<(f64, f64)> {
        let degrees = self.turned[self.modes.system];
        (degrees != 0.0).then(|| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            (if backwards { -sin } else { sin }, cos)
        })
    }

    /// Where a point of the program is.
    pub(super) fn forward(&self, mut point: Point) -> Point {
        if let Some(Scaling { centre, by }) = self.scaling {
            point = std::array::from_fn(|axis| centre[axis] + (point[axis] - centre[axis]) * by[axis]);
        }
        if let Some(Rotation { centre, sin, cos }) = self.rotation {
            point = add(centre, rotate(sub(point, centre), sin, cos));
        }
        point = add(point, self.shift());
        if let Some((sin, cos)) = self.turn(false) {
            point = rotate(point, sin, cos);
        }
        add(point, self.offsets[self.modes.system])
    }

    /// How the program would write a place.
    pub(super) fn backward(&self, mut place: Point) -> Point {
        place = sub(place, self.offsets[self.modes.system]);
        if let Some((sin, cos)) = self.turn(true) {
            place = rotate(place, sin, cos);
        }
        place = sub(place, self.shift());
        if let Some(Rotation { centre, sin, cos }) = self.rotation {
            place = add(centre, rotate(sub(place, centre), -sin, cos));
        }
        if let Some(Scaling { centre, by }) = self.scaling {
            place = std::array::from_fn(|axis| centre[axis] + (place[axis] - centre[axis]) / by[axis]);
        }
        place
    }

    /// Where the program's zero is.
    pub(super) fn zero(&self) -> Point {
        add(self.shift(), self.offsets[self.modes.system])
    }

    /// After a change of offsets: the tool stays, its coordinates change.
    pub(super) fn moved(&mut self) {
        self.position = self.backward(self.place);
    }

    /// Whether an arc of a plane stays an arc; whether it turns the other way.
    pub(super) fn arc_flips(&self, plane: Plane) -> Result<bool, Fault> {
        let is_turned = self.rotation.is_some_and(|rotation| rotation.sin != 0.0) || self.turned[self.modes.system] != 0.0;
        if is_turned && plane != Plane::Xy {
            return refused("an arc outside of the plane X Y in a rotated system is not done");
        }
        let Some(Scaling { by, .. }) = self.scaling else { return Ok(false) };
        let [a, b, _] = plane.axes();
        if (by[a].abs() - by[b].abs()).abs() > 1e-9 {
            return refused("an arc that is scaled differently along its axes (G51) is not done");
        }
        Ok((by[a] < 0.0) != (by[b] < 0.0))
    }
}

fn rotate(point: Point, sin: f64, cos: f64) -> Point {
    [point[0] * cos - point[1] * sin, point[0] * sin + point[1] * cos, point[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All transformations at once, there and back.
    #[test]
    fn backward_undoes_forward() {
        let mut machine = Machine::new(1.0, false);
        machine.offsets[0] = [10.0, 20.0, 30.0];
        machine.turned[0] = 30.0;
        machine.offset_92 = [1.0, 2.0, 3.0];
        machine.offset_52 = [-4.0, 0.5, 0.0];
        machine.scaling = Some(Scaling { centre: [1.0, 1.0, 0.0], by: [2.0, 2.0, -1.0] });
        machine.rotation = Some(Rotation { centre: [5.0, 0.0, 0.0], sin: 0.6, cos: 0.8 });
        let point = [7.0, -3.0, 11.0];
        let back = machine.backward(machine.forward(point));
        assert!(sub(point, back).into_iter().all(|difference| difference.abs() < 1e-12));
        assert_eq!(machine.arc_flips(Plane::Xy), Ok(false));
    }
}
