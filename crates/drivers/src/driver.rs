//! Runs the scripts of a part, watches it, and sets it up again after faults.

use crate::bus::{BusError, READ_MAX, Registers};
use crate::part::{PartFault, SensorPart, Step};
use afbc_types::Stamped;
use embassy_futures::select::{Either, select};

/// Faults in a row after which a part is set up again.
pub const FAULTS_MAX: u32 = 10;
/// Pause before a part is set up again \[us\].
pub const PAUSE_US: u32 = 100_000;
/// Time between two looks whether a part that did not answer does again \[us\].
const LOOK_US: u32 = 2_000;
/// Pause after the second fault in a row and each further one \[us\]: the next attempt would follow at once, and a task
/// of the sensors' priority leaves the others no time.
const RETRY_US: u32 = 1_000;
/// Pause after each step of a set-up \[us\]: a control tick that is due goes first, for the steps together take longer
/// than it may be late.
const GIVE_WAY_US: u32 = 10;
/// Longest transfer \[us\], and what each of its bytes adds \[us\]: 1 MHz.
const TRANSFER_US: u32 = 10_000;
const BYTE_US: u32 = 8;
/// Cycles in a row without a reading.
const CYCLES_MAX: u32 = 100;
/// Cycles between two looks at a register that was set.
const CYCLES_A_LOOK: u32 = 16;
/// Shortest answer of equal bits that is none \[bytes\].
const SILENCE_LENGTH: usize = 3;
/// Time between two looks at a register for which a script waits \[us\].
const AWAIT_US: u32 = 1_000;

/// Time and the interrupt of a part, as its board has them.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait PartTiming {
    /// Time since power-up \[us\].
    fn now_us(&self) -> u64;

    /// Waits for at least so long.
    async fn wait(&self, us: u32);

    /// Waits for the part's interrupt, at most so long, and returns true if it has come. A part whose interrupt is not
    /// wired waits that long and returns true.
    async fn ready(&mut self, us: u32) -> bool {
        self.wait(us).await;
        true
    }

    /// Returns the time of the interrupt for which [`ready`](Self::ready) has waited \[us\]; none if there was none.
    fn ready_us(&self) -> Option<u64> {
        None
    }
}

/// A part on a bus.
#[derive(Debug)]
pub struct Driver<P, B, T> {
    part: P,
    bus: B,
    timing: T,
    /// True if it has been set up.
    is_up: bool,
    /// True if it was, to the end, and nothing has been set since.
    was_set_up: bool,
    /// Faults in a row, and the last one.
    faults: u32,
    last_fault: Option<PartFault>,
    /// Cycles since the last look, and number of registers looked at.
    cycles: u32,
    looks: usize,
    /// Time of the interrupt of this cycle \[us\].
    ready_us: Option<u64>,
    last: [u8; READ_MAX],
    /// Equal answers in a row.
    equals: u32,
}

impl<P: SensorPart, B: Registers, T: PartTiming> Driver<P, B, T> {
    /// A part that is yet to be set up, by the first [`Driver::reading`].
    pub fn new(part: P, bus: B, timing: T) -> Self {
        Driver {
            part,
            bus,
            timing,
            is_up: false,
            was_set_up: false,
            faults: 0,
            last_fault: None,
            cycles: 0,
            looks: 0,
            ready_us: None,
            last: [0; READ_MAX],
            equals: 0,
        }
    }

    /// True if it has been set up and reads without a fault.
    pub fn works(&self) -> bool {
        self.is_up && self.faults == 0
    }

    /// Returns the next reading, with the time of the part's interrupt or, without one, of the beginning of the
    /// transfer. Sets the part up before the first one and, after a pause, after [`FAULTS_MAX`] faults in a row, unless
    /// it only did not answer and is found as it was set up.
    ///
    /// # Errors
    /// The fault that this cycle, or the set-up, met. Call it again.
    pub async fn reading(&mut self) -> Result<Stamped<P::Reading>, PartFault> {
        let result = self.attempt().await;
        match &result {
            Ok(_) => self.faults = 0,
            Err(fault) => {
                self.last_fault = Some(*fault);
                self.faults = self.faults.saturating_add(1);
                self.is_up &= self.faults < FAULTS_MAX;
            }
        }
        result
    }

    /// Has it set up by the next reading, without a pause.
    pub(crate) fn forget(&mut self) {
        (self.is_up, self.was_set_up, self.faults, self.equals, self.ready_us) = (false, false, 0, 0, None);
    }

    async fn attempt(&mut self) -> Result<Stamped<P::Reading>, PartFault> {
        if !self.is_up && !self.comes_back().await {
            self.set_up().await?;
        }
        if self.faults > 1 {
            self.timing.wait(RETRY_US).await;
        }
        for _ in 0..CYCLES_MAX {
            if let Some(reading) = self.cycle().await? {
                return Ok(reading);
            }
        }
        Err(PartFault::Late)
    }

    /// Pauses after faults. A part that did not answer is looked at meanwhile: if it answers again with everything as
    /// it was set, its wire had failed and not the part, and true is returned at once.
    async fn comes_back(&mut self) -> bool {
        if self.faults == 0 {
            return false;
        }
        // Not one that is late or stuck: it may answer with everything as it was set, and only a set-up helps.
        let did_not_answer = matches!(
            self.last_fault,
            Some(
                PartFault::Bus | PartFault::Silent | PartFault::Identity(_) | PartFault::Register(_) | PartFault::Range
            )
        );
        if !self.was_set_up || !did_not_answer {
            self.timing.wait(PAUSE_US).await;
            return false;
        }
        let end_us = self.timing.now_us().saturating_add(PAUSE_US.into());
        while self.timing.now_us() < end_us {
            self.timing.wait(LOOK_US).await;
            if self.is_as_set().await.unwrap_or(false) {
                // A fault stays: the part does not count as working before it has read.
                (self.is_up, self.faults, self.cycles) = (true, 1, 0);
                return true;
            }
        }
        false
    }

    /// True if it is the part, and everything is as it was set; false if neither can be read.
    async fn is_as_set(&mut self) -> Result<bool, PartFault> {
        let mut is_seen = false;
        for (at, step) in P::SETUP.iter().enumerate() {
            if let Step::Identify(..) = step {
                self.step(step).await?;
                is_seen = true;
            }
            self.look(at).await?;
            is_seen |= register_set_by(step).is_some();
        }
        Ok(is_seen)
    }

    /// Runs the set-up, and reads back what was set.
    pub(crate) async fn set_up(&mut self) -> Result<(), PartFault> {
        self.was_set_up = false;
        for step in P::SETUP {
            self.step(step).await?;
            self.timing.wait(GIVE_WAY_US).await;
        }
        for at in 0..P::SETUP.len() {
            self.look(at).await?;
            self.timing.wait(GIVE_WAY_US).await;
        }
        // It works when it reads. What has stuck stays so until its reading changes.
        (self.is_up, self.was_set_up, self.faults, self.cycles) = (true, true, self.faults.min(1), 0);
        Ok(())
    }

    async fn cycle(&mut self) -> Result<Option<Stamped<P::Reading>>, PartFault> {
        self.ready_us = None;
        self.cycles += 1;
        if self.cycles >= CYCLES_A_LOOK {
            let at = (self.looks + 1) % P::SETUP.len().max(1);
            // What differs is looked at again in the next cycle, for a part may read on with a lost set-up.
            self.look(at).await?;
            (self.cycles, self.looks) = (0, at);
        }
        let mut complete = None;
        for step in P::CYCLE {
            // To the script's end: a step behind the reading may find that the part has failed.
            complete = self.step(step).await?.or(complete);
        }
        Ok(complete)
    }

    /// Reads back the register that a step of the set-up set, if it did.
    async fn look(&mut self, at: usize) -> Result<(), PartFault> {
        let Some(step) = P::SETUP.get(at) else { return Ok(()) };
        let Some(register) = register_set_by(step) else { return Ok(()) };
        // A script may set a register twice.
        if P::SETUP.iter().skip(at + 1).any(|later| register_set_by(later) == Some(register)) {
            return Ok(());
        }
        let value = self.value(step).await?;
        if self.byte(register).await? == value { Ok(()) } else { Err(PartFault::Register(register)) }
    }

    /// Returns the value that a step of the set-up gives its register.
    async fn value(&mut self, step: &Step) -> Result<u8, PartFault> {
        Ok(match *step {
            Step::Set(_, value) => value,
            Step::SetLike(_, value, mask, other) => value | self.byte(other).await? & mask,
            _ => 0,
        })
    }

    pub(crate) async fn step(&mut self, step: &Step) -> Result<Option<Stamped<P::Reading>>, PartFault> {
        match *step {
            Step::Identify(register, identities) => {
                let identity = self.byte(register).await?;
                // The list first: the identity of a QMC5883L is all ones.
                match identity {
                    _ if identities.contains(&identity) => (),
                    0x00 | 0xFF => return Err(PartFault::Silent),
                    _ => return Err(PartFault::Identity(identity)),
                }
            }
            Step::Set(register, value) | Step::Write(register, value) => self.write(register, &[value]).await?,
            Step::SetLike(register, ..) => {
                let value = self.value(step).await?;
                self.write(register, &[value]).await?;
            }
            Step::WriteAll(register, bytes) => self.write(register, bytes).await?,
            Step::Read(register, length) => return self.read(register, length).await,
            Step::Await(register, mask, value, ms) => {
                let mut looks = ms;
                while self.byte(register).await? & mask != value {
                    looks = looks.checked_sub(1).ok_or(PartFault::Late)?;
                    self.timing.wait(AWAIT_US).await;
                }
            }
            Step::Wait(us) => self.timing.wait(us).await,
            Step::Ready(us) => {
                if !self.timing.ready(us).await {
                    return Err(PartFault::Late);
                }
                self.ready_us = self.timing.ready_us();
            }
        }
        Ok(None)
    }

    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), PartFault> {
        transfer(&self.timing, bytes.len(), self.bus.write(register, bytes)).await
    }

    pub(crate) async fn byte(&mut self, register: u8) -> Result<u8, PartFault> {
        let mut answer = [0];
        transfer(&self.timing, answer.len(), self.bus.read(register, &mut answer)).await?;
        let [byte] = answer;
        Ok(byte)
    }

    async fn read(&mut self, register: u8, length: usize) -> Result<Option<Stamped<P::Reading>>, PartFault> {
        let at_us = self.ready_us.unwrap_or_else(|| self.timing.now_us());
        let mut answer = [0; READ_MAX];
        let answer = answer.get_mut(..length).ok_or(PartFault::Bus)?;
        transfer(&self.timing, length, self.bus.read(register, answer)).await?;
        if length >= SILENCE_LENGTH && [0x00, 0xFF].iter().any(|idle| answer.iter().all(|byte| byte == idle)) {
            return Err(PartFault::Silent);
        }
        let reading = self.part.take(register, answer)?;
        if reading.is_some() {
            let last = self.last.get_mut(..length).ok_or(PartFault::Bus)?;
            self.equals = if last == answer { self.equals.saturating_add(1) } else { 0 };
            last.copy_from_slice(answer);
            if self.equals >= P::STUCK_AFTER {
                return Err(PartFault::Stuck);
            }
        }
        Ok(reading.map(|value| Stamped { value, at_us }))
    }
}

/// Returns the register that a step sets and that is read back, if it does.
fn register_set_by(step: &Step) -> Option<u8> {
    match *step {
        Step::Set(register, _) | Step::SetLike(register, ..) => Some(register),
        _ => None,
    }
}

/// Waits for a transfer, but not for one that never ends.
async fn transfer(
    timing: &impl PartTiming,
    length: usize,
    transfer: impl Future<Output = Result<(), BusError>>,
) -> Result<(), PartFault> {
    let limit_us = TRANSFER_US.saturating_add(BYTE_US.saturating_mul(u32::try_from(length).unwrap_or(u32::MAX)));
    match select(transfer, timing.wait(limit_us)).await {
        Either::First(result) => Ok(result?),
        Either::Second(()) => Err(PartFault::Bus),
    }
}

impl From<BusError> for PartFault {
    fn from(_: BusError) -> Self {
        PartFault::Bus
    }
}
