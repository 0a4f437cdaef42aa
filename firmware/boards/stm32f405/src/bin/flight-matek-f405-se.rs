//! Matek F405-SE; `docs/boards/matek-f405-se.md` shows the wiring.
//!
//! The compass shares I2C1 with the barometer. I2C2 would need stream 7 of DMA1, which I2C1 uses; I2C1's alternative,
//! stream 6, belongs to TIM4.
//!
//! | Betaflight's description | |
//! |---|---|
//! | gyroscope: clock, data in, data out, select, interrupt, alignment | PA5, PA6, PA7, PA4, PC4, CW270 |
//! | motors 1 to 4 | PB7, PB6, PB0, PB1 |
//! | barometer: clock, data | PB8, PB9 |
//! | buzzer | PC15 |
//! | battery: voltage, current | PC0, PC1 |
//! | current's scale | 179 |
#![no_std]
#![no_main]

use afbc_drivers::bmp280::Bmp280;
use afbc_drivers::dps310::Dps310;
use afbc_drivers::mpu::Mpu6000;

chip_stm32f4::flight_controller! {
    crystal_hz: 8_000_000,
    link: USART1 { tx: PA9, rx: PA10 },
    gnss: USART6 { tx: PC6, rx: PC7 },
    radio: USART2 { tx: PA2, rx: PA3, sbus: "SBUS" },
    escs: UART5 { tx: PC12, rx: PD2 },
    imu: SPI1 {
        clock: PA5, out: PA7, in: PA6, select: PA4,
        dma: DMA2_CH3 by DMA2_STREAM3, DMA2_CH0 by DMA2_STREAM0,
        ready: PC4 on EXTI4 by EXTI4,
        parts: (Mpu6000,), alignment: CW270
    },
    i2c: I2C1 {
        clock: PB8, data: PB9, interrupts: I2C1_EV, I2C1_ER,
        dma: DMA1_CH7 by DMA1_STREAM7, DMA1_CH0 by DMA1_STREAM0,
        barometer: (Dps310, Bmp280)
    },
    battery: ADC1 { voltage: PC0, current: PC1, volts_per_volt: 11.0, amperes_per_volt: 55.9 },
    indicator: { buzzer: PC15 },
    card: SPI3 { clock: PB3, out: PB5, in: PB4, select: PC14, quiet: [] },
    motors: 4 as BETAFLIGHT {
        first: TIM4<u16>, DMA1_CH6 by DMA1_STREAM6 { (PB6: GPIOB 6, motor 2), (PB7: GPIOB 7, motor 1), (), () },
        second: TIM3<u16>, DMA1_CH2 by DMA1_STREAM2 { (), (), (PB0: GPIOB 0, motor 3), (PB1: GPIOB 1, motor 4) },
    },
}
