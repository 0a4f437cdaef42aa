//! Answers to commands, each to its sender.

use afbc_flight_core::inbox::REQUESTS_MAX;
use afbc_flight_core::{Asked, Inbox, Request};
use afbc_link::{Address, Answer, Command, Downlink};
use heapless::Deque;

/// Largest number of queued answers, besides those of the flight core. Further commands are not answered, but counted.
pub const ANSWERS_MAX: usize = 32;
/// Answers sent per tick, more than commands can arrive in a millisecond at 921,600 baud.
pub const ANSWERS_PER_TICK: usize = 3;
/// Time after which a request without an answer counts as handled in a tick whose report was lost \[us\].
pub const FORGOTTEN_US: u64 = 100_000;
/// Number of the reason "too many requests are queued", for requests that do not reach the flight core.
pub const BUSY: i32 = 0;

/// Processes commands, and keeps track of the answers.
#[derive(Default)]
pub(crate) struct Answers {
    /// Requests that the flight core has not answered, indexed by ticket. The first place is reserved for
    /// [`Request::Kill`], so that it is always accepted. The flight core's inbox never overflows.
    asked: [Option<Open>; REQUESTS_MAX],
    waiting: Deque<Told, ANSWERS_MAX>,
    unanswered: u32,
}

/// A queued answer.
struct Told {
    command: u16,
    answer: Answer,
    to: Address,
}

/// A request that is not answered yet.
#[derive(Clone, Copy)]
struct Open {
    command: u16,
    from: Address,
    at_us: u64,
}

impl Answers {
    /// Puts the request of `command` into `inbox`, or answers commands that are no requests.
    pub(crate) fn hear(&mut self, command: Command, from: Address, at_us: u64, inbox: &mut Inbox) {
        let id = command.id();
        let request = match command {
            Command::Arm => Request::Arm,
            Command::Disarm => Request::Disarm,
            Command::Kill => Request::Kill,
            Command::Engage => Request::Engage,
            Command::Denied(_) => return self.answer(id, Answer::Denied, from),
            Command::Other(_) => return self.answer(id, Answer::Unsupported, from),
        };
        let kills = request == Request::Kill;
        let mut places = self.asked.iter_mut().zip(0..).filter(|(_, ticket)| (*ticket == 0) == kills);
        match places.find(|(place, _)| place.is_none()) {
            Some((place, ticket)) => {
                *place = Some(Open { command: id, from, at_us });
                inbox.request(Asked { request, ticket });
            }
            // The motors are about to be stopped already.
            None if kills => self.answer(id, Answer::Accepted, from),
            None => self.answer(id, Answer::Refused(BUSY), from),
        }
    }

    /// Converts the flight core's answer to a message, to its sender.
    pub(crate) fn settle(&mut self, answer: afbc_flight_core::Answer) -> Option<Downlink> {
        let Open { command, from: to, .. } = self.asked.get_mut(usize::from(answer.ticket))?.take()?;
        let answer = answer.result.map_or_else(|refusal| Answer::Refused(refusal as i32), |()| Answer::Accepted);
        Some(Downlink::Answer { command, answer, to })
    }

    /// Returns the next answer to be sent at `now_us`.
    pub(crate) fn next(&mut self, now_us: u64) -> Option<Downlink> {
        let told = self.waiting.pop_front().or_else(|| {
            let forgotten = |open: &mut Open| now_us.saturating_sub(open.at_us) > FORGOTTEN_US;
            let Open { command, from: to, .. } = self.asked.iter_mut().find_map(|place| place.take_if(forgotten))?;
            Some(Told { command, answer: Answer::Failed, to })
        });
        told.map(|Told { command, answer, to }| Downlink::Answer { command, answer, to })
    }

    /// Returns the number of commands that were not answered.
    pub(crate) fn unanswered(&self) -> u32 {
        self.unanswered
    }

    fn answer(&mut self, command: u16, answer: Answer, to: Address) {
        if self.waiting.push_back(Told { command, answer, to }).is_err() {
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }
}
