//! Reads, counts and erases the logs on a card.

use crate::storage::card::CardError;
use crate::storage::card_keeper::{CardKeeper, log_name};
use crate::storage::keeper::StorageState;
use crate::storage::query::{KeeperAnswer, LogQuery};
use core::ops::ControlFlow;
use embedded_sdmmc::{Error, Mode};

impl CardKeeper<'_> {
    /// Answers a query. For a read, fills `page` with the log's bytes.
    pub(crate) fn look_up(&mut self, query: LogQuery, page: &mut [u8]) -> Result<KeeperAnswer, Error<CardError>> {
        match query {
            LogQuery::Nothing => Ok(KeeperAnswer::None),
            LogQuery::Count => self.count(),
            LogQuery::Size(place) => {
                Ok(self.find(place)?.map_or(KeeperAnswer::None, |(_, size)| KeeperAnswer::Is(size)))
            }
            LogQuery::Read(place, offset) => self.read(place, offset, page),
            LogQuery::Erase => self.erase_one(),
        }
    }

    /// Returns the number of the log being written, or else of the next log.
    fn bound(&self) -> u32 {
        self.next.saturating_sub(u32::from(self.file.is_some()))
    }

    fn count(&mut self) -> Result<KeeperAnswer, Error<CardError>> {
        self.close_read()?;
        let bound = self.bound();
        self.reader.bound = Some(bound);
        let mut count = 0_u32;
        self.each_log(&mut |number, size| {
            count += u32::from(number < bound && size.is_some());
            ControlFlow::Continue(())
        })?;
        Ok(KeeperAnswer::Is(count))
    }

    /// Returns number and size of the log at a place in the counted list.
    fn find(&mut self, place: u16) -> Result<Option<(u32, u32)>, Error<CardError>> {
        // A station may ask for a log without asking for the count. Then the logs finished by now count.
        let now = self.bound();
        let bound = *self.reader.bound.get_or_insert(now);
        let (mut left, mut found) = (place, None);
        self.each_log(&mut |number, size| {
            let Some(size) = size.filter(|_| number < bound) else { return ControlFlow::Continue(()) };
            found = (left == 0).then_some((number, size));
            // Wraps at the log that is found, but the search ends there.
            left = left.wrapping_sub(1);
            if found.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        Ok(found)
    }

    fn read(&mut self, place: u16, offset: u32, page: &mut [u8]) -> Result<KeeperAnswer, Error<CardError>> {
        if self.reader.open.is_none_or(|(open, _)| open != place) {
            self.close_read()?;
            let Some((number, _)) = self.find(place)? else { return Ok(KeeperAnswer::None) };
            let (Some(volumes), Some(root)) = (&self.volumes, self.root) else { return Err(Error::BadHandle) };
            let name = log_name(number).ok_or(Error::NotFound)?;
            self.reader.open = Some((place, volumes.open_file_in_dir(root, name, Mode::ReadOnly)?));
        }
        let (Some(volumes), Some((_, file))) = (&self.volumes, self.reader.open) else { return Err(Error::BadHandle) };
        // The offset is checked first. A seek beyond the end is an error in `embedded-sdmmc`, and an error would give
        // up the volume.
        if offset > volumes.file_length(file)? {
            return Ok(KeeperAnswer::Is(0));
        }
        volumes.file_seek_from_start(file, offset)?;
        let length = volumes.read(file, page)?;
        Ok(KeeperAnswer::Is(length as u32))
    }

    /// Erases the first log: frees its clusters, then deletes its directory entry.
    fn erase_one(&mut self) -> Result<KeeperAnswer, Error<CardError>> {
        self.close_read()?;
        self.reader.bound = None;
        let Some((number, _)) = self.find(0)? else { return Ok(KeeperAnswer::None) };
        let (Some(volumes), Some(root)) = (&self.volumes, self.root) else { return Err(Error::BadHandle) };
        let name = log_name(number).ok_or(Error::NotFound)?;
        let emptied = volumes.open_file_in_dir(root, name, Mode::ReadWriteTruncate)?;
        volumes.close_file(emptied)?;
        volumes.delete_entry_in_dir(root, name)?;
        // The card has room again.
        if self.state == StorageState::Full {
            self.state = StorageState::Ready;
        }
        Ok(KeeperAnswer::Is(1))
    }

    /// Closes the file being read.
    fn close_read(&mut self) -> Result<(), Error<CardError>> {
        if let (Some(volumes), Some((_, file))) = (&self.volumes, self.reader.open.take()) {
            volumes.close_file(file)?;
        }
        Ok(())
    }
}
