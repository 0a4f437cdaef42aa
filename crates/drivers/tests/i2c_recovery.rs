//! Recovery of a bus whose part holds the data line and whose controller is stuck in a transfer. Both are modelled at
//! the level of the two lines: the bus as in UM10204, and the known behaviour of the STM32F4's controller.

use crate::qmc5883l::Registers as Compass;
use crate::rig::{Rig, run};
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{Driver, I2cLine, I2cLines, I2cRegisters, PartFault, RecoveringI2c, Registers};
use core::future::pending;
use embassy_futures::block_on;
use embedded_hal_async::i2c::{ErrorKind, ErrorType, I2c, Operation};
use std::cell::RefCell;
use std::rc::Rc;

/// Transfer that the part is in the middle of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Amid {
    Nothing,
    /// Sends bits, the first of them on the line, then waits for an acknowledgement. If `heeds` is false, the part
    /// ignores START and STOP until an acknowledgement is missing.
    Sends {
        bits: u8,
        left: u8,
        heeds: bool,
    },
    /// Receives bits and acknowledges after the eighth.
    Takes {
        taken: u8,
    },
}

/// State of lines, part and controller.
#[derive(Debug)]
struct Bus {
    amid: Amid,
    /// True for a line that the controller has released.
    is_clock_released: bool,
    is_data_released: bool,
    /// Number of bytes that the part has received by mistake.
    mistaken: u32,
    /// Number of attempts to release the clock for which the part holds it low.
    stretches: u32,
    /// True if the controller is stuck in an unfinished transfer.
    is_locked: bool,
    /// State in which the next transfer is interrupted, if any.
    breaks: Option<Amid>,
    recoveries: u32,
}

impl Bus {
    fn part_pulls_data(&self) -> bool {
        match self.amid {
            Amid::Sends { bits, left, .. } => left > 0 && bits & 0x80 == 0,
            Amid::Takes { taken } => taken == 8,
            Amid::Nothing => false,
        }
    }

    fn is_data_high(&self) -> bool {
        self.is_data_released && !self.part_pulls_data()
    }

    fn drive(&mut self, line: I2cLine, is_released: bool) {
        let (clock, data) = (self.is_clock_released, self.is_data_high());
        match line {
            I2cLine::Clock => self.is_clock_released = is_released,
            I2cLine::Data => self.is_data_released = is_released,
        }
        match (clock, self.is_clock_released) {
            (false, true) => self.rises(),
            (true, false) => self.falls(),
            // START or STOP.
            (true, true) if self.is_data_high() != data && !matches!(self.amid, Amid::Sends { heeds: false, .. }) => {
                self.amid = Amid::Nothing;
            }
            _ => (),
        }
    }

    /// Reads the data line, as the part does at a rising edge of the clock.
    fn rises(&mut self) {
        match &mut self.amid {
            Amid::Sends { left: 0, .. } if self.is_data_released => self.amid = Amid::Nothing,
            Amid::Takes { taken } if *taken < 8 => *taken += 1,
            _ => (),
        }
    }

    /// Changes the data line, as the part does at a falling edge of the clock.
    fn falls(&mut self) {
        match &mut self.amid {
            Amid::Sends { bits, left, .. } if *left > 0 => (*bits, *left) = (*bits << 1, *left - 1),
            // The last byte was acknowledged, so the part sends the next byte.
            Amid::Sends { left, .. } => *left = 8,
            Amid::Takes { taken } if *taken == 8 => {
                self.mistaken += 1;
                *taken = 0;
            }
            _ => (),
        }
    }
}

/// Controller of a bus with the rig's part.
#[derive(Clone)]
struct Port {
    bus: Rc<RefCell<Bus>>,
    rig: Rig<Compass>,
}

impl Port {
    fn new(rig: &Rig<Compass>, amid: Amid) -> Self {
        let bus = Bus {
            amid,
            is_clock_released: true,
            is_data_released: true,
            mistaken: 0,
            stretches: 0,
            is_locked: false,
            breaks: None,
            recoveries: 0,
        };
        Port { bus: Rc::new(RefCell::new(bus)), rig: rig.clone() }
    }
}

impl ErrorType for Port {
    type Error = ErrorKind;
}

impl I2c for Port {
    async fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let amid = self.bus.borrow_mut().breaks.take();
        if let Some(amid) = amid {
            (self.bus.borrow_mut().amid, self.bus.borrow_mut().is_locked) = (amid, true);
        }
        // A controller cannot begin while the bus is held or an earlier transfer has not ended.
        if self.bus.borrow().is_locked || self.bus.borrow().amid != Amid::Nothing {
            return pending().await;
        }
        let result = match operations {
            [Operation::Write([register]), Operation::Read(into)] => self.rig.read(*register, into).await,
            [Operation::Write([register, bytes @ ..])] => self.rig.write(*register, bytes).await,
            _ => panic!("{operations:?}"),
        };
        result.map_err(|_| ErrorKind::Other)
    }
}

impl I2cLines for Port {
    fn take(&mut self) {
        let mut bus = self.bus.borrow_mut();
        bus.recoveries += 1;
        (bus.is_clock_released, bus.is_data_released) = (true, true);
    }

    fn drive(&mut self, line: I2cLine, is_released: bool) {
        let mut bus = self.bus.borrow_mut();
        if line == I2cLine::Clock && is_released && bus.stretches > 0 {
            bus.stretches -= 1;
            return;
        }
        bus.drive(line, is_released);
    }

    fn is_clock_high(&self) -> bool {
        self.bus.borrow().is_clock_released
    }

    fn restart(&mut self) {
        let mut bus = self.bus.borrow_mut();
        bus.is_locked &= !(bus.is_clock_released && bus.is_data_released);
    }
}

/// Returns every state in which a part can be interrupted.
fn all_amid() -> Vec<Amid> {
    let sends = (0..=8).flat_map(|left| {
        let bits = [0x00, 0xFF, 0x55, 0xAA, 0x0F, 0xF0];
        bits.into_iter().flat_map(move |bits| [true, false].map(|heeds| Amid::Sends { bits, left, heeds }))
    });
    [Amid::Nothing].into_iter().chain(sends).chain((0..=8).map(|taken| Amid::Takes { taken })).collect()
}

type CompassDriver = Driver<Qmc5883l, I2cRegisters<RecoveringI2c<Port, Port>>, Rig<Compass>>;

fn driver(port: &Port) -> CompassDriver {
    let bus = RecoveringI2c::new(port.clone(), port.clone());
    Driver::new(Qmc5883l, I2cRegisters::new(bus, 0x0D), port.rig.clone())
}

/// The first reading succeeds in whatever state a watchdog reset has left the part.
#[test]
fn a_bus_is_recovered_at_the_start() {
    for amid in all_amid() {
        for stretches in [0, 1, 7] {
            let rig = Rig::new(Compass::new());
            let port = Port::new(&rig, amid);
            port.bus.borrow_mut().stretches = stretches;
            let mut driver = driver(&port);
            assert!(block_on(driver.reading()).is_ok(), "{amid:?}");
            // A working bus is not recovered again.
            for _ in 0..100 {
                assert!(block_on(driver.reading()).is_ok(), "{amid:?}");
            }
            assert_eq!(port.bus.borrow().recoveries, 1, "{amid:?}");
            // Recovery does not complete a byte that the part was receiving, unless only the clock of its
            // acknowledgement was missing.
            let begun = matches!(amid, Amid::Takes { taken } if taken < 8);
            assert!(!begun || port.bus.borrow().mistaken == 0, "{amid:?}");
        }
    }
}

/// An interrupted transfer costs one fault; the next reading is correct.
#[test]
fn a_bus_is_recovered_after_a_transfer_that_was_given_up() {
    let rig = Rig::new(Compass::new());
    let port = Port::new(&rig, Amid::Nothing);
    let mut driver = driver(&port);
    let _ = run(&mut driver, &rig, 1_000_000);
    for amid in all_amid() {
        port.bus.borrow_mut().breaks = Some(amid);
        assert_eq!(block_on(driver.reading()).map(|_| ()), Err(PartFault::Bus), "{amid:?}");
        assert!(!driver.works() && block_on(driver.reading()).is_ok(), "{amid:?}");
        let (readings, faults) = run(&mut driver, &rig, 100_000);
        assert!(faults.is_empty() && readings.len() > 5, "{amid:?}: {faults:?}");
    }
    assert_eq!(port.bus.borrow().recoveries as usize, 1 + all_amid().len());
}

/// A part that holds the clock longer than a recovery waits costs one more recovery.
#[test]
fn a_clock_line_that_is_held_is_waited_for() {
    let rig = Rig::new(Compass::new());
    let port = Port::new(&rig, Amid::Nothing);
    let mut driver = driver(&port);
    port.bus.borrow_mut().breaks = Some(Amid::Sends { bits: 0, left: 8, heeds: false });
    port.bus.borrow_mut().stretches = 200;
    let (readings, faults) = run(&mut driver, &rig, 2_000_000);
    assert!((1..5).contains(&faults.len()) && readings.len() > 50, "{faults:?}, {} readings", readings.len());
}

/// A controller that counts transactions, of which some fail; and its lines, which count recoveries.
#[derive(Clone, Default)]
struct Counted(Rc<RefCell<[u32; 2]>>);

impl ErrorType for Counted {
    type Error = ErrorKind;
}

impl I2c for Counted {
    async fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        self.0.borrow_mut()[0] += operations.len() as u32;
        if address == 0x0D { Ok(()) } else { Err(ErrorKind::Other) }
    }
}

impl I2cLines for Counted {
    fn take(&mut self) {}

    fn drive(&mut self, _: I2cLine, _: bool) {}

    fn is_clock_high(&self) -> bool {
        true
    }

    fn restart(&mut self) {
        self.0.borrow_mut()[1] += 1;
    }
}

/// Transactions of any operations reach the controller, and its answer comes back; the first, and each after one that
/// has failed, finds the bus recovered.
#[test]
fn transactions_are_the_controllers() {
    let counted = Counted::default();
    let mut bus = RecoveringI2c::new(counted.clone(), counted.clone());
    for (address, recoveries) in [(0x0D, 1), (0x0D, 1), (0x0E, 1), (0x0D, 2), (0x0D, 2)] {
        let mut into = [0];
        let before = counted.0.borrow()[0];
        let result = block_on(bus.transaction(address, &mut [Operation::Write(&[1]), Operation::Read(&mut into)]));
        assert_eq!(result.is_ok(), address == 0x0D);
        assert_eq!(*counted.0.borrow(), [before + 2, recoveries]);
    }
}
