//! Link task: receives and sends messages, at a lower priority than the control tick.

use crate::aux_sensors;
use crate::board::{Board, Links, Receiver as _, Transmitter as _};
use crate::control;
use crate::escs;
use crate::indication;
use crate::logging::LinkLog;
use crate::parameters;
use crate::radio::{self, RadioLine};
use crate::recording::{self, ExactLog};
use crate::samples::{self, Sampler as _};
use crate::self_tests;
use crate::ticks::{self, Tick};
pub use afbc_comms::Comms;
use afbc_comms::services::imus::{self, ImuNews};
use afbc_comms::services::signing::Signing;
use afbc_comms::services::status::SensorBits;
use afbc_comms::{AuxSensors, Calibrator, EscAction, EscReports, EscsHeard, REPORT_MAX, Reboot, Setup};
use afbc_mavlink::{Decoder, Uplink};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{ControlInputs, EscTelemetry, TickRecord};
use afbc_types::ROTORS_MAX;
use core::array;
use core::cell::RefCell;
use core::future::poll_fn;
use core::pin::pin;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Poll;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use heapless::Vec;
use static_cell::StaticCell;

/// Largest number of bytes read in one call.
const READ_MAX: usize = 128;

static BAD_FRAMES: AtomicU32 = AtomicU32::new(0);

/// Returns the number of frames dropped since power-up.
pub fn bad_frames() -> u32 {
    BAD_FRAMES.load(Ordering::Relaxed)
}

/// Ticks between a reboot request and the reset. They leave time to send the answer and to write a changed parameter.
const FAREWELL: u32 = 100;

/// State of the link task: the services for ground stations, the parameters and, where present, exact log, radio and
/// black box.
pub type CommsParts = (
    Comms,
    ParameterTable,
    Option<&'static mut ExactLog>,
    Option<&'static mut RadioLine>,
    Option<&'static mut LinkLog>,
);

/// Creates the link task's state. Must be called once. The state is built in place, because passing it to the task by
/// value would store it twice and use stack.
#[inline(never)]
pub fn make<B: Board>(
    table: ParameterTable,
    signing: Signing,
    log: Option<&'static mut ExactLog>,
    radio: Option<&'static mut RadioLine>,
    black_box: Option<&'static mut LinkLog>,
) -> &'static mut CommsParts {
    static PARTS: StaticCell<CommsParts> = StaticCell::new();
    PARTS.init_with(|| {
        let boot_loader = B::BOOT_LOADER.is_some();
        let reboots: &[_] = if boot_loader { &[Reboot::Program, Reboot::BootLoader] } else { &[Reboot::Program] };
        let calibrates = B::Sampler::SENSES;
        let setup = Setup { reboots, calibrates, ..Setup::of(&table.configuration().link) };
        let mut comms = Comms::with(setup);
        comms.set_signing(signing);
        if table.configuration().escs.answers && !B::ANSWERS {
            comms.warn("DSHOT_BIDIR_EN: board cannot read ESC replies");
        }
        (comms, table, log, radio, black_box)
    })
}

/// Runs the link task: receives messages, and reports every tick on every link. `OTHERS` is the number of links after
/// the first.
pub async fn run<B: Board, const OTHERS: usize>(
    (comms, table, log, radio, black_box): &mut CommsParts,
    links: &mut B::Links,
) -> ! {
    // Each link has its own decoder, because frames arrive in pieces and pieces of two links must not mix.
    let mut decoder = comms.decoder();
    let mut decoders: [_; OTHERS] = array::from_fn(|_| comms.decoder());
    let wired = links.each().iter().position(|link| link.receiver.is_wired()).unwrap_or(0);
    // The first signing key is accepted over a wired link only, because it locks out everyone who lacks it.
    *of_link(&mut decoder, &mut decoders, wired) = comms.decoder().wired();
    let mut incoming = [0; READ_MAX];
    let mut outgoing = Vec::<u8, REPORT_MAX>::new();
    let mut leaving = 0;
    let mut calibrator = B::Sampler::SENSES.then(calibrator);
    let mut details = if recording::is_possible::<B>() { ticks::details_out() } else { None };
    let mut esc_reports = (B::ESCS || B::ANSWERS).then(|| escs::reports(table));
    loop {
        match select(receive(links, &mut incoming), ticks::next()).await {
            Either::First((link, length)) => {
                let bytes = incoming.get(..length).unwrap_or_default();
                if radio::is_possible::<B>()
                    && let Some(radio) = radio.as_deref_mut().filter(|radio| radio.link() == Some(link))
                {
                    if let Some(news) = radio.receive(comms, bytes, table) {
                        pass_on::<B>(&news, log);
                    }
                    // A radio receiver does not send MAVLink.
                    continue;
                }
                let news = hear::<B>(comms, of_link(&mut decoder, &mut decoders, link), black_box, bytes);
                pass_on::<B>(&news, log);
                BAD_FRAMES.store(comms.bad_frames(), Ordering::Relaxed);
            }
            Either::Second(tick) => {
                if B::INDICATES {
                    indication::put(&tick.report);
                }
                if B::Sampler::SENSES {
                    look_at_sensors::<B>(comms, table, tick.report.time_us);
                }
                if B::HAS_LOG
                    && let Some(black_box) = black_box
                {
                    begin_logging(comms, black_box, table, &tick);
                }
                report(comms, &tick, B::CORE_HZ, &mut outgoing);
                // The constant lets the compiler drop this code on a board without sensors.
                if B::Sampler::SENSES
                    && let Some(calibrator) = &mut calibrator
                {
                    calibrate(comms, calibrator, table, &mut outgoing);
                }
                // This condition is constant as well, for the same reason.
                let kept = if recording::is_possible::<B>() { log.as_deref_mut() } else { None };
                let others = [kept.as_ref().map(|log| log.link()), radio.as_ref().and_then(|radio| radio.link())];
                let changed = serve(comms, table, kept, &mut outgoing);
                if B::ESCS
                    && let Some(reports) = &mut esc_reports
                {
                    if changed.is_some() {
                        reports.adopt(table.configuration());
                    }
                    if let Some(news) = listen_to_escs(comms, reports, escs::take_answers(), &tick) {
                        pass_on::<B>(&news, log);
                    }
                }
                if B::HAS_LOG
                    && let Some(black_box) = black_box
                {
                    black_box.transfer(comms, &mut outgoing);
                }
                let told = links.each().iter_mut().enumerate().filter(|(index, _)| !others.contains(&Some(*index)));
                // Telemetry that a link has no room for is lost.
                told.for_each(|(_, link)| {
                    link.transmitter.transmit(&tick, &outgoing);
                });
                // An uploaded mission or fence can yield inputs for the control tick without a byte received in this
                // tick.
                if comms.has_mail() {
                    let news = hear::<B>(comms, &mut decoder, black_box, &[]);
                    pass_on::<B>(&news, log);
                }
                if radio::is_possible::<B>()
                    && let Some(radio) = radio
                {
                    // The receiver is called without bytes too, so that a silent receiver is noticed.
                    if let Some(news) = radio.receive(comms, &[], table) {
                        pass_on::<B>(&news, log);
                    }
                    radio.send(comms, &tick, links, table);
                }
                if recording::is_possible::<B>() {
                    if tick.is_detailed
                        && let Some(queue) = &mut details
                        && let Some(details) = queue.try_receive()
                    {
                        let tick = TickRecord { report: &tick.report, details };
                        record::<B>(&tick, log, black_box, table, comms.esc_telemetry());
                        queue.receive_done();
                    }
                    if let Some(log) = log {
                        log.send(&tick, links);
                    }
                }
                if B::HAS_LOG
                    && let Some(black_box) = black_box
                {
                    if let Some(change) = changed {
                        black_box.change(table, change);
                    }
                    black_box.send(tick.report.time_us, &outgoing);
                }
                leaving += u32::from(comms.wants_reboot().is_some());
                // The vehicle may have armed since the request, and a reset would stop the motors in flight.
                if leaving >= FAREWELL && !control::armed() {
                    reboot::<B>(comms);
                }
            }
        }
    }
}

/// Passes the state of sensors outside the control tick to the ground stations, and the battery's state to the control
/// tick.
fn look_at_sensors<B: Board>(comms: &mut Comms, table: &ParameterTable, now_us: u64) {
    let failsafe = &table.configuration().guidance.failsafe;
    let mut aux = aux_sensors::known(now_us, [failsafe.divider, failsafe.current_a_v]);
    if B::Sampler::IS_REDUNDANT {
        report_imus(comms, &mut aux, now_us);
    }
    report_self_tests(comms, &mut aux);
    comms.set_aux_sensors(aux);
    // The battery is also passed on when there is no battery state any more.
    let battery = comms.battery();
    control::with_mail(|inputs| inputs.battery = battery);
}

/// Begins a tick of the log, and reports changes of its storage.
fn begin_logging(comms: &mut Comms, black_box: &mut LinkLog, table: &ParameterTable, tick: &Tick) {
    match black_box.begin_tick(tick.report.time_us, tick.report.mode.armed(), table) {
        Some((text, true)) => comms.warn(text),
        Some((text, false)) => comms.inform(text),
        None => (),
    }
}

/// Restarts into the boot loader or this program, as a ground station requested.
fn reboot<B: Board>(comms: &Comms) -> ! {
    if let (Some(Reboot::BootLoader), Some(restart)) = (comms.wants_reboot(), B::BOOT_LOADER) {
        restart();
    }
    cortex_m::peripheral::SCB::sys_reset()
}

/// Returns the decoder of a link: `first` of link 0, or one of `others`.
fn of_link<'a>(
    first: &'a mut Decoder<Uplink>,
    others: &'a mut [Decoder<Uplink>],
    link: usize,
) -> &'a mut Decoder<Uplink> {
    link.checked_sub(1).and_then(|other| others.get_mut(other)).unwrap_or(first)
}

/// Decodes received bytes, including requests for stored logs.
fn hear<B: Board>(
    comms: &mut Comms,
    decoder: &mut Decoder<Uplink>,
    black_box: &mut Option<&'static mut LinkLog>,
    bytes: &[u8],
) -> ControlInputs {
    match black_box {
        Some(black_box) if B::HAS_LOG => comms.receive_with_logs(decoder, bytes, &mut black_box.server),
        // This arm is unreachable on a board with logs. It spares the image a second copy of the receiver.
        _ if B::HAS_LOG => ControlInputs::EMPTY,
        _ => comms.receive(decoder, bytes),
    }
}

/// Passes inputs on to the control tick and records them in the exact log.
fn pass_on<B: Board>(news: &ControlInputs, log: &mut Option<&'static mut ExactLog>) {
    let tick = control::with_mail(|inputs| inputs.merge(news));
    if recording::is_possible::<B>()
        && let Some(log) = log
    {
        log.inputs(tick, news);
    }
}

/// Writes a tick into the exact log and the black box.
fn record<B: Board>(
    tick: &TickRecord<'_>,
    log: &mut Option<&'static mut ExactLog>,
    black_box: &mut Option<&'static mut LinkLog>,
    table: &ParameterTable,
    escs: &EscTelemetry,
) {
    if let Some(log) = log {
        log.tick(tick);
    }
    if B::HAS_LOG
        && let Some(black_box) = black_box
    {
        black_box.tick(tick, table, escs);
    }
}

/// Waits for bytes on any link; returns the link's index and the number of bytes.
fn receive(links: &mut impl Links, buffer: &mut [u8]) -> impl Future<Output = (usize, usize)> {
    poll_fn(|context| {
        // Recreating the futures at every poll loses nothing (`Receiver::receive`); the wakers stay with the ring
        // buffers.
        for (index, link) in links.each().iter_mut().enumerate() {
            if let Poll::Ready(length) = pin!(link.receiver.receive(buffer)).poll(context) {
                return Poll::Ready((index, length));
            }
        }
        Poll::Pending
    })
}

/// Sends all messages of a tick. It is not inlined, like the control tick, so that it can be identified in the image.
#[inline(never)]
fn report(comms: &mut Comms, tick: &Tick, core_hz: u32, outgoing: &mut Vec<u8, REPORT_MAX>) {
    outgoing.clear();
    let tick_us = tick.cycles as f32 / (core_hz / 1_000_000) as f32;
    comms.report(&tick.report, tick_us, |frame| drop(outgoing.extend_from_slice(frame)));
}

/// Reports the state of two inertial sensors. It is not inlined and has its memory in a static of its own, so
/// that boards with one sensor spend no memory on it.
#[inline(never)]
fn report_imus(comms: &mut Comms, aux: &mut AuxSensors, now_us: u64) {
    static NEWS: Mutex<CriticalSectionRawMutex, RefCell<ImuNews>> = Mutex::new(RefCell::new(ImuNews::NEW));
    let pair = samples::imu_pair(now_us);
    let SensorBits { present, healthy } = imus::bits(&pair);
    aux.sensors.present |= present;
    aux.sensors.healthy |= healthy;
    if let Some(text) = NEWS.lock(|news| news.try_borrow_mut().ok()?.look(now_us, &pair)) {
        comms.warn(text);
    }
}

/// Passes on a request for the sensors' self-tests, and reports their results. It is not inlined, like `report`.
#[inline(never)]
fn report_self_tests(comms: &mut Comms, aux: &mut AuxSensors) {
    if comms.wants_self_tests() {
        self_tests::ask();
    }
    match self_tests::report(&mut aux.sensors) {
        Some((text, true)) => comms.inform(text),
        Some((text, false)) => comms.warn(text),
        None => (),
    }
}

/// Passes received motor controller telemetry on, requests the next answer and moves the notch filter. Returns the
/// vehicle's reaction to a failed rotor, if any. It is not inlined, like `report`.
#[inline(never)]
fn listen_to_escs(
    comms: &mut Comms,
    reports: &mut EscReports,
    answers: [Option<u32>; ROTORS_MAX],
    tick: &Tick,
) -> Option<ControlInputs> {
    // Holds three answers; the line delivers at most one per tick. Bytes left over wait for the next tick.
    let mut heard = Vec::<u8, 32>::new();
    while !heard.is_full()
        && let Some(byte) = escs::heard()
    {
        let _ = heard.push(byte);
    }
    let heard = EscsHeard { bytes: &heard, speeds_rev_min: answers };
    let EscAction { ask, notch, inputs } = comms.escs(reports, &heard, &tick.report);
    ask.into_iter().for_each(escs::ask);
    notch.into_iter().for_each(escs::move_notch);
    inputs
}

/// Creates the calibrator. Must be called once, only on a board with sensors; the others spend no memory on it.
#[inline(never)]
fn calibrator() -> &'static mut Calibrator {
    static CALIBRATOR: StaticCell<Calibrator> = StaticCell::new();
    CALIBRATOR.init_with(Calibrator::new)
}

/// Advances a calibration, and sends raw sensor readings to ground stations. It is not inlined, like `report`.
#[inline(never)]
fn calibrate(
    comms: &mut Comms,
    calibrator: &mut Calibrator,
    table: &ParameterTable,
    outgoing: &mut Vec<u8, REPORT_MAX>,
) {
    let sample = samples::raw(comms.takes_samples());
    comms.calibrate(calibrator, sample, table, |frame| drop(outgoing.extend_from_slice(frame)));
}

/// Sends parameter values, passes on a changed parameter and changed signing records, and returns the changed
/// parameter. It is not inlined, like `report`.
#[inline(never)]
fn serve(
    comms: &mut Comms,
    table: &mut ParameterTable,
    log: Option<&mut ExactLog>,
    outgoing: &mut Vec<u8, REPORT_MAX>,
) -> Option<RecordChange> {
    let change = comms.parameters(table, |frame| drop(outgoing.extend_from_slice(frame)));
    if let Some(change) = change {
        let number = log.map_or(0, |log| log.change(table, change));
        parameters::change(table, change, number);
    }
    if let Some(text) = parameters::trouble() {
        comms.warn(text);
    }
    parameters::keep_signing(|| comms.signing_record());
    change
}
