//! Simulates a vehicle with a ground station.

use super::{Card, Room, Storage};
use afbc_comms::services::log_transfer::LogTransfer;
use afbc_comms::services::storage::LogStore;
use afbc_log::storage::LogMode;
use afbc_mavlink::{LogEntry, LogMessage, LogRequest};
use std::task::Poll;

/// Number of ticks within which a card without stalls answers.
pub(crate) const PATIENCE: usize = 2_000;

/// A vehicle with a ground station.
pub(crate) struct Station<S: Storage = Card> {
    pub(crate) room: Room<S>,
    pub(crate) transfer: LogTransfer,
}

impl<S: Storage> Station<S> {
    pub(crate) fn new(card: &S) -> Self {
        let mut room = Room::new(card);
        room.mode = LogMode::Armed;
        room.run(200);
        Station { room, transfer: LogTransfer::default() }
    }

    /// Flies for this many ticks, which leaves a log one second longer.
    pub(crate) fn fly(&mut self, ticks: u64) {
        self.room.armed = true;
        self.room.run(ticks);
        self.room.armed = false;
        self.room.run(1_300);
    }

    /// Sends a request. Returns all its answers, at most one message per tick. Panics if they do not end in time.
    pub(crate) fn ask(&mut self, request: LogRequest) -> Vec<LogMessage> {
        let messages = self.ask_for(request, PATIENCE);
        assert!(!self.transfer.is_busy(), "{request:?}: no answer");
        messages
    }

    /// Sends a request. Returns its answers until they are complete, or until none has come for this many ticks.
    pub(crate) fn ask_for(&mut self, request: LogRequest, patience: usize) -> Vec<LogMessage> {
        self.transfer.hear(request);
        let (mut messages, mut quiet) = (Vec::new(), 0);
        while self.transfer.is_busy() && quiet < patience {
            self.room.tick(false);
            let message = self.transfer.next(&mut self.room.stored);
            quiet = if message.is_some() { 0 } else { quiet + 1 };
            messages.extend(message);
        }
        messages
    }

    pub(crate) fn list(&mut self) -> Vec<LogEntry> {
        let listed = self.ask(LogRequest::List { first: 0, last: u16::MAX });
        let entries = listed.into_iter().map(|message| match message {
            LogMessage::Entry(entry) => entry,
            LogMessage::Data(data) => panic!("{data:?}"),
        });
        entries.filter(|entry| entry.count > 0).collect()
    }

    pub(crate) fn download(&mut self, log: u16, offset: u32, bytes: u32) -> Vec<u8> {
        let found = self.ask(LogRequest::Data { log, offset, bytes });
        Self::joined(log, offset, found)
    }

    /// Returns the bytes of consecutive parts of a log.
    pub(crate) fn joined(log: u16, offset: u32, messages: Vec<LogMessage>) -> Vec<u8> {
        let mut read = Vec::new();
        for message in messages {
            let LogMessage::Data(data) = message else { panic!("{message:?}") };
            assert_eq!((data.log, data.offset), (log, offset + read.len() as u32));
            read.extend_from_slice(&data.data[..data.count.into()]);
        }
        read
    }

    pub(crate) fn erase(&mut self) -> bool {
        for _ in 0..PATIENCE {
            self.room.tick(false);
            if let Poll::Ready(erased) = self.room.stored.erase_logs() {
                return erased;
            }
        }
        panic!("no answer");
    }

    pub(crate) fn is_served_as_it_is_kept(&mut self) {
        let held = self.room.logs();
        let listed = self.list();
        let sizes: Vec<_> = held.iter().map(|(_, bytes)| bytes.len() as u32).collect();
        assert_eq!(listed.iter().map(|entry| entry.size).collect::<Vec<_>>(), sizes);
        for (entry, (name, bytes)) in listed.iter().zip(&held) {
            assert_eq!((usize::from(entry.count), usize::from(entry.last)), (held.len(), held.len() - 1));
            assert!(self.download(entry.log, 0, u32::MAX) == *bytes, "{name} is another");
        }
    }
}
