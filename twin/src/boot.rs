//! Boots the STM32H743's flight image on register-level models of the Matek H743 and checks from outside, on bus and
//! pins, that it ticks at 1 kHz, feeds its watchdog, drives its eight motor outputs and talks.
//!
//! Models and processor are those of `rigless`, which nobody of this project wrote; the image is the one that is
//! flashed.
use crate::check::check;
use afbc_link::telemetry::Telemetry;
use afbc_link::{Address, Decoder, Downlink};
use rigless::chip::uart::Pattern;
use rigless::edge::Edge;
use rigless::emulator::{AccessKind, Driver, Host, Settled, Start, Stop, run};
use rigless::image::Image;
use rigless::machine::Board;
use rigless::machine::matekh743::MatekH743;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;
use std::error::Error;
use std::path::Path;

/// The wire of the first link, UART7.
const LINK: &str = "serial1";
/// The watchdog's key register, and the key that feeds it (RM0433, 45.4).
const IWDG_KR: u64 = 0x5800_4800;
const FEED: u64 = 0xAAAA;
/// First word of the parameters' flash, which a start gives a header.
const STORE: u64 = 0x0810_0000;
/// The outputs of motors 1 to 8: PWM3 to PWM10.
const MOTORS: std::ops::Range<usize> = 2..10;
/// DSHOT600 \[ns\]: the pulse of a zero, and the time of a bit; a stopped motor's frame has sixteen zeros.
const PULSE_NS: u64 = 625;
const BIT_NS: u64 = 1_667;
const BITS: u64 = 16;
/// A count of the timers \[ns\].
const COUNT_NS: u64 = 5;

/// Virtual time of the run \[ns\]: two heartbeats. In its last ticks the outputs are looked at every microsecond.
const END: u64 = 1_200_000_000;
const LOOK_FROM: u64 = END - 10_000_000;
const LOOK_EVERY: u64 = 1_000;
const TICK: u64 = 1_000_000;
/// What the sensors, at a higher priority, may delay a tick by \[ns\]: most while an IMU is set up.
const JITTER: u64 = 150_000;

/// Voltage of the battery that the models have at rest \[mV\].
const BATTERY_MV: u16 = 16_800;

/// What is seen from outside.
#[derive(Default)]
struct Seen {
    /// When the watchdog was fed \[ns\].
    feeds: Vec<u64>,
    /// For each motor, in how many looks its pin carried a pulse.
    pulses: [u64; MOTORS.end - MOTORS.start],
    /// Looks, and pulses that were none of DSHOT's zeros.
    looks: u64,
    wrong: Vec<String>,
    /// First word of the parameters' flash at the end.
    store: u64,
}

impl Driver<MatekH743> for Seen {
    fn on_settled(&mut self, _: &mut Session<MatekH743>, _: &mut dyn Host, settled: Settled) {
        if let Settled::Access { access, value } = settled
            && (access.kind, access.address, value) == (AccessKind::Write, IWDG_KR, FEED)
        {
            self.feeds.push(access.virtual_time.0);
        }
    }

    fn on_stop(&mut self, session: &mut Session<MatekH743>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        self.looks += 1;
        let outputs = session.board_mut().drive().0;
        for (output, count) in outputs[MOTORS].iter().zip(&mut self.pulses) {
            let Some(pulse) = output.pulse.filter(|pulse| pulse.width.0 > 0) else { continue };
            *count += 1;
            let [width, period] = [pulse.width.0, pulse.period.0];
            if width.abs_diff(PULSE_NS) > COUNT_NS || period.abs_diff(BIT_NS) > COUNT_NS {
                self.wrong.push(format!("{}: {width} of {period} ns", output.name));
            }
        }
        self.store = host.read(STORE, Width::W32).unwrap_or(u64::MAX);
        (stop.at.0 < END).then(|| VirtualNanos(stop.at.0 + LOOK_EVERY))
    }
}

/// Boots an image.
pub fn boot(image: &Path) -> Result<(), Box<dyn Error>> {
    let mut board = Box::new(MatekH743::new()?);
    board.attach_host(LINK, Box::new(Pattern::answering([])));
    let images = [Image::read(image, None)?];
    let session = Session::new(board, 0, VirtualNanos(LOOK_FROM))?;
    let mut finished = run(session, &Start::new(&images), Seen::default())?;

    for told in finished.session.told() {
        println!("the models say: {} {}: {}", told.instance, told.register, told.reason);
    }

    let Seen { feeds, pulses, looks, wrong, store } = &finished.driver;
    let periods: Vec<u64> = feeds.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (least, most) = (periods.iter().min().ok_or("the watchdog is not fed")?, periods.iter().max().ok_or("")?);
    let first = feeds[0] / TICK;
    println!("{} ticks from {first} ms on, {least} to {most} ns apart, each feeds the watchdog", feeds.len());
    check(feeds.len() as u64 + first >= END / TICK - 1, "no tick is missing")?;
    check(least.abs_diff(TICK) <= JITTER && most.abs_diff(TICK) <= JITTER, "1 kHz")?;

    // A frame for each tick of the looks.
    let frames = looks * LOOK_EVERY / TICK * BITS * BIT_NS / LOOK_EVERY;
    println!("pulses at {pulses:?} of {looks} looks at the motors' pins; frames of stopped motors have {frames}");
    check(wrong.is_empty(), &format!("DSHOT600: {wrong:?}"))?;
    check(pulses.iter().all(|pulses| pulses.abs_diff(frames) * 10 <= frames), "every motor has a frame in every tick")?;

    check(*store & 0xFFFF_FFFF != 0xFFFF_FFFF, "the parameters' store has a header")?;
    let words = finished.session.board_mut().host_mut(LINK).map(|peer| peer.received().to_vec()).unwrap_or_default();
    let bytes: Vec<u8> = words.iter().map(|word| *word as u8).collect();
    let (mut messages, mut heartbeats, mut battery_mv) = (0, 0, None);
    Decoder::new(Address { system: 255, component: 190 }).feed(&bytes, |_, message: Downlink| {
        messages += 1;
        heartbeats += u32::from(matches!(message, Downlink::Heartbeat { .. }));
        if let Downlink::Telemetry(Telemetry::System(system)) = message {
            battery_mv = Some(system.voltage_mv);
        }
    });
    println!("{} bytes on the link: {messages} messages, {heartbeats} of them heartbeats", bytes.len());
    check(heartbeats >= 2, "a heartbeat every second")?;
    println!("battery: {battery_mv:?} mV");
    check(battery_mv.is_some_and(|voltage_mv| voltage_mv.abs_diff(BATTERY_MV) < 50), "a battery of four cells")?;

    let [unmapped, refused] = [finished.session.unmapped().len(), finished.session.refused().len()];
    check(unmapped + refused == 0, &format!("{unmapped} unmapped and {refused} refused accesses"))?;
    check(finished.session.resets().is_empty(), "no reset")
}
