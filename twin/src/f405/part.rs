//! STM32F405 as a model of an STM32F427, with two additions. DMA serves the motors' timers. The I2C does not
//! acknowledge the last byte that DMA reads (`LAST`: RM0090, 27.3.7). Without this, the I2C would read one byte more,
//! which the next transfer would take as its first.

use super::wiring::{Sensors, Wiring};
use rigless::device::{ErasedDevice, ResetCause};
use rigless::mcu::Mcu;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::dma2::{Register, s0cr};
use rigless::soc::stm32f427::generated::i2c3::{self, cr1, cr2};
use rigless::soc::stm32f427::peripherals::dma::{Dma, Wire};
use rigless::soc::stm32f427::peripherals::tim::UPDATE_REQUEST;
use rigless::soc::stm32f427::peripherals::{CONTROLLERS, I2C_INTERFACES};
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;
use std::sync::LazyLock;

/// DMA requests of DMA1 and DMA2: those of the models, and the updates of the motors' timers, which the models lack
/// (RM0090, tables 42 and 43).
static WIRINGS: LazyLock<[Vec<Wire>; 2]> = LazyLock::new(|| {
    let timer = |instance, channel, streams| Wire { instance, request: UPDATE_REQUEST, channel, streams };
    let first = [timer("TIM3", 5, &[2]), timer("TIM4", 2, &[6]), timer("TIM5", 6, &[0, 6])];
    let second = [timer("TIM8", 7, &[1])];
    [
        CONTROLLERS[0].wiring.iter().copied().chain(first).collect(),
        CONTROLLERS[1].wiring.iter().copied().chain(second).collect(),
    ]
});

#[derive(Debug)]
pub struct BoardChip {
    pub stm32: Stm32f427,
    /// Bus slot of the sensors' I2C, with the control and count registers of the DMA stream that receives from it.
    i2c: Option<(usize, [Register; 2])>,
    /// Bus slot of DMA1.
    dma: usize,
}

impl BoardChip {
    /// Creates the part of a board.
    pub fn new(wiring: &Wiring) -> Result<Self, Error> {
        let stm32 = Stm32f427::new()?;
        let dma = stm32.bus().slot("DMA1")?;
        let i2c = match wiring.sensors {
            Some(Sensors { i2c, i2c_stream, .. }) => Some((stm32.bus().slot(I2C_INTERFACES[i2c])?, stream(i2c_stream))),
            None => None,
        };
        let mut part = BoardChip { stm32, i2c, dma };
        part.wire();
        Ok(part)
    }

    /// Withholds the acknowledgement of the byte that the I2C is reading, if it is the stream's last. Must be called
    /// before the model learns that the byte has come.
    fn withhold_acknowledgement(&mut self, slot: usize) {
        let Some((i2c, [control, count])) = self.i2c.filter(|(i2c, _)| *i2c == slot) else { return };
        let bus = self.stm32.bus_mut();
        let stream = bus.slots()[self.dma].registers();
        let is_last = s0cr::EN.is_set(stream.get(control)) && stream.get(count) == 1;
        let registers = bus.slot_mut(i2c).registers_mut();
        let control = registers.get(i2c3::Register::Cr2);
        if is_last && cr2::LAST.is_set(control) && cr2::DMAEN.is_set(control) {
            let control = registers.get(i2c3::Register::Cr1);
            registers.set(i2c3::Register::Cr1, cr1::ACK.set(control, 0));
        }
    }

    fn wire(&mut self) {
        for ((dma, wiring), controller) in self.stm32.dma.iter_mut().zip(WIRINGS.iter()).zip(&CONTROLLERS) {
            *dma = Dma::new(wiring, controller.last_data, controller.reaches_memory);
        }
    }
}

/// Returns control and count registers of a stream that receives from an I2C on one of the boards.
fn stream(number: usize) -> [Register; 2] {
    match number {
        0 => [Register::S0cr, Register::S0ndtr],
        3 => [Register::S3cr, Register::S3ndtr],
        _ => [Register::S5cr, Register::S5ndtr],
    }
}

impl Mcu for BoardChip {
    fn bus(&self) -> &Bus {
        self.stm32.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.stm32.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.stm32.reset(at, cause);
        // The reset of the models recreates the DMA without the additions.
        self.wire();
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.stm32.poll(now);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        self.withhold_acknowledgement(slot);
        self.stm32.split(slot)
    }
}
