//! Parameters of programs: `#1`, `#<name>`, `#<_name>`.

use super::fault::{Fault, refused};
use std::collections::BTreeMap;

/// Numbers of parameters, at most; Mach has the most with 10,320.
const NUMBER_MOST: f64 = 65_535.0;
/// Parameters that each call has for itself.
const LOCALS: usize = 30;

/// Values that a program may ask of the machine, in its own units.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct System {
    pub(super) position: [f64; 3],
    pub(super) offset_92: [f64; 3],
    pub(super) offsets: [[f64; 3]; 9],
    pub(super) system: usize,
    pub(super) tool: u32,
    pub(super) selected: u32,
    pub(super) diameter: f64,
    pub(super) feed: f64,
    pub(super) speed: f64,
    pub(super) plane: f64,
    pub(super) is_metric: bool,
    pub(super) is_absolute: bool,
    pub(super) line: u64,
}

/// Parameters of a call.
#[derive(Clone, Debug, Default)]
struct Frame {
    numbered: [f64; LOCALS],
    named: BTreeMap<Vec<u8>, f64>,
}

/// All parameters.
#[derive(Debug)]
pub(super) struct Parameters {
    frames: Vec<Frame>,
    numbered: BTreeMap<u32, f64>,
    global: BTreeMap<Vec<u8>, f64>,
    pub(super) system: System,
    /// The value that the last subprogram returned.
    pub(super) returned: Option<f64>,
}

impl Default for Parameters {
    fn default() -> Self {
        let (numbered, global, system) = (BTreeMap::new(), BTreeMap::new(), System::default());
        Self { frames: vec![Frame::default()], numbered, global, system, returned: None }
    }
}

fn truth(is: bool) -> f64 {
    f64::from(u8::from(is))
}

impl Parameters {
    /// Enters a subprogram with its arguments.
    pub(super) fn enter(&mut self, arguments: &[f64]) {
        let mut frame = Frame::default();
        frame.numbered.iter_mut().zip(arguments).for_each(|(parameter, argument)| *parameter = *argument);
        self.frames.push(frame);
    }

    /// Enters a subprogram that shares its parameters with the caller, as those of `M98` do.
    pub(super) fn share(&mut self) {
        let frame = self.frames.last().cloned().unwrap_or_default();
        self.frames.push(frame);
    }

    /// Leaves a subprogram; what is shared goes back to the caller.
    pub(super) fn leave(&mut self, is_shared: bool) {
        if self.frames.len() > 1 {
            let frame = self.frames.pop();
            if let (true, Some(frame), Some(last)) = (is_shared, frame, self.frames.last_mut()) {
                *last = frame;
            }
        }
    }

    /// A numbered one; 0 if it was never set.
    pub(super) fn numbered(&self, number: f64) -> Result<f64, Fault> {
        let index = index(number)?;
        let frame = self.frames.last().map(|frame| &frame.numbered);
        if let Some(value) = (index as usize).checked_sub(1).and_then(|local| frame?.get(local)) {
            return Ok(*value);
        }
        let system = &self.system;
        let value = match index {
            5211..=5213 => system.offset_92[index as usize - 5211],
            5220 => system.system as f64 + 1.0,
            5221..=5390 if (index - 5221) % 20 < 3 => {
                let (number, axis) = ((index as usize - 5221) / 20, (index as usize - 5221) % 20);
                system.offsets.get(number).map_or(0.0, |offset| offset[axis])
            }
            5400 => f64::from(system.tool),
            5410 => system.diameter,
            5420..=5422 => system.position[index as usize - 5420],
            _ => self.numbered.get(&index).copied().unwrap_or(0.0),
        };
        Ok(value)
    }

    pub(super) fn set_numbered(&mut self, number: f64, value: f64) -> Result<(), Fault> {
        let index = index(number)?;
        let frame = self.frames.last_mut().map(|frame| &mut frame.numbered);
        match (index as usize).checked_sub(1).and_then(|local| frame?.get_mut(local)) {
            Some(parameter) => *parameter = value,
            None => drop(self.numbered.insert(index, value)),
        }
        Ok(())
    }

    /// A named one; those with an underscore are global, and some of them the machine's.
    pub(super) fn named(&self, name: &[u8]) -> Option<f64> {
        let local = self.frames.last().and_then(|frame| frame.named.get(name));
        if let Some(value) = local.or_else(|| self.global.get(name)) {
            return Some(*value);
        }
        let system = &self.system;
        Some(match name {
            b"_x" => system.position[0],
            b"_y" => system.position[1],
            b"_z" => system.position[2],
            b"_a" | b"_b" | b"_c" | b"_u" | b"_v" | b"_w" | b"_task" | b"_remap_level" | b"_lathe_radius_mode" => 0.0,
            b"_metric" => truth(system.is_metric),
            b"_imperial" => truth(!system.is_metric),
            b"_absolute" => truth(system.is_absolute),
            b"_incremental" => truth(!system.is_absolute),
            b"_feed" => system.feed,
            b"_rpm" => system.speed,
            b"_plane" => system.plane,
            b"_current_tool" => f64::from(system.tool),
            b"_selected_tool" => f64::from(system.selected),
            b"_coord_system" => 540.0 + 10.0 * system.system as f64,
            b"_line" => system.line as f64,
            b"_call_level" => self.frames.len() as f64 - 1.0,
            b"_vmajor" => 2.0,
            b"_vminor" => 9.0,
            b"_value" => self.returned.unwrap_or(0.0),
            b"_value_returned" => truth(self.returned.is_some()),
            _ => return None,
        })
    }

    pub(super) fn set_named(&mut self, name: &[u8], value: f64) {
        if name.starts_with(b"_") {
            self.global.insert(name.to_vec(), value);
        } else if let Some(frame) = self.frames.last_mut() {
            frame.named.insert(name.to_vec(), value);
        }
    }
}

fn index(number: f64) -> Result<u32, Fault> {
    let whole = number.round();
    if (number - whole).abs() < 1e-4 && (0.0..=NUMBER_MOST).contains(&whole) {
        Ok(whole as u32)
    } else {
        refused(format!("#{number} is no parameter"))
    }
}
