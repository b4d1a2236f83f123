//! Helpers of the end-to-end tests: they look at the product as a user can (its command line, its files, its documented JSON)
//! and at meshes with their own eyes, sharing no code with the engine.
//!
//! Every helper panics where it cannot do its work: a test then means nothing and must fail.

pub mod binary;
pub mod disk;
pub mod edit;
pub mod forms;
pub mod hot;
pub mod http;
pub mod moto;
pub mod openapi;
pub mod oracle;
pub mod place;
pub mod proxy;
pub mod receiver;
pub mod scene;
pub mod served;
pub mod stl;
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
pub mod trace;
#[cfg(target_os = "linux")]
pub mod wire;
pub mod zip;

pub use place::{Place, Ran};
