//! The machine around the daemon: mounts, fillers, users, processes.

use std::ffi::CString;
use std::fs::File;
use std::io::Write;
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Mounts and other users need root.
pub(crate) fn is_root(scenario: &str) -> bool {
    let root = rustix::process::geteuid().is_root();
    if !root {
        println!("| {scenario} | | skipped: needs root |");
    }
    root
}

/// A tmpfs; unmounted when dropped, even while something in it is open.
pub(crate) struct Mount {
    at: PathBuf,
    /// Its server, which answers nothing.
    server: Option<File>,
}

fn c_string(bytes: &[u8]) -> CString {
    CString::new(bytes).expect("no zero byte")
}

impl Mount {
    /// Mounts one over `at`, which is made; its root belongs to `owner`.
    pub(crate) fn tmpfs(at: &Path, options: &str, owner: u32) -> Self {
        std::fs::create_dir_all(at).expect("the mount point can be made");
        let (path, tmpfs) = (c_string(at.as_os_str().as_bytes()), c_string(b"tmpfs"));
        let data = c_string(format!("mode=0755,uid={owner},gid={owner},{options}").as_bytes());
        // SAFETY: all pointers are to strings that outlive the call.
        let done = unsafe { libc::mount(tmpfs.as_ptr(), path.as_ptr(), tmpfs.as_ptr(), 0, data.as_ptr().cast()) };
        assert_eq!(done, 0, "mount: {}", std::io::Error::last_os_error());
        Self { at: at.to_owned(), server: None }
    }

    /// Shows a folder at `at`, too, as a mount of its own.
    pub(crate) fn bind(from: &Path, at: &Path) -> Self {
        let [from, path] = [from, at].map(|path| c_string(path.as_os_str().as_bytes()));
        // SAFETY: the pointers are to strings that outlive the call, or null where the call ignores them.
        let done = unsafe { libc::mount(from.as_ptr(), path.as_ptr(), std::ptr::null(), libc::MS_BIND, std::ptr::null()) };
        assert_eq!(done, 0, "mount: {}", std::io::Error::last_os_error());
        Self { at: at.to_owned(), server: None }
    }

    /// A file system of a program that answers nothing, over a folder that is there: every call waits until this is dropped.
    pub(crate) fn silent(at: &Path) -> Self {
        let server = File::options().read(true).write(true).open("/dev/fuse").expect("file systems of programs");
        let data = c_string(format!("fd={},rootmode=40000,user_id=0,group_id=0", server.as_raw_fd()).as_bytes());
        let (path, fuse) = (c_string(at.as_os_str().as_bytes()), c_string(b"fuse"));
        // SAFETY: all pointers are to strings that outlive the call.
        let done = unsafe { libc::mount(fuse.as_ptr(), path.as_ptr(), fuse.as_ptr(), 0, data.as_ptr().cast()) };
        assert_eq!(done, 0, "mount: {}", std::io::Error::last_os_error());
        Self { at: at.to_owned(), server: Some(server) }
    }

    /// From now on nothing can be written to it.
    pub(crate) fn make_read_only(&self) {
        let path = c_string(self.at.as_os_str().as_bytes());
        let flags = libc::MS_REMOUNT | libc::MS_RDONLY;
        // SAFETY: the pointers are to a string that outlives the call, or null, as the call allows for remounting.
        let done = unsafe { libc::mount(std::ptr::null(), path.as_ptr(), std::ptr::null(), flags, std::ptr::null()) };
        assert_eq!(done, 0, "remount: {}", std::io::Error::last_os_error());
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        // Whoever waits for it is told that it is gone.
        self.server = None;
        let path = c_string(self.at.as_os_str().as_bytes());
        // SAFETY: the pointer is to a string that outlives the call.
        unsafe { libc::umount2(path.as_ptr(), libc::MNT_DETACH) };
    }
}

/// Fills a file system to its last byte with a file.
pub(crate) fn fill_bytes(file: &Path) {
    let mut filler = File::create(file).expect("the filler can be made");
    for size in [1 << 16, 1 << 12, 1] {
        let block = vec![0xAA; size];
        while filler.write_all(&block).is_ok() {}
    }
}

/// Takes all inodes of a file system but `free`; returns the fillers.
pub(crate) fn fill_inodes(folder: &Path, free: usize) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder).expect("a folder for fillers");
    let mut fillers = Vec::new();
    loop {
        let path = folder.join(fillers.len().to_string());
        if File::create(&path).is_err() {
            break;
        }
        fillers.push(path);
    }
    for path in fillers.drain(fillers.len() - free..) {
        std::fs::remove_file(path).expect("a filler can be removed");
    }
    fillers
}

/// Sends a signal; whoever it is for may be gone.
pub(crate) fn send(pid: u32, signal: i32) {
    // SAFETY: no pointers; the number is of a process of this test's own.
    unsafe { libc::kill(pid.cast_signed(), signal) };
}

/// Processes that run this very binary, by its path; zombies have none.
pub(crate) fn processes_of(binary: &Path) -> Vec<u32> {
    let numbers = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    numbers
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .filter(|pid| std::fs::read_link(format!("/proc/{pid}/exe")).is_ok_and(|exe| exe == binary))
        .collect()
}

/// Raises the soft limit of a running process to its hard one, as its own user: not every root may change what belongs to others.
pub(crate) fn raise_limit_as(user: u32, pid: u32, resource: libc::__rlimit_resource_t) {
    let mut command = Command::new("true");
    command.uid(user).gid(user);
    // SAFETY: between fork and exec only plain system calls are made, with pointers to a local or null.
    unsafe {
        command.pre_exec(move || {
            let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
            let done = libc::prlimit(pid.cast_signed(), resource, std::ptr::null(), &raw mut limit) == 0 && {
                limit.rlim_cur = limit.rlim_max;
                libc::prlimit(pid.cast_signed(), resource, &raw const limit, std::ptr::null_mut()) == 0
            };
            if done { Ok(()) } else { Err(std::io::Error::last_os_error()) }
        });
    }
    // The process may have ended meanwhile.
    match command.status() {
        Err(error) if error.raw_os_error() != Some(libc::ESRCH) => panic!("the limit cannot be raised: {error}"),
        _ => {}
    }
}

/// Sets the soft limit of a running process.
pub(crate) fn set_limit(pid: u32, resource: libc::__rlimit_resource_t, value: u64) {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: both pointers are to a local that outlives the calls, or null, as the call allows. The process may be gone.
    unsafe {
        if libc::prlimit(pid.cast_signed(), resource, std::ptr::null(), &raw mut limit) == 0 {
            limit.rlim_cur = value.min(limit.rlim_max);
            libc::prlimit(pid.cast_signed(), resource, &raw const limit, std::ptr::null_mut());
        }
    }
}
