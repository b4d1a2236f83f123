//! What lies in `in/`: every name that is no folder and not temporary, to a depth. No link is followed.

use std::collections::BTreeMap;
use std::fs::{FileType, Metadata};
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use crate::folder::{NameKind, endings, is_hot, name_kind};
use crate::fsx::Identity;

/// Sub-folders are searched to this depth: more than a path that a record can hold has room for in practice.
pub(super) const DEPTH: usize = 64;

/// What lies in a folder.
#[derive(Default)]
pub(super) struct Found {
    /// Everything that is neither a folder nor temporary; what is no regular mesh file comes with words for what it is.
    pub files: BTreeMap<PathBuf, (Identity, Option<String>)>,
    /// Sub-folders that cannot be read, and why.
    pub unreadable: BTreeMap<PathBuf, String>,
}

impl Found {
    /// Reads this folder below `root`, and those in it to this depth. O(names).
    ///
    /// # Errors
    /// As `readdir` and `lstat`, of the folder itself.
    pub(super) fn walk(&mut self, root: &Path, below: &Path, depth: usize) -> io::Result<()> {
        for entry in std::fs::read_dir(root.join(below))? {
            // A folder that is read half is not read.
            let entry = entry?;
            let name = entry.file_name();
            let kind = name_kind(&name);
            if kind == NameKind::Ignored {
                continue;
            }
            // Not followed, if it is a link.
            let meta = match entry.metadata() {
                Ok(meta) => meta,
                // Gone between the two calls: not there.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(error),
            };
            let path = below.join(&name);
            if meta.is_dir() {
                // Someone else's files.
                // A sub-folder that cannot be read does not hide the others.
                let walked = match is_hot(&root.join(&path)) {
                    Ok(true) => Err("it is a hot folder of its own".into()),
                    Ok(false) if depth == 0 => Err(format!("it lies deeper than {DEPTH} folders")),
                    Ok(false) => self.walk(root, &path, depth - 1).map_err(|error| error.to_string()),
                    Err(error) => Err(error.to_string()),
                };
                if let Err(why) = walked {
                    self.unreadable.insert(path, why);
                }
                continue;
            }
            self.files.insert(path, (Identity::from(&meta), what_else(&meta, kind, &name.to_string_lossy())));
        }
        Ok(())
    }
}

/// Words for what is no mesh.
pub(super) fn what_else(meta: &Metadata, kind: NameKind, name: &str) -> Option<String> {
    let special = |t: FileType| {
        let words = [
            (t.is_symlink(), "a symbolic link, which is not followed"),
            (t.is_fifo(), "a pipe"),
            (t.is_socket(), "a socket"),
            (t.is_block_device() || t.is_char_device(), "a device"),
        ];
        words.iter().find(|(is, _)| *is).map(|(_, words)| (*words).to_owned())
    };
    if let Some(words) = special(meta.file_type()) {
        return Some(words);
    }
    (kind == NameKind::Foreign).then(|| match name.rsplit_once('.') {
        Some((_, extension)) => {
            format!("a .{} file, which is not read; meshes end in {}", extension.to_ascii_lowercase(), endings())
        }
        None => format!("a file of unknown format; meshes end in {}", endings()),
    })
}
