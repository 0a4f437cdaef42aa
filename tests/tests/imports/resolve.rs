//! Resolves a crate's paths to files.

use super::Imports;
use super::paths::{Named, Path, Use};
use super::read::Crate;
use std::collections::BTreeSet;

/// Imports that are being followed, each as a module and an index in its list. An import cannot help to resolve itself.
type Seen = BTreeSet<(usize, usize)>;

impl Crate {
    /// Returns the imports of each file.
    pub(crate) fn imports(&self) -> Imports {
        let mut imports = Imports::new();
        for module in 0..self.modules.len() {
            let file = &self.modules[module].file;
            let imported = imports.entry(file.clone()).or_default();
            for (target, path) in self.of_module(module) {
                let target = &self.modules[target].file;
                if target != file {
                    imported.entry(target.clone()).or_insert_with(|| path.join("::"));
                }
            }
        }
        imports
    }

    /// Returns the modules that a module's code names, with the paths used.
    fn of_module(&self, module: usize) -> Vec<(usize, Path)> {
        let mut found = Vec::new();
        for import in &self.modules[module].uses {
            let targets = self.named(module, &import.path);
            // A parent that re-exports an item of its child does not thereby use the child.
            let uses = targets.into_iter().filter(|target| !import.is_public || !self.is_within(*target, module));
            found.extend(uses.map(|target| (target, import.path.clone())));
        }
        let mut called = BTreeSet::new();
        let mut ahead: Vec<&Named> = self.modules[module].paths.iter().collect();
        while let Some((path, is_call)) = ahead.pop() {
            let Some(name) = path.last() else { continue };
            // A single word is never a module. It may be a variable of the same name, `self` as a value, or `crate` in
            // a visibility.
            let is_module =
                ["crate", "self", "super"].contains(&name.as_str()) || self.modules[module].children.contains_key(name);
            if path.len() == 1 && !is_call && is_module {
                continue;
            }
            let mut targets = self.named(module, path);
            if *is_call {
                let macros = self.macros.get(name).map_or(&[][..], Vec::as_slice);
                // A macro may also be in scope because it stands earlier in the text.
                let in_text = path.len() == 1 && macros.iter().all(|it| !targets.contains(&it.module));
                let meant: Vec<_> = macros.iter().filter(|it| in_text || targets.contains(&it.module)).collect();
                targets = meant.iter().map(|it| it.module).collect();
                if called.insert(name) {
                    ahead.extend(meant.iter().flat_map(|it| &it.paths));
                }
            }
            found.extend(targets.into_iter().map(|target| (target, path.clone())));
        }
        found
    }

    /// True if `module` is a descendant of `other`.
    fn is_within(&self, module: usize, other: usize) -> bool {
        self.modules[module].parent.is_some_and(|parent| parent == other || self.is_within(parent, other))
    }

    /// Returns the modules that define the item of a path in `module`, and modules on the way that import it privately.
    /// Returns none if the path leads out of the crate.
    fn named(&self, module: usize, path: &[String]) -> BTreeSet<usize> {
        self.from(module, path, &mut Seen::new())
    }

    fn from(&self, module: usize, path: &[String], seen: &mut Seen) -> BTreeSet<usize> {
        let (mut base, mut rest, mut rooted) = (module, path, false);
        while let [first, others @ ..] = rest {
            base = match first.as_str() {
                "crate" => 0,
                "self" => base,
                "super" => self.modules[base].parent.unwrap_or(base),
                _ => break,
            };
            (rest, rooted) = (others, true);
        }
        let found = self.inside(base, rest, base == module, seen);
        // A macro of the module defines a name that is found nowhere else.
        if found.is_empty() && rooted { [base].into() } else { found }
    }

    /// Returns the modules to which the rest of a path leads within a module. `own` is true if the path is written in
    /// that module.
    fn inside(&self, module: usize, path: &[String], own: bool, seen: &mut Seen) -> BTreeSet<usize> {
        let [name, rest @ ..] = path else { return [module].into() };
        if name == "self" {
            return self.inside(module, rest, own, seen);
        }
        let it = &self.modules[module];
        let mut found = BTreeSet::new();
        let child = it.children.get(name).copied();
        if let Some(child) = child {
            let within = self.inside(child, rest, false, seen);
            found.extend(if within.is_empty() { [child].into() } else { within });
        }
        // An import with a child's name does not bring the child's contents into scope: `use a::a;`.
        let named = |import: &Use| import.name.as_ref() == Some(name) && (child.is_none() || rest.is_empty());
        for (index, import) in it.uses.iter().enumerate().filter(|(_, import)| named(import)) {
            if seen.insert((module, index)) {
                found.extend(self.from(module, &[&import.path, rest].concat(), seen));
                found.extend((!import.is_public && !own).then_some(module));
                seen.remove(&(module, index));
            }
        }
        let exports = self.macros.get(name).into_iter().flatten().filter(|it| module == 0 && it.exported);
        found.extend(exports.map(|it| it.module));
        found.extend(it.items.contains(name).then_some(module));
        if found.is_empty() {
            for (index, import) in it.uses.iter().enumerate().filter(|(_, import)| import.name.is_none()) {
                if seen.insert((module, index)) {
                    for target in self.from(module, &import.path, seen) {
                        found.extend(self.inside(target, path, false, seen));
                    }
                    seen.remove(&(module, index));
                }
            }
        }
        found
    }
}
