//! `sitl bring-up`: checks a board step by step.

use super::terminal::{CommandError, print, say};
use crate::network::NetworkBoard;
use crate::serial::SerialBoard;
use afbc_files::OutputFile;
use afbc_ground::bring_up::{BringUpOptions, BringUpStep, Verdict, bring_up};
use afbc_hil::Autopilot;
use afbc_onboard::BAUD;
use clap::{Args, value_parser};
use std::io::stdin;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

/// Take the first steps with a board, propellers off, and write a log that you can send to the developers
///
/// Reads the board's version, parameters, sensors, control ticks and noise at rest over MAVLink, guides you through
/// turning the board by hand, and gives a verdict on each step. The command never arms the board and changes no
/// parameter. See docs/bring-up.md.
#[derive(Args, Debug)]
pub(crate) struct BringUpArgs {
    /// Connection to the board: serial:DEVICE[:BAUD], udp:HOST:PORT or tcp:HOST:PORT
    #[arg(long, value_name = "CONNECTION", default_value = "serial:/dev/ttyACM0")]
    connect: BoardAddress,

    /// File to write; an existing file is not overwritten
    #[arg(long, short, value_name = "FILE", default_value = "bring-up.md")]
    out: PathBuf,

    /// Name of the board and of the parts connected to it, for the log
    #[arg(long, value_name = "TEXT", default_value = "not said")]
    board: String,

    /// Time at rest during which noise and ticks are measured [s]
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = value_parser!(u32).range(1..=3600))]
    rest: u32,

    /// Ask nothing: confirms that the propellers are off, and skips the steps that need somebody to turn the board
    #[arg(long)]
    yes: bool,
}

/// Address of the board.
#[derive(Clone, Debug)]
enum BoardAddress {
    Serial(String, u32),
    Udp(String),
    Tcp(String),
}

impl FromStr for BoardAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("serial", rest)) if !rest.is_empty() => Ok(match rest.rsplit_once(':') {
                Some((device, baud)) => {
                    let baud = baud
                        .parse()
                        .map_err(|_| format!("{baud} is not a baud rate; write a number such as {BAUD}"))?;
                    BoardAddress::Serial(device.into(), baud)
                }
                None => BoardAddress::Serial(rest.into(), BAUD),
            }),
            Some(("udp", address)) => Ok(BoardAddress::Udp(address.into())),
            Some(("tcp", address)) => Ok(BoardAddress::Tcp(address.into())),
            _ => Err("write serial:DEVICE[:BAUD], udp:HOST:PORT or tcp:HOST:PORT".into()),
        }
    }
}

impl BringUpArgs {
    /// Runs the steps and writes the log.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let out = self.out.display();
        let output = OutputFile::new(&self.out, "--out")?;
        if !self.yes {
            confirm()?;
        }
        let (mut port, connected) = self.connect.open()?;
        let options = BringUpOptions { rest_s: self.rest, is_attended: !self.yes };
        let mut exchange = |uplink: &[u8], hear: &mut dyn FnMut(&[u8])| Ok(port.exchange(uplink, hear)?);
        let mut log = bring_up(&mut exchange, options, &mut say)?;
        let head = [
            ("board, as given by the user", self.board),
            ("connection", connected),
            ("begun before", date(SystemTime::now())),
            ("by", concat!("sitl ", env!("CARGO_PKG_VERSION")).into()),
            ("somebody is at the board", if self.yes { "no" } else { "yes" }.into()),
        ];
        log.head = head.map(|(what, value)| (what.into(), value)).into();
        output.write(|to| to.write_all(log.page().as_bytes()))?;
        let line = |step: &BringUpStep| {
            let because =
                if step.reasons.is_empty() { String::new() } else { format!(": {}", step.reasons.join("; ")) };
            format!("{:<24} {}{because}\n", step.name, step.verdict)
        };
        let failed = log.steps.iter().filter(|step| step.verdict == Verdict::Failed).count();
        let lines: String = log.steps.iter().map(line).collect();
        print(&format!("{lines}\n{failed} of {} steps failed; the log is {out}\n", log.steps.len()))?;
        Ok(ExitCode::from(u8::from(!log.is_well())))
    }
}

impl BoardAddress {
    /// Connects; also returns a description of the connection.
    fn open(&self) -> Result<(Box<dyn Autopilot>, String), CommandError> {
        Ok(match self {
            BoardAddress::Serial(device, baud) => {
                (Box::new(SerialBoard::open(device, *baud)?) as _, format!("{device}, {baud} baud"))
            }
            BoardAddress::Udp(address) => (Box::new(NetworkBoard::udp(address)?), format!("UDP, {address}")),
            BoardAddress::Tcp(address) => (Box::new(NetworkBoard::tcp(address)?), format!("TCP, {address}")),
        })
    }
}

/// Asks the user to confirm that the propellers are off.
fn confirm() -> Result<(), CommandError> {
    say("Are the propellers off? Type yes:");
    let mut answer = String::new();
    stdin().read_line(&mut answer)?;
    if answer.trim() == "yes" {
        return Ok(());
    }
    Err("take the propellers off first; --yes confirms this without a question".into())
}

/// Returns a time as year, month, day, hour and minute in UTC.
fn date(time: SystemTime) -> String {
    let minutes = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 60);
    let (mut day, minute) = (minutes / (24 * 60), minutes % (24 * 60));
    let mut year = 1970;
    let is_leap = |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    while day >= 365 + u64::from(is_leap(year)) {
        day -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let mut month = 1;
    // The list has eleven months, and December has the rest.
    for days in [31, 28 + u64::from(is_leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30] {
        if day < days {
            break;
        }
        day -= days;
        month += 1;
    }
    format!("{year}-{month:02}-{:02} {:02}:{:02} UTC", day + 1, minute / 60, minute % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Expected dates are from `date -u -d @SECONDS`.
    #[test]
    fn dates_by_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (951_868_799, "2000-02-29 23:59 UTC"),
            (1_798_761_599, "2026-12-31 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }

    #[test]
    fn connections_are_read() {
        for (text, shown) in [
            ("serial:/dev/ttyACM0", "Serial(\"/dev/ttyACM0\", 460800)"),
            ("serial:COM3:57600", "Serial(\"COM3\", 57600)"),
            ("udp:127.0.0.1:18570", "Udp(\"127.0.0.1:18570\")"),
            ("tcp:[::1]:5760", "Tcp(\"[::1]:5760\")"),
        ] {
            assert_eq!(format!("{:?}", text.parse::<BoardAddress>().ok()), format!("Some({shown})"));
        }
        for text in ["", "/dev/ttyACM0", "serial:", "serial:/dev/ttyACM0:fast", "usb:1"] {
            assert!(text.parse::<BoardAddress>().is_err(), "{text}");
        }
    }
}
