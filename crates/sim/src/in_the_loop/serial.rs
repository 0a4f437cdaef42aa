//! A board at the end of a serial port.

use super::{Autopilot, Error, Station};
use afbc_link::Command;
use serialport::SerialPort;
use std::io;
use std::thread;
use std::time::{Duration, Instant};

/// One exchange.
const PERIOD: Duration = Duration::from_millis(1);
/// Longest wait between two looks at what has arrived.
const NAP: Duration = Duration::from_micros(200);
/// How long the port may take to accept what is written.
const WRITE_TIMEOUT: Duration = Duration::from_millis(200);
/// How often a vehicle that is left is told to disarm: one frame may get lost.
const FAREWELLS: usize = 3;

/// A board, in real time. Dropping it disarms the vehicle, whatever has happened.
pub struct Serial {
    port: Box<dyn SerialPort>,
    /// When the millisecond under way is over.
    deadline: Option<Instant>,
    late_max: Duration,
}

impl Serial {
    /// Opens the port `device` at `baud`, 8N1.
    ///
    /// # Errors
    /// [`Error::Port`].
    pub fn open(device: &str, baud: u32) -> Result<Self, Error> {
        let port = serialport::new(device, baud).timeout(WRITE_TIMEOUT).open().map_err(Error::Port)?;
        Ok(Serial::new(port))
    }

    /// Takes a port that is open.
    pub fn new(port: Box<dyn SerialPort>) -> Self {
        Serial { port, deadline: None, late_max: Duration::ZERO }
    }

    /// The longest that this side was behind real time: states are late by as much.
    pub fn late_max(&self) -> Duration {
        self.late_max
    }

    /// Gives `hear` what arrives until `deadline`.
    fn listen(&mut self, deadline: Instant, hear: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        let mut buffer = [0; 4096];
        loop {
            if self.port.bytes_to_read()? > 0 {
                let length = self.port.read(&mut buffer)?;
                hear(buffer.get(..length).unwrap_or_default());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            thread::sleep(left.min(NAP));
        }
    }
}

impl Autopilot for Serial {
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        let deadline = *self.deadline.get_or_insert_with(Instant::now);
        self.listen(deadline, hear).map_err(Error::Link)?;
        self.late_max = self.late_max.max(deadline.elapsed());
        // From deadline to deadline, so that a delay is caught up with.
        self.deadline = Some(deadline + PERIOD);
        self.port.write_all(uplink).map_err(Error::Link)
    }
}

impl Drop for Serial {
    fn drop(&mut self) {
        let mut station = Station::new();
        (0..FAREWELLS).for_each(|_| station.command(Command::Kill));
        // There is nobody left to tell if this fails; the vehicle comes down by itself once no more states come.
        let _ = self.port.write_all(&station.take());
        let _ = self.port.flush();
    }
}

/// The names of all serial ports.
///
/// # Errors
/// [`Error::Port`].
pub fn ports() -> Result<Vec<String>, Error> {
    let ports = serialport::available_ports().map_err(Error::Port)?;
    Ok(ports.into_iter().map(|port| port.port_name).collect())
}
