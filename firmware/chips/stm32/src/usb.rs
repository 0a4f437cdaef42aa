//! A link by USB: a serial port (CDC-ACM) on the full-speed core OTG_FS. Baud rates set by the host have no effect.
//!
//! The USB interrupt and tasks have the lowest priority, since a host waits. A flight does not depend on them: the
//! links' task only accesses two rings, and bytes for a host that does not read are dropped.

use embassy_executor::SpawnToken;
use embassy_futures::join::join3;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::interrupt::{Interrupt, InterruptExt, Priority};
use embassy_stm32::pac::otg::regs::Gintsts;
use embassy_stm32::peripherals::USB_OTG_FS;
use embassy_stm32::usb::{Config, DmPin, DpPin, Driver, Instance, InterruptHandler};
use embassy_stm32::{Peri, pac, rcc, uid};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_time::{Duration, Timer, with_timeout};
use embassy_usb::Builder;
use embassy_usb::class::cdc_acm::{self, CdcAcmClass};
use firmware::executors::{self, priority};
use static_cell::StaticCell;

/// Vendor and product: pid.codes' test IDs, since this project has none of its own.
const VENDOR: u16 = 0x1209;
const PRODUCT: u16 = 0x0001;
/// Largest packet of the port and of the control endpoint \[bytes\].
const PACKET_MAX: usize = 64;
/// Largest packet sent \[bytes\]: after a packet of full size, a host would wait for more.
const SENT_MAX: usize = PACKET_MAX - 1;
/// If a host has not read for this long, the waiting bytes are dropped.
const STALLED: Duration = Duration::from_millis(100);
/// Delay of USB's start after the time base's start.
const START: Duration = Duration::from_millis(100);
/// Core identifications that the driver supports; a missing core reads 0.
const CORES: [u32; 7] = [0x1000, 0x1100, 0x1200, 0x2000, 0x2100, 0x2300, 0x3100];

/// Bytes from the host.
pub(crate) static RECEIVED: Pipe<CriticalSectionRawMutex, 256> = Pipe::new();
/// Bytes for the host: room for all messages after a tick and some more.
static SENT: Pipe<CriticalSectionRawMutex, 1024> = Pipe::new();

/// Proof that the port was started.
pub struct UsbPort(());

/// Starts the port on the core's pins D+ and D-; the core's clock must be 48 MHz. The bus voltage is not sensed, since
/// its pin, PA9, belongs to a UART.
pub fn start(
    core: Peri<'static, USB_OTG_FS>,
    plus: Peri<'static, impl DpPin<USB_OTG_FS>>,
    minus: Peri<'static, impl DmPin<USB_OTG_FS>>,
    line: impl Binding<<USB_OTG_FS as Instance>::Interrupt, InterruptHandler<USB_OTG_FS>> + 'static,
) -> UsbPort {
    // Packet buffer of the port and of the control endpoint.
    static PACKETS: StaticCell<[u8; 2 * PACKET_MAX]> = StaticCell::new();
    let mut config = Config::default();
    config.vbus_detection = false;
    let driver = Driver::new_fs(core, line, plus, minus, PACKETS.init([0; 2 * PACKET_MAX]), config);
    Interrupt::OTG_FS.set_priority(Priority::from(priority::HOUSEKEEPING));
    executors::dispense_with(Interrupt::OTG_FS);
    executors::housekeeping().spawn(executors::once(wait(driver)));
    UsbPort(())
}

/// Number of bytes copied at once into the ring for the host.
pub const PIECE: usize = 64;

/// Queues all bytes for the host and returns true, or queues none and returns false if the ring is too full.
pub(crate) fn send(mut bytes: &[u8]) -> bool {
    // The free room cannot shrink, since only the links' task writes.
    if SENT.free_capacity() < bytes.len() {
        return false;
    }
    // Copy in pieces, since all interrupts wait during a copy. The ring accepts bytes up to its end first, then the
    // rest.
    while let Ok(length @ 1..) = SENT.try_write(bytes.get(..PIECE).unwrap_or(bytes)) {
        bytes = bytes.get(length..).unwrap_or_default();
    }
    true
}

/// Spawns the port's task from within its executor, where the task need not be Send. Waits until the vehicle runs: USB
/// must not delay its start.
#[embassy_executor::task]
async fn wait(driver: Driver<'static, USB_OTG_FS>) {
    Timer::after(START).await;
    executors::spawner().await.spawn(claim(driver));
}

/// Prepares the port's task. Not inlined, so that it can be identified in the image.
#[inline(never)]
fn claim(driver: Driver<'static, USB_OTG_FS>) -> SpawnToken<impl Sized> {
    executors::once(port(driver))
}

#[embassy_executor::task]
async fn port(driver: Driver<'static, USB_OTG_FS>) {
    if !answers() {
        defmt::warn!("no USB");
        return;
    }
    let mut config = embassy_usb::Config::new(VENDOR, PRODUCT);
    config.manufacturer = Some("AFBC");
    config.product = Some("AFBC flight controller");
    config.serial_number = Some(uid::uid_hex());
    // The port powers the board. This is the largest current of USB 2.0 \[mA\].
    config.max_power = 500;
    let (mut configuration, mut capabilities, mut control) = ([0; 80], [0; 16], [0; PACKET_MAX]);
    let mut state = cdc_acm::State::new();
    let mut builder = Builder::new(driver, config, &mut configuration, &mut capabilities, &mut [], &mut control);
    let (sender, receiver) = CdcAcmClass::new(&mut builder, &mut state, PACKET_MAX as u16).split();
    let mut device = builder.build();
    join3(device.run(), pass_on(sender), take_in(receiver)).await;
}

/// Returns true if the core exists and its interrupt flags can be cleared: otherwise the driver would wait forever. Not
/// inlined, so that it can be identified in the image.
#[inline(never)]
fn answers() -> bool {
    rcc::enable_and_reset::<USB_OTG_FS>();
    let (core, ones) = (pac::USB_OTG_FS, Gintsts(u32::MAX));
    core.gintsts().write_value(ones);
    CORES.contains(&core.cid().read().0) && core.gintsts().read() != ones
}

/// Sends the ring's bytes whenever a host is connected.
async fn pass_on<'d>(mut sender: cdc_acm::Sender<'d, Driver<'d, USB_OTG_FS>>) {
    let mut packet = [0; SENT_MAX];
    loop {
        sender.wait_connection().await;
        // Bytes for the previous host are outdated.
        SENT.clear();
        let mut connected = true;
        while connected {
            let length = SENT.read(&mut packet).await;
            let bytes = packet.get(..length).unwrap_or_default();
            connected = loop {
                match with_timeout(STALLED, sender.write_packet(bytes)).await {
                    Ok(result) => break result.is_ok(),
                    Err(_) => SENT.clear(),
                }
            };
        }
    }
}

/// Fills the ring with received bytes. While the ring is full, the host waits.
async fn take_in<'d>(mut receiver: cdc_acm::Receiver<'d, Driver<'d, USB_OTG_FS>>) {
    let mut packet = [0; PACKET_MAX];
    loop {
        receiver.wait_connection().await;
        while let Ok(length) = receiver.read_packet(&mut packet).await {
            RECEIVED.write_all(packet.get(..length).unwrap_or_default()).await;
        }
    }
}
