//! Boots the flight image of a board on register-level models of it. Checks from outside, on bus and pins, that the
//! image ticks at 1 kHz, feeds its watchdog, drives its motor outputs and sends telemetry.

use crate::check::check;
use crate::fly::images;
use crate::machine::{EarlyRevision, Machine, Signal};
use crate::steady::{SteadyPin, floating};
use crate::wire::UartWire;
use afbc_mavlink::telemetry::Telemetry;
use afbc_mavlink::{Address, Decoder, Downlink};
use rigless::emulator::{AccessKind, Driver, Host, Settled, Start, Stop, run};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

/// Key that feeds the watchdog.
const FEED: u64 = 0xAAAA;
/// Address of the ground station.
const STATION: Address = Address { system: 255, component: 190 };
/// DSHOT600 \[ns\]: length of a zero's pulse, and period of a bit. The frame of a stopped motor has 16 zeros.
const PULSE_NS: u64 = 625;
const BIT_NS: u64 = 1_667;
const BITS: u64 = 16;
/// PWM \[ns\]: pulse of a stopped motor, and period.
const STOPPED_NS: u64 = 1_000_000;
const PERIOD_NS: u64 = 2_500_000;
/// Resolution of the timers \[ns\], for DSHOT and with PWM's prescaler.
const COUNT_NS: u64 = 5;
const DIVIDED_COUNT_NS: u64 = 50;

/// Virtual time of the run \[ns\], enough for two heartbeats. In the last 10 ms, the outputs are sampled every
/// microsecond.
const END: u64 = 1_200_000_000;
const LOOK_FROM: u64 = END - 10_000_000;
const LOOK_EVERY: u64 = 1_000;
const TICK: u64 = 1_000_000;
/// Virtual time within which an image has set its clocks \[ns\].
const START_UP: u64 = 100_000_000;

/// Observations from outside.
struct BootObserver {
    /// Times at which the watchdog was fed \[ns\].
    feeds: Vec<u64>,
    /// Number of samples, for each motor, in which its pin carried a pulse.
    pulses: Vec<u64>,
    /// Number of samples, and pulses that differ from the pulse of a stopped motor.
    looks: u64,
    wrong: Vec<String>,
    /// First word of the parameters' flash, read at the end of the run.
    store: u64,
    /// Pins that float at the end of the run.
    floating: Vec<SteadyPin>,
}

impl<M: Machine> Driver<M> for BootObserver {
    fn on_settled(&mut self, _: &mut Session<M>, _: &mut dyn Host, settled: Settled) {
        if let Settled::Access { access, value } = settled
            && (access.kind, access.address, value) == (AccessKind::Write, M::WATCHDOG, FEED)
        {
            self.feeds.push(access.virtual_time.0);
        }
    }

    fn on_stop(&mut self, session: &mut Session<M>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        self.looks += 1;
        for (output, count) in session.board_mut().motors().iter().zip(&mut self.pulses) {
            let Some(pulse) = output.pulse.filter(|pulse| pulse.width.0 > 0) else { continue };
            *count += 1;
            let [width, period] = [pulse.width.0, pulse.period.0];
            let (expected, count_ns) = match M::SIGNAL {
                Signal::Dshot600(_) => ([PULSE_NS, BIT_NS], COUNT_NS),
                Signal::Pwm400 => ([STOPPED_NS, PERIOD_NS], DIVIDED_COUNT_NS),
            };
            if width.abs_diff(expected[0]) > count_ns || period.abs_diff(expected[1]) > count_ns {
                self.wrong.push(format!("{}: {width} of {period} ns", output.name));
            }
        }
        self.store = host.read(M::STORE, Width::W32).unwrap_or(u64::MAX);
        let mcu = session.mcu();
        let read = |address| mcu.read(stop.at, address, Width::W32).unwrap_or(0);
        self.floating = floating(M::PORTS, M::STEADY, read);
        (stop.at.0 < END).then(|| VirtualNanos(stop.at.0 + LOOK_EVERY))
    }
}

/// Records what an image writes to the register of an erratum's workaround.
struct WorkaroundObserver {
    register: u64,
    written: Vec<u64>,
}

impl<M: Machine> Driver<M> for WorkaroundObserver {
    fn on_settled(&mut self, _: &mut Session<M>, _: &mut dyn Host, settled: Settled) {
        if let Settled::Access { access, value } = settled
            && (access.kind, access.address) == (AccessKind::Write, self.register)
        {
            self.written.push(value);
        }
    }

    fn on_stop(&mut self, _: &mut Session<M>, _: Stop, _: &mut dyn Host) -> Option<VirtualNanos> {
        None
    }
}

/// Returns what the start of an image writes to the register of an erratum's workaround, on the chip's early revision
/// or on that of the models.
fn workaround<M: Machine>(image: &Path, revision: EarlyRevision, is_early: bool) -> Result<Vec<u64>, Box<dyn Error>> {
    let mut board = M::built()?;
    if is_early {
        board.set_early_revision()?;
    }
    let driver = WorkaroundObserver { register: revision.register, written: Vec::new() };
    let images = images::<M>(image, &[])?;
    let finished = run(Session::new(board, 0, VirtualNanos(START_UP))?, &Start::new(&images), driver)?;
    Ok(finished.driver.written)
}

/// Checks that an image works around the erratum of the chip's early revision, and does so on this revision only.
fn check_early_revision<M: Machine>(image: &Path) -> Result<(), Box<dyn Error>> {
    let Some(revision) = M::EARLY_REVISION else { return Ok(()) };
    let [early, later] = [true, false].map(|is_early| workaround::<M>(image, revision, is_early));
    let (early, later) = (early?, later?);
    println!("{}: writes {early:x?} to {:#x}; a later revision writes {later:x?}", revision.name, revision.register);
    check(early == [revision.value], &format!("the erratum of {}", revision.name))?;
    check(later.is_empty(), "no workaround on a chip without the erratum")
}

/// Boots an image.
pub fn boot<M: Machine>(image: &Path) -> Result<(), Box<dyn Error>> {
    check_early_revision::<M>(image)?;
    let mut board = M::built()?;
    let wire = UartWire::default();
    check(board.attach_link(wire.clone()), "the link is wired")?;
    let (feeds, pulses, floating) = (Vec::new(), vec![0; M::MOTORS.len()], Vec::new());
    let seen = BootObserver { feeds, pulses, looks: 0, wrong: Vec::new(), store: 0, floating };
    let images = images::<M>(image, &[])?;
    let finished = run(Session::new(board, 0, VirtualNanos(LOOK_FROM))?, &Start::new(&images), seen)?;

    for told in finished.session.told() {
        println!("the models say: {} {}: {}", told.instance, told.register, told.reason);
    }

    let BootObserver { feeds, pulses, looks, wrong, store, floating } = &finished.driver;
    let bytes = wire.take();
    let (mut messages, mut heartbeats, mut battery_mv) = (0, 0, None);
    Decoder::new(STATION).feed(&bytes, |_, message: Downlink| {
        messages += 1;
        heartbeats += u32::from(matches!(message, Downlink::Heartbeat { .. }));
        match message {
            Downlink::Text { text, .. } => println!("the vehicle says: {}", text.to_str().unwrap_or("?")),
            Downlink::Telemetry(Telemetry::System(system)) => battery_mv = Some(system.voltage_mv),
            _ => {}
        }
    });
    println!("{} bytes on the link: {messages} messages, {heartbeats} of them heartbeats", bytes.len());
    for pair in feeds.windows(2).filter(|pair| (pair[1] - pair[0]).abs_diff(TICK) > M::JITTER) {
        println!("at {} us: no tick for {} us", pair[0] / 1000, (pair[1] - pair[0]) / 1000);
    }
    let periods: Vec<u64> = feeds.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (least, most) = (periods.iter().min().ok_or("the watchdog is not fed")?, periods.iter().max().ok_or("")?);
    let first = feeds[0] / TICK;
    println!("{} ticks from {first} ms on, {least} to {most} ns apart; each feeds the watchdog", feeds.len());
    check(feeds.len() as u64 + first >= END / TICK - 1, "no tick is missing")?;
    check(least.abs_diff(TICK) <= M::JITTER && most.abs_diff(TICK) <= M::JITTER, "1 kHz")?;

    // DSHOT sends one frame per tick. PWM repeats its pulses all the time.
    let carried = match M::SIGNAL {
        Signal::Dshot600(_) => looks * LOOK_EVERY / TICK * BITS * BIT_NS / LOOK_EVERY,
        Signal::Pwm400 => *looks,
    };
    println!("of {looks} samples, each motor's pin had a pulse in {pulses:?}; stopped motors should have {carried}");
    check(wrong.is_empty(), &format!("{:?}: {wrong:?}", M::SIGNAL))?;
    check(pulses.iter().all(|pulses| pulses.abs_diff(carried) * 10 <= carried), "every motor has its pulses")?;

    check(floating.is_empty(), &format!("pins that would float on a real board: {floating:?}"))?;
    check(!M::STORES || *store & 0xFFFF_FFFF != 0xFFFF_FFFF, "the parameters' store has a header")?;
    check(heartbeats >= 2, "a heartbeat every second")?;
    println!("battery: {battery_mv:?} mV");
    let close = |expected_mv: u16| battery_mv.is_some_and(|voltage_mv: u16| voltage_mv.abs_diff(expected_mv) < 50);
    check(M::BATTERY_MV.is_none_or(close), "its battery")?;
    let unmapped: Vec<_> = finished.session.unmapped().iter().map(|access| access.address).collect();
    let refused = finished.session.refused().len();
    println!("unmapped accesses: {unmapped:x?}, refused: {refused}");
    check(unmapped.iter().all(|address| M::UNMAPPED.contains(address)), "no unmapped accesses except the known ones")?;
    check(refused == 0, "no refused accesses")?;
    check(finished.session.resets().is_empty(), "no reset")
}
