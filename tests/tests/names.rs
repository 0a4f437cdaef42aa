//! One name, one meaning: each public type name is declared in one crate only, except those listed here with a reason.

use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Names that several crates may use, with the reasons.
const SHARED: [(&str, &str); 6] = [
    ("Error", "a library's error, as in std"),
    ("Gains", "a law's gains, named with the law's module: `pid::Gains`"),
    ("Law", "afbc: what fills the cascade; scenario: a law of the list, with its gains"),
    ("Limits", "bounds on what the module computes, named with it: `limiter::Limits`"),
    ("Memory", "what changes from step to step, named with the module that steps"),
    ("Settings", "the constants of a crate, named with it: `estimator::Settings`"),
];
/// Largest allowed number of shared names.
const SHARED_MAX: usize = 30;

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

/// Adds the public types that tokens declare, also within modules and macros. An alias for a type of the same name does
/// not count.
fn declared(tokens: TokenStream, names: &mut BTreeSet<String>) {
    let tokens: Vec<_> = tokens.into_iter().collect();
    let word = |at: usize| match tokens.get(at) {
        Some(TokenTree::Ident(word)) => word.to_string(),
        _ => String::new(),
    };
    for (at, token) in tokens.iter().enumerate() {
        if let TokenTree::Group(group) = token {
            declared(group.stream(), names);
        }
        let kind = word(at + 1);
        if word(at) != "pub" || !["struct", "enum", "union", "trait", "type"].contains(&kind.as_str()) {
            continue;
        }
        let name = word(at + 2);
        let ends = |token: &TokenTree| matches!(token, TokenTree::Punct(mark) if mark.as_char() == ';');
        let rest = tokens.iter().skip(at + 3).take_while(|token| !ends(token));
        let is_alias = kind == "type" && rest.map(ToString::to_string).any(|token| token == name);
        if !name.is_empty() && !is_alias {
            names.insert(name);
        }
    }
}

fn names_of(text: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    declared(text.parse().unwrap(), &mut names);
    names
}

/// Returns, for each public type name, the crates that declare it.
fn crates_by_name() -> BTreeMap<String, BTreeSet<String>> {
    let within = |folder: &str| fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path());
    let single = ["firmware", "sitl"].map(|name| root().join(name));
    let mut by_name: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for folder in within("crates").chain(within("firmware/boards")).chain(single).filter(|path| path.is_dir()) {
        let owner = folder.file_name().unwrap().to_str().unwrap();
        for file in files(&folder.join("src")) {
            for name in names_of(&fs::read_to_string(file).unwrap()) {
                by_name.entry(name).or_default().insert(owner.to_owned());
            }
        }
    }
    by_name
}

#[test]
fn a_public_type_name_has_one_meaning() {
    let by_name = crates_by_name();
    assert!(by_name.len() > 400, "{} names", by_name.len());
    let shared: BTreeMap<_, _> = by_name.iter().filter(|(_, crates)| crates.len() > 1).collect();
    println!("{} of {} public type names are in more than one crate:", shared.len(), by_name.len());
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
fn every_form_of_a_public_type_is_seen() {
    let text =
        "pub struct A; mod m { pub enum B {} } made! { /// Doc.\n pub struct C {} } pub trait D {} pub type E = u8;
        pub type F = other::F<4>; pub(crate) struct G; struct H; pub fn struct_i() {} pub union J { j: u8 }";
    assert_eq!(names_of(text).into_iter().collect::<String>(), "ABCDEJ");
}
