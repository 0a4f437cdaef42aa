//! Sets up the clocks: 168 MHz, the chip's rated speed, from the crystal or, if that fails, from the internal
//! oscillator. Also sets up the flash for this speed.
//!
//! The internal oscillator is accurate to 1 % at room temperature. The vehicle can fly on it, with all times up to 1 %
//! too short or too long, but arming is refused ([`crystal::has_failed`]).

use chip_stm32::crystal;
use embassy_stm32::pac::rcc::vals::{Pllm, Pllsrc, Sw};
use embassy_stm32::pac::{DBGMCU, FLASH, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

/// Clock of the core \[Hz\].
pub const CORE_HZ: u32 = 168_000_000;
/// Input of the PLL \[Hz\]; the crystal's frequency must be a multiple of it.
const PLL_INPUT_HZ: u32 = 2_000_000;
/// Core cycles per millisecond before the clocks are set up.
const START_UP_CYCLES_PER_MS: u32 = 16_000;
/// Polls of the PLL until it counts as broken: some 3 ms at 16 MHz; the PLL needs 0.3 ms.
const LOCK_LOOKS: u32 = 5_000;

/// Sets up clocks and flash of a board with a crystal of `CRYSTAL_HZ`: 4 to 26 MHz in steps of 2 MHz. Must be called
/// once after reset.
pub fn start<const CRYSTAL_HZ: u32>() -> Peripherals {
    const { assert!(CRYSTAL_HZ.is_multiple_of(PLL_INPUT_HZ) && CRYSTAL_HZ >= 4_000_000 && CRYSTAL_HZ <= 26_000_000) }
    RCC.cr().modify(|cr| cr.set_hseon(true));
    let starts = crystal::starts(START_UP_CYCLES_PER_MS, || RCC.cr().read().hserdy());
    let peripherals = embassy_stm32::init(config::<CRYSTAL_HZ>(starts));
    speed_up_flash();
    // The clock security system switches to the internal oscillator and raises an NMI if the crystal fails.
    RCC.cr().modify(|cr| cr.set_csson(starts));
    peripherals
}

/// Returns the clock settings: core 168 MHz, buses 168, 42 and 84 MHz, USB 48 MHz.
fn config<const CRYSTAL_HZ: u32>(crystal: bool) -> Config {
    let source = if crystal { PllSource::HSE } else { PllSource::HSI };
    // The internal oscillator has 16 MHz.
    let prediv = if crystal { PllPreDiv::from_bits((CRYSTAL_HZ / PLL_INPUT_HZ) as u8) } else { PllPreDiv::DIV8 };
    let mut config = Config::default();
    config.rcc.hse = crystal.then_some(Hse { freq: Hertz(CRYSTAL_HZ), mode: HseMode::Oscillator });
    config.rcc.pll_src = source;
    // PLL at 336 MHz: a half for the core, a seventh for USB.
    config.rcc.pll =
        Some(Pll { prediv, mul: PllMul::MUL168, divp: Some(PllPDiv::DIV2), divq: Some(PllQDiv::DIV7), divr: None });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

/// First chip revision (Z) whose flash prefetch works; on revision A it corrupts the data.
const REVISION_Z: u16 = 0x1001;

/// Turns on the flash's caches and prefetch, which embassy leaves off: they hide most of the five wait states.
fn speed_up_flash() {
    let acr = FLASH.acr();
    // The caches are off now, as a flush requires; a boot loader may have filled them.
    acr.modify(|acr| {
        acr.set_icrst(true);
        acr.set_dcrst(true);
    });
    acr.modify(|acr| {
        acr.set_icrst(false);
        acr.set_dcrst(false);
        acr.set_icen(true);
        acr.set_dcen(true);
        acr.set_prften(DBGMCU.idcode().read().rev_id() >= REVISION_Z);
    });
}

/// Handles a failed crystal: the core, now at 16 MHz, is set to 168 MHz again within a control period.
#[allow(unsafe_code, reason = "required by the runtime: this interrupts critical sections")]
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if !RCC.cir().read().cssf() {
        return;
    }
    crystal::fail();
    RCC.cir().modify(|cir| cir.set_cssc(true));
    RCC.cr().modify(|cr| {
        cr.set_hseon(false);
        cr.set_pllon(false);
    });
    // Source and factors of the PLL can be changed only while it is off (RM0090, 7.3.2).
    RCC.pllcfgr().modify(|pll| {
        pll.set_pllsrc(Pllsrc::HSI);
        pll.set_pllm(Pllm::DIV8);
    });
    RCC.cr().modify(|cr| cr.set_pllon(true));
    // Count polls, since the time base stands still during an NMI.
    if (0..LOCK_LOOKS).any(|_| RCC.cr().read().pllrdy()) {
        RCC.cfgr().modify(|cfgr| cfgr.set_sw(Sw::PLL1_P));
    }
}
