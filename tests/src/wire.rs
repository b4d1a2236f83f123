//! A network of a test's own. Each host is a network namespace with one wire, which ends in this process: it carries packets from host to host, and
//! loses them or holds them back as the test says. Nothing of the machine's own network is touched, and all is gone with the process. Needs root.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{Read, Write};
use std::net::Ipv4Addr;
use std::os::fd::{AsFd, AsRawFd};
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

use rustix::thread::{LinkNameSpaceType, move_into_link_name_space};

/// Packets are no larger: far fewer go than over a cable.
const LARGEST: usize = 60_000;
/// Addresses are `10.77.0.N`, from 1.
const NET: [u8; 3] = [10, 77, 0];

/// A packet that is held back: until when, its number, the host it is for.
type Held = Reverse<(Instant, u64, usize, Vec<u8>)>;

/// The network.
pub struct Net {
    switch: Arc<Switch>,
}

/// A machine on it.
pub struct Host {
    namespace: File,
    wire: Arc<Wire>,
    /// Where others reach it.
    pub address: Ipv4Addr,
}

struct Wire {
    tun: File,
    is_cut: AtomicBool,
    delay_ms: AtomicU64,
}

struct Switch {
    wires: RwLock<Vec<Arc<Wire>>>,
    late: Sender<(Instant, usize, Vec<u8>)>,
}

impl Net {
    /// `None`, and a line: this user, or this kernel, makes none.
    pub fn new() -> Option<Self> {
        let made = std::thread::spawn(|| namespace().and_then(|_| tun().map(drop))).join();
        if let Err(error) = made.expect("it does not panic") {
            println!("skipped: no network of one's own can be made here: {error}");
            return None;
        }
        let (late, held) = channel();
        let switch = Arc::new(Switch { wires: RwLock::default(), late });
        let of_late = Arc::downgrade(&switch);
        std::thread::spawn(move || {
            hold(&held, |to, packet| {
                if let Some(switch) = of_late.upgrade() {
                    switch.deliver(to, packet);
                }
            });
        });
        Some(Self { switch })
    }

    /// One more machine.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn host(&self) -> Host {
        let mut wires = self.switch.wires.write().unwrap_or_else(PoisonError::into_inner);
        let number = wires.len();
        let last = u8::try_from(number + 1).expect("few hosts");
        let address = Ipv4Addr::new(NET[0], NET[1], NET[2], last);
        // A namespace belongs to the thread that makes it, and to the programs that this one starts.
        let made = std::thread::spawn(move || {
            let made = (namespace().expect("a namespace"), tun().expect("a wire"));
            ip(&["addr", "add", &format!("{address}/24"), "dev", "wire"]);
            ip(&["link", "set", "wire", "mtu", &LARGEST.to_string(), "up"]);
            ip(&["link", "set", "lo", "up"]);
            made
        });
        let (namespace, tun) = made.join().expect("it can be set up");
        let wire = Arc::new(Wire { tun, is_cut: AtomicBool::new(false), delay_ms: AtomicU64::new(0) });
        wires.push(Arc::clone(&wire));
        let (own, switch) = (Arc::clone(&wire), Arc::clone(&self.switch));
        std::thread::spawn(move || switch.carry(&own));
        Host { namespace, wire, address }
    }
}

impl Host {
    /// This thread, and every process that it starts, is on this machine from now on.
    ///
    /// # Panics
    /// When the system does not allow it.
    pub fn enter(&self) {
        move_into_link_name_space(self.namespace.as_fd(), Some(LinkNameSpaceType::Network)).expect("root may enter it");
    }

    /// Does something on this machine.
    ///
    /// # Panics
    /// When that does.
    pub fn inside<T: Send>(&self, what: impl FnOnce() -> T + Send) -> T {
        let there = || {
            self.enter();
            what()
        };
        std::thread::scope(|scope| scope.spawn(there).join()).expect("it does not panic")
    }

    /// All packets to it and from it are lost, or none.
    pub fn cut(&self, is_cut: bool) {
        self.wire.is_cut.store(is_cut, Ordering::SeqCst);
    }

    /// Each packet to it or from it takes so long.
    pub fn delay(&self, by: Duration) {
        self.wire.delay_ms.store(u64::try_from(by.as_millis()).unwrap_or(u64::MAX), Ordering::SeqCst);
    }
}

impl Wire {
    fn delay(&self) -> Duration {
        Duration::from_millis(self.delay_ms.load(Ordering::SeqCst))
    }
}

impl Switch {
    fn wire(&self, number: usize) -> Option<Arc<Wire>> {
        self.wires.read().unwrap_or_else(PoisonError::into_inner).get(number).cloned()
    }

    /// Takes what a host sends, for as long as the process lives.
    fn carry(&self, from: &Wire) {
        let mut buffer = vec![0; LARGEST + 100];
        while let Ok(length) = (&from.tun).read(&mut buffer) {
            let packet = &buffer[..length];
            let Some(to) = receiver(packet) else { continue };
            let Some(wire) = self.wire(to) else { continue };
            let delay = from.delay() + wire.delay();
            if from.is_cut.load(Ordering::SeqCst) {
                continue;
            }
            if delay.is_zero() {
                self.deliver(to, packet);
            } else {
                // The thread that holds them lives as long as the process.
                let _ = self.late.send((Instant::now() + delay, to, packet.to_vec()));
            }
        }
    }

    fn deliver(&self, to: usize, packet: &[u8]) {
        if let Some(wire) = self.wire(to).filter(|wire| !wire.is_cut.load(Ordering::SeqCst)) {
            // A host whose buffers are full loses it, as on any network.
            let _ = (&wire.tun).write(packet);
        }
    }
}

/// The number of the host that a packet is for; other protocols than IPv4 are not carried.
fn receiver(packet: &[u8]) -> Option<usize> {
    let to = packet.get(16..20).filter(|_| packet[0] >> 4 == 4)?;
    (to[..3] == NET && to[3] > 0).then(|| usize::from(to[3]) - 1)
}

/// Gives each packet on at its time, in the order of their times.
fn hold(held: &Receiver<(Instant, usize, Vec<u8>)>, deliver: impl Fn(usize, &[u8])) {
    let mut waiting: BinaryHeap<Held> = BinaryHeap::new();
    for number in 0.. {
        let pause = waiting.peek().map_or(Duration::from_secs(1), |next| next.0.0.saturating_duration_since(Instant::now()));
        match held.recv_timeout(pause) {
            Ok((due, to, packet)) => waiting.push(Reverse((due, number, to, packet))),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        while waiting.peek().is_some_and(|next| next.0.0 <= Instant::now()) {
            if let Some(Reverse((_, _, to, packet))) = waiting.pop() {
                deliver(to, &packet);
            }
        }
    }
}

/// Moves this thread into a namespace of its own.
fn namespace() -> std::io::Result<File> {
    // SAFETY: no pointers; what is no longer shared is this thread's network alone.
    if unsafe { libc::unshare(libc::CLONE_NEWNET) } != 0 {
        return Err(std::io::Error::last_os_error());
    }
    File::open("/proc/thread-self/ns/net")
}

/// The end of a wire; its other end is the device `wire` of this thread's namespace.
fn tun() -> std::io::Result<File> {
    let tun = File::options().read(true).write(true).open("/dev/net/tun")?;
    // SAFETY: all zeros is a valid request.
    let mut request: libc::ifreq = unsafe { std::mem::zeroed() };
    for (to, from) in request.ifr_name.iter_mut().zip(b"wire") {
        *to = libc::c_char::try_from(*from).expect("ASCII");
    }
    request.ifr_ifru.ifru_flags = libc::c_short::try_from(libc::IFF_TUN | libc::IFF_NO_PI).expect("two small flags");
    // SAFETY: the descriptor is open, and the request outlives the call.
    match unsafe { libc::ioctl(tun.as_raw_fd(), libc::TUNSETIFF, &raw const request) } {
        0 => Ok(tun),
        _ => Err(std::io::Error::last_os_error()),
    }
}

fn ip(arguments: &[&str]) {
    assert!(Command::new("ip").args(arguments).status().expect("ip starts").success(), "ip {arguments:?}");
}
