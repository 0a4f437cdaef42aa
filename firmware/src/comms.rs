//! The link: receives and sends messages, at a lower priority than the control tick.

use crate::board::{Receiver, Transmitter};
use crate::control::{self, Tick};
pub use afbc_onboard::Comms;
use afbc_onboard::REPORT_MAX;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_futures::select::{Either, select};
use heapless::Vec;

/// Largest number of bytes read at once.
const READ_MAX: usize = 128;

static BAD_FRAMES: AtomicU32 = AtomicU32::new(0);

/// Returns the number of frames dropped since power-up.
pub fn bad_frames() -> u32 {
    BAD_FRAMES.load(Ordering::Relaxed)
}

/// Receives messages, and reports every tick.
pub async fn run(comms: &mut Comms, receiver: &mut impl Receiver, transmitter: &mut impl Transmitter) -> ! {
    let mut incoming = [0; READ_MAX];
    let mut outgoing = Vec::<u8, REPORT_MAX>::new();
    loop {
        match select(receiver.receive(&mut incoming), control::next_tick()).await {
            Either::First(length) => {
                let news = comms.receive(incoming.get(..length).unwrap_or_default());
                control::with_inbox(|inbox| inbox.post(&news));
                BAD_FRAMES.store(comms.bad_frames(), Ordering::Relaxed);
            }
            Either::Second(tick) => {
                report(comms, &tick, &mut outgoing);
                transmitter.transmit(&tick, &outgoing);
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
