//! Reads the modules of a crate, starting at its root file.

use super::paths::{Named, Path, Use, in_strings, in_tokens, uses};
use proc_macro2::TokenStream;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path as FilePath, PathBuf};
use syn::visit::{self, Visit};
use syn::{Attribute, Expr, ExprLit, Item, Lit, Meta};

/// A module: a file or a part of one.
#[derive(Default)]
pub(crate) struct Module {
    pub(crate) file: PathBuf,
    pub(crate) parent: Option<usize>,
    /// Child modules, by name.
    pub(crate) children: BTreeMap<String, usize>,
    /// Names of the items that the module defines.
    pub(crate) items: BTreeSet<String>,
    pub(crate) uses: Vec<Use>,
    /// Paths in the module's code; the flag is true for macros that are called.
    pub(crate) paths: Vec<Named>,
}

/// Paths in a macro's body, and the module that defines the macro.
pub(crate) struct Macro {
    pub(crate) module: usize,
    pub(crate) exported: bool,
    pub(crate) paths: Vec<Named>,
}

/// A program or library with all modules that it declares. The first module is the root.
pub(crate) struct Crate {
    pub(crate) modules: Vec<Module>,
    pub(crate) macros: BTreeMap<String, Vec<Macro>>,
}

impl Crate {
    /// Reads a crate from its root file. `read` returns the text of a file; none if there is no such file.
    pub(crate) fn read(root: &FilePath, read: &dyn Fn(&FilePath) -> Option<String>) -> Self {
        let mut reader = Reader { of: Crate { modules: Vec::new(), macros: BTreeMap::new() }, read, module: 0 };
        let text = read(root).unwrap_or_else(|| panic!("{}: no such file", root.display()));
        reader.file(root, &text, None, root.parent().unwrap());
        reader.of
    }

    /// Returns every file of the crate.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.modules.iter().map(|module| &module.file)
    }
}

struct Reader<'a> {
    of: Crate,
    read: &'a dyn Fn(&FilePath) -> Option<String>,
    /// Index of the module that is being read.
    module: usize,
}

impl Reader<'_> {
    /// Reads a file as a module. The modules that it declares are in `folder`.
    fn file(&mut self, file: &FilePath, text: &str, parent: Option<usize>, folder: &FilePath) -> usize {
        let parsed = syn::parse_file(text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.inside(&parsed.items, file, parent, folder)
    }

    /// Reads the items of a module.
    fn inside(&mut self, items: &[Item], file: &FilePath, parent: Option<usize>, folder: &FilePath) -> usize {
        let (outer, module) = (self.module, self.of.modules.len());
        self.module = module;
        self.of.modules.push(Module { file: file.to_owned(), parent, ..Module::default() });
        for item in items {
            match item {
                Item::Mod(item) => self.declared(item, file, folder),
                item => {
                    self.here().items.extend(name(item).filter(|_| !for_tests(attributes(item))));
                    self.visit_item(item);
                }
            }
        }
        self.module = outer;
        module
    }

    /// Reads a module that the present module declares.
    fn declared(&mut self, item: &syn::ItemMod, file: &FilePath, folder: &FilePath) {
        let (name, parent) = (item.ident.to_string(), self.module);
        let child = match &item.content {
            Some(_) if for_tests(&item.attrs) => return,
            Some((_, items)) => self.inside(items, file, Some(parent), &folder.join(&name)),
            None => {
                let elsewhere = item.attrs.iter().find_map(moved).map(|path| file.with_file_name(path));
                let places = [folder.join(&name).with_extension("rs"), folder.join(&name).join("mod.rs")];
                let read = |path: PathBuf| (self.read)(&path).map(|text| (path, text));
                let found = elsewhere.clone().into_iter().chain(places).find_map(read);
                let (path, text) = found.unwrap_or_else(|| panic!("{}: mod {name}: no such file", file.display()));
                let is_folder = elsewhere.is_some() || path.ends_with("mod.rs");
                let folder = if is_folder { path.parent().unwrap().to_owned() } else { folder.join(&name) };
                self.file(&path, &text, Some(parent), &folder)
            }
        };
        self.here().children.insert(name, child);
    }

    fn here(&mut self) -> &mut Module {
        &mut self.of.modules[self.module]
    }

    fn tokens(&mut self, tokens: &TokenStream) {
        let found = in_tokens(tokens);
        self.here().paths.extend(found);
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if !for_tests(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !for_tests(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    /// A module within a function counts as a child of the surrounding module.
    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        let (file, folder) = (self.here().file.clone(), PathBuf::new());
        self.declared(item, &file, &folder);
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        if item.leading_colon.is_none() {
            self.here().uses.extend(uses(&item.tree, &item.vis));
        }
    }

    fn visit_item_extern_crate(&mut self, item: &'ast syn::ItemExternCrate) {
        if let ("self", Some((_, name))) = (item.ident.to_string().as_str(), &item.rename) {
            let name = Some(name.to_string());
            self.here().uses.push(Use { name, path: vec!["crate".to_owned()], is_public: true });
        }
    }

    fn visit_item_macro(&mut self, item: &'ast syn::ItemMacro) {
        let Some(name) = &item.ident else { return visit::visit_item_macro(self, item) };
        let exported = item.attrs.iter().any(|attribute| attribute.path().is_ident("macro_export"));
        let (module, paths) = (self.module, in_tokens(&item.mac.tokens));
        // Other paths have a meaning only where the macro is called.
        let rooted = paths.iter().filter(|(path, _)| path.first().is_some_and(|first| first == "crate")).cloned();
        self.here().paths.extend(rooted);
        self.here().items.insert(name.to_string());
        self.of.macros.entry(name.to_string()).or_default().push(Macro { module, exported, paths });
    }

    fn visit_macro(&mut self, called: &'ast syn::Macro) {
        if called.path.leading_colon.is_none() {
            let path = segments(&called.path);
            self.here().paths.push((path, true));
        }
        self.tokens(&called.tokens);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            let segments = segments(path);
            self.here().paths.push((segments, false));
        }
        visit::visit_path(self, path);
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        match &attribute.meta {
            Meta::List(list) if !list.path.is_ident("doc") => {
                self.tokens(&list.tokens);
                self.here().paths.extend(in_strings(&list.tokens));
            }
            _ => {}
        }
        if attribute.path().segments.len() > 1 {
            self.visit_path(attribute.path());
        }
    }

    /// `pub(super)` and `pub(in crate::a)` import nothing.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
}

fn segments(path: &syn::Path) -> Path {
    path.segments.iter().map(|segment| segment.ident.to_string()).collect()
}

/// True for code that is compiled for tests only.
fn for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string().replace(' ', "");
            condition == "test" || condition.starts_with("all(test")
        }
        _ => false,
    })
}

/// Returns the file named by `#[path = "..."]`.
fn moved(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else { return None };
    match &pair.value {
        Expr::Lit(ExprLit { lit: Lit::Str(path), .. }) if pair.path.is_ident("path") => Some(path.value()),
        _ => None,
    }
}

/// Returns the name that an item defines in its module.
fn name(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(it) => &it.ident,
        Item::Enum(it) => &it.ident,
        Item::Fn(it) => &it.sig.ident,
        Item::Static(it) => &it.ident,
        Item::Struct(it) => &it.ident,
        Item::Trait(it) => &it.ident,
        Item::TraitAlias(it) => &it.ident,
        Item::Type(it) => &it.ident,
        Item::Union(it) => &it.ident,
        _ => return None,
    };
    Some(name.to_string())
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(it) => &it.attrs,
        Item::Enum(it) => &it.attrs,
        Item::ExternCrate(it) => &it.attrs,
        Item::Fn(it) => &it.attrs,
        Item::ForeignMod(it) => &it.attrs,
        Item::Impl(it) => &it.attrs,
        Item::Macro(it) => &it.attrs,
        Item::Static(it) => &it.attrs,
        Item::Struct(it) => &it.attrs,
        Item::Trait(it) => &it.attrs,
        Item::Type(it) => &it.attrs,
        Item::Union(it) => &it.attrs,
        Item::Use(it) => &it.attrs,
        _ => &[],
    }
}
