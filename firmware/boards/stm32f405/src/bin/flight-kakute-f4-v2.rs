//! Kakute F4 V2; `docs/boards/kakute-f4-v2.md` shows the wiring.
//!
//! | Betaflight's description | |
//! |---|---|
//! | gyroscope: clock, data in, data out, select, interrupt, alignment | PA5, PA6, PA7, PC4, PC5, CW270 |
//! | motors 1 to 4 | PB0, PB1, PA3, PA2 |
//! | barometer: clock, data | PB8, PB9 |
//! | LED | PB5 |
//! | buzzer | PC9 |
//! | battery: voltage, current | PC3, PC2 |
//! | current's scale | 275 |
#![no_std]
#![no_main]

use afbc_drivers::bmp280::Bmp280;
use afbc_drivers::dps310::Dps310;
use afbc_drivers::mpu::{Icm20689, Mpu6000};

chip_stm32f4::flight_controller! {
    crystal_hz: 8_000_000,
    link: USART1 { tx: PA9, rx: PA10 },
    gnss: UART4 { tx: PA0, rx: PA1 },
    radio: USART3 { tx: PB10, rx: PB11, sbus: "R3", inverter: PB15 },
    escs: UART5 { tx: PC12, rx: PD2 },
    imu: SPI1 {
        clock: PA5, out: PA7, in: PA6, select: PC4,
        dma: DMA2_CH3 by DMA2_STREAM3, DMA2_CH0 by DMA2_STREAM0,
        ready: PC5 on EXTI5 by EXTI9_5,
        parts: (Icm20689, Mpu6000), alignment: CW270
    },
    i2c: I2C1 {
        clock: PB8, data: PB9, interrupts: I2C1_EV, I2C1_ER,
        dma: DMA1_CH7 by DMA1_STREAM7, DMA1_CH5 by DMA1_STREAM5,
        barometer: (Dps310, Bmp280)
    },
    battery: ADC1 { voltage: PC3, current: PC2, volts_per_volt: 11.0, amperes_per_volt: 36.4 },
    indicator: { led: PB5, buzzer: PC9 },
    motors: 4 as BETAFLIGHT {
        first: TIM3<u16>, DMA1_CH2 by DMA1_STREAM2 { (), (), (PB0: GPIOB 0, motor 1), (PB1: GPIOB 1, motor 2) },
        second: TIM5<u32>, DMA1_CH6 by DMA1_STREAM6 { (), (), (PA2: GPIOA 2, motor 4), (PA3: GPIOA 3, motor 3) },
    },
}
