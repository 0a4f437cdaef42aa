//! Cycles that a core takes per instruction, at best and at most.

/// Limit for which cycles are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleLimit {
    /// Every fetch hits a cache, and no instruction waits for a previous result.
    Best,
    /// No fetch hits a cache, and every instruction waits.
    Bound,
}

/// Shares of the kinds of instructions; 1 is all instructions.
#[derive(Clone, Copy, Debug)]
pub struct InstructionMix {
    /// Share of loads from memory.
    pub load: f64,
    /// Share of loads from constants in the code, which `load` includes.
    pub literal: f64,
    /// Share of stores to memory.
    pub store: f64,
    /// Share of loads and stores of several registers.
    pub multiple: f64,
    /// Share of multiplications and additions in single precision.
    pub multiply_add: f64,
    /// Share of VDIV.F32 and VSQRT.F32.
    pub divide: f64,
    /// Share of branches and calls, all counted as taken.
    pub branch: f64,
    /// Mean length of an instruction \[bytes\].
    pub bytes: f64,
}

/// Mix of the 45,156 instructions that the control tick of `speedybee-f405-v4` can reach; the other images differ by 1
/// %. 71 % of the instructions have four bytes.
pub(super) const MIX: InstructionMix = InstructionMix {
    load: 0.20,
    literal: 0.02,
    store: 0.118,
    multiple: 0.035,
    multiply_add: 0.068,
    divide: 0.010,
    branch: 0.063,
    bytes: 3.43,
};

/// Cycles per instruction of each kind.
#[derive(Clone, Copy, Debug)]
struct CyclesPerKind {
    load: f64,
    store: f64,
    multiple: f64,
    multiply_add: f64,
    divide: f64,
    branch: f64,
    other: f64,
}

/// Cycles and clock of a core with its flash.
#[derive(Debug)]
pub struct CoreCycles {
    /// Name of the core.
    pub name: &'static str,
    /// Clock of the core \[Hz\].
    pub hz: u64,
    best: CyclesPerKind,
    bound: CyclesPerKind,
    /// Size of a flash line \[bytes\], and the core's wait for it \[cycles\].
    line_bytes: f64,
    line_wait: f64,
    /// True if the next line is fetched while one is executed.
    prefetches: bool,
    /// True if the cache holds more code than runs between two bytes of a link, so that the byte interrupt's code stays
    /// cached.
    keeps_interrupts: bool,
    /// Cycles of entry and exit of an interrupt, at best and at most.
    exception: [u64; 2],
}

/// Cortex-M4F with the STM32F405's flash: five wait states, lines of 16 bytes, prefetch (RM0090, 3.5.2; off on chips of
/// revision A). The cache holds 1 KiB, less code than a tick runs between two interrupts. Cycles are from Arm 100166,
/// tables 3-1 and 7-1: a load takes 1 or 2, VDIV and VSQRT 14, VFMA 3, a taken branch 1 plus 1 to 3. A load or store of
/// several registers takes one cycle per register, here four. Interrupt entry and exit take 12 each, and 17 more each
/// with the FPU's registers.
pub static CORTEX_M4F: CoreCycles = CoreCycles {
    name: "Cortex-M4F, flash with 5 wait states and prefetch",
    hz: 168_000_000,
    best: CyclesPerKind {
        load: 1.0,
        store: 1.0,
        multiple: 5.0,
        multiply_add: 3.0,
        divide: 14.0,
        branch: 2.0,
        other: 1.0,
    },
    bound: CyclesPerKind {
        load: 2.0,
        store: 2.0,
        multiple: 6.0,
        multiply_add: 3.0,
        divide: 14.0,
        branch: 4.0,
        other: 1.0,
    },
    line_bytes: 16.0,
    line_wait: 5.0,
    prefetches: true,
    keeps_interrupts: false,
    exception: [24, 64],
};

/// Cortex-M7 of the STM32H743 with instruction cache, without data cache. Arm publishes no cycles, so these are
/// estimates. At best, dual issue takes half a cycle per instruction. At most, instructions issue singly, every branch
/// is mispredicted, and a load takes 7 cycles: half of the loads are from AXI memory at half the clock, half from the
/// stack without waiting. A flash line of 32 bytes takes 16 cycles.
pub static CORTEX_M7: CoreCycles = CoreCycles {
    name: "Cortex-M7, instruction cache, no data cache",
    hz: 400_000_000,
    best: CyclesPerKind {
        load: 1.0,
        store: 1.0,
        multiple: 3.0,
        multiply_add: 1.0,
        divide: 14.0,
        branch: 1.0,
        other: 0.5,
    },
    bound: CyclesPerKind {
        load: 7.0,
        store: 4.0,
        multiple: 6.0,
        multiply_add: 4.0,
        divide: 16.0,
        branch: 8.0,
        other: 1.0,
    },
    line_bytes: 32.0,
    line_wait: 16.0,
    prefetches: false,
    keeps_interrupts: true,
    exception: [24, 64],
};

impl CoreCycles {
    /// Returns the mean cycles per instruction in a loop that the cache holds.
    #[must_use]
    pub fn per_cached(&self, limit: CycleLimit) -> f64 {
        let CyclesPerKind { load, store, multiple, multiply_add, divide, branch, other } = match limit {
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

    /// Returns the mean cycles per instruction. The bound adds a wait for each branch, literal and flash line. A
    /// prefetch shortens a line's wait by the time of the line before, at one cycle per instruction.
    #[must_use]
    pub fn per_instruction(&self, limit: CycleLimit) -> f64 {
        let line = self.line_bytes / MIX.bytes;
        let in_line = if self.prefetches { (1.0 + self.line_wait - line).max(0.0) } else { self.line_wait };
        let waits = in_line / line + (MIX.branch + MIX.literal) * self.line_wait;
        self.per_cached(limit) + if limit == CycleLimit::Bound { waits } else { 0.0 }
    }

    /// Returns the time of `straight` instructions outside of loops and `looped` ones in cached loops \[ns\].
    #[must_use]
    pub fn time_ns(&self, straight: u64, looped: u64, limit: CycleLimit) -> u64 {
        let cycles = straight as f64 * self.per_instruction(limit) + looped as f64 * self.per_cached(limit);
        (cycles * 1e9 / self.hz as f64).ceil() as u64
    }

    /// Returns the time of a byte interrupt's instructions \[ns\].
    #[must_use]
    pub fn byte_ns(&self, instructions: u64, limit: CycleLimit) -> u64 {
        if self.keeps_interrupts { self.time_ns(0, instructions, limit) } else { self.time_ns(instructions, 0, limit) }
    }

    /// Returns the time of an interrupt's entry and exit \[ns\].
    #[must_use]
    pub fn exception_ns(&self, limit: CycleLimit) -> u64 {
        let [best, bound] = self.exception;
        let cycles = if limit == CycleLimit::Best { best } else { bound };
        (cycles * 1_000_000_000).div_ceil(self.hz)
    }
}
