//! Makes one fault happen.

use super::fault::{Fault, What};
use super::run::{Eyes, Next};
use super::stop::Stop;

/// A fault, and how far the counting is.
pub struct Injector {
    fault: Fault,
    seen: u64,
    /// How often it happened.
    pub hits: u64,
    /// Registers of threads whose call was changed, as the program set them.
    cut: Vec<(i32, libc::user_regs_struct)>,
    /// Threads that close a descriptor: it is closed even when that fails.
    closing: Vec<i32>,
}

impl Injector {
    /// Nothing counted yet.
    pub fn new(fault: Fault) -> Self {
        Self { fault, seen: 0, hits: 0, cut: Vec::new(), closing: Vec::new() }
    }
}

impl Eyes for Injector {
    fn numbers(&self) -> Vec<i64> {
        self.fault.numbers()
    }

    fn before(&mut self, stop: &Stop) -> Next {
        let Some(kind) = stop.kind().filter(|kind| self.fault.counts(stop.role, kind)) else { return Next::Go };
        self.seen += 1;
        if !self.fault.hits(self.seen) {
            return Next::Go;
        }
        match self.fault.what {
            What::Errno(errno) => {
                self.hits += 1;
                if kind.name == "brk" {
                    // It has no errors: it answers with the end of the heap as it is, as it does when asked for the impossible.
                    self.cut.push((stop.thread, stop.registers));
                    return Next::Change(Box::new(libc::user_regs_struct { rdi: 0, ..stop.registers }));
                }
                if kind.name == "close" {
                    self.closing.push(stop.thread);
                    return Next::Return;
                }
                Next::Fail(errno)
            }
            What::One | What::Half => {
                let Some(count) = kind.count else { return Next::Go };
                let mut registers = stop.registers;
                let count = count.of(&mut registers);
                // One byte cannot be cut.
                if *count < 2 {
                    return Next::Go;
                }
                *count = if self.fault.what == What::One { 1 } else { *count / 2 };
                self.hits += 1;
                self.cut.push((stop.thread, stop.registers));
                Next::Change(Box::new(registers))
            }
        }
    }

    fn after(&mut self, stop: &Stop) -> Option<libc::user_regs_struct> {
        if let (Some(at), What::Errno(errno)) = (self.closing.iter().position(|thread| *thread == stop.thread), self.fault.what) {
            self.closing.swap_remove(at);
            return Some(libc::user_regs_struct { rax: i64::from(-errno).cast_unsigned(), ..stop.registers });
        }
        let at = self.cut.iter().position(|(thread, _)| *thread == stop.thread)?;
        let (_, before) = self.cut.swap_remove(at);
        // Arguments stay what they were: the program may count on them.
        let mut registers = stop.registers;
        (registers.rdi, registers.rdx, registers.r10, registers.r8) = (before.rdi, before.rdx, before.r10, before.r8);
        Some(registers)
    }
}
