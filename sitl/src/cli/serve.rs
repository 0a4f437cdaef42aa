//! `sitl serve`: serves simulated vehicles over MAVLink.

use super::target::TargetArg;
use super::terminal::{CommandError, INTERRUPTED, print, say};
use super::vehicle::VehicleArgs;
use afbc_files::OutputFile;
use afbc_hil::{LogFile, UlogFiles};
use afbc_serve::web::{Admission, Token, WebServer};
use afbc_serve::{
    Addresses, InputLines, Interfaces, LineOutput, ParameterFile, Ports, RunEnd, Server, ServerAction, ServerHook,
    TimeRate, VEHICLES_MAX, fleet, guide, run,
};
use clap::{Args, value_parser};
use std::ffi::OsString;
use std::fs::{create_dir_all, read_to_string};
use std::io::{self, BufReader, stdin, stdout};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest number of vehicles.
const MOST: i64 = VEHICLES_MAX as i64;

/// Serve a simulated vehicle to ground stations and companion computers, by MAVLink
///
/// The vehicle stands on the ground, outdoors in a breeze, until somebody arms it. The firmware's own code flies it
/// with simulated sensors. Lines on stdin change weather and faults; `help` lists them. See docs/serve.md.
#[derive(Args, Debug)]
pub(crate) struct ServeArgs {
    /// Name of a built-in scenario, or path of a scenario file, which sets place, weather, instruments and faults
    #[arg(long, value_name = "SCENARIO", default_value = "outdoor")]
    scenario: TargetArg,

    /// Fly indoors with a motion-capture system; the same as --scenario mocap
    #[arg(long, conflicts_with = "scenario")]
    indoors: bool,

    #[command(flatten)]
    on: VehicleArgs,

    /// Number of vehicles, which stand side by side
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u8).range(1..=MOST))]
    vehicles: u8,

    /// MAVLink system id of the first vehicle, unless its parameter MAV_SYS_ID sets another; further vehicles count up
    #[arg(long, value_name = "ID", default_value_t = 1, value_parser = value_parser!(u8).range(1..=150))]
    system: u8,

    /// Seed of weather and sensors, instead of the scenario's
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(0..=1_000_000_000))]
    seed: Option<u64>,

    /// Address of this machine to serve at; 0.0.0.0 serves everybody on the network, without any protection
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    bind: IpAddr,

    /// UDP port of the first vehicle; further vehicles count up; 0 for any free port
    #[arg(long, value_name = "PORT", default_value_t = Addresses::default().udp)]
    port: u16,

    /// Also serve by TCP, from this port on, or from 5760 if no port is given; each further vehicle is 10 ports higher
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "5760")]
    tcp: Option<u16>,

    /// Address at which a ground station listens for heartbeats; `none` for no address; may be repeated
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:14550")]
    station: Vec<String>,

    /// Address at which the first vehicle's companion computer listens; ports of further vehicles count up; `none` for
    /// no address; may be repeated
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:14540")]
    companion: Vec<String>,

    /// Keep the parameters in this file, which is created if missing; with several vehicles, each has a file that ends
    /// in its system id
    #[arg(long, value_name = "FILE")]
    parameters: Option<PathBuf>,

    /// Write the exact log to this new file, for `sitl replay --exact`; with several vehicles, each has a file that
    /// ends in its system id
    #[arg(long, value_name = "FILE")]
    exact_log: Option<PathBuf>,

    /// Write the black box, PX4's ULog, to this new file. Several vehicles have a file each, with the system id before
    /// the extension, and a restart begins another file, with the number of the start. If a folder is given, each start
    /// writes the next file, log001.ulg and so on, in a folder for each of several vehicles, and stations can download
    /// the logs
    #[arg(long, value_name = "FILE|FOLDER")]
    ulog: Option<PathBuf>,

    /// Serve a page at this address of this machine, to watch and command the first vehicle in a browser; any address
    /// but 127.0.0.1 needs a token, which is printed unless --web-token sets one
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8590",
        value_parser = web_address)]
    web: Option<SocketAddr>,

    /// File with the token that browsers must send
    #[arg(long, value_name = "FILE", requires = "web")]
    web_token: Option<PathBuf>,

    /// Speed of time relative to real time; 0 for as fast as possible
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed, allow_negative_numbers = true)]
    speed: f64,

    /// Run as fast as possible; the same as --speed 0
    #[arg(long, conflicts_with = "speed")]
    fast: bool,

    /// Let time stand still; `step N` on stdin takes in what has arrived, lets N milliseconds pass, and then answers
    #[arg(long, conflicts_with_all = ["speed", "fast"])]
    lockstep: bool,

    /// Command line as on stdin, run before the start, as in --do 'at 20 wind 5 0 0'; may be repeated
    #[arg(long = "do", value_name = "LINE")]
    lines: Vec<String>,
}

impl ServeArgs {
    /// Serves until a signal or a command ends it.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let target = if self.indoors { TargetArg::from("mocap") } else { self.scenario.clone() };
        let mut scenario = self.on.put(target.scenario()?)?;
        scenario.seed = self.seed.unwrap_or(scenario.seed);
        let scenarios = fleet(&scenario, self.vehicles)?;
        let mut server = match &self.parameters {
            Some(path) => {
                let files = (self.system..).map(|system| file(path, system, self.vehicles));
                let parameter_files =
                    files.zip(&scenarios).map(|(file, scenario)| ParameterFile::open(&file, scenario));
                Server::with_parameter_files(&scenarios, self.system, parameter_files.collect::<Result<_, _>>()?)?
            }
            None => Server::new(&scenarios, self.system)?,
        };
        if let Some(system) = server.ambiguous() {
            return Err(format!(
                "several vehicles have the system id {system}; change MAV_SYS_ID in one of the files of --parameters"
            )
            .into());
        }
        let exact_logs = self.exact_logs()?;
        let black_boxes = self.black_boxes()?;
        for line in &self.lines {
            let reply = server.line(line);
            let answer = reply.lines.last().map_or("ok", String::as_str);
            if let Some(problem) = answer.strip_prefix("error ") {
                return Err(format!("--do '{line}': {problem}").into());
            }
            if reply.action != ServerAction::Nothing {
                return Err(format!(
                    "--do '{line}': this command has no effect before the start; add a time, as in 'at 60 ...'"
                )
                .into());
            }
        }
        let addresses = self.addresses()?;
        // Peers on loopback are on this machine, so they are trusted like a wired link.
        server.set_wired(addresses.bind.is_loopback());
        let mut ports = Ports::open(&addresses, server.vehicles().len())?;
        let mut web = self.web.map(|address| self.web_server(address)).transpose()?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopper = Arc::clone(&stop);
        ctrlc::set_handler(move || stopper.store(true, Ordering::Relaxed))?;
        // The files are created only now, so that a refused command leaves no file behind.
        let logs = exact_logs.iter().map(|output| Ok::<_, CommandError>((output.path(), LogFile::create(output)?)));
        let logs = logs.collect::<Result<Vec<_>, _>>()?;
        server.record(logs.iter().map(|(_, log)| log.clone()).collect());
        server.log(black_boxes.iter().map(|path| self.black_box(path)).collect::<Result<_, _>>()?);
        print(&format!("{}: {}", scenario.name, guide(&addresses, &ports.addresses()?, &server.systems())))?;
        if let Some(web) = &web {
            print(&format!("Open {} in a browser (docs/page.md).\n", web.url()))?;
        }

        let rate = match self {
            ServeArgs { lockstep: true, .. } => TimeRate::Lockstep,
            ServeArgs { fast: true, .. } => TimeRate::Times(0.0),
            ServeArgs { speed, .. } => TimeRate::Times(speed),
        };
        let hook: &mut dyn ServerHook = match &mut web {
            Some(web) => web,
            None => &mut (),
        };
        let mut output = LineOutput::to(stdout())?;
        let answers = output.clone();
        let mut lines = match rate {
            // Time waits until the answers are read, so that none is lost.
            TimeRate::Lockstep => InputLines::paced(BufReader::new(stdin()), move || answers.wait_for_room()),
            TimeRate::Times(_) => InputLines::of(BufReader::new(stdin())),
        };
        let end =
            run(&mut server, Interfaces { ports: &mut ports, hook }, rate, &mut lines, &stop, |line| output.line(line));
        output.finish();
        server.end_logs().iter().for_each(|line| say(line));
        for (path, log) in logs {
            log.finish().map_err(|error| unwritten(path, &error))?;
        }
        Ok(ExitCode::from(if end == RunEnd::Stopped { INTERRUPTED } else { 0 }))
    }

    /// Opens the port of the page.
    fn web_server(&self, address: SocketAddr) -> Result<WebServer, CommandError> {
        let token = match &self.web_token {
            Some(path) => {
                let failed = |why: String| format!("{}: {why}; change it, or leave out --web-token", path.display());
                let text = read_to_string(path).map_err(|error| failed(format!("cannot be read ({error})")))?;
                Some(Token::chosen(&text).map_err(failed)?)
            }
            None if address.ip().is_loopback() => None,
            None => Some(Token::random()?),
        };
        Ok(WebServer::open(address, Admission::at(address.ip(), token)?)?)
    }

    /// Returns the output files of the exact logs, if requested.
    fn exact_logs(&self) -> Result<Vec<OutputFile>, CommandError> {
        let Some(path) = &self.exact_log else { return Ok(Vec::new()) };
        let paths = (self.system..).take(self.vehicles.into()).map(|system| file(path, system, self.vehicles));
        Ok(paths.map(|path| OutputFile::new(&path, "--exact-log")).collect::<Result<_, _>>()?)
    }

    /// Returns the files of the black boxes, or folders for them, if requested.
    fn black_boxes(&self) -> Result<Vec<PathBuf>, CommandError> {
        let Some(path) = &self.ulog else { return Ok(Vec::new()) };
        let of = |system: u8| match self.vehicles {
            1 => path.clone(),
            _ if path.is_dir() => path.join(system.to_string()),
            _ => path.with_extension(extension(path, system)),
        };
        let paths: Vec<_> = (self.system..).take(self.vehicles.into()).map(of).collect();
        if !path.is_dir() {
            paths.iter().try_for_each(|path| OutputFile::new(path, "--ulog").map(drop))?;
        }
        Ok(paths)
    }

    /// Creates the file of a black box.
    fn black_box(&self, path: &Path) -> Result<UlogFiles, String> {
        if self.ulog.as_ref().is_some_and(|ulog| ulog.is_dir()) {
            let cure = "choose another file for --ulog";
            create_dir_all(path).map_err(|error| format!("{}: cannot be made ({error}); {cure}", path.display()))?;
        }
        UlogFiles::create(path)
    }

    fn addresses(&self) -> Result<Addresses, CommandError> {
        let all = |texts: &[String], option: &str| {
            let wanted = texts.iter().filter(|text| *text != "none");
            wanted.map(|text| address(text, option, self.bind)).collect::<Result<Vec<_>, _>>()
        };
        Ok(Addresses {
            bind: self.bind,
            udp: self.port,
            stations: all(&self.station, "--station")?,
            companions: all(&self.companion, "--companion")?,
            tcp: self.tcp,
        })
    }
}

/// Returns the message for an exact log that cannot be written.
pub(super) fn unwritten(path: &Path, error: &io::Error) -> String {
    format!("{}: the file cannot be written ({error}); choose another file for --exact-log", path.display())
}

/// Returns the file of one vehicle. With several vehicles, its name ends in the system id.
fn file(path: &Path, system: u8, vehicles: u8) -> PathBuf {
    if vehicles == 1 {
        return path.into();
    }
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{system}"));
    path.with_file_name(name)
}

/// Returns the system id followed by the path's extension.
fn extension(path: &Path, system: u8) -> OsString {
    let mut extension = OsString::from(system.to_string());
    if let Some(own) = path.extension() {
        extension.push(".");
        extension.push(own);
    }
    extension
}

/// Resolves the address of a peer, in the address family of `bind`.
fn address(text: &str, option: &str, bind: IpAddr) -> Result<SocketAddr, CommandError> {
    let found = text.to_socket_addrs().map_err(|error| {
        format!("{option} {text}: no such address ({error}); write HOST:PORT, as in 127.0.0.1:14550, or none")
    })?;
    let same = found.into_iter().find(|address| address.is_ipv4() == bind.is_ipv4());
    Ok(same
        .ok_or_else(|| format!("{option} {text}: the address cannot be reached from {bind}; choose another --bind"))?)
}

/// Parses the address of the page: an IP address with or without a port, or a port.
fn web_address(text: &str) -> Result<SocketAddr, String> {
    const PORT: u16 = 8590;
    let whole = text.parse().ok();
    let address = || text.parse().ok().map(|address: IpAddr| SocketAddr::new(address, PORT));
    let port = || text.parse().ok().map(|port: u16| SocketAddr::new(Ipv4Addr::LOCALHOST.into(), port));
    whole.or_else(address).or_else(port).ok_or_else(|| "write ADDRESS:PORT, as in 127.0.0.1:8590".into())
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "the speed must be a number".to_owned())?;
    if (0.0..=1000.0).contains(&speed) { Ok(speed) } else { Err("the speed must lie within 0 to 1000".into()) }
}
