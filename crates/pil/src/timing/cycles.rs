//! Cycles that a core takes for an instruction, at best and at most.

/// Which of the two limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleLimit {
    /// Every fetch hits a cache, nothing waits for the result before it.
    Best,
    /// No fetch hits a cache, everything waits.
    Bound,
}

/// Shares of kinds of instructions, of a sum of 1.
#[derive(Clone, Copy, Debug)]
pub struct Mix {
    /// From memory.
    pub load: f64,
    /// Of these, from constants between the code.
    pub literal: f64,
    /// To memory.
    pub store: f64,
    /// Of several registers.
    pub multiple: f64,
    /// Multiply and add, single precision.
    pub multiply_add: f64,
    /// VDIV.F32 and VSQRT.F32.
    pub divide: f64,
    /// Branches and calls, as if all were taken.
    pub branch: f64,
    /// Mean length \[bytes\].
    pub bytes: f64,
}

/// Of the 45,156 instructions that the control tick of `speedybee-f405-v4` can reach; the other images differ by 1 %.
/// 71 % have four bytes.
pub(super) const MIX: Mix = Mix {
    load: 0.20,
    literal: 0.02,
    store: 0.118,
    multiple: 0.035,
    multiply_add: 0.068,
    divide: 0.010,
    branch: 0.063,
    bytes: 3.43,
};

/// Cycles of each kind.
#[derive(Clone, Copy, Debug)]
struct Kinds {
    load: f64,
    store: f64,
    multiple: f64,
    multiply_add: f64,
    divide: f64,
    branch: f64,
    other: f64,
}

/// A core with its flash.
#[derive(Debug)]
pub struct CoreCycles {
    /// Its name.
    pub name: &'static str,
    /// Its clock \[Hz\].
    pub hz: u64,
    best: Kinds,
    bound: Kinds,
    /// What a fetch brings \[bytes\], and how long the core waits for it \[cycles\].
    line_bytes: f64,
    line_wait: f64,
    /// True if the next line is fetched while one is executed.
    prefetches: bool,
    /// True if its cache holds more code than runs between two bytes of a link, and so the interrupt for them.
    keeps_interrupts: bool,
    /// Entry and exit of an interrupt, at best and at most \[cycles\].
    exception: [u64; 2],
}

/// Cortex-M4F with the STM32F405's flash at five wait states, in lines of 16 bytes, with its prefetch (RM0090, 3.5.2;
/// off on chips of revision A). Its cache holds 1 KiB, less than a tick runs between two interrupts. Loads take 1 or 2
/// cycles, VDIV and VSQRT 14, VFMA 3, a taken branch 1 and 1 to 3 (Arm 100166, tables 3-1 and 7-1); several registers
/// one each, here four. Entry and exit take 12 each and, with the FPU's registers, 17 more.
pub static CORTEX_M4F: CoreCycles = CoreCycles {
    name: "Cortex-M4F, flash with 5 wait states and prefetch",
    hz: 168_000_000,
    best: Kinds { load: 1.0, store: 1.0, multiple: 5.0, multiply_add: 3.0, divide: 14.0, branch: 2.0, other: 1.0 },
    bound: Kinds { load: 2.0, store: 2.0, multiple: 6.0, multiply_add: 3.0, divide: 14.0, branch: 4.0, other: 1.0 },
    line_bytes: 16.0,
    line_wait: 5.0,
    prefetches: true,
    keeps_interrupts: false,
    exception: [24, 64],
};

/// Cortex-M7 of the STM32H743 with its instruction cache; its data cache is off. Arm gives no cycles: at best half a
/// cycle for what two pipelines share; at most single issue, a branch mispredicted, a load of 7 cycles (half of them
/// from the AXI memory at half the clock, half from the stack, which has none) and 16 for a line of 32 bytes from the
/// flash. These are estimates.
pub static CORTEX_M7: CoreCycles = CoreCycles {
    name: "Cortex-M7, instruction cache, no data cache",
    hz: 400_000_000,
    best: Kinds { load: 1.0, store: 1.0, multiple: 3.0, multiply_add: 1.0, divide: 14.0, branch: 1.0, other: 0.5 },
    bound: Kinds { load: 7.0, store: 4.0, multiple: 6.0, multiply_add: 4.0, divide: 16.0, branch: 8.0, other: 1.0 },
    line_bytes: 32.0,
    line_wait: 16.0,
    prefetches: false,
    keeps_interrupts: true,
    exception: [24, 64],
};

impl CoreCycles {
    /// Returns the cycles of an instruction of a loop that its cache holds.
    #[must_use]
    pub fn per_cached(&self, limit: CycleLimit) -> f64 {
        let Kinds { load, store, multiple, multiply_add, divide, branch, other } = match limit {
            CycleLimit::Best => self.best,
            CycleLimit::Bound => self.bound,
        };
        let rest = 1.0 - MIX.load - MIX.store - MIX.multiple - MIX.multiply_add - MIX.divide - MIX.branch;
        MIX.load * load
            + MIX.store * store
            + MIX.multiple * multiple
            + MIX.multiply_add * multiply_add
            + MIX.divide * divide
            + MIX.branch * branch
            + rest * other
    }

    /// Returns the cycles of an instruction: at most, with a wait for each branch, each literal and each line, of which
    /// a prefetch takes the time of the line before it, at one cycle an instruction.
    #[must_use]
    pub fn per_instruction(&self, limit: CycleLimit) -> f64 {
        let line = self.line_bytes / MIX.bytes;
        let in_line = if self.prefetches { (1.0 + self.line_wait - line).max(0.0) } else { self.line_wait };
        let waits = in_line / line + (MIX.branch + MIX.literal) * self.line_wait;
        self.per_cached(limit) + if limit == CycleLimit::Bound { waits } else { 0.0 }
    }

    /// Returns the time of instructions, and of those in loops \[ns\].
    #[must_use]
    pub fn time_ns(&self, straight: u64, looped: u64, limit: CycleLimit) -> u64 {
        let cycles = straight as f64 * self.per_instruction(limit) + looped as f64 * self.per_cached(limit);
        (cycles * 1e9 / self.hz as f64).ceil() as u64
    }

    /// Returns the time of the instructions of an interrupt for a byte \[ns\].
    #[must_use]
    pub fn byte_ns(&self, instructions: u64, limit: CycleLimit) -> u64 {
        if self.keeps_interrupts { self.time_ns(0, instructions, limit) } else { self.time_ns(instructions, 0, limit) }
    }

    /// Returns the time of entry to and exit from an interrupt \[ns\].
    #[must_use]
    pub fn exception_ns(&self, limit: CycleLimit) -> u64 {
        let [best, bound] = self.exception;
        let cycles = if limit == CycleLimit::Best { best } else { bound };
        (cycles * 1_000_000_000).div_ceil(self.hz)
    }
}
