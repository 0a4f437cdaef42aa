//! Answers to commands. Each command is answered exactly once, to its sender.

use afbc_flight_core::inbox::QUEUE_MAX;
use afbc_flight_core::{Request, Ticketed};
use afbc_guidance::{Order, OrderRefusal};
use afbc_mavlink::{Address, CommandResult, Downlink};
use heapless::Deque;

/// Largest number of different queued answers, besides those of flight core and guidance. A further command is counted,
/// but neither carried out nor answered, as if it had been lost.
pub const ANSWERS_MAX: usize = 48;
/// From this number of queued answers on, further commands are refused as [`BUSY`].
pub const BUSY_FROM: usize = 32;
/// Number of answers sent per tick, more than commands can arrive in a millisecond at 921,600 baud.
pub const ANSWERS_PER_TICK: usize = 3;
/// An unanswered request counts as failed after this time \[us\]: the report with its answer must have been lost.
pub const FORGOTTEN_US: u64 = 100_000;
/// Time between "in progress" answers \[us\]. Stations give up after half a second without one.
pub const IN_PROGRESS_US: u64 = 250_000;
/// Reason number: too many requests are queued. For requests that do not reach the flight core.
pub const BUSY: i32 = 0;
/// Reason number: another station is in control.
pub const NOT_IN_CONTROL: i32 = 64;
/// Reason number: the origin of the local frame is not known.
pub const NO_ORIGIN: i32 = 65;
/// Reason number: the message has no known content and cannot be sent now.
pub const NOT_KNOWN: i32 = 66;

/// Reason number: the vehicle is being calibrated.
pub const CALIBRATES: i32 = 67;

/// Keeps track of commands until they are answered.
#[derive(Default)]
pub struct Commands {
    /// Requests that the flight core has not answered, indexed by ticket. Ticket 0 is reserved for [`Request::Kill`],
    /// so that it is always accepted. The array limits open requests, so that the flight core's inbox never overflows.
    asked: [Option<OpenCommand>; QUEUE_MAX],
    /// Orders that the guidance has not answered, indexed by ticket. The guidance's queue cannot overflow either.
    ordered: [Option<OpenCommand>; QUEUE_MAX],
    /// The command in progress, and the time of its last "in progress" answer \[us\].
    in_progress: Option<(OpenCommand, u64)>,
    waiting: Deque<QueuedAnswer, ANSWERS_MAX>,
    unanswered: u32,
}

/// A queued answer.
struct QueuedAnswer {
    command: u16,
    answer: CommandResult,
    to: Address,
    /// Number of commands that are to get this answer.
    times: u16,
}

/// A command that has not been answered yet.
#[derive(Clone, Copy)]
struct OpenCommand {
    /// Number of the command; none for a message that needs no answer.
    command: Option<u16>,
    from: Address,
    at_us: u64,
}

impl Commands {
    /// Returns a request to the flight core for a command. If too many are open, answers the command and returns none.
    pub fn ask(&mut self, request: Request, command: u16, from: Address, at_us: u64) -> Option<Ticketed<Request>> {
        let kills = request == Request::Kill;
        let mut places = self.asked.iter_mut().zip(0..).filter(|(_, ticket)| (*ticket == 0) == kills);
        match places.find(|(place, _)| place.is_none()) {
            Some((place, ticket)) => {
                *place = Some(OpenCommand { command: Some(command), from, at_us });
                Some(Ticketed { value: request, ticket })
            }
            None => {
                // A kill is open already: the motors are about to stop.
                self.answer(command, if kills { CommandResult::Accepted } else { CommandResult::Refused(BUSY) }, from);
                None
            }
        }
    }

    /// Returns an order to the guidance for a command, or for a message that needs no answer. If too many are open,
    /// answers the command and returns none.
    pub fn order(&mut self, order: Order, command: Option<u16>, from: Address, at_us: u64) -> Option<Ticketed<Order>> {
        match self.ordered.iter_mut().zip(0..).find(|(place, _)| place.is_none()) {
            Some((place, ticket)) => {
                *place = Some(OpenCommand { command, from, at_us });
                Some(Ticketed { value: order, ticket })
            }
            None => {
                command.into_iter().for_each(|command| self.answer(command, CommandResult::Refused(BUSY), from));
                None
            }
        }
    }

    /// Begins a lasting command: "in progress" is sent until it is [ended](Self::end). If another one lasts already,
    /// refuses the command and returns false.
    pub fn begin(&mut self, command: u16, from: Address, at_us: u64) -> bool {
        let is_free = self.in_progress.is_none();
        if is_free {
            self.answer(command, CommandResult::InProgress, from);
            self.in_progress = Some((OpenCommand { command: Some(command), from, at_us }, at_us));
        } else {
            self.answer(command, CommandResult::Refused(BUSY), from);
        }
        is_free
    }

    /// Ends the lasting command.
    pub fn end(&mut self, answer: CommandResult) {
        if let Some((OpenCommand { command: Some(command), from, .. }, _)) = self.in_progress.take() {
            self.answer(command, answer, from);
        }
    }

    /// Returns true if another command may be carried out because its answer can be queued.
    pub fn has_room(&self) -> bool {
        self.waiting.len() < BUSY_FROM
    }

    /// Queues the answer to a command.
    pub fn answer(&mut self, command: u16, answer: CommandResult, to: Address) {
        let same = |waits: &&mut QueuedAnswer| {
            (waits.command, waits.answer, waits.to) == (command, answer, to) && waits.times < u16::MAX
        };
        if let Some(waits) = self.waiting.iter_mut().find(same) {
            waits.times += 1;
        } else if self.waiting.push_back(QueuedAnswer { command, answer, to, times: 1 }).is_err() {
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }

    /// Converts the flight core's answer to a message to the command's sender.
    pub fn settle(&mut self, answer: afbc_flight_core::RequestAnswer) -> Option<Downlink> {
        let open = self.asked.get_mut(usize::from(answer.ticket))?.take()?;
        open.answered(
            answer.result.map_or_else(|refusal| CommandResult::Refused(refusal as i32), |()| CommandResult::Accepted),
        )
    }

    /// Converts the guidance's answer to a message to the command's sender.
    pub fn settle_order(&mut self, ticket: u8, result: Result<(), OrderRefusal>) -> Option<Downlink> {
        let open = self.ordered.get_mut(usize::from(ticket))?.take()?;
        open.answered(
            result.map_or_else(|declined| CommandResult::Refused(declined as i32), |()| CommandResult::Accepted),
        )
    }

    /// Returns the next answer to be sent at `now_us`.
    pub fn next(&mut self, now_us: u64) -> Option<Downlink> {
        if let Some(QueuedAnswer { command, answer, to, times }) = self.waiting.front_mut() {
            let next = Downlink::CommandAck { command: *command, answer: *answer, to: *to };
            *times -= 1;
            if *times == 0 {
                self.waiting.pop_front();
            }
            return Some(next);
        }
        let forgotten = |open: &mut OpenCommand| now_us.saturating_sub(open.at_us) > FORGOTTEN_US;
        let mut open = self.asked.iter_mut().chain(&mut self.ordered);
        // A lost message that needs no answer is dropped silently.
        while let Some(lost) = open.find_map(|place| place.take_if(forgotten)) {
            if let Some(answer) = lost.answered(CommandResult::Failed) {
                return Some(answer);
            }
        }
        match &mut self.in_progress {
            Some((open, told_us)) if now_us.saturating_sub(*told_us) >= IN_PROGRESS_US => {
                *told_us = now_us;
                open.answered(CommandResult::InProgress)
            }
            _ => None,
        }
    }

    /// Returns the number of commands that were neither carried out nor answered.
    pub fn unanswered(&self) -> u32 {
        self.unanswered
    }
}

impl OpenCommand {
    fn answered(self, answer: CommandResult) -> Option<Downlink> {
        self.command.map(|command| Downlink::CommandAck { command, answer, to: self.from })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afbc_guidance::FlightMode;

    const A: Address = Address { system: 255, component: 190 };
    const B: Address = Address { system: 245, component: 190 };

    fn answered(command: u16, answer: CommandResult, to: Address) -> Option<Downlink> {
        Some(Downlink::CommandAck { command, answer, to })
    }

    #[test]
    fn orders_are_answered_to_their_senders() {
        let mut commands = Commands::default();
        let order = Order::Select(FlightMode::Land);
        let give = |commands: &mut Commands, from| commands.order(order, Some(21), from, 0).map(|it| it.ticket);
        assert_eq!([A, B, A, B].map(|from| give(&mut commands, from)), [Some(0), Some(1), Some(2), Some(3)]);
        assert_eq!(give(&mut commands, A), None);
        assert_eq!(commands.next(0), answered(21, CommandResult::Refused(BUSY), A));
        assert_eq!(commands.settle_order(1, Ok(())), answered(21, CommandResult::Accepted, B));
        assert_eq!(commands.settle_order(1, Ok(())), None, "once");
        let declined = OrderRefusal::NotArmed;
        assert_eq!(commands.settle_order(0, Err(declined)), answered(21, CommandResult::Refused(declined as i32), A));
        assert_eq!(commands.settle_order(77, Ok(())), None);
        assert_eq!(commands.next(FORGOTTEN_US), None);
        assert_eq!(commands.next(FORGOTTEN_US + 1), answered(21, CommandResult::Failed, A));
        assert_eq!(commands.next(FORGOTTEN_US + 1), answered(21, CommandResult::Failed, B));
        assert_eq!(commands.next(FORGOTTEN_US + 1), None);
    }

    #[test]
    fn a_message_that_is_no_command_is_not_answered() {
        let mut commands = Commands::default();
        assert!(commands.order(Order::Resume(1), None, A, 0).is_some());
        assert!(commands.order(Order::Resume(2), None, A, 0).is_some());
        assert_eq!(commands.settle_order(0, Ok(())), None);
        assert_eq!(commands.next(FORGOTTEN_US + 1), None);
    }

    #[test]
    fn a_command_that_lasts_is_in_progress_until_it_ends() {
        let mut commands = Commands::default();
        assert!(commands.begin(245, A, 0));
        assert!(!commands.begin(245, B, 10));
        assert_eq!(commands.next(20), answered(245, CommandResult::InProgress, A));
        assert_eq!(commands.next(20), answered(245, CommandResult::Refused(BUSY), B));
        assert_eq!(commands.next(IN_PROGRESS_US - 1), None);
        assert_eq!(commands.next(IN_PROGRESS_US), answered(245, CommandResult::InProgress, A));
        assert_eq!(commands.next(IN_PROGRESS_US), None);
        commands.end(CommandResult::Accepted);
        commands.end(CommandResult::Accepted);
        assert_eq!(commands.next(3 * IN_PROGRESS_US), answered(245, CommandResult::Accepted, A));
        assert_eq!(commands.next(9 * IN_PROGRESS_US), None);
    }
}
