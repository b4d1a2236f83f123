//! One life of the simulated daemon: its parts are those of the product, and each does one step when it is told to.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use clap::Parser;
use crossbeam::channel::unbounded;
use suture_store::{JobStore, SledStore};

use super::plan::Place;
use super::sky::Sky;
use crate::attempt::{Context, Slot};
use crate::cli::{Cli, Command};
use crate::event_bus::Bus;
use crate::event_store::Heard;
use crate::folder::Folder;
use crate::keeper::Keeper;
use crate::past::Unread;
use crate::pulse::Pulse;
use crate::retention::sweep::Sweeper;
use crate::schedule::Schedule;
use crate::settings::Settings;
use crate::signals::{Hangup, Stop};
use crate::watch::{look_for_pause, moment, recover, sweeper};
use crate::world::World;

type Slots = RefCell<Vec<Rc<RefCell<Slot>>>>;

/// A daemon.
pub(super) struct Life {
    keeper: RefCell<Keeper>,
    slots: Slots,
    sweeper: RefCell<Sweeper>,
    hangup: Hangup,
    pub context: Arc<Context>,
}

impl Life {
    /// Begins as the product does: folders, store, recovery, keeper.
    pub(super) fn begin(sky: &Arc<Sky>, place: &Place) -> Self {
        let config = place.config();
        let words = ["suture", "watch", "--config", config.to_str().unwrap()];
        let Command::Watch(args) = Cli::parse_from(words).command else { panic!("it is `watch`") };
        let hangup = Hangup::default();
        let settings = Arc::new(Settings::of(&args, hangup.clone()).unwrap());
        let config = settings.now();
        let folders: Vec<_> = config.folders.iter().map(|folder| Arc::new(Folder::open(folder, None).unwrap())).collect();
        let store = SledStore::open_with(&config.state, Arc::<Sky>::clone(sky)).unwrap();
        let unread = Unread::of(&store, &folders).unwrap();
        let bus = Arc::new(Bus::new(false));
        let (events, inbox) = unbounded();
        let world: Arc<dyn World> = Arc::<Sky>::clone(sky);
        let context = Arc::new(Context {
            schedule: Schedule::new(Arc::clone(&world)),
            world,
            store: Arc::new(Heard::new(Arc::new(store), Arc::clone(&bus))),
            folders,
            settings,
            events,
            once: false,
            halt: false.into(),
            not_good: Arc::default(),
            away: Mutex::default(),
            full: Mutex::default(),
            unread,
            pulse: Pulse::new(),
            bus,
            failed: Mutex::new(None),
        });
        recover(&context).unwrap();
        let keeper = RefCell::new(Keeper::new(&context, inbox, &Stop::default()));
        look_for_pause(&context);
        let life = Self { keeper, slots: RefCell::default(), sweeper: RefCell::new(sweeper(&context)), hangup, context };
        life.keeper.borrow_mut().begin(&|workers| life.raise(workers)).unwrap();
        life
    }

    fn raise(&self, workers: usize) -> Result<(), suture_store::StoreError> {
        let mut slots = self.slots.borrow_mut();
        while slots.len() < workers {
            slots.push(Rc::new(RefCell::new(Slot::new(&self.context))));
        }
        Ok(())
    }

    pub(super) fn store(&self) -> &dyn JobStore {
        &*self.context.store
    }

    /// The keeper hears what happened, and looks at everything.
    pub(super) fn keep(&self) {
        let mut keeper = self.keeper.borrow_mut();
        keeper.listen(Duration::ZERO);
        keeper.pass(&|workers| self.raise(workers)).unwrap();
        let failed = self.context.failed.lock().unwrap();
        assert!(failed.is_none(), "the store failed: {failed:?}");
    }

    /// The sweeper looks whether it is its turn.
    pub(super) fn sweep(&self) {
        self.sweeper.borrow_mut().look(moment(&self.context), &|| false).unwrap();
    }

    /// A slot that is not at work has a turn, if there is one; returns whether there was.
    pub(super) fn work(&self) -> bool {
        let slots = self.slots.borrow().clone();
        let free = slots.iter().find_map(|slot| slot.try_borrow_mut().ok());
        free.is_some_and(|mut slot| slot.try_turn())
    }

    /// The configuration is to be read anew.
    pub(super) fn reload(&self) {
        self.hangup.raise();
    }
}
