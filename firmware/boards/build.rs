//! Sets the linker arguments of a board's images. A build script sets them so that builds from the workspace's root
//! work and the host's crates are not affected.

use std::path::Path;

fn main() {
    let board = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [own, sections] = [board.join("memory.x"), board.with_file_name("link.x")];
    let root = board.ancestors().nth(3).expect("the workspace's root");
    // Cargo takes a file that is not there for changed, and would link every image at each build.
    for file in [&own, &sections, &root.join("memory.x")].into_iter().filter(|file| file.is_file()) {
        println!("cargo:rerun-if-changed={}", file.display());
    }
    // Uses the board's own memory map. Without one, cortex-m-rt's link.x includes the map at the workspace's root.
    let scripts = if own.is_file() {
        [&own, &sections].map(|path| path.display().to_string()).to_vec()
    } else {
        println!("cargo:rustc-link-search={}", root.display());
        vec!["link.x".to_owned()]
    };
    // Sections need no alignment to pages, since a microcontroller has none.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    for script in scripts.into_iter().chain(["defmt.x".to_owned()]) {
        println!("cargo:rustc-link-arg-bins=-T{script}");
    }
}
