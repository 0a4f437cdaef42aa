//! Sets up the clocks: 400 MHz, which chips of every revision reach, from the crystal or, if that fails, from the
//! internal oscillator. Also turns on the instruction cache. The data cache stays off, so that DMA and core see the
//! same memory.
//!
//! The internal oscillator is accurate to 1 % at room temperature. The vehicle can fly on it, with all times up to 1 %
//! too short or too long, but arming is refused ([`crystal::has_failed`]).

use chip_stm32::crystal;
use cortex_m::peripheral::SCB;
use embassy_stm32::pac::crs::vals::Syncsrc;
use embassy_stm32::pac::rcc::vals::{Pllm, Pllsrc, Sw};
use embassy_stm32::pac::{CRS, DBGMCU, RCC};
use embassy_stm32::rcc::mux::Usbsel;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Hsi48Config, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};

/// Clock of the core \[Hz\].
pub const CORE_HZ: u32 = 400_000_000;
/// Input of the PLL \[Hz\]; the crystal's frequency must be a multiple of it. The PLL's fast oscillator must not be
/// used at 2 MHz or below.
const PLL_INPUT_HZ: u32 = 4_000_000;
/// Core cycles per millisecond before the clocks are set up.
const START_UP_CYCLES_PER_MS: u32 = 64_000;
/// Polls of the PLL until it counts as broken: some 2 ms at 64 MHz; the PLL needs 0.2 ms.
const LOCK_LOOKS: u32 = 10_000;

/// Sets up the clocks of a board with a crystal of `CRYSTAL_HZ`: 4 to 48 MHz in steps of 4 MHz. Must be called once
/// after reset.
pub fn start<const CRYSTAL_HZ: u32>(scb: &mut SCB) -> Peripherals {
    const { assert!(CRYSTAL_HZ.is_multiple_of(PLL_INPUT_HZ) && CRYSTAL_HZ >= 4_000_000 && CRYSTAL_HZ <= 48_000_000) }
    limit_ram_reads();
    RCC.cr().modify(|cr| cr.set_hseon(true));
    let starts = crystal::starts(START_UP_CYCLES_PER_MS, || RCC.cr().read().hserdy());
    let peripherals = embassy_stm32::init(config::<CRYSTAL_HZ>(starts));
    trim_usb_clock();
    scb.enable_icache();
    // The clock security system switches to the internal oscillator and raises an NMI if the crystal fails.
    RCC.cr().modify(|cr| cr.set_hsecsson(starts));
    peripherals
}

/// First chip revision (X) whose AXI RAM handles several reads at once; earlier ones (Z, Y) may then return wrong data.
const REVISION_X: u16 = 0x2001;

/// Limits the AXI RAM to one read at a time on a chip of an early revision, as ES0392 requires ("Reading from AXI SRAM
/// may lead to data read corruption").
#[expect(unsafe_code, reason = "an address that the register definitions lack")]
fn limit_ram_reads() {
    /// Register AXI_TARG7_FN_MOD, which the register definitions lack, and its bit READ_ISS_OVERRIDE.
    const TARGET_7: *mut u32 = 0x5100_8108 as *mut u32;
    const ONE_READ: u32 = 1;
    if DBGMCU.idc().read().rev_id() < REVISION_X {
        // SAFETY: nothing else uses this register of the bus matrix, which the errata sheet documents.
        unsafe { TARGET_7.write_volatile(ONE_READ) };
    }
}

/// Returns the clock settings: core 400 MHz, buses 200 MHz, peripherals and SPI 100 MHz, timers 200 MHz, USB 48 MHz.
/// USB has its own oscillator, so that a failed crystal does not stop it.
fn config<const CRYSTAL_HZ: u32>(crystal: bool) -> Config {
    let source = if crystal { PllSource::HSE } else { PllSource::HSI };
    // The internal oscillator has 64 MHz.
    let prediv = if crystal { PllPreDiv::from_bits((CRYSTAL_HZ / PLL_INPUT_HZ) as u8) } else { PllPreDiv::DIV16 };
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = crystal.then_some(Hse { freq: Hertz(CRYSTAL_HZ), mode: HseMode::Oscillator });
    rcc.hsi48 = Some(Hsi48Config { sync_from_usb: true });
    rcc.mux.usbsel = Usbsel::HSI48;
    rcc.pll1 = Some(Pll {
        source,
        prediv,
        mul: PllMul::MUL200,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.voltage_scale = VoltageScale::Scale1;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    // The ADCs run on the internal oscillator, which a failed crystal does not stop.
    rcc.mux.adcsel = mux::Adcsel::PER;
    config
}

/// Trims USB's clock by the host's frames on OTG_FS, which the manual calls USB2; embassy selects OTG_HS.
fn trim_usb_clock() {
    /// Value of the field SYNCSRC for USB2.
    const USB2: Syncsrc = Syncsrc::_RESERVED_3;
    // The source can be changed only while the counter is off.
    CRS.cr().modify(|cr| cr.set_cen(false));
    CRS.cfgr().modify(|cfgr| cfgr.set_syncsrc(USB2));
    CRS.cr().modify(|cr| cr.set_cen(true));
}

/// Handles a failed crystal: the core, now at 64 MHz, is set to 400 MHz again within a few control periods.
#[allow(unsafe_code, reason = "required by the runtime: this interrupts critical sections")]
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    if !RCC.cifr().read().hsecssf() {
        return;
    }
    crystal::fail();
    RCC.cicr().write(|cicr| cicr.set_hsecssc(true));
    RCC.cr().modify(|cr| {
        cr.set_hseon(false);
        cr.set_pllon(0, false);
    });
    // Source and divider can be changed only while the PLL is off (RM0433, RCC_PLLCKSELR).
    RCC.pllckselr().modify(|pll| {
        pll.set_pllsrc(Pllsrc::HSI);
        pll.set_divm(0, Pllm::DIV16);
    });
    RCC.cr().modify(|cr| cr.set_pllon(0, true));
    // Count polls, since the time base stands still during an NMI.
    if (0..LOCK_LOOKS).any(|_| RCC.cr().read().pllrdy(0)) {
        RCC.cfgr().modify(|cfgr| cfgr.set_sw(Sw::PLL1_P));
    }
}
