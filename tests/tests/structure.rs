//! Structure of the code: no circular imports between modules, no crate larger than a fifth of the whole, no overlong
//! lines.
#![allow(clippy::unwrap_used, missing_docs, reason = "what cannot be read must stop the test")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest width of a line, as `max_width` in `rustfmt.toml`.
const WIDTH: usize = 120;

/// Path of a module within its crate; empty for the crate itself.
type Module = Vec<String>;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns every file below `folder`, without build products, results and version control.
fn all_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| match path.file_name().and_then(|name| name.to_str()) {
        Some("target" | "out" | ".git") | None => Vec::new(),
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

/// Returns the numbers of a file's overlong lines. Excepted are listings, tables and lines with an address in Markdown.
fn overlong(path: &Path, text: &str) -> Vec<usize> {
    let markdown = path.extension().is_some_and(|extension| extension == "md");
    let mut listing = false;
    let mut numbers = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        listing ^= markdown && line.trim_start().starts_with("```");
        let excepted = markdown && (listing || line.starts_with('|') || line.contains("://"));
        if !excepted && line.chars().count() > WIDTH {
            numbers.push(number);
        }
    }
    numbers
}

/// Returns the folders of all crates.
fn crates() -> Vec<PathBuf> {
    let inner = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path());
    inner.chain(["sitl", "tests", "firmware"].map(|name| root().join(name))).collect()
}

/// Returns the code of one crate's files by module, without comments and tests.
fn modules(src: &Path) -> BTreeMap<Module, String> {
    let mut modules = BTreeMap::new();
    for path in files(src) {
        let within = path.strip_prefix(src).unwrap().with_extension("");
        let mut module: Module = within.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
        if module.first().is_some_and(|first| first == "bin") || module.last().is_some_and(|last| last == "tests") {
            continue;
        }
        if module.last().is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str())) {
            module.pop();
        }
        let text = fs::read_to_string(&path).unwrap();
        let text = text.split("\nmod tests {").next().unwrap();
        let lines = text.lines().map(|line| line.split("//").next().unwrap());
        modules.insert(module, lines.collect::<Vec<_>>().join(" "));
    }
    modules
}

/// Returns the paths of a `use` tree: a::b and a::c::d for `a::{b, c::d}`. Names after `as` are left out.
fn paths(tree: &str) -> Vec<Vec<String>> {
    let tree = tree.trim();
    if let Some(inner) = tree.strip_prefix('{').and_then(|tree| tree.strip_suffix('}')) {
        let (mut depth, mut parts) = (0, vec![String::new()]);
        for c in inner.chars() {
            depth += i32::from(c == '{') - i32::from(c == '}');
            match c {
                ',' if depth == 0 => parts.push(String::new()),
                _ => parts.last_mut().unwrap().push(c),
            }
        }
        return parts.iter().filter(|part| !part.trim().is_empty()).flat_map(|part| paths(part)).collect();
    }
    match tree.split_once("::") {
        Some((first, rest)) => {
            paths(rest).into_iter().map(|path| [vec![first.trim().to_owned()], path].concat()).collect()
        }
        None => vec![vec![tree.split(" as ").next().unwrap().trim().to_owned()]],
    }
}

/// Returns a path as written in `module`, from the crate's root; none if it leads elsewhere.
fn absolute(module: &Module, path: &[String], all: &BTreeMap<Module, String>) -> Option<Vec<String>> {
    let ups = path.iter().take_while(|part| *part == "super").count();
    let (base, rest) = match path.first()?.as_str() {
        "crate" => (&[][..], path.get(1..)?),
        "self" => (module.as_slice(), path.get(1..)?),
        "super" => (module.get(..module.len().checked_sub(ups)?)?, path.get(ups..)?),
        first if all.contains_key(&[module.as_slice(), &[first.to_owned()]].concat()) => (module.as_slice(), path),
        _ => return None,
    };
    Some([base, rest].concat())
}

/// Returns the imports of each module. A path to something re-exported by `pub use` leads to where that is defined.
fn imports(all: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<Module>> {
    // The module that a path leads into, and the name taken from it.
    let target = |path: &[String]| {
        let length = (0..=path.len()).rev().find(|&length| path.get(..length).is_some_and(|p| all.contains_key(p)));
        let (module, rest) = path.split_at(length.unwrap_or(0));
        (module.to_vec(), rest.first().cloned())
    };
    let (mut imports, mut handed_on) = (BTreeMap::<Module, Vec<Vec<String>>>::new(), BTreeMap::new());
    for (module, code) in all {
        // Only whole words: `use ` at the beginning of a statement.
        for statement in code.split(';') {
            let Some((before, tree)) = statement.rsplit_once("use ") else { continue };
            let is_public = before.trim_end().ends_with("pub") || before.trim_end().ends_with(')');
            for path in paths(tree).iter().filter_map(|path| absolute(module, path, all)) {
                if is_public {
                    handed_on.insert((module.clone(), path.last().cloned().unwrap()), path);
                } else {
                    imports.entry(module.clone()).or_default().push(path);
                }
            }
        }
        // Paths in the code itself, except of macros, which belong to the crate's root wherever they are defined.
        let words = code.split_inclusive(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        for word in words.filter(|word| word.starts_with("crate::") || word.starts_with("super::")) {
            let Some(word) = (!word.ends_with('!')).then(|| word.trim_end_matches(|c: char| !c.is_alphanumeric()))
            else {
                continue;
            };
            let path: Vec<String> = word.split("::").map(str::to_owned).collect();
            imports.entry(module.clone()).or_default().extend(absolute(module, &path, all));
        }
    }
    let resolve = |path: &Vec<String>| {
        let (mut module, mut name) = target(path);
        while let Some(path) = name.as_ref().and_then(|name| handed_on.get(&(module.clone(), name.clone()))) {
            (module, name) = target(path);
        }
        module
    };
    let of = |(module, paths): (&Module, &Vec<Vec<String>>)| {
        (module.clone(), paths.iter().map(resolve).filter(|target| target != module).collect())
    };
    imports.iter().map(of).collect()
}

/// Returns the modules of circular imports, if any: modules without remaining imports are removed repeatedly.
fn circle(mut imports: BTreeMap<Module, BTreeSet<Module>>) -> Vec<Module> {
    loop {
        let left: BTreeSet<Module> = imports.keys().cloned().collect();
        let before = imports.len();
        imports.retain(|_, targets| targets.iter().any(|target| left.contains(target)));
        if imports.len() == before {
            return imports.into_keys().collect();
        }
    }
}

#[test]
fn no_module_imports_one_that_imports_it() {
    // The firmware's board is one of several files under one name.
    for folder in crates().iter().filter(|folder| !folder.ends_with("firmware")) {
        let modules = modules(&folder.join("src"));
        assert!(!modules.is_empty(), "{}", folder.display());
        let circle = circle(imports(&modules));
        assert!(circle.is_empty(), "{}: among these, or in what they need: {circle:?}", folder.display());
    }
}

#[test]
fn a_circle_is_found() {
    let module = |name: &str| name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect::<Module>();
    let find = |files: &[(&str, &str)]| {
        circle(imports(&files.iter().map(|(name, code)| (module(name), (*code).to_owned())).collect()))
    };
    assert!(find(&[("", "mod a; mod b;"), ("a", "use crate::b::B;"), ("b", "fn f() {}")]).is_empty());
    assert_eq!(find(&[("a", "use crate::b::B;"), ("b", "use super::a::{self, A};")]).len(), 2);
    assert_eq!(find(&[("a", "fn f() { crate::b::g() }"), ("b", "use crate::a::A;")]).len(), 2);
    // Through a parent that re-exports its children's items.
    let parent = ("p", "mod a; mod b; pub use a::A; pub use b::{B, C};");
    assert!(find(&[parent, ("p::a", "use super::B;"), ("p::b", "fn f() {}")]).is_empty());
    assert_eq!(find(&[parent, ("p::a", "use super::B;"), ("p::b", "use crate::p::A;")]).len(), 2);
    // A parent that uses its child, which uses the parent.
    assert_eq!(find(&[("p", "mod a; use a::f; struct P;"), ("p::a", "use super::P;")]).len(), 2);
}

/// Metadata and files that a registry requires or shows; `scripts/check-packages` packs and compiles each crate.
#[test]
fn crates_to_be_published_have_complete_metadata() {
    let mut published = Vec::new();
    for folder in crates() {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let has = |start: &str| manifest.lines().any(|line| line.starts_with(start));
        if has("publish") {
            // Inherited from the workspace: false.
            assert!(has("publish.workspace = true"), "{}", folder.display());
            continue;
        }
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        let told = ["description = ", "keywords = ", "categories = ", "readme = ", "license.", "rust-version."];
        for key in told.into_iter().chain(["[package.metadata.docs.rs]", "all-features = true"]) {
            assert!(has(key), "{name}: {key}");
        }
        for file in ["README.md", "LICENSE-MIT", "LICENSE-APACHE"] {
            assert!(fs::read_to_string(folder.join(file)).is_ok_and(|text| text.lines().count() > 5), "{name}: {file}");
        }
        published.push(name);
    }
    published.sort();
    assert_eq!(published, ["afbc", "control", "estimator", "flight-core", "fpu", "link", "peers", "plant", "types"]);
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

#[test]
fn lines_are_at_most_120_columns_wide() {
    assert!(fs::read_to_string(root().join("rustfmt.toml")).unwrap().contains(&format!("max_width = {WIDTH}\n")));
    let mut checked = 0;
    for path in all_files(root()) {
        let named = |name: &str| path.parent().and_then(Path::file_name).is_some_and(|folder| folder == name);
        let script = named("scripts") || named(".ci");
        let text = path.extension().is_some_and(|extension| ["rs", "md", "toml"].iter().any(|text| extension == *text));
        if !script && !text {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(overlong(&path, &text), [], "lines of {}", path.display());
        checked += 1;
    }
    assert!(checked > 200, "{checked} files");
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
