//! Matek F405-STD; `docs/boards/matek-f405-std.md` shows the wiring.
//!
//! | Betaflight's description | |
//! |---|---|
//! | gyroscope: clock, data in, data out, select, interrupt, alignment | PA5, PA6, PA7, PC2, PC3, CW180 |
//! | motors 1 to 4 | PC6, PC7, PC8, PC9 |
//! | barometer: clock, data | PB6, PB7 |
//! | LED | PB9 |
//! | buzzer | PC13 |
//! | battery: voltage, current | PC5, PC4 |
//! | current's scale | 179 |
#![no_std]
#![no_main]

use afbc_drivers::bmi270::Bmi270;
use afbc_drivers::bmp280::Bmp280;
use afbc_drivers::dps310::Dps310;
use afbc_drivers::icm426xx::Icm42688p;
use afbc_drivers::mpu::{Icm20602, Icm20689, Mpu6000, Mpu6500};

chip_stm32f4::flight_controller! {
    crystal_hz: 8_000_000,
    link: USART1 { tx: PA9, rx: PA10 },
    gnss: USART3 { tx: PC10, rx: PC11 },
    radio: USART2 { tx: PA2, rx: PA3, sbus: "SBUS" },
    escs: UART5 { tx: PC12, rx: PD2 },
    imu: SPI1 {
        clock: PA5, out: PA7, in: PA6, select: PC2,
        dma: DMA2_CH3 by DMA2_STREAM3, DMA2_CH0 by DMA2_STREAM0,
        ready: PC3 on EXTI3 by EXTI3,
        parts: (Icm20602, Mpu6000, Mpu6500, Icm20689, Icm42688p<true>, Bmi270), alignment: CW180
    },
    i2c: I2C1 {
        clock: PB6, data: PB7, interrupts: I2C1_EV, I2C1_ER,
        dma: DMA1_CH6 by DMA1_STREAM6, DMA1_CH0 by DMA1_STREAM0,
        barometer: (Dps310, Bmp280)
    },
    battery: ADC1 { voltage: PC5, current: PC4, volts_per_volt: 11.0, amperes_per_volt: 55.9 },
    indicator: { led: PB9, buzzer: PC13 },
    motors: 4 as BETAFLIGHT {
        first: TIM8<u16>, DMA2_CH1 by DMA2_STREAM1 {
            (PC6: GPIOC 6, motor 1), (PC7: GPIOC 7, motor 2), (PC8: GPIOC 8, motor 3),
            (PC9: GPIOC 9, motor 4)
        },
    },
}
