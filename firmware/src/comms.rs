//! The link: receives and sends messages, at a lower priority than the control tick.

use crate::board::{Receiver, Transmitter};
use crate::control;
use crate::parameters;
use crate::ticks::{self, Tick};
use crate::vehicle::ParameterTable;
pub use afbc_onboard::Comms;
use afbc_onboard::{REPORT_MAX, Setup};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_futures::select::{Either, select};
use heapless::Vec;
use static_cell::StaticCell;

/// Largest number of bytes read at once.
const READ_MAX: usize = 128;

static BAD_FRAMES: AtomicU32 = AtomicU32::new(0);

/// Returns the number of frames dropped since power-up.
pub fn bad_frames() -> u32 {
    BAD_FRAMES.load(Ordering::Relaxed)
}

/// Ticks from a request to reboot to the reset, in which the answer leaves and a change of a parameter is written.
const FAREWELL: u32 = 100;
/// Text to the station when more changes of parameters are waiting for the flash than there is room for.
const NOT_KEPT: &str = "parameter not kept: set it again";

/// What the link's task has: the services for stations, and the parameters.
pub type Desk = (Comms, ParameterTable);

/// Creates it, with nothing received, to be called once: in place, since a task would store a value twice and take the
/// stack for it.
#[inline(never)]
pub fn make(table: ParameterTable) -> &'static mut Desk {
    static DESK: StaticCell<Desk> = StaticCell::new();
    DESK.init_with(|| {
        let setup = Setup { reboots: true, ..Setup::of(&table.configuration().link) };
        (Comms::with(setup), table)
    })
}

/// Receives messages, and reports every tick.
pub async fn run((comms, table): &mut Desk, receiver: &mut impl Receiver, transmitter: &mut impl Transmitter) -> ! {
    let mut incoming = [0; READ_MAX];
    let mut outgoing = Vec::<u8, REPORT_MAX>::new();
    let mut leaving = 0;
    loop {
        match select(receiver.receive(&mut incoming), ticks::next()).await {
            Either::First(length) => {
                let news = comms.receive(incoming.get(..length).unwrap_or_default());
                control::with_mail(|inputs| inputs.merge(&news));
                BAD_FRAMES.store(comms.bad_frames(), Ordering::Relaxed);
            }
            Either::Second(tick) => {
                report(comms, &tick, &mut outgoing);
                serve(comms, table, &mut outgoing);
                transmitter.transmit(&tick, &outgoing);
                if comms.has_mail() {
                    let news = comms.receive(&[]);
                    control::with_mail(|inputs| inputs.merge(&news));
                }
                leaving += u32::from(comms.wants_reboot());
                if leaving >= FAREWELL && !control::armed() {
                    cortex_m::peripheral::SCB::sys_reset();
                }
            }
        }
    }
}

/// Sends all messages after a tick. Out of line, like the control tick, to be identified in the image.
#[inline(never)]
fn report(comms: &mut Comms, tick: &Tick, outgoing: &mut Vec<u8, REPORT_MAX>) {
    outgoing.clear();
    // There is room for every frame.
    comms.report(&tick.report, tick.cycles, |frame| drop(outgoing.extend_from_slice(frame)));
}

/// Sends values of parameters, and passes on what has changed. Out of line like the report.
#[inline(never)]
fn serve(comms: &mut Comms, table: &mut ParameterTable, outgoing: &mut Vec<u8, REPORT_MAX>) {
    let change = comms.parameters(table, |frame| drop(outgoing.extend_from_slice(frame)));
    if let Some(change) = change
        && !parameters::change(table, change)
    {
        comms.warn(NOT_KEPT);
    }
}
