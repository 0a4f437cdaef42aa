//! Cuts the power at any instant while parameters are written or their flash is erased, at the level of the chip's
//! flash. At the next start, each parameter must have its old or its new value, whatever the interrupted word or
//! sector holds.

use crate::check::check;
use crate::fault_injection::FaultTarget;
use crate::machine::{Machine, quiet_usb};
use crate::parameter_flash::ParameterFlash;
use crate::random::Xorshift;
use crate::wire::UartWire;
use afbc_mavlink::{Address, Decoder, Downlink, Encoder, FRAME_MAX, ParameterName, ParameterRequest, Uplink};
use rigless::emulator::{AccessKind, Driver, Host, Settled, Start, Stop, run};
use rigless::image::Image;
use rigless::machine::matekh743::MatekH743;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

const STATION: Address = Address { system: 255, component: 190 };
/// Parameter that is written, with its old and new value, and a parameter that must keep its value.
const WRITTEN: (&str, f32, f32) = ("MIS_TAKEOFF_ALT", 3.0, 4.5);
const OTHER: (&str, f32) = ("RTL_RETURN_ALT", 22.0);
/// MAV_PARAM_TYPE_REAL32.
const REAL32: u8 = 9;

/// Parameters' two sectors (RM0433, 4.3.4): bytes of a sector, of both, and of a word that is programmed at once.
const SECTOR: u64 = 128 * 1024;
const BYTES: u64 = 2 * SECTOR;
const WORD: u64 = 32;
/// Control register of the second bank (RM0433, 4.9.25), with its START bit and the position of SNB.
const CR2: u64 = 0x5200_210C;
const START: u64 = 1 << 7;
const SECTOR_AT: u32 = 8;
/// One millisecond [ns].
const MS: u64 = 1_000_000;
/// Mean time between two cuts while a word is programmed [ns]. Most of these cuts are thinned out later.
const PROGRAM_APART_NS: u64 = 2_000;
/// Time after which a word counts as programmed [ns].
const PROGRAMS_NS: u64 = 150_000;
/// Time at which the parameter is set, and duration of its write [ns].
const SET_NS: u64 = 150 * MS;
const WRITES_NS: u64 = 30 * MS;
/// Longest start, with two erases [ns].
const START_NS: u64 = 3_000 * MS;

/// Operation that the power cuts interrupt.
#[derive(Clone, Copy, PartialEq)]
enum During {
    /// Write of a parameter that is set over the link.
    Write,
    /// Erase and copy at a start.
    Erase,
}

/// Flash operation that may not have ended.
#[derive(Clone, Copy)]
enum Pending {
    Program(u64, [u32; 8]),
    Erase(u64),
}

/// Run in which power cuts are simulated: at each cut, the flash content is kept, and the run goes on.
struct PowerCutRun {
    during: During,
    wire: UartWire,
    random: Xorshift,
    /// Mean time between two cuts during an erase [ns].
    erase_apart_ns: u64,
    pending: Option<Pending>,
    /// Start of the pending operation, and time of the next cut [ns].
    since_ns: u64,
    next_ns: u64,
    is_set: bool,
    kept: Vec<FlashAtCut>,
}

/// Flash content at a power cut.
struct FlashAtCut {
    at_ns: u64,
    in_erase: bool,
    bytes: Vec<u8>,
}

impl PowerCutRun {
    fn note(&mut self, address: u64, value: u64, now_ns: u64) {
        if address == CR2 && value & START != 0 {
            self.pending = Some(Pending::Erase(MatekH743::STORE + (value >> SECTOR_AT & 7) * SECTOR));
        } else if (MatekH743::STORE..MatekH743::STORE + BYTES).contains(&address) {
            let (word, place) = (address / WORD * WORD, address % WORD / 4);
            let mut data = match self.pending {
                Some(Pending::Program(at, data)) if at == word => data,
                // Parts of a word that are not written stay erased.
                _ => [u32::MAX; 8],
            };
            if let Some(part) = data.get_mut(place as usize) {
                *part = value as u32;
            }
            self.pending = Some(Pending::Program(word, data));
        } else {
            return;
        }
        self.since_ns = now_ns;
    }

    /// True while an operation may not have ended.
    fn is_busy(&self, now_ns: u64) -> bool {
        match self.pending {
            None => false,
            Some(Pending::Program(..)) => now_ns < self.since_ns + PROGRAMS_NS,
            // The end of an erase is not visible. A cut after it sets bits that are already set.
            Some(Pending::Erase(_)) => true,
        }
    }

    /// Keeps the flash content of a power cut now. An interrupted operation has changed only some of its bits.
    fn cut(&mut self, host: &mut dyn Host, now_ns: u64) -> Result<(), rigless::emulator::Error> {
        let mut bytes = Vec::with_capacity(BYTES as usize);
        for address in (MatekH743::STORE..MatekH743::STORE + BYTES).step_by(8) {
            bytes.extend(host.read(address, Width::W64)?.to_le_bytes());
        }
        let share = self.random.next() as u8;
        match self.pending {
            Some(Pending::Program(word, data)) => {
                let at = (word - MatekH743::STORE) as usize;
                let cells = &mut bytes[at..at + WORD as usize];
                let whole: Vec<u8> = data.iter().flat_map(|part| part.to_le_bytes()).collect();
                let has_ended = cells.iter().zip(&whole).all(|(cell, byte)| cell == byte);
                // The firmware reads a word with an uncorrectable error as zero.
                let is_refused = self.random.next() % 2 == 0;
                if !has_ended && is_refused {
                    cells.fill(0);
                } else if !has_ended {
                    for (cell, byte) in cells.iter_mut().zip(&whole) {
                        *cell &= byte | self.some_bits(share);
                    }
                }
            }
            Some(Pending::Erase(sector)) => {
                let at = (sector - MatekH743::STORE) as usize;
                for cell in bytes[at..at + SECTOR as usize].iter_mut() {
                    *cell |= self.some_bits(share);
                }
            }
            None => (),
        }
        let in_erase = matches!(self.pending, Some(Pending::Erase(_)));
        self.kept.push(FlashAtCut { at_ns: now_ns, in_erase, bytes });
        Ok(())
    }

    /// Returns random bits, each set with the probability `share` / 255.
    fn some_bits(&mut self, share: u8) -> u8 {
        (0..8).fold(0, |bits, _| bits << 1 | u8::from((self.random.next() >> 16) as u8 <= share))
    }
}

impl Driver<MatekH743> for PowerCutRun {
    fn on_settled(&mut self, session: &mut Session<MatekH743>, host: &mut dyn Host, settled: Settled) {
        let now_ns = match settled {
            Settled::Access { access, value } => {
                if access.kind == AccessKind::Write {
                    self.note(access.address, value, access.virtual_time.0);
                }
                access.virtual_time.0
            }
            Settled::Stop(stop) => stop.at.0,
            _ => return,
        };
        if !self.is_busy(now_ns) {
            return;
        }
        if now_ns >= self.next_ns {
            if self.cut(host, now_ns).is_err() {
                self.pending = None;
            }
            let in_erase = matches!(self.pending, Some(Pending::Erase(_)));
            let apart_ns = if in_erase { self.erase_apart_ns } else { PROGRAM_APART_NS };
            self.next_ns = now_ns + 1 + self.random.below(2 * apart_ns);
        }
        if session.pause().is_none() {
            // The core may access nothing until the next cut, and a cut needs a stop.
            session.pause_at(Some(VirtualNanos(self.next_ns)));
        }
    }

    fn on_stop(&mut self, session: &mut Session<MatekH743>, stop: Stop, _: &mut dyn Host) -> Option<VirtualNanos> {
        let now_ns = stop.at.0;
        quiet_usb(session, stop.at);
        match self.during {
            During::Write if now_ns < SET_NS => Some(VirtualNanos(now_ns + MS)),
            During::Write if !self.is_set => {
                let (name, _, new) = WRITTEN;
                let request = ParameterRequest::Set { name: padded(name), value: new.to_le_bytes(), kind: REAL32 };
                say(&self.wire, &[Uplink::Heartbeat, Uplink::Parameter(request)]);
                self.is_set = true;
                Some(VirtualNanos(now_ns + MS))
            }
            During::Write => (now_ns < SET_NS + WRITES_NS).then_some(VirtualNanos(now_ns + MS)),
            During::Erase => (now_ns < START_NS).then_some(VirtualNanos(now_ns + MS)),
        }
    }
}

/// Run that starts the board with the flash content of each cut, and reads the parameters each time.
struct RestartRun {
    wire: UartWire,
    random: Xorshift,
    decoder: Decoder<Downlink>,
    left: std::vec::IntoIter<FlashAtCut>,
    /// Time of the cut, and time of the start after it [ns].
    cut_ns: u64,
    started_ns: u64,
    /// Values of [`WRITTEN`] and [`OTHER`] read so far.
    values: [Option<f32>; 2],
    /// Time of each cut, and the values at the start after it.
    found: Vec<(u64, [Option<f32>; 2])>,
}

impl RestartRun {
    /// Starts the board with the next flash content, and with noise in all memories. Returns `None` after the last
    /// content.
    fn next(&mut self, session: &mut Session<MatekH743>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        let FlashAtCut { at_ns, bytes, .. } = self.left.next()?;
        for (address, cells) in (MatekH743::STORE..).step_by(8).zip(bytes.as_chunks::<8>().0) {
            let value = u64::from_le_bytes(*cells);
            if host.read(address, Width::W64).ok()? != value {
                host.program(address, Width::W64, value).ok()?;
            }
        }
        session.lose_memory(host, &mut self.random);
        session.reset_by_pin(stop.at, stop.instruction_count, host);
        // Bytes on the wire from before the cut belong to another start.
        self.wire.exchange(&[]);
        self.wire.take();
        (self.cut_ns, self.started_ns, self.values) = (at_ns, stop.at.0, [None; 2]);
        self.decoder = Decoder::new(STATION);
        Some(VirtualNanos(stop.at.0 + MS))
    }
}

impl Driver<MatekH743> for RestartRun {
    fn on_stop(&mut self, session: &mut Session<MatekH743>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        quiet_usb(session, stop.at);
        if self.started_ns == 0 {
            return self.next(session, stop, host);
        }
        let values = &mut self.values;
        self.decoder.feed(&self.wire.take(), |_, message: Downlink| {
            if let Downlink::Parameter(value) = message {
                for (name, known) in [WRITTEN.0, OTHER.0].iter().zip(values.iter_mut()) {
                    if padded(name) == value.name {
                        *known = Some(f32::from_le_bytes(value.value));
                    }
                }
            }
        });
        if self.values.iter().all(Option::is_some) || stop.at.0 > self.started_ns + START_NS {
            self.found.push((self.cut_ns, self.values));
            return self.next(session, stop, host);
        }
        // The parameters are requested again and again, since a starting board does not receive yet.
        if (stop.at.0 - self.started_ns) % (20 * MS) != 0 {
            return Some(VirtualNanos(stop.at.0 + MS));
        }
        let names = [WRITTEN.0, OTHER.0].map(|name| Uplink::Parameter(ParameterRequest::ReadName(padded(name))));
        say(&self.wire, &names);
        Some(VirtualNanos(stop.at.0 + MS))
    }
}

fn padded(name: &str) -> ParameterName {
    std::array::from_fn(|at| name.as_bytes().get(at).copied().unwrap_or(0))
}

fn say(wire: &UartWire, messages: &[Uplink]) {
    let mut sender = Encoder::new(STATION);
    for message in messages {
        wire.send(sender.send(message, &mut [0; FRAME_MAX]));
    }
}

fn board(wire: &UartWire) -> Result<Box<MatekH743>, Box<dyn Error>> {
    let mut board = Box::new(MatekH743::new()?);
    check(board.attach_link(wire.clone()), "the link is wired")?;
    Ok(board)
}

fn flash(bytes: Vec<u8>) -> Result<Image, Box<dyn Error>> {
    Ok(Image::new(Path::new("parameters"), bytes, Some(MatekH743::STORE))?)
}

/// Starts the board with each flash content, and returns the time of each cut and the values after it.
fn ask(image: &Image, left: Vec<FlashAtCut>, seed: u64) -> Result<Vec<(u64, [Option<f32>; 2])>, Box<dyn Error>> {
    let wire = UartWire::default();
    let session = Session::new(board(&wire)?, 0, VirtualNanos(MS))?;
    let starts = RestartRun {
        wire,
        random: Xorshift::new(seed, "starts"),
        decoder: Decoder::new(STATION),
        left: left.into_iter(),
        cut_ns: 0,
        started_ns: 0,
        values: [None; 2],
        found: Vec::new(),
    };
    Ok(run(session, &Start::new(std::slice::from_ref(image)), starts)?.driver.found)
}

/// Keeps about this many of the cuts, evenly spread.
fn thinned(kept: Vec<FlashAtCut>, cuts: u64) -> Vec<FlashAtCut> {
    let (all, cuts) = (kept.len(), usize::try_from(cuts).unwrap_or(usize::MAX).clamp(1, kept.len().max(1)));
    let is_left = |at: usize| (at + 1) * cuts / all > at * cuts / all;
    kept.into_iter().enumerate().filter(|(at, _)| is_left(*at)).map(|(_, kept)| kept).collect()
}

/// Runs the power cuts: `cuts` of them while a parameter's words are programmed, and as many each in the word writes
/// and the erases of a start that copies and erases.
pub fn cut_all(image: &Path, seed: u64, cuts: u64) -> Result<(), Box<dyn Error>> {
    let image = Image::read(image, None)?;
    let (name, old, new) = WRITTEN;
    for (during, what) in [(During::Write, "a parameter is written"), (During::Erase, "a start erases")] {
        let mut before = ParameterFlash::new()?;
        before.set(OTHER.0, OTHER.1)?;
        // A sector that is nearly full makes the start copy and erase.
        for change in 0..if during == During::Erase { 500 } else { 0 } {
            before.set(name, 1.0 + change as f32 * 1e-3)?;
        }
        before.set(name, old)?;
        let wire = UartWire::default();
        let session = Session::new(board(&wire)?, 0, VirtualNanos(MS))?;
        let cut = PowerCutRun {
            during,
            wire,
            random: Xorshift::new(seed, what),
            erase_apart_ns: 1_000 * MS / cuts.max(1),
            pending: None,
            since_ns: 0,
            next_ns: 0,
            is_set: false,
            kept: Vec::new(),
        };
        let images = [image.clone(), flash(before.bytes(WORD as usize)?)?];
        let kept = run(session, &Start::new(&images), cut)?.driver.kept;
        let (erases, programs): (Vec<_>, Vec<_>) = kept.into_iter().partition(|kept| kept.in_erase);
        println!("{what}: power cut at {} instants of word writes and {} of erases", programs.len(), erases.len());
        let kept: Vec<_> = thinned(programs, cuts).into_iter().chain(thinned(erases, cuts)).collect();
        let instants = kept.len();
        let (mut olds, mut news, mut wrong) = (0, 0, Vec::new());
        for (now_ns, found) in ask(&image, kept, seed)? {
            match found {
                [Some(value), Some(other)] if value == old && other == OTHER.1 => olds += 1,
                [Some(value), Some(other)] if value == new && other == OTHER.1 => news += 1,
                values => wrong.push(format!("cut at {now_ns} ns: {values:?}")),
            }
        }
        check(olds + news + wrong.len() == instants, "the board starts after each cut")?;
        println!(
            "{what}: afterwards {olds} times the old value, {news} times the new value, {} times another \
             value",
            wrong.len()
        );
        check(wrong.is_empty(), &wrong.join("\n"))?;
        check(during == During::Erase || news > 0 && olds > 0, "cuts before and after the write")?;
        check(during == During::Write || olds > 0, "cuts in a start that erases")?;
    }
    Ok(())
}
