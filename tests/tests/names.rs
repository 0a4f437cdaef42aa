//! One name, one meaning: each type name, public or private, is declared in one crate only, except those listed here
//! with a reason.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Names that several crates may use, with the reasons.
const SHARED: [(&str, &str); 14] = [
    ("Aids", "a board's slow sensors, which the trait `Board` calls so"),
    ("Board", "firmware: the trait that a board implements; xtask: a board of the table"),
    ("Error", "a library's error, as in std"),
    ("ExactLog", "the exact log, on board and on the host"),
    ("FlightController", "control: the trait of laws; stm32f4: the boards that the field calls so"),
    ("Gains", "a law's gains, named with the law's module: `pid::Gains`"),
    ("Irqs", "the interrupts of a board, as embassy's examples name them"),
    ("Memory", "what changes from step to step, named with the module that steps"),
    ("Receiver", "one end of a link: firmware: the trait; a chip and the emulated board implement it"),
    ("Rotors", "types: the rotors as software knows them; plant: as they are"),
    ("Sampler", "firmware: the trait; the emulated board implements it"),
    ("Settings", "the constants of a crate, named with it: `estimator::Settings`"),
    ("State", "types: the vehicle's state; firmware: the state of a task"),
    ("Transmitter", "the other end of a link, like `Receiver`"),
];
/// Largest allowed number of shared names.
const SHARED_MAX: usize = 25;
/// Folders of crates, and crates that stand alone.
const FOLDERS: [&str; 3] = ["crates", "firmware/boards", "firmware/chips"];
const SINGLE: [&str; 6] = ["firmware", "firmware/xtask", "playground", "python", "sitl", "twin"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns the Rust files of a folder, without unit tests in their own files.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| match path.file_name().and_then(|name| name.to_str()) {
        Some("tests" | "tests.rs") => Vec::new(),
        _ if path.is_dir() => files(&path),
        _ => vec![path],
    };
    entries.flat_map(of).filter(|path| path.extension().is_some_and(|extension| extension == "rs")).collect()
}

/// Adds the types that tokens declare, also within modules, functions and macros. Test modules do not count, nor do
/// associated types (`items` is false within blocks other than modules), nor an alias for a type of the same name.
fn declared(tokens: TokenStream, items: bool, names: &mut BTreeSet<String>) {
    let tokens: Vec<_> = tokens.into_iter().collect();
    let word = |at: usize| match tokens.get(at) {
        Some(TokenTree::Ident(word)) => word.to_string(),
        _ => String::new(),
    };
    let is_mark = |at: usize, mark: char| matches!(tokens.get(at), Some(TokenTree::Punct(it)) if it.as_char() == mark);
    // True from an attribute `#[cfg(test)]` to the end of its item.
    let mut is_test = false;
    for (at, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) if group.delimiter() == Delimiter::Bracket && at > 0 && is_mark(at - 1, '#') => {
                let condition = group.stream().to_string().replace(' ', "");
                is_test |= condition == "cfg(test)" || condition.starts_with("cfg(all(test,");
            }
            TokenTree::Group(group) => {
                let is_module = at > 1 && word(at - 2) == "mod";
                if !is_test {
                    declared(group.stream(), items && is_module, names);
                }
                is_test &= group.delimiter() != Delimiter::Brace;
            }
            TokenTree::Punct(mark) if mark.as_char() == ';' => is_test = false,
            TokenTree::Ident(kind) if !is_test => {
                let (kind, name) = (kind.to_string(), word(at + 1));
                let is_type = match kind.as_str() {
                    "struct" | "enum" | "trait" => true,
                    // `union` is a keyword only in front of a declaration.
                    "union" => matches!(tokens.get(at + 2), Some(TokenTree::Group(_))),
                    "type" => items,
                    _ => false,
                };
                let rest = tokens.iter().enumerate().skip(at + 2).take_while(|(at, _)| !is_mark(*at, ';'));
                let is_alias = kind == "type" && rest.map(|(_, token)| token.to_string()).any(|token| token == name);
                if is_type && !name.is_empty() && !is_alias {
                    names.insert(name);
                }
            }
            _ => {}
        }
    }
}

fn names_of(text: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    declared(text.parse().unwrap(), true, &mut names);
    names
}

/// Returns, for each type name, the crates that declare it.
fn crates_by_name() -> BTreeMap<String, BTreeSet<String>> {
    let within = |folder: &str| fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path());
    let single = SINGLE.map(|name| root().join(name));
    let mut by_name: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for folder in FOLDERS.into_iter().flat_map(within).chain(single).filter(|path| path.is_dir()) {
        let owner = folder.strip_prefix(root()).unwrap().display().to_string();
        for file in files(&folder.join("src")) {
            for name in names_of(&fs::read_to_string(file).unwrap()) {
                by_name.entry(name).or_default().insert(owner.clone());
            }
        }
    }
    by_name
}

#[test]
fn a_type_name_has_one_meaning() {
    let by_name = crates_by_name();
    assert!(by_name.len() > 1_000, "{} names", by_name.len());
    let shared: BTreeMap<_, _> = by_name.iter().filter(|(_, crates)| crates.len() > 1).collect();
    println!("{} of {} type names are in more than one crate:", shared.len(), by_name.len());
    for (name, crates) in &shared {
        let reason = SHARED.iter().find(|(shared, _)| shared == name).map(|(_, reason)| *reason);
        println!("{name}: {crates:?}: {}", reason.unwrap_or("no reason"));
    }
    let allowed: BTreeSet<_> = SHARED.iter().map(|(name, _)| *name).collect();
    let present: BTreeSet<_> = shared.keys().map(|name| name.as_str()).collect();
    assert_eq!(present, allowed, "names in several crates, and those with a reason");
    assert!(present.len() <= SHARED_MAX);
}

#[test]
fn every_form_of_a_type_is_seen() {
    let text = "pub struct A; mod m { pub enum B {} type C = u8; } made! { /// Doc.\n pub struct D {} } pub trait E {}
        pub(crate) struct F<T>(T); fn f() { struct G; } pub union H { j: u8 } #[derive(Debug)] enum I { X }";
    assert_eq!(names_of(text).into_iter().collect::<String>(), "ABCDEFGHI");
    let none = "pub type A = other::A<4>; impl T for u8 { type B = u8; } macro_rules! m { () => { struct $name; } }
        #[cfg(test)] #[allow(dead_code)] mod tests { struct C; } #[cfg(test)] mod d; fn union(u: U) {}
        #[cfg(test)] struct E; #[cfg(all(test, unix))] mod tests { struct F; }";
    assert_eq!(names_of(none), BTreeSet::new());
    assert_eq!(names_of("#[cfg(test)] mod tests { struct A; } struct B;").into_iter().collect::<String>(), "B");
}
