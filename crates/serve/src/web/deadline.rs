//! Limits on time and on message rate.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// A stream with a deadline that applies to all reads and writes together, however slow each is.
pub(crate) struct DeadlineStream<'a> {
    stream: &'a mut TcpStream,
    deadline: Instant,
}

impl<'a> DeadlineStream<'a> {
    pub(crate) fn new(stream: &'a mut TcpStream, within: Duration) -> Self {
        DeadlineStream { stream, deadline: Instant::now() + within }
    }

    fn left(&self) -> io::Result<Duration> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        if left.is_zero() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(left) }
    }
}

impl Read for DeadlineStream<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(Some(self.left()?))?;
        self.stream.read(bytes)
    }
}

impl Write for DeadlineStream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(Some(self.left()?))?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Counts events per second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RateCounter {
    since: Instant,
    count: u32,
}

impl RateCounter {
    pub(crate) fn new(now: Instant) -> Self {
        RateCounter { since: now, count: 0 }
    }

    /// Counts an event; returns how many there have been in the current second.
    pub(crate) fn count(&mut self, now: Instant) -> u32 {
        if now.saturating_duration_since(self.since) >= Duration::from_secs(1) {
            *self = RateCounter::new(now);
        }
        self.count = self.count.saturating_add(1);
        self.count
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use std::net::{Ipv4Addr, TcpListener};

    /// A peer that reads or writes one byte now and then gets no more time than others.
    #[test]
    fn a_slow_reader_or_writer_ends_at_the_deadline() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let mut slow = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut stream, _) = listener.accept().unwrap();
        std::thread::spawn(move || {
            while slow.read(&mut [0; 1]).is_ok_and(|length| length > 0) && slow.write(&[0]).is_ok() {
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        let within = Duration::from_millis(200);
        assert!(DeadlineStream::new(&mut stream, within).write_all(&vec![0; 1 << 28]).is_err());
        let mut timed = DeadlineStream::new(&mut stream, within);
        assert!(std::iter::repeat_with(|| timed.read(&mut [0; 1])).any(|read| read.is_err()));
    }

    /// A steady rate at the limit never exceeds it. The limit counts per second, not in total.
    #[test]
    fn a_rate_is_of_each_second() {
        let start = Instant::now();
        for per_s in [1_u32, 20, 60] {
            let mut rate = RateCounter::new(start);
            let most = (0..per_s * 100).map(|event| rate.count(start + Duration::from_secs(1) * event / per_s));
            assert_eq!(most.max(), Some(per_s));
        }
        let mut rate = RateCounter::new(start);
        assert_eq!((0..1000).map(|_| rate.count(start)).max(), Some(1000));
    }
}
