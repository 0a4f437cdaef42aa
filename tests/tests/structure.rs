//! Structure of the code: no circular imports between modules, and no crate larger than a fifth of the whole.

use crate::imports::{Crate, circles, within};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns every file below `folder`, without build products, results and version control.
fn all_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| match path.file_name().and_then(|name| name.to_str()) {
        Some("target" | "out" | ".git" | "node_modules") | None => Vec::new(),
        _ if path.is_dir() => all_files(&path),
        _ => vec![path],
    };
    entries.flat_map(of).collect()
}

/// Returns every Rust file below `folder`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let rust = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "rs");
    all_files(folder).into_iter().filter(rust).collect()
}

/// Returns the folders of all crates.
fn crates() -> Vec<PathBuf> {
    let manifests = all_files(root()).into_iter().filter(|path| path.ends_with("Cargo.toml"));
    manifests.filter_map(|path| path.parent().map(Path::to_owned)).filter(|folder| folder != root()).collect()
}

/// Returns the root file of every program, library and test of a package.
fn targets(package: &Path) -> Vec<PathBuf> {
    let manifest = fs::read_to_string(package.join("Cargo.toml")).unwrap();
    let named = manifest.split('"').filter(|word| word.ends_with(".rs")).map(PathBuf::from);
    let usual = ["src/lib.rs", "src/main.rs", "build.rs"].map(PathBuf::from);
    let mut found: Vec<_> = named.chain(usual).map(|path| package.join(path)).filter(|path| path.is_file()).collect();
    for folder in ["src/bin", "tests", "benches", "examples"] {
        let within = fs::read_dir(package.join(folder)).into_iter().flatten().map(|entry| entry.unwrap().path());
        found.extend(within.filter(|path| path.extension().is_some_and(|extension| extension == "rs")));
    }
    found.sort();
    found.dedup();
    found
}

#[test]
fn no_module_imports_one_that_imports_it() {
    let mut seen = BTreeSet::new();
    for target in crates().iter().flat_map(|package| targets(package)) {
        let read = Crate::read(&target, &|path| fs::read_to_string(path).ok());
        seen.extend(read.files().map(|file| file.canonicalize().unwrap()));
        let imports = read.imports();
        let circles: Vec<_> = circles(&imports).iter().map(|circle| within(&imports, circle)).collect();
        assert!(circles.is_empty(), "circles of imports: {}", circles.join("\n"));
    }
    let all: BTreeSet<_> = files(root()).iter().map(|file| file.canonicalize().unwrap()).collect();
    assert_eq!(all.difference(&seen).collect::<Vec<_>>(), Vec::<&PathBuf>::new(), "belong to no crate");
}

/// Returns the circles of a crate with these files. Its root file only declares them.
fn found(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let declared = files.iter().filter_map(|(name, _)| name.strip_suffix(".rs").filter(|name| !name.contains('/')));
    let root: String = declared.map(|name| format!("mod {name};\n")).collect();
    let text = |path: &Path| {
        let given = files.iter().find(|(name, _)| Path::new(name) == path).map(|(_, text)| (*text).to_owned());
        given.or_else(|| (path == Path::new("lib.rs")).then(|| root.clone()))
    };
    let imports = Crate::read(Path::new("lib.rs"), &text).imports();
    let name = |path: &PathBuf| path.display().to_string();
    circles(&imports).iter().map(|circle| circle.iter().map(name).collect()).collect()
}

/// Tries every form in which `a` may name an item of `b`, which imports `a`.
#[test]
fn a_circle_is_found() {
    let forms = [
        "use crate::b::B;",
        "use crate::b::B as Other;",
        "use crate::b::*;",
        "use crate::{b::{self, B}};",
        "use super::b;",
        "pub use crate::b::B;",
        "fn f() { use crate::b; b::g() }",
        "use crate::b as other; fn f() { other::g() }",
        "use crate::c; fn f() { c::g() }",
        "use crate::c::*; fn f() -> B { loop {} }",
        "use crate::c::inner; fn f() { inner::deep::g() }",
        "use crate::*; fn f() { b::g() }",
        "extern crate self as own; use own::b::B;",
        "fn f() { crate::b::g() }",
        "fn f() { super::b::g() }",
        "fn f(_: &dyn Into<crate::b::B>) {}",
        "fn f() -> u8 { <crate::b::B as Into<u8>>::into(crate::b::B) }",
        "use crate::b::Kind::{One, Two};",
        "fn f(kind: u8) -> bool { matches!(kind, crate::b::Kind::One) }",
        "const N: usize = crate::b::N;",
        "impl crate::b::Trait for u8 {}",
        "struct S<T: crate::b::Trait>(T);",
        "mod inner { use super::super::b::B; }",
        "mod inner { pub mod deep { fn f() { crate::b::g() } } }",
        "macro_rules! m { () => { crate::b::g() } }",
        "macro_rules! m { () => { $crate::b::g() } }",
        "macro_rules! m { () => { $crate::b::{self, B} } }",
        "macro_rules! m { () => { super::b::g() } } fn f() { m!() }",
        "use crate::b; macro_rules! m { () => { b::g() } } fn f() { m!() }",
        "fn f() { println!(\"{}\", crate::b::N) }",
        "use crate::b; fn f() { println!(\"{}\", [0; 2][..b::N].len()) }",
        "fn f() { vec![super::b::g()]; }",
        "thread_local! { static T: crate::b::B = crate::b::B; }",
        "fn f() { crate::made!() }",
        "fn f() { crate::b::local!() }",
        "fn f() { in_text!() }",
        "#[derive(crate::b::Derived)] struct S;",
        "#[serde(with = \"crate::b\")] struct S;",
    ];
    let b = "use crate::a::A; pub struct B; pub enum Kind { One, Two } pub const N: usize = 1; pub trait Trait {}
        pub fn g() {} #[macro_export] macro_rules! made { () => {} } macro_rules! local { () => {} }
        pub(crate) use local; macro_rules! in_text { () => {} }";
    let c = "pub use crate::b::*; pub use crate::b::g; pub mod inner { pub use crate::b as deep; }";
    for form in forms {
        let a = format!("pub struct A; {form}");
        let circles = found(&[("b.rs", b), ("c.rs", c), ("a.rs", &a)]);
        // A file that re-exports a name is part of the circle only if it is imported as a whole.
        let is_found = circles.iter().any(|circle| circle.contains(&"a.rs".into()) && circle.contains(&"b.rs".into()));
        assert!(is_found, "{form}: {circles:?}");
    }
}

#[test]
fn what_is_no_circle_is_not_found() {
    let b = "use crate::a::A; pub struct B; pub fn g() {}";
    for form in [
        "use std::fmt; fn f() { fmt::format(format_args!(\"crate::b\")); }",
        "use ::b::B;",
        "// use crate::b::B;\n/// [`B`](crate::b::B)\nfn f() { \"crate::b::B\"; }",
        "#[cfg(test)] mod tests { use crate::b::B; }",
        "#[cfg(test)] use crate::b::B;",
        "pub(in crate::b) fn f() {}",
        "fn f(b: u8) -> u8 { b }",
        "fn f() { let b = S { g: 1 }; b.g; }",
        "fn g() {} fn f() { g() }",
        "mod b { pub fn g() {} } fn f() { b::g() }",
    ] {
        let circles = found(&[("a.rs", &format!("pub struct A; {form}")), ("b.rs", b)]);
        assert!(circles.is_empty(), "{form}: {circles:?}");
    }
    // A module and a function, or a macro, may have the same name.
    let twice = [("a.rs", "mod f; pub use f::f; pub struct A;"), ("a/f.rs", "pub fn f() {}"), ("b.rs", b)];
    assert!(found(&twice).is_empty());
    let twice =
        [("m.rs", "fn f() { crate::m!() }"), ("n.rs", "use crate::m; #[macro_export] macro_rules! m { () => {} }")];
    assert_eq!(found(&twice), [["m.rs", "n.rs"]]);
    let twice = [
        ("m.rs", "use crate::n::N;"),
        ("n.rs", "pub struct N; #[macro_export] macro_rules! m { () => {} } crate::m!();"),
    ];
    assert!(found(&twice).is_empty());
}

/// If all tests of a crate are one program, the program names every test file. A forgotten file would never run.
#[test]
fn every_test_is_in_its_program() {
    let mut programs = 0;
    for manifest in all_files(root()).iter().filter(|path| path.ends_with("Cargo.toml")) {
        let text = fs::read_to_string(manifest).unwrap();
        if !text.contains("autotests = false") {
            continue;
        }
        programs += 1;
        let folder = manifest.parent().unwrap().join("tests");
        let all = fs::read_to_string(folder.join("all.rs")).unwrap();
        for file in fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file()) {
            let Some(name) = file.file_name().unwrap().to_str().unwrap().strip_suffix(".rs") else { continue };
            let runs = all.contains(&format!("mod {name};")) || text.contains(&format!("[[test]]\nname = \"{name}\""));
            assert!(runs, "{}: neither in all.rs nor a [[test]]", file.display());
        }
    }
    assert!(programs >= 10, "{programs} programs");
}

/// A parent that only declares its children and re-exports their items is in no circle. A parent that uses the items
/// may be.
#[test]
fn parents_are_distinguished_from_their_children() {
    let parent = ("p.rs", "mod a; mod b; pub use a::A; pub use b::{B, C};");
    let a = ("p/a.rs", "use super::B; pub struct A;");
    assert!(found(&[parent, a, ("p/b.rs", "pub struct B; pub struct C;")]).is_empty());
    assert!(found(&[parent, a, ("p/b.rs", "use crate::p; pub struct B; pub struct C;")]).is_empty());
    assert_eq!(found(&[parent, a, ("p/b.rs", "use crate::p::A; pub struct B;")]), [["p/a.rs", "p/b.rs"]]);
    for parent in [
        "mod a; use a::f; pub struct P;",
        "mod a; pub use a::f; pub struct P; fn g() { f() }",
        "mod a; pub struct P; fn g() { a::f() }",
        "mod a; pub struct P; fn g() { vec![a::f()]; }",
    ] {
        let child = ("p/a.rs", "use super::P; pub fn f() {}");
        assert_eq!(found(&[("p.rs", parent), child]), [["p/a.rs", "p.rs"]], "{parent}");
    }
    // A child that uses a private import of its parent imports from the parent.
    let parent = "mod a; mod b; use a::A; use b::f;";
    assert_eq!(
        found(&[("p.rs", parent), ("p/a.rs", "pub struct A;"), ("p/b.rs", "use super::A; pub fn f() {}")]),
        [["p/b.rs", "p.rs"]]
    );
    // Separate circles are reported separately.
    let pairs =
        [("a.rs", "use crate::b::B;"), ("b.rs", "use crate::a::A; use crate::c::C;"), ("c.rs", "use crate::d::D;")];
    assert_eq!(found(&[&pairs[..], &[("d.rs", "use crate::c::C;")]].concat()), [["a.rs", "b.rs"], ["c.rs", "d.rs"]]);
}

/// Checks the metadata and files that a registry requires or shows. `scripts/check-packages` packs and compiles each
/// crate.
#[test]
fn crates_to_be_published_have_complete_metadata() {
    let mut published = Vec::new();
    for folder in crates() {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let has = |start: &str| manifest.lines().any(|line| line.starts_with(start));
        if has("publish") {
            // The key may be inherited from the workspace, where publishing is off too.
            assert!(has("publish.workspace = true") || has("publish = false"), "{}", folder.display());
            continue;
        }
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        let required = ["description = ", "keywords = ", "categories = ", "readme = ", "license.", "rust-version."];
        for key in required.into_iter().chain(["[package.metadata.docs.rs]", "all-features = true"]) {
            assert!(has(key), "{name}: {key}");
        }
        for file in ["README.md", "LICENSE-MIT", "LICENSE-APACHE"] {
            assert!(fs::read_to_string(folder.join(file)).is_ok_and(|text| text.lines().count() > 5), "{name}: {file}");
        }
        published.push(name);
    }
    published.sort();
    assert_eq!(published, ["afbc", "control", "estimator", "flight-core", "fpu", "laws", "mavlink", "plant", "types"]);
    assert!(fs::read_to_string(root().join("Cargo.toml")).unwrap().contains("\npublish = false\n"));
}

/// The README states the length of the example.
#[test]
fn a_custom_law_takes_at_most_60_lines() {
    let example = fs::read_to_string(root().join("crates/sim/examples/own_law.rs")).unwrap();
    assert!(example.lines().count() <= 60, "{} lines", example.lines().count());
}

#[test]
fn no_crate_is_more_than_a_fifth_of_the_code() {
    let lines = |path: &PathBuf| fs::read_to_string(path).unwrap().lines().count();
    let sizes: Vec<(PathBuf, usize)> =
        crates().into_iter().map(|folder| (folder.clone(), files(&folder).iter().map(lines).sum())).collect();
    let whole: usize = sizes.iter().map(|(_, lines)| lines).sum();
    for (folder, lines) in sizes {
        assert!(5 * lines <= whole, "{}: {lines} of {whole} lines", folder.display());
    }
}

/// Decisions that go beyond the paper are marked "Not in the paper".
#[test]
fn decisions_beyond_the_paper_have_one_marker() {
    let marker = concat!("Our", "s");
    for path in files(root()) {
        let text = fs::read_to_string(&path).unwrap();
        for punctuation in [".", ":", ","] {
            assert!(!text.contains(&format!("{marker}{punctuation}")), "{}", path.display());
        }
    }
}
