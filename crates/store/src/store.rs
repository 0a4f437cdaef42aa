//! The store: two sectors of records.

use crate::record::{RECORD, RecordContent, RecordName};
use core::fmt;
use embedded_storage::nor_flash::NorFlash;

/// Number of sectors of a store.
const SECTORS: u32 = 2;
/// [`Store::make_room`] moves to the other sector if more than this share of the active one is used, in eighths.
const FULL_EIGHTHS: u32 = 4;

/// Reason why a value was not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The flash reported an error.
    Flash(E),
    /// The sector is full and the other one is not erased. [`Store::make_room`] at the next start erases it.
    NeedsErase,
    /// There are more names than a sector can hold.
    Full,
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Error::Flash(error)
    }
}

impl<E> Error<E> {
    /// Returns the reason as text of at most 50 characters.
    pub const fn reason(&self) -> &'static str {
        match self {
            Error::Flash(_) => "parameter not kept: flash cannot be written",
            Error::NeedsErase => "parameter not kept: store full, restart vehicle",
            Error::Full => "parameter not kept: store full, reset parameters",
        }
    }
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.reason())?;
        if let Error::Flash(error) = self { write!(f, " ({error:?})") } else { Ok(()) }
    }
}

impl<E: fmt::Debug> core::error::Error for Error<E> {}

/// State of the flash when the store was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StoreCondition {
    /// Number of places that are neither blank nor a valid record: the result of a power cut, or data of another
    /// program.
    pub damaged: u32,
    /// True if there is no store although the flash is not blank.
    pub foreign: bool,
    /// True if the values belong to another owner and do not count.
    pub of_another: bool,
}

/// Active sector, which holds the current records.
#[derive(Clone, Copy, Debug)]
struct ActiveSector {
    sector: u32,
    sequence: u32,
    /// First place after the last place that is not blank.
    next: u32,
    /// First place whose values count: after the last [`RecordContent::Begin`].
    first: u32,
    /// Owner of the values.
    owner: Option<u32>,
    /// True if any place is damaged.
    is_damaged: bool,
}

/// Named values in two sectors of `flash`.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    /// Offset of the first sector \[bytes\].
    start: u32,
    owner: u32,
    active: Option<ActiveSector>,
    found: StoreCondition,
}

/// Sector that is being filled and is not active yet.
struct FillingSector {
    sector: u32,
    owner: u32,
    /// `next` and `first` are places, as in [`ActiveSector`].
    next: u32,
    first: u32,
}

/// Name, edition and bits of a value.
type HeldValue = (RecordName, u16, u32);

/// Content of one place of a sector.
enum SlotContent {
    Blank,
    Damaged,
    Holds(RecordContent),
}

impl<F: NorFlash> Store<F> {
    /// Number of places in a sector, including the header's.
    const PLACES: u32 = {
        assert!(
            RECORD.is_multiple_of(F::WRITE_SIZE) && RECORD.is_multiple_of(F::READ_SIZE),
            "the flash must read and write words of 1, 2 or 4 bytes"
        );
        assert!(
            F::ERASE_SIZE >= 8 * RECORD && F::ERASE_SIZE <= 1 << 20,
            "the flash must have sectors of some hundred bytes to 1 MiB"
        );
        (F::ERASE_SIZE / RECORD) as u32
    };

    /// Largest number of names.
    pub const NAMES_MAX: u32 = Self::PLACES - 3;

    /// Opens the store in the two sectors at `start`, for the values of `owner` ([`hash`](crate::hash)). Writes
    /// nothing.
    ///
    /// # Errors
    /// Returns an error if the flash cannot be read.
    pub fn open(flash: F, start: u32, owner: u32) -> Result<Self, Error<F::Error>> {
        let mut store = Store { flash, start, owner, active: None, found: StoreCondition::default() };
        store.find()?;
        Ok(store)
    }

    /// Returns the state of the flash when the store was opened.
    pub fn found(&self) -> StoreCondition {
        self.found
    }

    /// Returns the flash.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// Erases the inactive sector, so that there is room for at least half a sector of further changes, and drops
    /// damaged places. Call it at start-up: on a processor that runs from the same flash, each erase stops everything.
    ///
    /// Returns an error of the flash.
    /// Of the flash.
    pub fn make_room(&mut self) -> Result<(), Error<F::Error>> {
        match self.active {
            None => {
                for sector in 0..SECTORS {
                    self.clear(sector)?;
                }
                let filling = self.begin(0, self.owner)?;
                self.finish(filling, 1)
            }
            Some(active) => {
                // A sector that fills up before the next start can then move to the other one without an erase.
                self.clear(other(active.sector))?;
                let fills = active.next > Self::PLACES * FULL_EIGHTHS / 8;
                // Without header and begin record: if all the rest counts, a move would free no place and only wear the
                // flash.
                if active.is_damaged || fills && self.live()? < active.next.saturating_sub(2) {
                    self.move_on(None)?;
                    self.clear(active.sector)?;
                }
                Ok(())
            }
        }
    }

    /// Calls `visit` with name, edition and bits of every current value of the owner. Values of the board
    /// ([`RecordName::outlasts`]) are left out.
    ///
    /// Returns an error of the flash.
    /// Of the flash.
    pub fn visit(&mut self, mut visit: impl FnMut(RecordName, u16, u32)) -> Result<(), Error<F::Error>> {
        let Some(active) = self.active.filter(|active| active.owner == Some(self.owner)) else { return Ok(()) };
        for place in active.first..active.next {
            if let Some((name, edition, bits)) = self.counts(active, place)?.filter(|(name, ..)| !name.outlasts()) {
                visit(name, edition, bits);
            }
        }
        Ok(())
    }

    /// Returns edition and bits of the value of `name`, if it has one.
    ///
    /// Returns an error of the flash.
    /// Of the flash.
    pub fn get(&mut self, name: RecordName) -> Result<Option<(u16, u32)>, Error<F::Error>> {
        let mine = |active: &ActiveSector| name.outlasts() || active.owner == Some(self.owner);
        let Some(active) = self.active.filter(mine) else { return Ok(None) };
        let first = if name.outlasts() { 1 } else { active.first };
        for place in (first..active.next).rev() {
            match self.read(active.sector, place)? {
                SlotContent::Holds(RecordContent::Value { name: at, edition, bits }) if at == name => {
                    return Ok(bits.map(|bits| (edition, bits)));
                }
                _ => (),
            }
        }
        Ok(None)
    }

    /// Writes the value of `name`, or deletes it for `None`. Erases nothing, and writes nothing if the value is
    /// unchanged.
    ///
    /// # Errors
    /// Returns an error if the value was not written. The previous value then still counts.
    pub fn set(&mut self, name: RecordName, edition: u16, bits: Option<u32>) -> Result<(), Error<F::Error>> {
        let held = self.get(name)?;
        if held == bits.map(|bits| (edition, bits)) {
            return Ok(());
        }
        // Only now are another owner's values void: until then its image finds them again.
        if self.active.is_some_and(|active| active.owner != Some(self.owner)) {
            self.reset()?;
        }
        // The names are counted only if enough records were written for the store to be full.
        let might_be_full = self.active.is_some_and(|active| active.next > Self::NAMES_MAX);
        if held.is_none() && might_be_full && self.live()? >= Self::NAMES_MAX {
            return Err(Error::Full);
        }
        self.add(RecordContent::Value { name, edition, bits })
    }

    /// Deletes all values with one record, except the board's ([`RecordName::outlasts`]).
    ///
    /// # Errors
    /// Returns an error if the record was not written. All values then still count.
    pub fn reset(&mut self) -> Result<(), Error<F::Error>> {
        let is_empty = self.active.is_some_and(|it| it.first >= it.next && it.owner == Some(self.owner));
        if is_empty { Ok(()) } else { self.add(RecordContent::Begin { owner: self.owner }) }
    }

    /// Finds the active sector and its content.
    fn find(&mut self) -> Result<(), Error<F::Error>> {
        let mut blank = true;
        for sector in 0..SECTORS {
            match self.read(sector, 0)? {
                SlotContent::Holds(RecordContent::Header { sequence }) => {
                    if self.active.is_none_or(|active| sequence > active.sequence) {
                        self.active =
                            Some(ActiveSector { sector, sequence, next: 1, first: 1, owner: None, is_damaged: false });
                    }
                }
                _ => blank = blank && self.is_blank(sector)?,
            }
        }
        let Some(mut active) = self.active else {
            self.found.foreign = !blank;
            return Ok(());
        };
        for place in 1..Self::PLACES {
            let held = self.read(active.sector, place)?;
            if !matches!(held, SlotContent::Blank) {
                // After the last place that is not blank, damaged or not: flash is written only once between erases.
                active.next = place + 1;
            }
            match held {
                SlotContent::Damaged => self.found.damaged += 1,
                SlotContent::Holds(RecordContent::Begin { owner }) => {
                    (active.first, active.owner) = (place + 1, Some(owner))
                }
                _ => (),
            }
        }
        active.is_damaged = self.found.damaged > 0;
        self.active = Some(active);
        self.found.of_another = active.owner.is_some_and(|owner| owner != self.owner);
        Ok(())
    }

    /// Appends a record. If the active sector is full, the record goes to the other sector.
    fn add(&mut self, record: RecordContent) -> Result<(), Error<F::Error>> {
        let mut active = self.active.ok_or(Error::NeedsErase)?;
        while active.next < Self::PLACES {
            let place = active.next;
            // The place is counted before the write. A failed write may leave it not blank, and it is not tried again.
            active.next += 1;
            self.active = Some(active);
            if self.write(active.sector, place, record)? {
                if let RecordContent::Begin { owner } = record {
                    (active.first, active.owner) = (active.next, Some(owner));
                    self.active = Some(active);
                }
                return Ok(());
            }
        }
        self.move_on(Some(record))
    }

    /// Copies the current records and `record` to the other sector, and makes that sector active.
    fn move_on(&mut self, record: Option<RecordContent>) -> Result<(), Error<F::Error>> {
        let active = self.active.ok_or(Error::NeedsErase)?;
        if !self.is_blank(other(active.sector))? {
            return Err(Error::NeedsErase);
        }
        let sector = other(active.sector);
        let begins = match record {
            Some(RecordContent::Begin { owner }) => Some(owner),
            _ => None,
        };
        let mut filling = self.begin(sector, begins.or(active.owner).unwrap_or(self.owner))?;
        for place in 1..active.next {
            let Some((name, edition, bits)) = self.counts(active, place)? else { continue };
            let stays = name.outlasts() || place >= active.first && begins.is_none();
            if stays && !matches!(record, Some(RecordContent::Value { name: new, .. }) if new == name) {
                self.append(&mut filling, RecordContent::Value { name, edition, bits: Some(bits) })?;
            }
        }
        if let Some(record @ RecordContent::Value { .. }) = record {
            self.append(&mut filling, record)?;
        }
        // The sequence does not wrap in a flash's life: each step costs an erase, and a sector endures some 10,000.
        self.finish(filling, active.sequence.wrapping_add(1))
    }

    /// Starts to fill the blank `sector`.
    fn begin(&mut self, sector: u32, owner: u32) -> Result<FillingSector, Error<F::Error>> {
        let mut filling = FillingSector { sector, owner, next: 1, first: 1 };
        self.append(&mut filling, RecordContent::Begin { owner })?;
        filling.first = filling.next;
        Ok(filling)
    }

    /// Appends a record to a sector that is not active yet.
    fn append(&mut self, filling: &mut FillingSector, record: RecordContent) -> Result<(), Error<F::Error>> {
        while filling.next < Self::PLACES {
            filling.next += 1;
            if self.write(filling.sector, filling.next - 1, record)? {
                return Ok(());
            }
        }
        Err(Error::Full)
    }

    /// Writes the header, which makes the sector active.
    fn finish(&mut self, filling: FillingSector, sequence: u32) -> Result<(), Error<F::Error>> {
        let FillingSector { sector, owner, next, first } = filling;
        // If the header cannot be written, the other sector stays active and this sector must be erased.
        if !self.write(sector, 0, RecordContent::Header { sequence })? {
            return Err(Error::NeedsErase);
        }
        self.active = Some(ActiveSector { sector, sequence, next, first, owner: Some(owner), is_damaged: false });
        Ok(())
    }

    /// Returns the number of current values.
    fn live(&mut self) -> Result<u32, Error<F::Error>> {
        let Some(active) = self.active else { return Ok(0) };
        let mut live = 0;
        for place in 1..active.next {
            let held = self.counts(active, place)?;
            live += u32::from(held.is_some_and(|(name, ..)| name.outlasts() || place >= active.first));
        }
        Ok(live)
    }

    /// Returns the value at `place`, if no later record has the same name.
    fn counts(&mut self, active: ActiveSector, place: u32) -> Result<Option<HeldValue>, Error<F::Error>> {
        let SlotContent::Holds(RecordContent::Value { name, edition, bits: Some(bits) }) =
            self.read(active.sector, place)?
        else {
            return Ok(None);
        };
        for later in place + 1..active.next {
            match self.read(active.sector, later)? {
                SlotContent::Holds(RecordContent::Value { name: again, .. }) if again == name => return Ok(None),
                _ => (),
            }
        }
        Ok(Some((name, edition, bits)))
    }

    fn address(&self, sector: u32, place: u32) -> u32 {
        self.start + sector * F::ERASE_SIZE as u32 + place * RECORD as u32
    }

    fn read(&mut self, sector: u32, place: u32) -> Result<SlotContent, Error<F::Error>> {
        let mut bytes = [0; RECORD];
        self.flash.read(self.address(sector, place), &mut bytes)?;
        Ok(match RecordContent::from_bytes(&bytes) {
            Some(record) => SlotContent::Holds(record),
            None if bytes.iter().all(|byte| *byte == 0xFF) => SlotContent::Blank,
            None => SlotContent::Damaged,
        })
    }

    /// Writes a record. Returns false if it does not read back as written.
    fn write(&mut self, sector: u32, place: u32, record: RecordContent) -> Result<bool, Error<F::Error>> {
        self.flash.write(self.address(sector, place), &record.to_bytes())?;
        Ok(matches!(self.read(sector, place)?, SlotContent::Holds(held) if held == record))
    }

    fn is_blank(&mut self, sector: u32) -> Result<bool, Error<F::Error>> {
        let (mut at, end) = (self.address(sector, 0), self.address(sector + 1, 0));
        let mut bytes = [0; 64];
        while at < end {
            let length = bytes.len().min((end - at) as usize);
            let part = bytes.get_mut(..length).unwrap_or_default();
            self.flash.read(at, part)?;
            if part.iter().any(|byte| *byte != 0xFF) {
                return Ok(false);
            }
            at += length as u32;
        }
        Ok(true)
    }

    /// Erases a sector, unless it is blank.
    fn clear(&mut self, sector: u32) -> Result<(), Error<F::Error>> {
        if !self.is_blank(sector)? {
            self.flash.erase(self.address(sector, 0), self.address(sector + 1, 0))?;
        }
        Ok(())
    }
}

const fn other(sector: u32) -> u32 {
    1 - sector
}
