//! Tests logs on disks that are full or stuck.
#![cfg(unix)]
#![allow(clippy::expect_used, missing_docs, reason = "tests")]

use afbc_files::OutputFile;
use afbc_hil::{LogFile, UlogFiles};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::{Sender, channel};

const FULL: &str = "/dev/full";

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("log_file").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("made");
    folder
}

/// Creates a pipe at `path` that takes nothing: its reader does not read until it gets a signal.
fn stuck(path: &Path) -> Sender<()> {
    assert!(Command::new("mkfifo").arg(path).status().expect("run").success());
    let (begin, waits) = channel();
    let pipe = path.to_owned();
    std::thread::spawn(move || {
        let mut reader = File::open(pipe).expect("opened");
        let _ = waits.recv();
        std::io::copy(&mut reader, &mut std::io::sink())
    });
    begin
}

#[test]
fn a_log_is_whole() {
    let path = folder("whole").join("whole");
    let log = LogFile::create(&OutputFile::new(&path, "--exact-log").expect("new")).expect("created");
    let mut sink = log.sink();
    let bytes: Vec<u8> = (0..30_000_000_u32).map(|it| (it / 7) as u8).collect();
    // The bytes come faster than any disk writes, but the file must be complete.
    bytes.chunks(777).for_each(&mut sink);
    log.finish().expect("written");
    assert!(fs::read(path).expect("read") == bytes && log.take_failure().is_none());
}

#[test]
fn a_full_disk_fails_the_end() {
    if !Path::new(FULL).exists() {
        return;
    }
    for bytes in [1, 200_000] {
        let log = LogFile::to(File::create(FULL).expect("opened")).expect("begun");
        log.sink()(&vec![0; bytes]);
        assert!(log.finish().is_err_and(|error| error.kind() == std::io::ErrorKind::StorageFull), "{bytes}");
        assert!(log.finish().is_err(), "it does not become whole by asking again");
    }
    // A live log reports the failure once, while the flight continues.
    let log = LogFile::to(File::create(FULL).expect("opened")).expect("begun").live();
    log.sink()(&[0; 200_000]);
    let told = std::iter::repeat_with(|| log.take_failure()).flatten().next();
    assert!(told.is_some_and(|told| told.contains("No space left")) && log.take_failure().is_none());
}

/// A live log does not wait for the disk: it ends, and reports that once.
#[test]
fn a_live_log_waits_for_no_disk() {
    let folder = folder("stuck");
    let path = folder.join("pipe");
    let _begin = stuck(&path);
    let log = LogFile::to(File::create(&path).expect("opened")).expect("begun").live();
    let mut sink = log.sink();
    (0..40_000).for_each(|_| sink(&[0; 1000]));
    assert_eq!(log.take_failure().as_deref(), Some("the disk is too slow for the log"));
    assert_eq!(log.take_failure(), None);
}

/// Each start has its own complete file.
#[test]
fn every_start_ends_whole() {
    let folder = folder("starts");
    let mut logs = UlogFiles::create(&folder).expect("created").live();
    for start in 1..=8_u8 {
        logs.sink()(&vec![start; 100_000]);
        logs.next_start();
    }
    logs.finish().expect("whole");
    for start in 1..=8_u8 {
        let path = folder.join(format!("log{start:03}.ulg"));
        assert!(fs::read(path).expect("read") == vec![start; 100_000], "{start}");
    }
}
