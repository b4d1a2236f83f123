//! A file that goes along with an OBJ: a material library, a texture. It is copied, byte for byte, to where the result of that OBJ is; no worker has it.
//!
//! **In:** the claimed file. **Out:** a copy in the attempt's folder, for [`crate::publish`]. **Promise:** the copy is a file of its own, is durable, and
//! was read back.
//!
//! Such a job is known by its path: no mesh is called so, and any other file is a job's only where an OBJ in `in/` names it ([`crate::scan`]).

use std::io;
use std::path::Path;

use suture_store::{Hash, RelPath, crash_point};

use crate::claim::Original;
use crate::create;
use crate::folder::{NameKind, name_kind};
use crate::fsx;
use crate::reuse::hash_unless;

/// Is a dropped file of this path carried, and not repaired?
pub(crate) fn is_carried(path: &RelPath) -> bool {
    path.to_path().file_name().is_some_and(|name| name_kind(name) == NameKind::Foreign)
}

/// Copies the claimed file, and returns the hash of its bytes.
///
/// # Errors
/// As `open`, `read` and `write`; of kind `Interrupted` as soon as `stop` says so, and of kind `InvalidData` where the copy, read back, is another one.
pub(crate) fn copy(claimed: &Path, to: &Path, stop: &dyn Fn() -> bool) -> io::Result<Hash> {
    let content = hash_unless(claimed, stop)?;
    create::copy_content(Original::open(claimed)?.file(), to)?.sync_all()?;
    if fsx::hash(to)? != content {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "its copy, read back, has other bytes"));
    }
    crash_point("daemon.carried");
    Ok(content)
}
