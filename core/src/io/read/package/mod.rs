//! A package: an archive whose parts refer to each other, as far as 3MF needs it.
//!
//! **In:** an archive.
//! **Out:** the start part of a print; the relationships of a part; whether the package is signed; which parts are encrypted.
//! **Promise:** a name never leads out of the package; a part that is encrypted is refused by name, never read as if it were not.
//!
//! By ECMA-376-2 (Open Packaging Conventions; sections 6 parts, 6.5 relationships, 7.2 content types, 10 signatures), 3MF Core 1.3 (section 2), 3MF Secure Content 1.0.2
//! (section 2 keystore).

mod opc;
mod part_name;
mod relationships;
#[cfg(test)]
mod tests;

pub(super) use opc::Opc;
pub(super) use part_name::resolve;
