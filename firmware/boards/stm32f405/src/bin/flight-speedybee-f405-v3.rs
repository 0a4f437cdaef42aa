//! SpeedyBee F405 V3; `docs/boards/speedybee-f405-v3.md` shows the wiring.
//!
//! | Betaflight's description | |
//! |---|---|
//! | gyroscope: clock, data in, data out, select, interrupt, alignment | PA5, PA6, PA7, PA4, PC4, CW0 |
//! | motors 1 to 4 | PB6, PB7, PB8, PB9 |
//! | barometer: clock, data | PB10, PB11 |
//! | LED | PC8 |
//! | buzzer | PC5 |
//! | battery: voltage, current | PC0, PC1 |
//! | current's scale | 386 |
//! | PINIO1 | PC3 |
#![no_std]
#![no_main]

use afbc_drivers::bmi270::Bmi270;
use afbc_drivers::dps310::Spl06;

chip_stm32f4::flight_controller! {
    crystal_hz: 8_000_000,
    link: USART3 { tx: PC10, rx: PC11 },
    gnss: USART6 { tx: PC6, rx: PC7 },
    radio: USART2 { tx: PA2, rx: PA3, sbus: "SBUS" },
    escs: UART5 { tx: PC12, rx: PD2 },
    imu: SPI1 {
        clock: PA5, out: PA7, in: PA6, select: PA4,
        dma: DMA2_CH3 by DMA2_STREAM3, DMA2_CH0 by DMA2_STREAM0,
        ready: PC4 on EXTI4 by EXTI4,
        parts: (Bmi270,), alignment: CW0
    },
    i2c: I2C2 {
        clock: PB10, data: PB11, interrupts: I2C2_EV, I2C2_ER,
        dma: DMA1_CH7 by DMA1_STREAM7, DMA1_CH3 by DMA1_STREAM3,
        barometer: (Spl06,)
    },
    battery: ADC1 { voltage: PC0, current: PC1, volts_per_volt: 11.0, amperes_per_volt: 25.9 },
    indicator: { led: PC8, buzzer: PC5 },
    bluetooth: PC3,
    card: SPI2 { clock: PB13, out: PB15, in: PB14, select: PA15, quiet: [PB12] },
    motors: 4 as BETAFLIGHT {
        first: TIM4<u16>, DMA1_CH6 by DMA1_STREAM6 {
            (PB6: GPIOB 6, motor 1), (PB7: GPIOB 7, motor 2), (PB8: GPIOB 8, motor 3),
            (PB9: GPIOB 9, motor 4)
        },
    },
}
