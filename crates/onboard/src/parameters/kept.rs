//! What of the parameters is in a store: the values that differ from the image's, over images to come.

use super::reason::Reason;
use super::table::ParameterTable;
use afbc_store::{Error, RecordName, Store};
use embedded_storage::nor_flash::NorFlash;

/// What is to be written after a change of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RecordChange {
    /// This parameter has this value now; none: that of the image.
    Set(RecordName, Option<f32>),
    /// All parameters are as in the image.
    Restored,
}

/// Rounds over the store in which values that need one another are set.
const ROUNDS_MAX: u32 = 100;

/// How to read what earlier images have written.
///
/// A name is used once: a parameter whose meaning or unit changes keeps its name, and gets a line in `changed`; one
/// that gets a new name, a line in `renamed`. A range that changes needs neither, since each value is checked when it
/// is read.
#[derive(Clone, Copy, Debug)]
pub struct Kept {
    /// Number of the present meanings, at least the largest of `changed`.
    pub edition: u16,
    /// Former and present name.
    pub renamed: &'static [(&'static str, &'static str)],
    /// Present name of a parameter, and the edition since which its value means what it means now.
    pub changed: &'static [(&'static str, u16)],
}

impl Kept {
    /// As this image writes and reads.
    pub const NOW: Self = Kept { edition: 0, renamed: &[], changed: &[] };

    /// Sets the parameters of `table`, which is as in the image, to what is in `store`. Calls `notice` with a line on
    /// each value that is not used; its parameter is as in the image then. Writes nothing.
    ///
    /// All values are taken together. If the vehicle could not fly with them, as those of an image with other gains,
    /// they are taken one by one as far as it could.
    ///
    /// # Errors
    /// Of the flash: then every parameter is as in the image.
    pub fn load<F: NorFlash, const N: usize>(
        &self,
        table: &mut ParameterTable<N>,
        store: &mut Store<F>,
        mut notice: impl FnMut(Reason),
    ) -> Result<(), Error<F::Error>> {
        let found = store.found();
        if found.foreign {
            notice(Reason::new("parameters", "store unreadable, all at defaults"));
        }
        if found.of_another {
            notice(Reason::new("parameters", "stored for another vehicle, not used"));
        }
        if found.damaged > 0 {
            notice(Reason::new("parameters", "a write was cut off, left out"));
        }
        let read = store.visit(|name, edition, bits| {
            let put = self.read(name, edition, bits).and_then(|(name, value)| table.put(name, value));
            let _ = put.map_err(&mut notice);
        });
        if read.is_ok() && table.check().is_ok() {
            return Ok(());
        }
        // Not what was read so far: half of the values would be a vehicle that nobody has set.
        table.restore();
        read.and_then(|()| self.load_singly(table, store, notice))
    }

    /// Sets what can be set, until nothing more can; calls `notice` with a line on each of the rest.
    fn load_singly<F: NorFlash, const N: usize>(
        &self,
        table: &mut ParameterTable<N>,
        store: &mut Store<F>,
        mut notice: impl FnMut(Reason),
    ) -> Result<(), Error<F::Error>> {
        let mut more = true;
        // In rounds: a value may be possible only beside another that comes later in the store. Bounded, since a former
        // and a present name of one parameter may stand there after a cut of power, and set it in turns.
        for round in 1..=ROUNDS_MAX {
            let last = !more || round == ROUNDS_MAX;
            more = false;
            store.visit(|name, edition, bits| {
                let Ok((name, value)) = self.read(name, edition, bits) else { return };
                // What is unknown, or out of its own range, has been reported.
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

    /// Writes a change.
    ///
    /// # Errors
    /// If it was not written, or in part: values of other names are not affected.
    pub fn keep<F: NorFlash>(&self, store: &mut Store<F>, change: RecordChange) -> Result<(), Error<F::Error>> {
        match change {
            RecordChange::Restored => store.reset(),
            RecordChange::Set(name, Some(value)) => {
                // The new value first: a cut of power between the two leaves at least one of them.
                store.set(name, self.edition, Some(value.to_bits()))?;
                self.forget(store, name)
            }
            // Former names first: at no point does one of them count again.
            RecordChange::Set(name, None) => {
                self.forget(store, name)?;
                store.set(name, self.edition, None)
            }
        }
    }

    /// Takes back what stands under former names of `name`.
    fn forget<F: NorFlash>(&self, store: &mut Store<F>, name: RecordName) -> Result<(), Error<F::Error>> {
        let former = self.renamed.iter().filter(|(_, now)| *now == name.as_str());
        former
            .filter_map(|(former, _)| RecordName::new(former))
            .try_for_each(|former| store.set(former, self.edition, None))
    }

    /// Returns the present name and value of what is stored.
    fn read(&self, name: RecordName, edition: u16, bits: u32) -> Result<(RecordName, f32), Reason> {
        let renamed = self.renamed.iter().find(|(former, _)| *former == name.as_str());
        let now = renamed.and_then(|(_, now)| RecordName::new(now)).unwrap_or(name);
        let is_changed = self.changed.iter().any(|(name, since)| *name == now.as_str() && edition < *since);
        if is_changed { Err(Reason::on(now, "has changed, set it again")) } else { Ok((now, f32::from_bits(bits))) }
    }
}
