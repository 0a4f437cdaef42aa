//! Campaigns on many machines, from outside: what a cluster's shell, log and disks see.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An empty folder of its own for each test.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cluster").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn sitl(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sitl")).current_dir(folder).args(arguments).output().unwrap()
}

/// What is printed if all goes well.
fn succeeds(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Short flights, some of which are lost.
const SHORT: &str = r#"
name = "short"
flights = 40
duration_s = 6.0
scenario = "hover"

[spread]
thrust_factor_ratio = [0.2, 1.2]
rotor_time_constant_s = 0.02
"#;

/// Each machine has the campaign's file somewhere else, and under another name: the results are the same all the same.
#[test]
fn results_do_not_depend_on_where_the_file_is() {
    let folder = folder("paths");
    fs::create_dir(folder.join("elsewhere")).unwrap();
    let paths = ["short.toml", "./short.toml", "elsewhere/copy of it.toml"];
    for path in paths {
        fs::write(folder.join(path), SHORT).unwrap();
    }
    let absolute = folder.join("short.toml").display().to_string();
    let all: Vec<&str> = paths.into_iter().chain([absolute.as_str()]).collect();
    for (i, path) in all.iter().enumerate() {
        let table = succeeds(&sitl(&folder, &["campaign", path, "--out", &format!("whole-{i}")]));
        // Who sits before the terminal can fly a flight again as it is printed.
        let quoted = if path.contains(' ') { format!("\"{path}\"") } else { (*path).to_owned() };
        assert!(table.contains(&format!("sitl campaign {quoted} --flight ")), "{table}");
    }
    for (i, path) in all.iter().take(3).enumerate() {
        let shard = format!("{}/3", i + 1);
        succeeds(&sitl(&folder, &["campaign", path, "--shard", &shard, "--out", &format!("part-{i}")]));
    }
    succeeds(&sitl(&folder, &["merge", "part-0", "part-1", "part-2", "--out", "merged"]));
    for file in ["results.parquet", "report.html", "summary.json", "campaign.json"] {
        let read = |out: &str| fs::read(folder.join(out).join(file)).unwrap();
        for out in ["whole-1", "whole-2", "whole-3", "merged"] {
            assert!(read("whole-0") == read(out), "{out}/{file}");
        }
    }
    let page = fs::read_to_string(folder.join("merged/report.html")).unwrap();
    assert!(page.contains("sitl campaign short.toml --flight "));
}
