//! Running a program under the eyes of the kernel's tracer (`ptrace` with a `seccomp` filter), below every library: its system calls
//! can be counted, made to fail, or written down. All threads and child processes are followed.
//!
//! Only on x86-64: registers and numbers of calls are the machine's.

pub mod calls;
pub mod count;
pub mod fault;
pub mod inject;
pub mod journal;
pub mod run;
mod start;
pub mod stop;

pub use fault::{Fault, Role, What, When};
pub use run::{Ended, Eyes, Next, run};
pub use stop::Stop;
