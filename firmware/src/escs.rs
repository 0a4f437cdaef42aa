//! Telemetry of the motor controllers, passed between the board's tasks and the link task.

use crate::vehicle::ROTORS;
use afbc_comms::EscReports;
use afbc_estimator::VelocityNotch;
use afbc_onboard::parameters::ParameterTable;
use afbc_types::ROTORS_MAX;
use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use heapless::Deque;
use static_cell::StaticCell;

/// Largest number of bytes queued for the link task: six answers.
const WAITING: usize = 64;

/// Electrical speed in each motor controller's newest answer \[rev/min\], plus one; 0 if there is no new answer.
static ANSWERED: [AtomicU32; ROTORS] = [const { AtomicU32::new(0) }; ROTORS];
static HEARD: Mutex<CriticalSectionRawMutex, RefCell<Deque<u8, WAITING>>> = Mutex::new(RefCell::new(Deque::new()));
/// Rotor whose motor controller is to be asked next, counted from 1; 0 for none.
static ASKED: AtomicU8 = AtomicU8::new(0);
/// New place of the notch filter, and a flag that it is new.
static NOTCH: Mutex<CriticalSectionRawMutex, Cell<Option<VelocityNotch>>> = Mutex::new(Cell::new(None));
static MOVES: AtomicBool = AtomicBool::new(false);

/// Queues bytes received from the telemetry line; drops those for which there is no room.
pub fn put(bytes: &[u8]) {
    HEARD.lock(|heard| {
        // `try_borrow_mut` succeeds, since nothing else borrows while the lock is held.
        let Ok(mut heard) = heard.try_borrow_mut() else { return };
        for byte in bytes {
            // An answer that lacks a byte fails its checksum and is ignored.
            let _ = heard.push_back(*byte);
        }
    });
}

/// Stores the electrical speed \[rev/min\] in the answer of a rotor's motor controller.
pub fn answered(rotor: usize, speed_rev_min: u32) {
    if let Some(place) = ANSWERED.get(rotor) {
        place.store(speed_rev_min.saturating_add(1), Ordering::Relaxed);
    }
}

/// Returns the electrical speeds answered since the last call \[rev/min\].
pub(crate) fn take_answers() -> [Option<u32>; ROTORS_MAX] {
    let mut answers = [None; ROTORS_MAX];
    for (answer, place) in answers.iter_mut().zip(&ANSWERED) {
        // Load and store need not be atomic together: an answer in between is lost, and another follows.
        *answer = place.load(Ordering::Relaxed).checked_sub(1);
        place.store(0, Ordering::Relaxed);
    }
    answers
}

/// Returns the rotor, counted from 0, whose motor controller the next frame must ask. Each request is returned once,
/// to the caller whose `is_mine` accepts the rotor.
pub fn asked(is_mine: impl FnOnce(usize) -> bool) -> Option<usize> {
    // Load and store need not be atomic together: the link task, which sets the value, has a lower priority.
    let rotor = usize::from(ASKED.load(Ordering::Relaxed)).checked_sub(1)?;
    is_mine(rotor).then(|| ASKED.store(0, Ordering::Relaxed))?;
    Some(rotor)
}

/// Sets the rotor to ask in the next frame.
pub(crate) fn ask(rotor: u8) {
    ASKED.store(rotor.wrapping_add(1), Ordering::Relaxed);
}

/// Returns the next received byte.
pub(crate) fn heard() -> Option<u8> {
    HEARD.lock(|heard| heard.try_borrow_mut().ok()?.pop_front())
}

/// Creates the evaluation of the telemetry. Must be called once, only by a board that has telemetry; the others spend
/// no memory on it.
#[inline(never)]
pub(crate) fn reports(table: &ParameterTable) -> &'static mut EscReports {
    static REPORTS: StaticCell<EscReports> = StaticCell::new();
    REPORTS.init_with(|| EscReports::new(table.configuration()))
}

/// Requests that the notch filter be moved before the next tick.
pub(crate) fn move_notch(notch: VelocityNotch) {
    // The notch is set before the flag, since the control tick may run in between.
    NOTCH.lock(|cell| cell.set(Some(notch)));
    MOVES.store(true, Ordering::Relaxed);
}

/// Returns the new place of the notch filter, once, if it is to be moved.
pub(crate) fn moved_notch() -> Option<VelocityNotch> {
    // The flag is read after every tick and is rarely set.
    MOVES.load(Ordering::Relaxed).then(|| {
        MOVES.store(false, Ordering::Relaxed);
        NOTCH.lock(Cell::take)
    })?
}
