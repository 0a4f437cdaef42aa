//! The motor controllers' line, between the board's tasks and the links'.

use crate::vehicle::{ParameterTable, ROTORS};
use afbc_estimator::VelocityNotch;
use afbc_station::EscReports;
use afbc_types::ROTORS_MAX;
use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use heapless::Deque;
use static_cell::StaticCell;

/// Bytes that wait for the links' task, at most: six answers.
const WAITING: usize = 64;

/// Electrical speed with which each motor controller has answered \[rev/min\], and one more; 0 for none.
static ANSWERED: [AtomicU32; ROTORS] = [const { AtomicU32::new(0) }; ROTORS];
static HEARD: Mutex<CriticalSectionRawMutex, RefCell<Deque<u8, WAITING>>> = Mutex::new(RefCell::new(Deque::new()));
/// Rotor that is to be asked, from 1; 0 for none.
static ASKED: AtomicU8 = AtomicU8::new(0);
/// Where the notch is to stand, and whether that is news.
static NOTCH: Mutex<CriticalSectionRawMutex, Cell<Option<VelocityNotch>>> = Mutex::new(Cell::new(None));
static MOVES: AtomicBool = AtomicBool::new(false);

/// Puts what has come over the line; what there is no room for is lost.
pub fn put(bytes: &[u8]) {
    HEARD.lock(|heard| {
        // Not borrowed elsewhere while it is locked; no panic in any case.
        let Ok(mut heard) = heard.try_borrow_mut() else { return };
        for byte in bytes {
            // An answer that lacks a byte fails its checksum, and counts as none.
            let _ = heard.push_back(*byte);
        }
    });
}

/// Puts the electrical speed \[rev/min\] with which a rotor's motor controller has answered a frame.
pub fn answered(rotor: usize, speed_rev_min: u32) {
    if let Some(place) = ANSWERED.get(rotor) {
        place.store(speed_rev_min.saturating_add(1), Ordering::Relaxed);
    }
}

/// Returns the electrical speeds that have been answered since the last call \[rev/min\].
pub(crate) fn take_answers() -> [Option<u32>; ROTORS_MAX] {
    let mut answers = [None; ROTORS_MAX];
    for (answer, place) in answers.iter_mut().zip(&ANSWERED) {
        // Load and store need not be one: an answer that comes in between is lost, and another follows.
        *answer = place.load(Ordering::Relaxed).checked_sub(1);
        place.store(0, Ordering::Relaxed);
    }
    answers
}

/// Returns the rotor, from 0, whose motor controller is to be asked in the next frame, if `is_mine` says so of it:
/// once.
pub fn asked(is_mine: impl FnOnce(usize) -> bool) -> Option<usize> {
    // Load and store need not be one: the links' task, which sets it, has a lower priority.
    let rotor = usize::from(ASKED.load(Ordering::Relaxed)).checked_sub(1)?;
    is_mine(rotor).then(|| ASKED.store(0, Ordering::Relaxed))?;
    Some(rotor)
}

/// Sets whom to ask in the next frame.
pub(crate) fn ask(rotor: u8) {
    ASKED.store(rotor.wrapping_add(1), Ordering::Relaxed);
}

/// Returns a byte that has come.
pub(crate) fn heard() -> Option<u8> {
    HEARD.lock(|heard| heard.try_borrow_mut().ok()?.pop_front())
}

/// Creates what listens to the line, to be called once, by a board that has it: the others do not have its memory.
#[inline(never)]
pub(crate) fn reports(table: &ParameterTable) -> &'static mut EscReports {
    static REPORTS: StaticCell<EscReports> = StaticCell::new();
    REPORTS.init_with(|| EscReports::new(table.configuration()))
}

/// Moves the notch before the next tick.
pub(crate) fn move_notch(notch: VelocityNotch) {
    // Before the flag: the control tick may come in between.
    NOTCH.lock(|cell| cell.set(Some(notch)));
    MOVES.store(true, Ordering::Relaxed);
}

/// Returns where the notch is to stand from the next tick on, if it moves.
pub(crate) fn moved_notch() -> Option<VelocityNotch> {
    // Looked at after every tick, and seldom true.
    MOVES.load(Ordering::Relaxed).then(|| {
        MOVES.store(false, Ordering::Relaxed);
        NOTCH.lock(Cell::take)
    })?
}
