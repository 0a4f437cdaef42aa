//! Output lines that nobody reads.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_scenario::built_in;
use afbc_serve::{InputLines, Interfaces, LineOutput, Ports, RunEnd, Server, TimeRate, fleet, run};
use std::io::{self, Cursor, Write};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

/// A reader that starts to read when it is told to.
#[derive(Clone)]
struct Reader {
    begin: Arc<Mutex<Option<Receiver<()>>>>,
    read: Arc<Mutex<Vec<u8>>>,
}

impl Reader {
    fn new() -> (Self, Sender<()>) {
        let (sender, begin) = channel();
        (Reader { begin: Arc::new(Mutex::new(Some(begin))), read: Arc::default() }, sender)
    }

    fn lines(&self) -> Vec<String> {
        String::from_utf8(self.read.lock().unwrap().clone()).unwrap().lines().map(str::to_owned).collect()
    }
}

impl Write for Reader {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Some(begin) = self.begin.lock().unwrap().take() {
            let _ = begin.recv();
        }
        self.read.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writing never blocks, however many lines nobody reads. Once somebody reads, the number of lost lines is reported.
#[test]
fn lines_that_nobody_reads_are_counted() {
    let (reader, begin) = Reader::new();
    let mut output = LineOutput::to(reader.clone()).unwrap();
    let all = 100_000;
    (0..all).for_each(|number| output.line(&format!("{number} of some lines that somebody may want to read")));
    begin.send(()).unwrap();
    output.wait_for_room();
    output.line("the last one");
    output.finish();
    let lines = reader.lines();
    let [.., lost, last] = lines.as_slice() else { unreachable!() };
    assert_eq!(last, "the last one");
    let lost: usize = lost.strip_prefix("lost ").unwrap().split(' ').next().unwrap().parse().unwrap();
    // All lines are complete and in order, and each is either there or counted as lost.
    let kept = &lines[..lines.len() - 2];
    assert!(kept.iter().enumerate().all(|(place, line)| line.starts_with(&format!("{place} of "))));
    assert!(lost > 0 && kept.len() + lost == all, "{} and {lost}", kept.len());
}

/// A flight continues to its end while nobody reads its output.
#[test]
fn a_flight_waits_for_no_reader() {
    let mut server = Server::new(&fleet(&built_in("mocap").unwrap().read().unwrap(), 1).unwrap(), 1).unwrap();
    let addresses = afbc_serve::Addresses { udp: 0, stations: vec![], companions: vec![], ..Default::default() };
    let mut ports = Ports::open(&addresses, 1).unwrap();
    for line in 0..1000 {
        assert_eq!(
            server.line(&format!("at {} help", f64::from(line) * 2e-3)).action,
            afbc_serve::ServerAction::Nothing
        );
    }
    let refused = server.line("at 2.5 quit").lines.concat();
    assert!(refused.contains("1000 scheduled lines are waiting already"), "{refused}");
    let (reader, begin) = Reader::new();
    let mut output = LineOutput::to(reader.clone()).unwrap();
    let text: String = (0..2000).map(|_| "status\nhelp\n").chain(["quit\n"]).collect();
    let mut lines = InputLines::of(Cursor::new(text));
    let end = run(
        &mut server,
        Interfaces { ports: &mut ports, hook: &mut () },
        TimeRate::Times(0.0),
        &mut lines,
        &AtomicBool::new(false),
        |line| output.line(line),
    );
    assert_eq!(end, RunEnd::Quit);
    drop(begin);
    output.finish();
    assert!(!reader.lines().is_empty());
}

/// Time advances between lines of an endless input. A line that is too long is refused as a whole.
#[test]
fn endless_lines_do_not_stop_time() {
    let mut server = Server::new(&fleet(&built_in("mocap").unwrap().read().unwrap(), 1).unwrap(), 1).unwrap();
    let addresses = afbc_serve::Addresses { udp: 0, stations: vec![], companions: vec![], ..Default::default() };
    let mut ports = Ports::open(&addresses, 1).unwrap();
    server.line("at 1 quit");
    let long = format!("{}wind 1 0 0", " ".repeat(600));
    let text = format!("{long}\nwind 2 0 0 # {}\nwind 3 0 0\r\n", "x".repeat(100_000));
    let mut lines = InputLines::of(io::BufReader::new(io::Read::chain(Cursor::new(text), Endless)));
    let mut said = Vec::new();
    let end = run(
        &mut server,
        Interfaces { ports: &mut ports, hook: &mut () },
        TimeRate::Times(0.0),
        &mut lines,
        &AtomicBool::new(false),
        |line| said.push(line.to_owned()),
    );
    assert_eq!(end, RunEnd::Quit);
    let too_long = "error a line has at most 512 characters";
    assert_eq!(said[..3], [too_long, too_long, "ok wind 3 0 0"]);
}

/// An endless input of "y" lines, like that of the program `yes`.
struct Endless;

impl io::Read for Endless {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        bytes.iter_mut().zip(b"y\n".iter().cycle()).for_each(|(to, from)| *to = *from);
        Ok(bytes.len() / 2 * 2)
    }
}
