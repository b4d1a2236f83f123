//! The simulated world: clocks that go when they are told to, a disk that is full when it is wanted to be, and workers that are none.

use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use suture_store::{Boot, Clock, Time};

use super::stage;
use crate::fence::Fence;
use crate::protocol::Request;
use crate::supervise::Ended;
use crate::world::{Hand, Share, Telling, World};

/// Summer time as in the middle of Europe.
const ZONE: &str = "CET-1CEST,M3.5.0,M10.5.0/3";
/// Room on a disk that is not full.
const ROOM: u64 = 1 << 40;

/// The simulated world.
pub(super) struct Sky(Mutex<State>);

struct State {
    zone: TimeZone,
    began: Instant,
    passed: Duration,
    /// What the clock on the wall shows, in milliseconds since 1970.
    wall: u64,
    /// When the daemon's present life began.
    born: Duration,
    boot: u64,
    full: bool,
    /// Since when it has been full, or has not.
    since: Duration,
    /// When the clock on the wall jumped last, by more than a minute.
    jumped: Option<Duration>,
    /// So many workers cannot be started.
    strikes: u32,
}

impl Sky {
    /// One whose clock on the wall shows `wall`, such as `2099-10-22T18:00:00`.
    pub(super) fn new(wall: &str) -> Arc<Self> {
        let zone = TimeZone::posix(ZONE).unwrap();
        let civil: jiff::civil::DateTime = wall.parse().unwrap();
        let wall = civil.to_zoned(zone.clone()).unwrap().timestamp().as_millisecond() as u64;
        let (began, passed, born, since) = (Instant::now(), Duration::ZERO, Duration::ZERO, Duration::ZERO);
        Arc::new(Self(Mutex::new(State {
            zone,
            began,
            passed,
            wall,
            born,
            boot: 1,
            full: false,
            since,
            jumped: None,
            strikes: 0,
        })))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }

    /// Time goes by.
    pub(super) fn pass(&self, time: Duration) {
        let mut state = self.state();
        state.passed += time;
        state.wall += time.as_millis() as u64;
    }

    /// How much has gone by since the beginning.
    pub(super) fn passed(&self) -> Duration {
        self.state().passed
    }

    /// Someone sets the clock on the wall, by so many milliseconds.
    pub(super) fn jump(&self, ms: i64) {
        let mut state = self.state();
        state.wall = state.wall.saturating_add_signed(ms);
        if ms.abs() > 60_000 {
            state.jumped = Some(state.passed);
        }
    }

    /// Another life of the daemon begins; of the machine, too?
    pub(super) fn begin_life(&self, reboot: bool) {
        let mut state = self.state();
        state.born = state.passed;
        state.boot += u64::from(reboot);
    }

    pub(super) fn set_full(&self, full: bool) {
        let mut state = self.state();
        if state.full != full {
            (state.full, state.since) = (full, state.passed);
        }
    }

    pub(super) fn is_full(&self) -> bool {
        self.state().full
    }

    /// For how long the disk has been full; `None`: it is not.
    pub(super) fn full_for(&self) -> Option<Duration> {
        let state = self.state();
        state.full.then(|| state.passed - state.since)
    }

    /// For how long the clock on the wall has gone steadily.
    pub(super) fn steady_for(&self) -> Duration {
        let state = self.state();
        state.passed - state.jumped.unwrap_or_default()
    }

    /// The next workers cannot be started.
    pub(super) fn strike(&self, strikes: u32) {
        self.state().strikes = strikes;
    }
}

impl Clock for Sky {
    fn now(&self) -> Time {
        Time(self.state().wall)
    }

    fn boot(&self) -> Boot {
        Boot(self.state().boot)
    }

    fn ticks(&self) -> u64 {
        let state = self.state();
        (state.passed - state.born).as_millis() as u64
    }
}

impl World for Sky {
    fn steady(&self) -> Instant {
        let state = self.state();
        state.began + state.passed
    }

    fn wall(&self) -> Time {
        self.now()
    }

    fn local(&self) -> Zoned {
        let state = self.state();
        Timestamp::from_millisecond(state.wall as i64).unwrap().to_zoned(state.zone.clone())
    }

    fn hire(&self, share: Share, _: &Fence) -> io::Result<Box<dyn Hand>> {
        let mut state = self.state();
        if state.strikes > 0 {
            state.strikes -= 1;
            return Err(io::ErrorKind::WouldBlock.into());
        }
        Ok(Box::new(Puppet(share)))
    }

    fn room(&self, _: &Path, _: u64) -> u64 {
        if self.is_full() { 0 } else { ROOM }
    }

    fn tells_of(&self, _: &Path) -> bool {
        false
    }
}

/// A worker that does what the simulation wants.
struct Puppet(Share);

impl Hand for Puppet {
    fn pid(&self) -> u32 {
        0
    }

    fn is_alive(&mut self) -> bool {
        true
    }

    fn run(&mut self, request: &Request, limit: Duration, stop: &dyn Fn() -> bool, _: Telling<'_>) -> Ended {
        stage::current().work(self.0, request, limit, stop)
    }
}

#[test]
fn summer_time_ends_on_the_wall_only() {
    let sky = Sky::new("2099-10-25T01:30:00");
    let hour = |sky: &Sky| (sky.local().hour(), sky.local().minute());
    let shown: Vec<_> = (0..4)
        .map(|_| {
            sky.pass(Duration::from_secs(3600));
            hour(&sky)
        })
        .collect();
    assert_eq!(shown, [(2, 30), (2, 30), (3, 30), (4, 30)]);
    assert_eq!(sky.ticks(), 4 * 3_600_000);
}
