//! Stores the parameters that differ from the firmware image, and reads them back in later images.

use super::reason::Reason;
use super::table::ParameterTable;
use afbc_store::{Error, RecordName, Store};
use embedded_storage::nor_flash::NorFlash;

/// A change of the parameter table that is to be stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RecordChange {
    /// A parameter and its new value; none if it has the image's value again.
    Set(RecordName, Option<f32>),
    /// All parameters have the image's values again.
    Restored,
}

/// Largest number of passes over the store to set values that depend on each other.
const ROUNDS_MAX: u32 = 100;

/// Tells how to read values that earlier images have stored.
///
/// A name is never reused. A parameter whose meaning or unit changes keeps its name and gets an entry in `changed`. A
/// parameter that is renamed gets an entry in `renamed`. A changed range needs no entry, since each value is checked
/// when it is read.
#[derive(Clone, Copy, Debug)]
pub struct Kept {
    /// Number of the present meanings, at least the largest in `changed`.
    pub edition: u16,
    /// Former and present name of each renamed parameter.
    pub renamed: &'static [(&'static str, &'static str)],
    /// Present name of a parameter, and the edition in which it got its present meaning.
    pub changed: &'static [(&'static str, u16)],
}

impl Kept {
    /// Format of the present firmware image.
    pub const NOW: Self = Kept { edition: 0, renamed: &[], changed: &[] };

    /// Sets the parameters in `table`, which must have the image's values, to the stored values. Calls `notice` with a
    /// line for each stored value that is not used; its parameter keeps the image's value. Does not write to the store.
    ///
    /// All values are set together. If the vehicle could not fly with them, for example because the image has other
    /// gains, they are set one by one as far as possible.
    ///
    /// # Errors
    /// A failure of the flash. Then all parameters have the image's values.
    pub fn load<F: NorFlash>(
        &self,
        table: &mut ParameterTable,
        store: &mut Store<F>,
        mut notice: impl FnMut(Reason),
    ) -> Result<(), Error<F::Error>> {
        let found = store.found();
        if found.foreign {
            notice(Reason::new("parameters", "store unreadable, using defaults"));
        }
        if found.of_another {
            notice(Reason::new("parameters", "stored for another vehicle, ignored"));
        }
        if found.damaged > 0 {
            notice(Reason::new("parameters", "a write was cut off, values are lost"));
        }
        let read = store.visit(|name, edition, bits| {
            let put = self.read(name, edition, bits).and_then(|(name, value)| table.put(name, value));
            let _ = put.map_err(&mut notice);
        });
        if read.is_ok() && table.check().is_ok() {
            return Ok(());
        }
        // Drops the values read so far: half of them would make a vehicle that nobody has configured.
        table.restore();
        read.and_then(|()| self.load_singly(table, store, notice))
    }

    /// Sets values one by one until no more can be set. Calls `notice` with a line for each of the rest.
    fn load_singly<F: NorFlash>(
        &self,
        table: &mut ParameterTable,
        store: &mut Store<F>,
        mut notice: impl FnMut(Reason),
    ) -> Result<(), Error<F::Error>> {
        let mut more = true;
        // Repeats, as a value may only be possible after a later one in the store. The number of passes is limited:
        // after a power cut, a parameter's former and present name may both be stored, and set it in turns.
        for round in 1..=ROUNDS_MAX {
            let last = !more || round == ROUNDS_MAX;
            more = false;
            store.visit(|name, edition, bits| {
                let Ok((name, value)) = self.read(name, edition, bits) else { return };
                // Unknown names and values out of range have been reported already.
                let known = table.get(name).filter(|parameter| parameter.range.check(value).is_ok());
                if known.is_some_and(|parameter| parameter.value != value) {
                    match table.set(name, value) {
                        Ok(_) => more = true,
                        Err(reason) if last => notice(reason),
                        Err(_) => (),
                    }
                }
            })?;
            if last {
                break;
            }
        }
        Ok(())
    }

    /// Stores a change.
    ///
    /// # Errors
    /// If the change was not stored, or only in part. Values of other names are not affected.
    pub fn keep<F: NorFlash>(&self, store: &mut Store<F>, change: RecordChange) -> Result<(), Error<F::Error>> {
        match change {
            RecordChange::Restored => store.reset(),
            RecordChange::Set(name, Some(value)) => {
                // Writes the new value first: a power cut before the second write leaves at least one value.
                store.set(name, self.edition, Some(value.to_bits()))?;
                self.forget(store, name)
            }
            // Deletes former names first, so that none of their values becomes valid again.
            RecordChange::Set(name, None) => {
                self.forget(store, name)?;
                store.set(name, self.edition, None)
            }
        }
    }

    /// Deletes the values stored under former names of `name`.
    fn forget<F: NorFlash>(&self, store: &mut Store<F>, name: RecordName) -> Result<(), Error<F::Error>> {
        let former = self.renamed.iter().filter(|(_, now)| *now == name.as_str());
        former
            .filter_map(|(former, _)| RecordName::new(former))
            .try_for_each(|former| store.set(former, self.edition, None))
    }

    /// Returns the present name and the value of a stored entry.
    fn read(&self, name: RecordName, edition: u16, bits: u32) -> Result<(RecordName, f32), Reason> {
        let renamed = self.renamed.iter().find(|(former, _)| *former == name.as_str());
        let now = renamed.and_then(|(_, now)| RecordName::new(now)).unwrap_or(name);
        let is_changed = self.changed.iter().any(|(name, since)| *name == now.as_str() && edition < *since);
        if is_changed {
            Err(Reason::on(now, "its meaning changed, set it again"))
        } else {
            Ok((now, f32::from_bits(bits)))
        }
    }
}
