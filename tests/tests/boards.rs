//! Firmware and boards meet in one place, and the documented wiring is that of the code.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // a file that cannot be read must stop the test

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Returns every Rust file below `folder`, with its text.
fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push((path.clone(), fs::read_to_string(&path).unwrap()));
        }
    }
    found
}

/// Returns the names of pins in `text`: P, a port, a number.
fn pins(text: &str) -> BTreeSet<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric());
    let is_pin = |word: &&str| {
        word.strip_prefix('P').is_some_and(|rest| {
            let number = rest.trim_start_matches(|c: char| c.is_ascii_uppercase());
            rest.len() == number.len() + 1 && number.parse::<u8>().is_ok_and(|number| number < 16)
        })
    };
    words.filter(is_pin).map(str::to_owned).collect()
}

#[test]
fn every_board_is_a_folder_and_meets_the_firmware_once() {
    let boards: Vec<_> = fs::read_dir(root().join("boards")).unwrap().map(|entry| entry.unwrap().path()).collect();
    let boards: Vec<_> = boards.iter().filter(|path| path.is_dir()).collect();
    assert!(boards.len() >= 3, "{boards:?}");
    for board in boards {
        let files = sources(board);
        for once in ["firmware::image!(", "impl Board for "] {
            let count: usize = files.iter().map(|(_, text)| text.matches(once).count()).sum();
            assert_eq!(count, 1, "{}: {once}", board.display());
        }
        assert!(board.join("memory.x").is_file() || root().join("memory.x").is_file(), "{}", board.display());
    }
}

/// No board is selected by `#[path]` or conditional compilation, and no chip is named.
#[test]
fn the_firmware_knows_no_board() {
    let manifest = fs::read_to_string(root().join("firmware/Cargo.toml")).unwrap();
    let firmware = sources(&root().join("firmware"));
    assert!(firmware.len() >= 7, "{firmware:?}");
    for (path, text) in firmware {
        assert!(pins(&text).is_empty(), "{}: {:?}", path.display(), pins(&text));
        for choice in ["cfg(", "cfg_attr", "peripherals::", "board_"] {
            assert!(!text.contains(choice), "{}: {choice}", path.display());
        }
        for chip in ["stm32", "f405", "h743", "usart", "can2"] {
            for text in [&text, &manifest] {
                assert!(!text.to_lowercase().contains(chip), "{}: {chip}", path.display());
            }
        }
    }
    for folder in ["boards", "chips", "crates", "firmware", "sitl", "tests"] {
        for (path, text) in sources(&root().join(folder)) {
            let is_moved = text.lines().any(|line| line.trim_start().starts_with("#[") && line.contains("path = "));
            assert!(!is_moved, "{}", path.display());
        }
    }
}

#[test]
fn the_wiring_is_what_the_board_uses() {
    let page = fs::read_to_string(root().join("docs/firmware.md")).unwrap();
    let wiring = page.split("\n## ").find(|section| section.starts_with("Wiring")).unwrap();
    for (board, heading, count) in [("stm32f405", "Wiring", 6), ("stm32h743", "Matek H743", 28)] {
        let table = wiring.split("\n### ").find(|section| section.starts_with(heading)).unwrap();
        let code = fs::read_to_string(root().join("boards").join(board).join("src/board.rs")).unwrap();
        let (head, body) = code.split_once("\nuse ").unwrap();
        assert_eq!(pins(body).len(), count, "{board}: {:?}", pins(body));
        // Those of crystal and debugger are fixed by the chip.
        let fixed = ["PH0", "PH1", "PA13", "PA14"].map(str::to_owned).into();
        assert_eq!(&pins(table) - &fixed, pins(body), "docs/firmware.md, {board}");
        assert_eq!(&pins(head) - &fixed, pins(body), "the table of {board} itself");
    }
}
