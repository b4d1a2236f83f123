//! How long files and functions are.

use std::path::Path;

use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Files of more lines than `file`, and functions of more than `function`, in a folder and those in it.
pub(crate) fn beyond(folder: &Path, file: usize, function: usize) -> Vec<String> {
    let mut long = Vec::new();
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for path in entries.map(|entry| entry.expect("an entry").path()) {
        if path.is_dir() {
            long.extend(beyond(&path, file, function));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let lines = text.lines().count();
            if lines > file {
                long.push(format!("{}: {lines} lines", path.display()));
            }
            let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let mut functions = Functions { most: function, long: Vec::new() };
            functions.visit_file(&parsed);
            long.extend(functions.long.into_iter().map(|name| format!("{}: {name}", path.display())));
        }
    }
    long
}

struct Functions {
    most: usize,
    long: Vec<String>,
}

impl Functions {
    fn look(&mut self, name: &syn::Ident, whole: proc_macro2::Span) {
        let lines = whole.end().line + 1 - whole.start().line;
        if lines > self.most {
            self.long.push(format!("`{name}`, {lines} lines"));
        }
    }
}

impl<'ast> Visit<'ast> for Functions {
    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.look(&function.sig.ident, function.sig.span().join(function.block.span()).unwrap_or_else(|| function.block.span()));
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.look(&function.sig.ident, function.sig.span().join(function.block.span()).unwrap_or_else(|| function.block.span()));
        visit::visit_impl_item_fn(self, function);
    }
}
