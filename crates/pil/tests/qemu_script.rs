//! Runs `scripts/qemu.sh` twice at once: it must install only once and finish what an earlier run left unfinished. Apt,
//! dpkg and QEMU are replaced by stand-ins.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "test")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/qemu.sh");

/// Creates a program in the first folder of the search path.
fn stand_in(folder: &Path, name: &str, body: &str) {
    let path = folder.join(name);
    fs::write(&path, format!("#!/bin/bash\n{body}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
}

#[test]
fn two_at_once_install_once() {
    let folder = std::env::temp_dir().join(format!("qemu-script-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let log = folder.join("log");
    let (log, done) = (log.display(), folder.join("done"));
    let done = done.display();
    let note = format!("echo \"begin $0 $*\" >>{log}; sleep 0.3; echo \"end $0 $*\" >>{log}");
    stand_in(&folder, "sudo", "exec \"$@\"");
    stand_in(&folder, "dpkg", &note);
    stand_in(&folder, "apt-get", &format!("{note}\ncase \"$*\" in *qemu-system-arm*) touch {done};; esac"));
    let version = format!("[ -e {done} ] && echo 'QEMU emulator version 8.2.0' || echo 'QEMU emulator version 7.2.0'");
    stand_in(&folder, "qemu-system-arm", &version);

    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let start = || {
        let mut script = Command::new(SCRIPT);
        script.env("PATH", &path).env("TMPDIR", &folder).stdout(Stdio::piped()).spawn().unwrap()
    };
    for script in [start(), start()] {
        let output = script.wait_with_output().unwrap();
        assert!(output.status.success());
        assert!(String::from_utf8_lossy(&output.stdout).contains("8.2.0"));
    }
    let log = fs::read_to_string(folder.join("log")).unwrap();
    fs::remove_dir_all(&folder).unwrap();
    let lines: Vec<&str> = log.lines().collect();
    for pair in lines.chunks(2) {
        let [begin, end] = pair else { panic!("{log}") };
        assert_eq!(begin.strip_prefix("begin"), end.strip_prefix("end"), "two ran at once:\n{log}");
    }
    assert_eq!(log.matches("begin").count(), 3, "dpkg, update, install:\n{log}");
    assert!(lines.first().unwrap().ends_with("dpkg --configure -a"), "first of all, what was left:\n{log}");
}
