//! Computes an image's memory use and, for a function, its worst-case stack and the panics that it can reach.
//!
//! The call graph comes from the machine code itself (Armv7-M manual, A5 to A7). Every direct branch that leaves a
//! function counts as a call. Every instruction that lowers the stack pointer counts for the whole function. Both rules
//! overestimate.

use crate::Error;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;

/// Budget of the guidance within a control tick: modes, trajectory limiter, safety net, and the link's commands.
pub const GUIDANCE_INSTRUCTIONS_MAX: u32 = 2_300;
/// Largest number of instructions in a control tick: the worst that the search ([`crate::worst_tick`]) found, plus a
/// margin. At 2.5 cycles each, it takes 125 us of the 1000 us.
pub const TICK_INSTRUCTIONS_MAX: u32 = 6_450 + GUIDANCE_INSTRUCTIONS_MAX;
/// Largest number of instructions in a control tick with the vehicle's own estimate.
pub const ESTIMATING_INSTRUCTIONS_MAX: u32 = 16_200 + GUIDANCE_INSTRUCTIONS_MAX;
/// Largest mean number of instructions in a control tick with the vehicle's own estimate.
pub const ESTIMATING_INSTRUCTIONS_MEAN: u32 = 9_700 + 2_400;

/// Address range of the flash.
const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0810_0000;

/// A linked image.
#[derive(Debug)]
pub struct LinkedImage {
    functions: BTreeMap<u32, ImageFunction>,
    symbols: BTreeMap<String, u32>,
    /// Log messages of the image, as written in the source.
    pub log: Vec<String>,
    /// Size of code, constants and initial values in the flash \[bytes\].
    pub flash_bytes: u64,
    /// Size of the static RAM without the stack \[bytes\].
    pub ram_bytes: u64,
}

#[derive(Debug, Default)]
struct ImageFunction {
    name: String,
    stack_bytes: u32,
    calls: BTreeSet<u32>,
    /// True if the function calls through a pointer.
    is_indirect: bool,
}

/// Everything that a function can reach by calls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReachableCode {
    /// Worst-case stack \[bytes\].
    pub stack_bytes: u32,
    /// Chain of calls with the deepest stack, outermost first, each with its own stack \[bytes\].
    pub deepest: Vec<(String, u32)>,
    /// Shortest chain of calls to each panicking function, outermost first. Calls after a panic are ignored, since a
    /// panic ends the task.
    pub panics: Vec<Vec<String>>,
    /// Shortest chain of calls to each double-precision function, outermost first. This processor has no
    /// double-precision instructions.
    pub doubles: Vec<Vec<String>>,
    /// Names of functions that call through a pointer; not the parameters' table, whose pointer is known.
    pub indirect: Vec<String>,
}

/// Functions of the executors' wakers. They are the targets of all calls through a pointer, except for those in
/// [`EXECUTORS`], and by [`USB_CALLERS`] and [`CHECK`].
const WAKER: [&str; 3] =
    ["embassy_executor::raw::waker::wake", "embassy_executor::raw::waker::clone", "embassy_executor::raw::waker::drop"];

/// Each executor's interrupt and the tasks that it polls through a pointer. A task is identified by a function that
/// only this task calls.
const EXECUTORS: [(&str, &[&str]); 3] = [
    ("CAN2_TX", &["firmware::control::tick", "chip_stm32::motors::encode"]),
    ("CAN2_RX0", &["firmware::comms::report"]),
    (
        "CAN2_RX1",
        &[
            "firmware::housekeeping::deepest_stack",
            "firmware::parameters::keep",
            "chip_stm32::usb::claim",
            "chip_stm32::usb::answers",
        ],
    ),
];
/// Functions that call a USB class's request handlers through a pointer, and names of these handlers.
const USB_CALLERS: [&str; 2] = ["chip_stm32::usb::", "embassy_usb::"];
const USB_CLASS: [&str; 2] = ["embassy_usb::class::cdc_acm::Control", "embassy_usb::Handler::"];
/// The function of the parameters' table that prepares a flight through a pointer, and the function at the pointer.
const CHECK: [&str; 2] =
    ["afbc_onboard::parameters::table::ParameterTable::could_fly", "afbc_onboard::parameters::table::check_rotors"];
/// Name of every task's poll function.
const POLL: &str = "embassy_executor::raw::TaskStorage<F>::poll";

/// Interrupts of the flight image by priority, highest first; interrupts of the same level do not nest.
pub const LEVELS: [(&str, &[&str]); 7] = [
    ("-2", &["NonMaskableInt"]),
    ("1", &["SysTick"]),
    ("2", &["USART1"]),
    ("4", &["CAN2_TX"]),
    ("6", &["DMA2_STREAM1"]),
    ("8", &["CAN2_RX0"]),
    ("12", &["CAN2_RX1", "OTG_FS"]),
];
/// Bytes that the processor pushes on an interrupt: 26 words including the FPU's, and one for alignment.
pub const FRAME_BYTES: u32 = 108;

impl LinkedImage {
    /// Reads an image.
    ///
    /// # Errors
    /// Fails if the file is missing or not an image.
    pub fn read(elf: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(elf).map_err(|_| Error::NoImage(elf.to_owned()))?;
        let file = object::File::parse(bytes.as_slice()).map_err(|error| Error::Protocol(error.to_string()))?;

        let (mut flash_bytes, mut ram_bytes) = (0, 0);
        for section in file.sections() {
            let is_flash = FLASH.contains(&section.address());
            match section.kind() {
                SectionKind::Data => {
                    flash_bytes += section.size();
                    ram_bytes += section.size();
                }
                SectionKind::UninitializedData => ram_bytes += section.size(),
                _ if is_flash => flash_bytes += section.size(),
                _ => (),
            }
        }

        // The symbols $t and $d mark the beginnings of code and data within a section.
        let marks: BTreeMap<u32, bool> = file
            .symbols()
            .filter_map(|symbol| {
                let name = symbol.name().ok()?;
                let is_code = name.starts_with("$t");
                (is_code || name.starts_with("$d")).then_some((symbol.address() as u32, is_code))
            })
            .collect();
        let is_code = |address: u32| marks.range(..=address).next_back().is_some_and(|(_, is_code)| *is_code);

        let mut functions = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0) {
            // Bit 0 of a function's address is the Thumb bit.
            let start = symbol.address() as u32 & !1;
            let code = symbol
                .section_index()
                .and_then(|index| file.section_by_index(index).ok())
                .and_then(|section| section.data_range(u64::from(start), symbol.size()).ok().flatten());
            let Some(code) = code else { continue };
            let name = format!("{:#}", rustc_demangle::demangle(symbol.name().unwrap_or_default()));
            functions.entry(start).or_insert_with(|| ImageFunction::decode(name, start, code, is_code));
        }
        let symbols = file.symbols().filter_map(|symbol| {
            Some((format!("{:#}", rustc_demangle::demangle(symbol.name().ok()?)), symbol.address() as u32))
        });
        let log = file.section_by_name(".defmt").map(|section| section.index());
        let log = file.symbols().filter(|symbol| symbol.section_index().is_some_and(|index| Some(index) == log));
        let log = log.filter_map(|symbol| Some(symbol.name().ok()?.to_owned())).collect();
        Ok(LinkedImage { functions, symbols: symbols.collect(), log, flash_bytes, ram_bytes })
    }

    /// Returns what the function named `name` can reach.
    ///
    /// # Errors
    /// Fails if there is no such function, or if it can call itself.
    pub fn reach(&self, name: &str) -> Result<ReachableCode, Error> {
        self.reach_without(name, &[])
    }

    /// Returns what the function can reach as long as none of the functions `omitted` is called.
    ///
    /// # Errors
    /// The same as for [`reach`](Self::reach).
    pub fn reach_without(&self, name: &str, omitted: &[&str]) -> Result<ReachableCode, Error> {
        let root = self.find(name).ok_or_else(|| Error::Protocol(format!("the image has no function {name}")))?;
        let omitted = omitted.iter().filter_map(|name| self.find(name)).collect();
        let mut walk = CallGraphWalk { linked: self, omitted, depths: BTreeMap::new(), open: BTreeSet::new() };
        let (stack_bytes, deepest) = walk.depth(root)?;
        let reached = walk.depths.keys().filter_map(|address| self.functions.get(address));
        let indirect = reached
            .filter(|function| function.is_indirect && function.name != CHECK[0])
            .map(|function| function.name.clone())
            .collect();
        Ok(ReachableCode {
            stack_bytes,
            deepest,
            panics: self.chains(root, ImageFunction::panics)?,
            doubles: self.chains(root, ImageFunction::is_of_doubles)?,
            indirect,
        })
    }

    /// Returns the shortest chain from `root` to each function that is `sought`. Calls after a panic are ignored.
    fn chains(&self, root: u32, sought: fn(&ImageFunction) -> bool) -> Result<Vec<Vec<String>>, Error> {
        let mut chains = Vec::new();
        let mut seen = BTreeSet::from([root]);
        let mut next = VecDeque::from([vec![root]]);
        while let Some(chain) = next.pop_front() {
            let last = chain.last().copied().unwrap_or(root);
            let function = self.function(last)?;
            if sought(function) {
                let names = chain.iter().map(|address| Ok(self.function(*address)?.name.clone()));
                chains.push(names.collect::<Result<_, Error>>()?);
            }
            if sought(function) || function.panics() {
                continue;
            }
            for callee in self.callees(last)? {
                if seen.insert(callee) {
                    next.push_back([chain.as_slice(), &[callee]].concat());
                }
            }
        }
        Ok(chains)
    }

    fn function(&self, address: u32) -> Result<&ImageFunction, Error> {
        let none = || Error::Protocol(format!("a call to {address:#010x}, where no function is"));
        self.functions.get(&address).ok_or_else(none)
    }

    /// Returns all functions that a function may call.
    fn callees(&self, address: u32) -> Result<BTreeSet<u32>, Error> {
        let function = self.function(address)?;
        let mut callees = function.calls.clone();
        let [checker, check] = CHECK;
        if function.is_indirect && function.name == checker {
            let check = self.functions.iter().find(|(_, function)| function.name.starts_with(check));
            callees.extend(check.map(|(address, _)| *address));
        } else if function.is_indirect {
            callees.extend(WAKER.iter().filter_map(|name| self.find(name)));
            for (_, marks) in EXECUTORS.iter().filter(|(interrupt, _)| *interrupt == function.name) {
                for mark in *marks {
                    callees.insert(self.task(mark)?);
                }
            }
            if USB_CALLERS.iter().any(|caller| function.name.starts_with(caller)) {
                let is_class = |function: &ImageFunction| USB_CLASS.iter().any(|name| function.name.contains(name));
                callees.extend(self.functions.iter().filter(|(_, f)| is_class(f)).map(|(address, _)| *address));
            }
        }
        Ok(callees)
    }

    /// Returns the task that calls the function `mark`.
    fn task(&self, mark: &str) -> Result<u32, Error> {
        let missing = |what: &str| Error::Protocol(format!("the image has no {what} {mark}"));
        let mark_address = self.find(mark).ok_or_else(|| missing("function"))?;
        let mut tasks = self.functions.iter().filter(|(_, function)| function.name == POLL);
        let task = tasks.find(|(_, function)| function.calls.contains(&mark_address));
        task.map(|(address, _)| *address).ok_or_else(|| missing("task that calls"))
    }

    /// Returns the start address of the function `name`.
    pub fn function_named(&self, name: &str) -> Option<u32> {
        self.find(name)
    }

    /// Returns the address of a symbol by its name in the source, such as `flight::board::RX`.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).copied()
    }

    fn find(&self, name: &str) -> Option<u32> {
        self.functions.iter().find(|(_, function)| function.name == name).map(|(address, _)| *address)
    }
}

/// Deepest stack of a function with its callees, and the chain of calls.
type StackDepth = (u32, Vec<(String, u32)>);

struct CallGraphWalk<'a> {
    linked: &'a LinkedImage,
    /// Functions that count as never called.
    omitted: BTreeSet<u32>,
    depths: BTreeMap<u32, StackDepth>,
    /// Functions on the current path.
    open: BTreeSet<u32>,
}

impl CallGraphWalk<'_> {
    fn depth(&mut self, address: u32) -> Result<StackDepth, Error> {
        if let Some(depth) = self.depths.get(&address) {
            return Ok(depth.clone());
        }
        let function = self.linked.function(address)?;
        if !self.open.insert(address) {
            // The stack of a recursion has no bound.
            return Err(Error::Protocol(format!("{} can call itself", function.name)));
        }
        let (mut below, mut chain) = StackDepth::default();
        let callees = if function.panics() { BTreeSet::new() } else { self.linked.callees(address)? };
        for callee in callees.difference(&self.omitted.clone()).copied() {
            let (bytes, names) = self.depth(callee)?;
            if bytes > below {
                (below, chain) = (bytes, names);
            }
        }
        self.open.remove(&address);
        chain.insert(0, (function.name.clone(), function.stack_bytes));
        let depth = (function.stack_bytes + below, chain);
        self.depths.insert(address, depth.clone());
        Ok(depth)
    }
}

impl ImageFunction {
    /// Returns true if a panic begins in this function.
    fn panics(&self) -> bool {
        self.name.contains("panic") || self.name.ends_with("_fail") || self.name.ends_with("_failed")
    }

    /// Returns true for a double-precision routine such as `__adddf3`, `__aeabi_dmul` or `__aeabi_f2d`.
    fn is_of_doubles(&self) -> bool {
        let name = self.name.rsplit("::").next().unwrap_or_default();
        name.starts_with("__") && (name.contains("df") || name.starts_with("__aeabi_d") || name.ends_with("2d"))
    }

    fn decode(name: String, start: u32, code: &[u8], is_code: impl Fn(u32) -> bool) -> Self {
        let mut function = ImageFunction { name, ..ImageFunction::default() };
        let end = start + code.len() as u32;
        let halfwords: Vec<u16> = code
            .chunks_exact(2)
            .map(|pair| pair.iter().rev().fold(0, |value, byte| value << 8 | u16::from(*byte)))
            .collect();
        let mut index = 0;
        while let Some(&first) = halfwords.get(index) {
            let address = start + 2 * index as u32;
            if !is_code(address) {
                index += 1;
                continue;
            }
            let effect = if first >> 11 >= 0b11101 {
                index += 2;
                InstructionEffect::of_wide(first, halfwords.get(index - 1).copied().unwrap_or(0))
            } else {
                index += 1;
                InstructionEffect::of_narrow(first)
            };
            match effect {
                InstructionEffect::Push(bytes) => function.stack_bytes += bytes,
                InstructionEffect::Branch(offset) => {
                    let target = address.wrapping_add(4).wrapping_add_signed(offset);
                    if !(start..end).contains(&target) {
                        function.calls.insert(target);
                    }
                }
                InstructionEffect::Indirect => function.is_indirect = true,
                InstructionEffect::Other => (),
            }
        }
        function
    }
}

/// Effect of an instruction on stack and control flow.
enum InstructionEffect {
    /// Lowers the stack pointer by this many bytes.
    Push(u32),
    /// Branches to its own address + 4 + this offset, with or without return.
    Branch(i32),
    /// Branches to an address in a register.
    Indirect,
    Other,
}

impl InstructionEffect {
    fn of_narrow(code: u16) -> Self {
        let bits = u32::from(code);
        match code {
            // PUSH
            _ if code & 0xFE00 == 0xB400 => InstructionEffect::Push(4 * (bits & 0x1FF).count_ones()),
            // SUB SP, #imm7 * 4
            _ if code & 0xFF80 == 0xB080 => InstructionEffect::Push(4 * (bits & 0x7F)),
            // BLX register; BX other than LR
            _ if code & 0xFF87 == 0x4780 || code & 0xFF87 == 0x4700 && code != 0x4770 => InstructionEffect::Indirect,
            // This is a conditional branch B. The conditions 14 and 15 mean UDF and SVC.
            _ if code & 0xF000 == 0xD000 && code & 0x0E00 != 0x0E00 => InstructionEffect::Branch(signed(bits << 1, 9)),
            // B
            _ if code & 0xF800 == 0xE000 => InstructionEffect::Branch(signed(bits << 1, 12)),
            _ => InstructionEffect::Other,
        }
    }

    fn of_wide(first: u16, second: u16) -> Self {
        let (a, b) = (u32::from(first), u32::from(second));
        let is_branch = a & 0xF800 == 0xF000 && b & 0x8000 != 0;
        let (s, j1, j2) = (a >> 10 & 1, b >> 13 & 1, b >> 11 & 1);
        match b & 0x5000 {
            // BL, B
            0x5000 | 0x1000 if is_branch => {
                let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
                let offset = s << 24 | i1 << 23 | i2 << 22 | (a & 0x3FF) << 12 | (b & 0x7FF) << 1;
                return InstructionEffect::Branch(signed(offset, 25));
            }
            // This is a conditional branch B. The conditions 14 and 15 mean system instructions.
            0x0000 if is_branch && a >> 7 & 7 != 7 => {
                let offset = s << 20 | j2 << 19 | j1 << 18 | (a & 0x3F) << 12 | (b & 0x7FF) << 1;
                return InstructionEffect::Branch(signed(offset, 21));
            }
            _ => (),
        }
        match (a, b) {
            // PUSH.W
            (0xE92D, _) => InstructionEffect::Push(4 * b.count_ones()),
            // STR register, [SP, #-imm8]!
            (0xF84D, _) if b & 0x0F00 == 0x0D00 => InstructionEffect::Push(b & 0xFF),
            // STRD registers, [SP, #-imm8 * 4]!
            (0xE96D, _) => InstructionEffect::Push(4 * (b & 0xFF)),
            // VPUSH
            _ if a & 0xFFBF == 0xED2D && b & 0x0E00 == 0x0A00 => InstructionEffect::Push(4 * (b & 0xFF)),
            // SUB.W SP, SP, #imm; SUBW SP, SP, #imm12
            _ if a & 0xFBEF == 0xF1AD && b & 0x8F00 == 0x0D00 => InstructionEffect::Push(expand(immediate(a, b))),
            _ if a & 0xFBFF == 0xF2AD && b & 0x8F00 == 0x0D00 => InstructionEffect::Push(immediate(a, b)),
            // LDR PC, [register other than SP]
            _ if a & 0xFF70 == 0xF850 && b >> 12 == 15 && a & 15 != 13 => InstructionEffect::Indirect,
            _ => InstructionEffect::Other,
        }
    }
}

/// Returns the lowest `width` bits as a signed number.
fn signed(bits: u32, width: u32) -> i32 {
    (bits << (32 - width)) as i32 >> (32 - width)
}

/// Returns i:imm3:imm8 of a wide instruction.
fn immediate(first: u32, second: u32) -> u32 {
    (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF
}

/// Computes ThumbExpandImm of the Armv7-M manual.
fn expand(imm12: u32) -> u32 {
    let byte = imm12 & 0xFF;
    match imm12 >> 8 {
        0 => byte,
        1 => byte | byte << 16,
        2 => byte << 8 | byte << 24,
        3 => byte * 0x0101_0101,
        _ => (0x80 | imm12 & 0x7F).rotate_right(imm12 >> 7),
    }
}
