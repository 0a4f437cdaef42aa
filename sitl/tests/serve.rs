//! Tests `sitl serve`: messages, errors and exit codes.

#![expect(clippy::unwrap_used, reason = "tests")]

use crate::common::{command, folder, refused, sitl, succeeds};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::UdpSocket;
use std::process::{Child, Command, Output, Stdio};

/// Serves at free ports, and sends nothing to anyone.
const ALONE: [&str; 7] = ["serve", "--port", "0", "--station", "none", "--companion", "none"];

fn started(test: &str, arguments: &[&str]) -> Child {
    let all = [&ALONE, arguments].concat();
    command(&folder(test), &all).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Runs `sitl serve` with these lines on stdin.
fn with_lines(test: &str, arguments: &[&str], lines: &str) -> Output {
    let mut child = started(test, arguments);
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn a_newcomer_learns_how_to_connect_each_client() {
    let lines = ["serve", "--port", "0", "--tcp", "0", "--fast", "--vehicles", "3", "--do", "at 0.01 quit"];
    let reported = succeeds(&sitl(&folder("newcomer"), &lines));
    for wanted in [
        "outdoor: 3 vehicles, system ids 1 to 3.",
        "System().connect(\"udpin://0.0.0.0:14540\")",
        "QGroundControl  connects automatically",
        "mavproxy.py --master=udpin:0.0.0.0:14550",
        "mavutil.mavlink_connection(\"udpin:0.0.0.0:14550\")",
        "udpout:127.0.0.1:",
        "tcp:127.0.0.1:",
        "0.010 ok at 0.01 quit",
    ] {
        assert!(reported.contains(wanted), "{wanted}: {reported}");
    }
}

/// In lockstep, the answers depend on the lines alone.
#[test]
fn the_same_lines_give_the_same_answers() {
    let lines = "step 1000\nwind 5 0 0\nstep 500\nnonsense\nfault gnss lost\nstatus\nstep 100\nstatus\n";
    let options = ["--lockstep", "--seed", "7", "--do", "at 1.2 battery 0.4"];
    let [first, second] = ["first", "second"].map(|test| succeeds(&with_lines(test, &options, lines)));
    // Skips the connection guide, which names the ports.
    let answers =
        |reported: &str| reported.lines().skip_while(|line| !line.starts_with("ok")).map(str::to_owned).collect();
    let [first, second]: [Vec<String>; 2] = [&first, &second].map(|reported| answers(reported));
    assert_eq!(first, second);
    assert!(first.iter().any(|line| line == "1.200 ok at 1.2 battery 0.4"), "{first:?}");
    assert!(first.last().is_some_and(|line| line == "ok status, 1.600 s"), "{first:?}");
    assert!(first.iter().any(|line| line.contains("1.600 s, disarmed") && line.ends_with("gnss-lost")), "{first:?}");
}

#[test]
fn what_cannot_be_served_is_refused_in_one_line() {
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let folder = folder("refused");
    for (arguments, wanted) in [
        (&["serve", "--port", port.as_str()] as &[&str], "is taken, perhaps by another sitl serve"),
        (&["serve", "--port", "0", "--do", "wind 5"], "--do 'wind 5': wind X Y Z: three numbers are needed"),
        (&["serve", "--port", "0", "--do", "quit"], "--do 'quit': this command has no effect before the start"),
        (&["serve", "--port", "0", "--station", "nobody"], "--station nobody: no such address"),
        (&["serve", "--port", "0", "--scenario", "outdor"], "no such scenario; did you mean outdoor?"),
        (&["serve", "--port", "0", "--scenario", "hover"], "the vehicle has no sensors to fly with"),
        (&["serve", "--port", "0", "--bind", "192.0.2.1"], "192.0.2.1 is no address of this machine"),
        (&["serve", "--port", "0", "--parameters", "no/such"], "no/such: its folder does not exist; make it first"),
        (&["serve", "--port", "65535", "--vehicles", "2"], "the ports from 65535 on do not suffice for 2 vehicles"),
    ] {
        let error = refused(&sitl(&folder, arguments));
        assert!(error.contains(wanted) && error.lines().count() == 1, "{arguments:?}: {error}");
    }
}

#[test]
fn ctrl_c_ends_it_cleanly() {
    for (signal, options) in [("-INT", &[] as &[&str]), ("-TERM", &["--lockstep"])] {
        let mut child = started(&format!("ctrl-c{signal}"), options);
        let mut reported = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        while !line.starts_with("Lines typed here") {
            line.clear();
            assert_ne!(reported.read_line(&mut line).unwrap(), 0, "it ended before it served");
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let mut rest = String::new();
        reported.read_to_string(&mut rest).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(130), "{rest}");
    }
}

/// Output that nobody reads, more than a pipe holds, does not stop the flight.
#[test]
fn an_unread_output_stops_nothing() {
    for pace in ["--fast", "--lockstep"] {
        let mut child = started(&format!("unread{pace}"), &[pace, "--vehicles", "4", "--do", "at 3 quit"]);
        let mut lines = child.stdin.take().unwrap();
        lines.write_all("status\n".repeat(if pace == "--fast" { 1000 } else { 600 }).as_bytes()).unwrap();
        lines.write_all(b"step 5000\n").unwrap();
        let ended = (0..6000).find_map(|_| {
            std::thread::sleep(std::time::Duration::from_millis(10));
            child.try_wait().unwrap()
        });
        let _ = child.kill();
        assert_eq!(ended.map(|status| status.code()), Some(Some(0)), "{pace}");
    }
}

/// The end of stdin, as under a service manager, ends only a lockstep.
#[test]
fn without_stdin_it_goes_on() {
    let reported = succeeds(&with_lines("no-stdin", &["--fast", "--indoors", "--do", "at 5 quit"], ""));
    assert!(
        reported.contains("mocap: 1 vehicle, system id 1.") && reported.ends_with("5.000 ok at 5 quit\n"),
        "{reported}"
    );
}
