//! Who imports whom: files of one crate, by the paths in them. What only tests use is left out, and paths in macros are not seen.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree};

/// The path of a module within its crate; empty for the root.
pub(crate) type Module = Vec<String>;

/// For each file of a crate those that it imports.
pub(crate) struct Imports(BTreeMap<Module, BTreeSet<Module>>);

impl Imports {
    /// Of the crate whose source is in this folder.
    pub(crate) fn of(folder: &Path) -> Self {
        let mut files = BTreeMap::new();
        let root = ["lib.rs", "main.rs"].map(|name| folder.join(name)).into_iter().find(|path| path.exists());
        gather(&root.expect("a root"), Vec::new(), &mut files);
        if folder.join("lib.rs").exists() && folder.join("main.rs").exists() {
            // The program is a root of its own, which uses the library by name.
            gather(&folder.join("main.rs"), vec!["main".into()], &mut files);
        }
        let of_file = |(module, file): (&Module, &syn::File)| {
            let mut paths = Paths { at: module.clone(), files: &files, found: BTreeSet::new() };
            paths.visit_file(file);
            paths.found.remove(module);
            (module.clone(), paths.found)
        };
        Self(files.iter().map(of_file).collect())
    }

    /// Every file, but the root and those for tests.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Module> {
        self.0.keys().filter(|module| !module.is_empty())
    }

    pub(crate) fn all(&self) -> impl Iterator<Item = (&Module, &Module)> {
        self.0.iter().flat_map(|(from, to)| to.iter().map(move |to| (from, to)))
    }

    pub(crate) fn edges(&self) -> usize {
        self.all().count()
    }

    /// Groups of files each of which leads to every other one.
    pub(crate) fn circles(&self) -> Vec<Vec<String>> {
        let reached: BTreeMap<&Module, BTreeSet<&Module>> = self.0.keys().map(|from| (from, self.reached(from))).collect();
        let leads = |from: &Module, to: &Module| reached.get(from).is_some_and(|all| all.contains(to));
        let mut circles = BTreeSet::new();
        for module in self.0.keys().filter(|module| leads(module, module)) {
            let group: Vec<String> =
                self.0.keys().filter(|other| leads(module, other) && leads(other, module)).map(|m| m.join("::")).collect();
            circles.insert(group);
        }
        circles.into_iter().collect()
    }

    /// The folders of this crate, each with those beside it that its files import, once for every folder that holds folders.
    pub(crate) fn folders(&self) -> Vec<Self> {
        let parents: BTreeSet<&[String]> = self.0.keys().flat_map(|module| (0..module.len()).map(|n| &module[..n])).collect();
        let below = |parent: &[String]| {
            let child =
                |module: &Module| module.strip_prefix(parent).filter(|rest| !rest.is_empty()).map(|rest| rest[..1].to_vec());
            let mut folders: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
            for (from, to) in self.all() {
                if let (Some(from), Some(to)) = (child(from), child(to))
                    && from != to
                {
                    folders.entry(from).or_default().insert(to);
                }
            }
            Self(folders)
        };
        parents.into_iter().map(below).collect()
    }

    fn reached(&self, from: &Module) -> BTreeSet<&Module> {
        let mut all = BTreeSet::new();
        let mut waiting: Vec<&Module> = self.0.get(from).into_iter().flatten().collect();
        while let Some(module) = waiting.pop() {
            if all.insert(module) {
                waiting.extend(self.0.get(module).into_iter().flatten());
            }
        }
        all
    }
}

/// Reads a file and those of its modules that are no tests'.
fn gather(path: &Path, module: Module, files: &mut BTreeMap<Module, syn::File>) {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let file = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let parent = path.parent().unwrap_or(path);
    let folder = if ["lib", "main", "mod"].contains(&stem) { parent.to_owned() } else { parent.join(stem) };
    for item in &file.items {
        if let Item::Mod(declared) = item
            && declared.content.is_none()
            && !is_for_tests(&declared.attrs)
        {
            let name = declared.ident.to_string();
            let places: [PathBuf; 2] = [folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs")];
            let Some(place) = places.into_iter().find(|place| place.exists()) else { continue };
            let of_root = module.first().is_some_and(|first| first == "main") && module.len() == 1;
            let mut child = if of_root { Vec::new() } else { module.clone() };
            child.push(name);
            gather(&place, child, files);
        }
    }
    files.insert(module, file);
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    let says_test = |a: &Attribute| a.meta.require_list().is_ok_and(|list| list.tokens.to_string().contains("test"));
    attributes.iter().any(|a| a.path().is_ident("cfg") && says_test(a))
}

/// The paths in a file.
struct Paths<'a> {
    at: Module,
    files: &'a BTreeMap<Module, syn::File>,
    found: BTreeSet<Module>,
}

impl Paths<'_> {
    /// Notes the file that this path leads to, if it is one of the crate.
    fn note(&mut self, path: &[String]) {
        let Some(first) = path.first() else { return };
        let mut full = match first.as_str() {
            "crate" => Vec::new(),
            "self" | "super" => self.at.clone(),
            child => {
                let mut full = self.at.clone();
                full.push(child.to_owned());
                if !self.files.contains_key(&full) {
                    return;
                }
                self.at.clone()
            }
        };
        for part in path {
            match part.as_str() {
                "crate" | "self" => {}
                "super" => _ = full.pop(),
                name => full.push(name.to_owned()),
            }
        }
        while !self.files.contains_key(&full) && full.pop().is_some() {}
        self.found.insert(full);
    }

    fn note_tree(&mut self, tree: &UseTree, before: &[String]) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.note_tree(&path.tree, &with(&path.ident)),
            UseTree::Name(name) => self.note(&with(&name.ident)),
            UseTree::Rename(rename) => self.note(&with(&rename.ident)),
            UseTree::Glob(_) => self.note(before),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.note_tree(tree, before)),
        }
    }
}

impl<'ast> Visit<'ast> for Paths<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Struct(item) => &item.attrs,
            Item::Const(item) => &item.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_for_tests(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        if module.content.is_some() {
            self.at.push(module.ident.to_string());
            visit::visit_item_mod(self, module);
            self.at.pop();
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.note_tree(&item.tree, &[]);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            self.note(&path.segments.iter().map(|segment| segment.ident.to_string()).collect::<Vec<_>>());
        }
        visit::visit_path(self, path);
    }

    // Who may see an item is no import.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
}
