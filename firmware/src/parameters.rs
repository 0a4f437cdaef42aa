//! Storage of the vehicle's parameters and its MAVLink signing key. They are read from the board's flash at the start,
//! and written to it while the vehicle is disarmed.
//!
//! Sectors are erased at the start only, before the watchdog and the control tick run. Erasing a sector of the chip's
//! own flash takes half a second or more, during which an access to the flash may stop the core. Writing may stop the
//! core for up to 0.1 ms per word. The tick's interrupt runs between two words, so a tick is delayed by 0.1 ms at
//! most, which is within its tolerance. No word is written while armed ([`Gate`]).

use crate::control;
use crate::vehicle::{CONFIGURATION, NAME, Prepared, ROTORS};
use afbc_comms::services::signing::{Signing, SigningRecord};
use afbc_onboard::parameters::{Kept, ParameterTable, RecordChange};
use afbc_store::{Error, RecordName, Store, hash};
use core::cell::RefCell;
use core::future::poll_fn;
use core::pin::pin;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Poll;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, Timer};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use heapless::Deque;

/// Change that is waiting to be written.
#[derive(Clone, Copy)]
enum UnwrittenRecord {
    /// A change of the parameters.
    Parameters(RecordChange),
    /// A part of the signing key.
    Signing(SigningRecord),
}

/// Changes to write, and a signal that the queue has changes.
static CHANGES: Mutex<CriticalSectionRawMutex, RefCell<Deque<UnwrittenRecord, 8>>> =
    Mutex::new(RefCell::new(Deque::new()));
static CHANGED: Signal<CriticalSectionRawMutex, ()> = Signal::new();
/// Flags for a station's warning: the parameters' flash could not be read at the start; a change could not be written.
/// Cleared when the station is told.
static UNREAD: AtomicBool = AtomicBool::new(false);
static UNWRITTEN: AtomicBool = AtomicBool::new(false);
/// Time between two attempts to write while the vehicle is armed \[us\].
const PATIENCE_US: u64 = 100_000;

/// Flash that is written word by word, and only while the vehicle is disarmed.
pub struct Gate<M>(M);

/// Error of a [`Gate`].
#[derive(Clone, Copy, Debug)]
pub enum Shut {
    /// The vehicle is armed.
    Armed,
    /// The flash failed.
    Flash(NorFlashErrorKind),
}

impl NorFlashError for Shut {
    fn kind(&self) -> NorFlashErrorKind {
        match *self {
            Shut::Armed => NorFlashErrorKind::Other,
            Shut::Flash(kind) => kind,
        }
    }
}

impl<M: NorFlash> ErrorType for Gate<M> {
    type Error = Shut;
}

impl<M: NorFlash> ReadNorFlash for Gate<M> {
    const READ_SIZE: usize = M::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Shut> {
        self.0.read(offset, bytes).map_err(|error| Shut::Flash(error.kind()))
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<M: NorFlash> NorFlash for Gate<M> {
    const WRITE_SIZE: usize = M::WRITE_SIZE;
    const ERASE_SIZE: usize = M::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Shut> {
        // Erasing is not gated, because flash is erased only at the start, before the vehicle can arm.
        self.0.erase(from, to).map_err(|error| Shut::Flash(error.kind()))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Shut> {
        (offset..).step_by(M::WRITE_SIZE).zip(bytes.chunks(M::WRITE_SIZE)).try_for_each(|(at, word)| {
            if control::armed() {
                return Err(Shut::Armed);
            }
            self.0.write(at, word).map_err(|error| Shut::Flash(error.kind()))
        })
    }
}

/// Writer of changes; without a store it writes none.
pub struct Keeper<M>(Option<Store<Gate<M>>>);

/// Reads the parameters and the signing key from `memory`, whose sectors begin at `start`, and makes room for changes.
/// If the store cannot be read, the parameters are the image's.
pub fn read<M: NorFlash>(memory: M, start: u32) -> (Keeper<M>, ParameterTable, Signing) {
    let mut table = ParameterTable::for_rotors::<ROTORS>(CONFIGURATION);
    // The store is tied to the vehicle's name, so that values set for another vehicle are ignored.
    let Ok(mut store) = Store::open(Gate(memory), start, hash(NAME.as_bytes())) else {
        UNREAD.store(true, Ordering::Relaxed);
        return (Keeper(None), table, Signing::default());
    };
    if store.make_room().is_err() {
        defmt::warn!("the parameters' flash cannot be erased");
    }
    let notice = |notice: afbc_onboard::parameters::Reason| defmt::warn!("{=str}", notice.as_str());
    if Kept::NOW.load(&mut table, &mut store, notice).is_err() {
        defmt::warn!("the parameters' flash cannot be read");
        UNREAD.store(true, Ordering::Relaxed);
    }
    let signing = Signing::kept(|name| word(&mut store, name));
    (Keeper(Some(store)), table, signing)
}

/// Returns the bits of a record. It is not inlined, since it is called for each part of the key.
#[inline(never)]
fn word<M: NorFlash>(store: &mut Store<Gate<M>>, name: RecordName) -> Option<u32> {
    store.get(name).ok().flatten().map(|(_, bits)| bits)
}

/// Passes a changed parameter on to flight and flash. At the next disarmed tick, the vehicle adopts `table` as the
/// configuration of this number.
pub fn change(table: &ParameterTable, change: RecordChange, number: u16) {
    // Each change has already been checked. If it still cannot fly, the former configuration stays.
    if let Ok(prepared) = Prepared::new(table.configuration()) {
        control::fly(prepared, number);
    }
    put(UnwrittenRecord::Parameters(change));
}

/// Returns a problem with the parameters' flash as a text for stations. Each problem is returned once.
pub fn trouble() -> Option<&'static str> {
    if UNREAD.swap(false, Ordering::Relaxed) {
        return Some("parameters' flash unreadable: using defaults");
    }
    UNWRITTEN.swap(false, Ordering::Relaxed).then_some("setting not saved to flash: set it again")
}

/// Queues the record returned by `record`, if any, once the queue has room. `record` is called outside the queue's
/// lock, during which no interrupt runs.
pub fn keep_signing(record: impl FnOnce() -> Option<SigningRecord>) {
    let has_room = CHANGES.lock(|changes| changes.try_borrow().is_ok_and(|changes| !changes.is_full()));
    // The room cannot vanish, since only this task queues. It is checked first because a record is handed out once.
    if has_room && let Some(record) = record() {
        put(UnwrittenRecord::Signing(record));
    }
}

/// Queues a change, or sets the flag `UNWRITTEN` if the queue is full.
fn put(change: UnwrittenRecord) {
    if CHANGES.lock(|changes| changes.try_borrow_mut().ok()?.push_back(change).ok()).is_none() {
        UNWRITTEN.store(true, Ordering::Relaxed);
    }
    CHANGED.signal(());
}

/// Runs the task that writes changes while the vehicle is disarmed.
pub async fn run<M: NorFlash>(keeper: &mut Keeper<M>) -> ! {
    loop {
        let change = next().await;
        let Keeper(Some(store)) = keeper else {
            UNWRITTEN.store(true, Ordering::Relaxed);
            continue;
        };
        loop {
            match keep(store, change) {
                // The vehicle has armed: try again later.
                Err(Error::Flash(Shut::Armed)) => {
                    Timer::at(Instant::from_micros(Instant::now().as_micros().wrapping_add(PATIENCE_US))).await;
                }
                Err(error) => {
                    defmt::warn!("{=str}", error.reason());
                    UNWRITTEN.store(true, Ordering::Relaxed);
                    break;
                }
                Ok(()) => break,
            }
        }
    }
}

/// Writes a change. It is not inlined, so that it can be identified in the image.
#[inline(never)]
fn keep<M: NorFlash>(store: &mut Store<Gate<M>>, change: UnwrittenRecord) -> Result<(), Error<Shut>> {
    match change {
        UnwrittenRecord::Parameters(change) => Kept::NOW.keep(store, change),
        UnwrittenRecord::Signing(SigningRecord { name, bits }) => store.set(name, 0, bits),
    }
}

/// Waits for the next change.
fn next() -> impl Future<Output = UnwrittenRecord> {
    poll_fn(|context| {
        // The waker is registered before the queue is read, so that no change is missed.
        let _ = pin!(CHANGED.wait()).poll(context);
        match CHANGES.lock(|changes| changes.try_borrow_mut().ok()?.pop_front()) {
            Some(change) => Poll::Ready(change),
            None => Poll::Pending,
        }
    })
}
