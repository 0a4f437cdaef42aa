//! Tests `sitl bring-up` with a served vehicle, and with connections that have no board.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder, refused, sitl};
use std::fs;
use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::process::Stdio;
use std::thread;

/// Runs in real time, like a board, so verdicts that depend on this machine's load are not checked.
#[test]
fn a_served_vehicle_is_asked_everything() {
    let folder = folder("served");
    let options = ["serve", "--port", "0", "--station", "none", "--companion", "none"];
    let mut served = command(&folder, &options).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(served.stdout.take().unwrap()).lines();
    let at = lines.find_map(|line| line.unwrap().split_once("udpout:").map(|(_, at)| at.to_owned())).unwrap();
    let at = at.split(',').next().unwrap().to_owned();
    let rest = thread::spawn(move || lines.for_each(drop));
    let connection = format!("udp:{at}");
    let asked = ["bring-up", "--yes", "--rest", "2", "--connect", &connection, "--out", "log.md", "--board", "served"];
    let output = sitl(&folder, &asked);
    drop(served.kill());
    served.wait().unwrap();
    rest.join().unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 1)), "{error}");
    let log = fs::read_to_string(folder.join("log.md")).unwrap();
    for wanted in [
        "| board, as given by the user | served |",
        concat!("| firmware | ", env!("CARGO_PKG_VERSION"), " |"),
        "| parameters | passed |",
        "| gyroscope | well |",
        "| gyroscope, deviation [rad/s] | ",
        "| right side down | not done |",
        "| SER_TEL1_BAUD | 460800 |",
    ] {
        assert!(log.contains(wanted), "{wanted}: {log}\n{error}");
    }
    // A second log does not replace the first.
    let error = refused(&sitl(&folder, &asked));
    assert!(error.contains("log.md: the file exists already"), "{error}");
}

#[test]
fn what_is_no_board_is_refused_in_one_line() {
    let folder = folder("refused");
    let mute = UdpSocket::bind("127.0.0.1:0").unwrap();
    let silent = format!("udp:{}", mute.local_addr().unwrap());
    let closed = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let closed = format!("udp:{closed}");
    let babbling = UdpSocket::bind("127.0.0.1:0").unwrap();
    let babbled = format!("udp:{}", babbling.local_addr().unwrap());
    // Answers every sender as a Betaflight board would.
    thread::spawn(move || {
        while let Ok((_, from)) = babbling.recv_from(&mut [0; 512]) {
            drop(babbling.send_to(b"$M>\x03\x01\x00\x01\x2c\x2f\r\n# Betaflight", from));
        }
    });
    for (connection, wanted) in [
        ("serial:/dev/no-such-board", "the serial port cannot be opened"),
        (silent.as_str(), "the board sends nothing"),
        (closed.as_str(), "no program listens at this port"),
        (babbled.as_str(), "bytes but no MAVLink heartbeat"),
        ("udp:nowhere", "nowhere: no such address"),
    ] {
        let output = sitl(&folder, &["bring-up", "--yes", "--connect", connection, "--out", "none.md"]);
        let error = refused(&output);
        assert!(error.contains(wanted) && error.lines().count() == 1, "{connection}: {error}");
    }
    assert!(!folder.join("none.md").exists());
    // Without --yes, nobody confirms here that the propellers are off.
    let output = command(&folder, &["bring-up", "--out", "none.md"]).stdin(Stdio::null()).output().unwrap();
    assert!(refused(&output).contains("take the propellers off first"));
}
