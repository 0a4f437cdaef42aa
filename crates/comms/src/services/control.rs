//! Decides which station is in control.
//!
//! The first station that commands is in control, until it has been silent for a time or releases control. A station is
//! known by its system and component number: the link has no other proof of identity (`docs/security.md`).

use afbc_mavlink::{Address, ControlAnswer, ControlRequest, VehicleCommand};

/// Silence after which a station is no longer in control \[us\].
pub const SILENT_US: u64 = 10_000_000;
/// Number of refused stations that are remembered as informed.
const INFORMED_MAX: usize = 4;

/// The station in control, and the stations that were told about it.
#[derive(Clone, Copy, Debug)]
pub struct OperatorControl {
    silent_us: u64,
    /// The station in control, and when it was last heard \[us\].
    holder: Option<(Address, u64)>,
    /// Stations that were told that another station is in control. The oldest entry is overwritten.
    informed: [Option<Address>; INFORMED_MAX],
    /// Index in `informed` to be written next.
    next: usize,
}

/// The answer to a station that wants to command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlClaim {
    /// The station is in control.
    Granted,
    /// Another station is in control.
    Refused {
        /// The station in control.
        holder: Address,
        /// True if the station has not been informed yet.
        first_time: bool,
    },
}

impl Default for OperatorControl {
    fn default() -> Self {
        OperatorControl { silent_us: SILENT_US, holder: None, informed: [None; INFORMED_MAX], next: 0 }
    }
}

impl OperatorControl {
    /// Sets the silence after which a station is no longer in control \[us\].
    pub fn set_silence(&mut self, silent_us: u64) {
        self.silent_us = silent_us;
    }

    /// Returns the station in control at `now_us`.
    pub fn holder(&self, now_us: u64) -> Option<Address> {
        let heard = |(_, heard_us): &(Address, u64)| now_us.saturating_sub(*heard_us) <= self.silent_us;
        self.holder.filter(heard).map(|(holder, _)| holder)
    }

    /// Notes that a message of a station has arrived. Returns true if the station is in control. A holder that returns
    /// after a silence is in control again, unless another station has taken over.
    pub fn hear(&mut self, from: Address, now_us: u64) -> bool {
        let is_holder = self.holder.is_some_and(|(holder, _)| holder == from);
        if is_holder {
            self.holder = Some((from, now_us));
        }
        is_holder
    }

    /// Answers a station that wants to command. It takes control if nobody has it.
    pub fn claim(&mut self, from: Address, now_us: u64) -> ControlClaim {
        match self.holder(now_us) {
            Some(holder) if holder != from => ControlClaim::Refused { holder, first_time: self.is_first_refusal(from) },
            Some(_) => ControlClaim::Granted,
            None => {
                // The holder has changed, so every station is to be informed again.
                (self.holder, self.informed, self.next) = (Some((from, now_us)), [None; INFORMED_MAX], 0);
                ControlClaim::Granted
            }
        }
    }

    /// Answers CHANGE_OPERATOR_CONTROL.
    pub fn change(&mut self, request: ControlRequest, from: Address, now_us: u64) -> (ControlAnswer, ControlClaim) {
        let claim = match (request, self.holder(now_us)) {
            (ControlRequest::Release, None) => ControlClaim::Granted,
            (ControlRequest::Release, Some(holder)) if holder == from => {
                self.holder = None;
                ControlClaim::Granted
            }
            _ => self.claim(from, now_us),
        };
        let granted = claim == ControlClaim::Granted;
        (ControlAnswer { station: from.system, control: request, granted }, claim)
    }

    /// Returns true if a station has not been informed yet, and notes that it is now.
    fn is_first_refusal(&mut self, from: Address) -> bool {
        let first_time = !self.informed.contains(&Some(from));
        if first_time {
            if let Some(place) = self.informed.get_mut(self.next) {
                *place = Some(from);
            }
            self.next = (self.next + 1) % INFORMED_MAX;
        }
        first_time
    }
}

/// Returns true if only the station in control may give this command. Any station may send requests and may stop the
/// motors: [`VehicleCommand::Kill`] works in flight too, [`VehicleCommand::Disarm`] only on the ground.
pub fn is_needed_for(command: VehicleCommand) -> bool {
    match command {
        VehicleCommand::Arm
        | VehicleCommand::Engage
        | VehicleCommand::SelfTest
        | VehicleCommand::TakeOff(_)
        | VehicleCommand::Land
        | VehicleCommand::Return
        | VehicleCommand::SelectMode(_)
        | VehicleCommand::SelectStandardMode(_)
        | VehicleCommand::Reposition { .. }
        | VehicleCommand::Orbit { .. }
        | VehicleCommand::Speed(_)
        | VehicleCommand::Home(_)
        | VehicleCommand::StartMission(..)
        | VehicleCommand::SetCurrent(..)
        | VehicleCommand::Reboot(_)
        | VehicleCommand::Calibrate(_)
        | VehicleCommand::Storage(_) => true,
        VehicleCommand::Disarm
        | VehicleCommand::Kill
        | VehicleCommand::SetInterval { .. }
        | VehicleCommand::GetInterval(_)
        | VehicleCommand::RequestMessage { .. }
        | VehicleCommand::RequestProtocol
        | VehicleCommand::RequestCapabilities
        | VehicleCommand::CheckArming
        | VehicleCommand::StartLogStream
        | VehicleCommand::StopLogStream
        | VehicleCommand::Denied(_)
        | VehicleCommand::Other(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Address = Address { system: 255, component: 190 };
    const B: Address = Address { system: 245, component: 190 };

    #[test]
    fn the_first_one_is_in_control_until_it_is_silent() {
        let mut control = OperatorControl::default();
        assert_eq!(control.holder(0), None);
        assert_eq!(control.claim(A, 0), ControlClaim::Granted);
        assert_eq!(control.claim(B, 1), ControlClaim::Refused { holder: A, first_time: true });
        assert_eq!(control.claim(B, 2), ControlClaim::Refused { holder: A, first_time: false });
        assert!(control.hear(A, SILENT_US));
        assert!(!control.hear(B, SILENT_US));
        assert_eq!(control.claim(B, 2 * SILENT_US), ControlClaim::Refused { holder: A, first_time: false });
        let mut back = control;
        assert!(back.hear(A, 2 * SILENT_US + 1));
        assert!(matches!(back.claim(B, 2 * SILENT_US + 2), ControlClaim::Refused { holder: A, .. }));
        assert_eq!(control.claim(B, 2 * SILENT_US + 1), ControlClaim::Granted);
        assert!(!control.hear(A, 2 * SILENT_US + 2));
        assert_eq!(control.claim(A, 2 * SILENT_US + 2), ControlClaim::Refused { holder: B, first_time: true });
    }

    #[test]
    fn control_is_handed_over_by_its_holder_alone() {
        let mut control = OperatorControl::default();
        let granted = |request, from: Address| ControlAnswer { station: from.system, control: request, granted: true };
        assert_eq!(control.change(ControlRequest::Take, A, 0).0, granted(ControlRequest::Take, A));
        assert!(!control.change(ControlRequest::Take, B, 1).0.granted);
        assert!(!control.change(ControlRequest::Release, B, 2).0.granted);
        assert_eq!(control.holder(3), Some(A));
        assert_eq!(control.change(ControlRequest::Release, A, 4).0, granted(ControlRequest::Release, A));
        assert_eq!(control.holder(5), None);
        assert_eq!(control.change(ControlRequest::Take, B, 6).0, granted(ControlRequest::Take, B));
        assert_eq!(control.holder(7), Some(B));
    }

    /// Releasing control that nobody has is granted and does not take control.
    #[test]
    fn a_release_takes_nothing() {
        let mut control = OperatorControl::default();
        let (answer, claim) = control.change(ControlRequest::Release, B, 0);
        assert_eq!((answer.granted, answer.station, claim), (true, B.system, ControlClaim::Granted));
        assert_eq!(control.holder(0), None);
        assert_eq!(control.claim(A, 1), ControlClaim::Granted);
        // Releasing another station's control is refused and does not take control.
        let (answer, claim) = control.change(ControlRequest::Release, B, 2);
        assert_eq!((answer.granted, claim), (false, ControlClaim::Refused { holder: A, first_time: true }));
        assert_eq!(control.holder(2), Some(A));
    }

    /// Each station is informed once, unless more than `INFORMED_MAX` others have been informed since. A new holder is
    /// announced to all again.
    #[test]
    fn stations_are_informed_once() {
        let mut control = OperatorControl::default();
        control.claim(A, 0);
        let station = |system| Address { system, component: 1 };
        let informed = |control: &mut OperatorControl, system| match control.claim(station(system), 1) {
            ControlClaim::Refused { holder, first_time } => (holder, first_time),
            ControlClaim::Granted => (station(system), false),
        };
        for system in 1..=INFORMED_MAX as u8 {
            assert_eq!(informed(&mut control, system), (A, true));
        }
        for system in 1..=INFORMED_MAX as u8 {
            assert_eq!(informed(&mut control, system), (A, false));
        }
        // A further station overwrites the first station. When the first station returns, it overwrites the second.
        for system in [9, 1] {
            assert_eq!(informed(&mut control, system), (A, true));
        }
        assert_eq!([informed(&mut control, 3), informed(&mut control, 9)], [(A, false); 2]);
        assert_eq!(informed(&mut control, 2), (A, true));
        control.change(ControlRequest::Release, A, 2);
        control.claim(B, 3);
        assert_eq!(informed(&mut control, 9), (B, true));
    }

    #[test]
    fn silence_is_as_long_as_it_is_set() {
        let mut control = OperatorControl::default();
        control.set_silence(500);
        assert_eq!(control.claim(A, 1000), ControlClaim::Granted);
        for (now_us, holder) in [(1000, Some(A)), (1500, Some(A)), (1501, None)] {
            assert_eq!(control.holder(now_us), holder);
        }
        assert!(!control.hear(B, 1200) && control.hear(A, 1400));
        assert_eq!([1900, 1901].map(|now_us| control.holder(now_us)), [Some(A), None]);
    }
}
