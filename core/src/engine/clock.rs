//! What is spent by stage while a mesh is worked on.

use std::path::Path;
use std::time::Instant;

use crate::contract::error::Result;
use crate::contract::finite;
use crate::contract::report::{Cost, Report, Stage};
use crate::util::cost;
use crate::util::peak::Peak;

/// Runs from the beginning of the work on a mesh to its report.
pub(crate) struct Clock {
    start: Instant,
    lap: Instant,
    cpu_seconds_before: f64,
    stages: Vec<Stage>,
    peak: Peak,
}

impl Clock {
    pub(crate) fn start() -> Self {
        let now = Instant::now();
        Self { start: now, lap: now, cpu_seconds_before: cost::cpu_seconds(), stages: Vec::new(), peak: Peak::begin() }
    }

    /// Ends the stage that ran until now.
    pub(crate) fn stage(&mut self, name: &str) {
        let seconds = self.lap.elapsed().as_secs_f64();
        self.lap = Instant::now();
        self.peak.look();
        tracing::debug!(stage = name, seconds, "Stage done.");
        match self.stages.iter_mut().find(|stage| stage.name == name) {
            Some(stage) => stage.seconds += seconds,
            None => self.stages.push(Stage { name: name.into(), seconds }),
        }
    }

    /// Puts what was spent on a mesh of so many triangles into its report, which is complete then and can be told to anyone.
    pub(crate) fn close(self, mut report: Report, path: &Path, triangles: usize) -> Result<Report> {
        report.cost = self.cost(triangles as u64);
        report.stages = self.stages;
        finite::checked(path, report)
    }

    fn cost(&self, triangles: u64) -> Cost {
        let wall_seconds = self.start.elapsed().as_secs_f64();
        Cost {
            wall_seconds,
            cpu_seconds: cost::cpu_seconds() - self.cpu_seconds_before,
            triangles_per_second: triangles as f64 / wall_seconds.max(1e-9),
            peak_resident_bytes: cost::peak_resident_bytes(),
            peak_anonymous_bytes: self.peak.bytes(),
        }
    }
}
