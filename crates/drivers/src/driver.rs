//! Runs a part's scripts, monitors the part and sets it up again after faults.

use crate::bus::{BusError, READ_MAX, Registers};
use crate::part::{PartFault, ScriptStep, SensorPart};
use afbc_types::Stamped;
use embassy_futures::select::{Either, select};

/// Number of consecutive faults after which a part is set up again.
pub const FAULTS_MAX: u32 = 10;
/// Pause before a part is set up again \[us\].
pub const PAUSE_US: u32 = 100_000;
/// Interval at which a part that did not answer is checked \[us\].
const LOOK_US: u32 = 2_000;
/// Pause after the second and each further consecutive fault \[us\]. Without it the next attempt would follow at once,
/// and a task of the sensors' priority would starve the others.
const RETRY_US: u32 = 1_000;
/// Pause after each step of a set-up \[us\]. It lets a due control tick run, since all steps together take longer than
/// a tick may be late.
const GIVE_WAY_US: u32 = 10;
/// Time limit of a transfer \[us\], and its extra time per byte \[us\], for a clock of 1 MHz.
const TRANSFER_US: u32 = 10_000;
const BYTE_US: u32 = 8;
/// Largest number of consecutive cycles without a reading.
const CYCLES_MAX: u32 = 100;
/// Number of cycles between two checks of a register's value.
const CYCLES_A_LOOK: u32 = 16;
/// Length from which an answer of equal bits counts as silence \[bytes\].
const SILENCE_LENGTH: usize = 3;
/// Interval at which a script polls a register \[us\].
const AWAIT_US: u32 = 1_000;

/// Board's clock and a part's interrupt.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait PartTiming {
    /// Returns the time since power-up \[us\].
    fn now_us(&self) -> u64;

    /// Waits for at least this time.
    async fn wait(&self, us: u32);

    /// Waits for the part's interrupt, at most for the time `us`, and returns true if it has come. If no interrupt is
    /// wired, waits for the whole time and returns true.
    async fn ready(&mut self, us: u32) -> bool {
        self.wait(us).await;
        true
    }

    /// Returns the time of the interrupt that ended the last [`ready`](Self::ready) \[us\]; none if there was no
    /// interrupt.
    fn ready_us(&self) -> Option<u64> {
        None
    }
}

/// Driver of a part on a bus.
#[derive(Debug)]
pub struct Driver<P, B, T> {
    part: P,
    bus: B,
    timing: T,
    /// True while the part is set up.
    is_up: bool,
    /// True if the last set-up was complete and its settings have not been changed since.
    was_set_up: bool,
    /// Number of consecutive faults, and the last fault.
    faults: u32,
    last_fault: Option<PartFault>,
    /// Number of cycles since the last register check, and the checked step's index.
    cycles: u32,
    looks: usize,
    /// Time of the interrupt in this cycle \[us\].
    ready_us: Option<u64>,
    last: [u8; READ_MAX],
    /// Number of consecutive equal answers.
    equals: u32,
}

impl<P: SensorPart, B: Registers, T: PartTiming> Driver<P, B, T> {
    /// Creates the driver. The first [`Driver::reading`] sets the part up.
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

    /// True if the part is set up and reads without a fault.
    pub fn works(&self) -> bool {
        self.is_up && self.faults == 0
    }

    /// Returns the next reading, with the time of the part's interrupt, or without one the time at which the transfer
    /// began. Sets the part up before the first reading. After [`FAULTS_MAX`] consecutive faults, pauses and sets the
    /// part up again, unless the part only failed to answer and then still has its settings.
    ///
    /// # Errors
    /// The fault of this cycle or of the set-up. The caller may simply call it again.
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

    /// Makes the next reading set the part up, without a pause.
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

    /// Pauses after faults. Meanwhile it checks a part that did not answer: if the part answers again with all its
    /// settings, only its wiring had failed. Then it returns true at once.
    async fn comes_back(&mut self) -> bool {
        if self.faults == 0 {
            return false;
        }
        // A part that is late or stuck is not checked, since its registers may be correct, and only a set-up helps.
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
                // One fault stays, so that the part does not count as working before it has given a reading.
                (self.is_up, self.faults, self.cycles) = (true, 1, 0);
                return true;
            }
        }
        false
    }

    /// True if identity and settings of the part are unchanged; false if its script checks neither.
    async fn is_as_set(&mut self) -> Result<bool, PartFault> {
        let mut is_seen = false;
        for (at, step) in P::SETUP.iter().enumerate() {
            if let ScriptStep::Identify(..) = step {
                self.step(step).await?;
                is_seen = true;
            }
            self.look(at).await?;
            is_seen |= register_set_by(step).is_some();
        }
        Ok(is_seen)
    }

    /// Runs the set-up and reads the settings back.
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
        // One fault stays until the first reading. The count of equal answers stays until a reading changes.
        (self.is_up, self.was_set_up, self.faults, self.cycles) = (true, true, self.faults.min(1), 0);
        Ok(())
    }

    async fn cycle(&mut self) -> Result<Option<Stamped<P::Reading>>, PartFault> {
        self.ready_us = None;
        self.cycles += 1;
        if self.cycles >= CYCLES_A_LOOK {
            let at = (self.looks + 1) % P::SETUP.len().max(1);
            // A wrong register is checked again in the next cycle, since a part may go on reading with its settings
            // lost.
            self.look(at).await?;
            (self.cycles, self.looks) = (0, at);
        }
        let mut complete = None;
        for step in P::CYCLE {
            // Runs the whole script: a step after the reading may detect a failure.
            complete = self.step(step).await?.or(complete);
        }
        Ok(complete)
    }

    /// Reads back the register of a set-up step, if the step is one that is read back.
    async fn look(&mut self, at: usize) -> Result<(), PartFault> {
        let Some(step) = P::SETUP.get(at) else { return Ok(()) };
        let Some(register) = register_set_by(step) else { return Ok(()) };
        // Skips a register that a later step sets again.
        if P::SETUP.iter().skip(at + 1).any(|later| register_set_by(later) == Some(register)) {
            return Ok(());
        }
        let value = self.value(step).await?;
        if self.byte(register).await? == value { Ok(()) } else { Err(PartFault::Register(register)) }
    }

    /// Returns the value that a set-up step writes to its register.
    async fn value(&mut self, step: &ScriptStep) -> Result<u8, PartFault> {
        Ok(match *step {
            ScriptStep::Set(_, value) => value,
            ScriptStep::SetLike(_, value, mask, other) => value | self.byte(other).await? & mask,
            _ => 0,
        })
    }

    pub(crate) async fn step(&mut self, step: &ScriptStep) -> Result<Option<Stamped<P::Reading>>, PartFault> {
        match *step {
            ScriptStep::Identify(register, identities) => {
                let identity = self.byte(register).await?;
                // Compares with the list first, since the identity of a QMC5883L is 0xFF.
                match identity {
                    _ if identities.contains(&identity) => (),
                    0x00 | 0xFF => return Err(PartFault::Silent),
                    _ => return Err(PartFault::Identity(identity)),
                }
            }
            ScriptStep::Set(register, value) | ScriptStep::Write(register, value) => {
                self.write(register, &[value]).await?
            }
            ScriptStep::SetLike(register, ..) => {
                let value = self.value(step).await?;
                self.write(register, &[value]).await?;
            }
            ScriptStep::WriteAll(register, bytes) => self.write(register, bytes).await?,
            ScriptStep::Read(register, length) => return self.read(register, length).await,
            ScriptStep::Await(register, mask, value, ms) => {
                let mut looks = ms;
                while self.byte(register).await? & mask != value {
                    looks = looks.checked_sub(1).ok_or(PartFault::Late)?;
                    self.timing.wait(AWAIT_US).await;
                }
            }
            ScriptStep::Wait(us) => self.timing.wait(us).await,
            ScriptStep::Ready(us) => {
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

/// Returns the register that a step sets and that is read back; none for other steps.
fn register_set_by(step: &ScriptStep) -> Option<u8> {
    match *step {
        ScriptStep::Set(register, _) | ScriptStep::SetLike(register, ..) => Some(register),
        _ => None,
    }
}

/// Waits for a transfer, with a time limit.
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
