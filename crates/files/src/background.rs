//! Writing in the background, so that a slow disk or reader never delays the caller.

use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Writes to a file, a pipe or a terminal in its own thread, so that a slow disk or a stalled reader delays nobody
/// else.
#[derive(Debug)]
pub struct BackgroundWriter(Arc<SharedQueue>);

#[derive(Debug)]
struct SharedQueue {
    state: Mutex<QueueState>,
    changed: Condvar,
    /// Largest number of bytes in the queue, including those being written.
    room: usize,
}

#[derive(Debug, Default)]
struct QueueState {
    waiting: Vec<u8>,
    /// Number of bytes that are being written.
    writing: usize,
    failure: Option<io::Error>,
    /// True once the writer was closed: nothing more will be queued.
    is_closed: bool,
    /// True once the thread has ended.
    is_over: bool,
}

impl BackgroundWriter {
    /// Starts a thread that writes to `out`, with room for at most `room` queued bytes.
    ///
    /// # Errors
    /// If the system cannot start the thread.
    pub fn new(out: impl Write + Send + 'static, room: usize) -> io::Result<Self> {
        let shared = Arc::new(SharedQueue { state: Mutex::default(), changed: Condvar::new(), room });
        let writer = Arc::clone(&shared);
        thread::Builder::new().name("writer".into()).spawn(move || writer.write(out))?;
        Ok(BackgroundWriter(shared))
    }

    /// Queues all of `bytes` and returns true. Returns false, and queues nothing, if there is no room, writing has
    /// failed or the writer is closed. Never waits.
    pub fn offer(&self, bytes: &[u8]) -> bool {
        let mut state = self.0.lock();
        let takes = state.goes_on() && state.has_room(bytes.len(), self.0.room);
        if takes {
            state.waiting.extend_from_slice(bytes);
            self.0.changed.notify_all();
        }
        takes
    }

    /// Waits until there is room for this many bytes, writing has failed or the writer is closed.
    pub fn wait_for_room(&self, bytes: usize) {
        let full = |state: &mut QueueState| state.goes_on() && !state.has_room(bytes, self.0.room);
        drop(self.0.changed.wait_while(self.0.lock(), full));
    }

    /// Returns the error that stopped writing, if any.
    pub fn failure(&self) -> Option<io::Error> {
        self.0.lock().failure.as_ref().map(copied)
    }

    /// Closes the writer: its thread ends once it has written the queue.
    pub fn close(&self) {
        self.0.lock().is_closed = true;
        self.0.changed.notify_all();
    }

    /// True once the thread has ended: after [`close`](Self::close) with everything written, or after a failure.
    pub fn is_over(&self) -> bool {
        self.0.lock().is_over
    }

    /// Closes the writer and waits until everything is written, at most for the time `within`.
    ///
    /// # Errors
    /// If writing failed, or time ran out.
    pub fn finish(&self, within: Option<Duration>) -> io::Result<()> {
        self.close();
        let deadline = within.map(|within| Instant::now() + within);
        let mut state = self.0.lock();
        while !state.is_over {
            let changed = &self.0.changed;
            state = match deadline.map(|deadline| deadline.saturating_duration_since(Instant::now())) {
                None => changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                Some(Duration::ZERO) => return Err(io::ErrorKind::TimedOut.into()),
                Some(left) => changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0,
            };
        }
        state.failure.as_ref().map(copied).map_or(Ok(()), Err)
    }
}

/// Queues all bytes at once or fails; never waits.
impl Write for BackgroundWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let too_slow = || io::Error::other("the disk is too slow for the log");
        if self.offer(bytes) { Ok(bytes.len()) } else { Err(self.failure().unwrap_or_else(too_slow)) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for BackgroundWriter {
    fn drop(&mut self) {
        self.close();
    }
}

impl SharedQueue {
    fn lock(&self) -> MutexGuard<'_, QueueState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes queued bytes until the writer is closed and the queue is empty, or until writing fails.
    fn write(&self, mut out: impl Write) {
        let mut bytes = Vec::new();
        loop {
            let idle = |state: &mut QueueState| state.waiting.is_empty() && !state.is_closed;
            let waited = self.changed.wait_while(self.lock(), idle);
            let mut state = waited.unwrap_or_else(PoisonError::into_inner);
            if state.waiting.is_empty() {
                break;
            }
            std::mem::swap(&mut state.waiting, &mut bytes);
            state.writing = bytes.len();
            drop(state);
            let written = out.write_all(&bytes).and_then(|()| out.flush());
            bytes.clear();
            let mut state = self.lock();
            state.writing = 0;
            if let Err(error) = written {
                (state.failure, state.waiting) = (Some(error), Vec::new());
                break;
            }
            self.changed.notify_all();
        }
        // Closes the file before anybody sees that the thread has ended, so that the file is complete by then.
        drop(out);
        self.lock().is_over = true;
        self.changed.notify_all();
    }
}

impl QueueState {
    fn goes_on(&self) -> bool {
        self.failure.is_none() && !self.is_closed
    }

    /// True if `more` bytes fit into the queue. An empty queue takes a piece of any size, so that no piece is too large
    /// forever.
    fn has_room(&self, more: usize, room: usize) -> bool {
        let held = self.waiting.len() + self.writing;
        held == 0 || held.saturating_add(more) <= room
    }
}

/// Returns a copy of the error.
fn copied(error: &io::Error) -> io::Error {
    let text = || io::Error::new(error.kind(), error.to_string());
    error.raw_os_error().map_or_else(text, io::Error::from_raw_os_error)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// A reader that reads one piece for each message in the channel.
    struct Reader(Receiver<()>, Sender<Vec<u8>>);

    impl Write for Reader {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.recv().map_err(|_| io::Error::from(io::ErrorKind::StorageFull))?;
            let _ = self.1.send(bytes.to_vec());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn writer(room: usize) -> (BackgroundWriter, Sender<()>, Receiver<Vec<u8>>) {
        let ((go, wait), (put, taken)) = (channel(), channel());
        (BackgroundWriter::new(Reader(wait, put), room).unwrap(), go, taken)
    }

    /// While nobody reads, the queue fills up to its room, whatever the size of the pieces. Everything queued arrives,
    /// in order.
    #[test]
    fn what_waits_is_bounded_and_arrives() {
        for piece in [1, 7, 100] {
            let (writer, go, taken) = writer(1000);
            let mut sent = Vec::new();
            while writer.offer(&vec![sent.len() as u8; piece]) {
                sent.extend(vec![sent.len() as u8; piece]);
                assert!(sent.len() <= 1000);
            }
            assert!(sent.len() > 1000 - piece, "{}", sent.len());
            (0..1000).for_each(|_| go.send(()).unwrap());
            writer.wait_for_room(piece);
            assert!(writer.offer(&[9]));
            writer.finish(None).unwrap();
            sent.push(9);
            assert_eq!(taken.iter().collect::<Vec<_>>().concat(), sent);
            assert!(!writer.offer(&[1]));
        }
    }

    #[test]
    fn nobody_waits_for_ever() {
        let (mut writer, go, _taken) = writer(10);
        assert!(writer.offer(&[0; 10_000]) && !writer.offer(&[0]));
        assert!(writer.write(&[0]).unwrap_err().to_string().contains("too slow"));
        let late = writer.finish(Some(Duration::from_millis(1))).unwrap_err();
        assert_eq!(late.kind(), io::ErrorKind::TimedOut);
        // The reader is gone.
        drop(go);
        writer.wait_for_room(10);
        assert_eq!(writer.finish(None).unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(writer.failure().unwrap().kind(), io::ErrorKind::StorageFull);
        assert!(!writer.offer(&[]) && writer.is_over());
    }
}
