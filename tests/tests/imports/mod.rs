//! Finds the imports between the files of a crate, and circles among them.
//!
//! A file imports another one if its code names an item that the other defines: in a `use`, by a path, or in the tokens
//! of a macro. A name is followed through every module that re-exports it (`pub use`) to the file that defines it. So a
//! parent that only declares its children and re-exports their items imports none of them; a parent that also uses the
//! items does. Test code (`#[cfg(test)]`) counts only if it has its own file.

mod paths;
mod read;
mod resolve;

pub(crate) use read::Crate;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Imports of each file: the other files, each with a path by which it is named.
pub(crate) type Imports = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// Returns the circles: sets of files in which every file imports every other, directly or indirectly.
pub(crate) fn circles(imports: &Imports) -> Vec<BTreeSet<PathBuf>> {
    let reached = |from: &PathBuf| {
        let (mut reached, mut ahead) = (BTreeSet::new(), vec![from]);
        while let Some(file) = ahead.pop() {
            let targets = imports.get(file).into_iter().flat_map(BTreeMap::keys);
            ahead.extend(targets.filter(|target| reached.insert((*target).clone())));
        }
        reached
    };
    let reached: BTreeMap<&PathBuf, BTreeSet<PathBuf>> = imports.keys().map(|file| (file, reached(file))).collect();
    let circle = |(file, ahead): (&&PathBuf, &BTreeSet<PathBuf>)| {
        let returns = |other: &&PathBuf| reached.get(other).is_some_and(|back| back.contains(*file));
        ahead.iter().filter(returns).cloned().collect::<BTreeSet<_>>()
    };
    let found: BTreeSet<_> = reached.iter().map(circle).filter(|circle| !circle.is_empty()).collect();
    found.into_iter().collect()
}

/// Returns the imports within a circle, one per line.
pub(crate) fn within(imports: &Imports, circle: &BTreeSet<PathBuf>) -> String {
    let of = |file: &PathBuf| {
        let targets = imports.get(file).into_iter().flatten().filter(|(target, _)| circle.contains(*target));
        targets.map(|(target, path)| format!("\n  {} names {path} of {}", file.display(), target.display())).collect()
    };
    circle.iter().map(of).collect::<Vec<String>>().concat()
}
