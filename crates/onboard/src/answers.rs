//! An answer for everyone who asks.

use afbc_flight_core::inbox::REQUESTS_MAX;
use afbc_flight_core::{Asked, Inbox, Request};
use afbc_link::{Address, Answer, Command, Downlink};
use heapless::Deque;

/// Most answers that wait to be sent, beside those of the flight core. Whoever asks for more at once gets none, which is
/// counted.
pub const ANSWERS_MAX: usize = 32;
/// Most of them that go out after one tick: more than commands can come in a millisecond at 921,600 baud.
pub const ANSWERS_PER_TICK: usize = 3;
/// A request that has no answer for this long was dealt with in a tick that went unreported \[us\].
pub const FORGOTTEN_US: u64 = 100_000;
/// The number of the reason for which a request is refused before it reaches the flight core: too many wait there.
pub const BUSY: i32 = 0;

/// Takes commands, and knows who is to be told what.
#[derive(Default)]
pub(crate) struct Answers {
    /// What the flight core has been asked and has not answered; the place is the ticket. The first is for
    /// [`Request::Kill`], which never has to wait for a place. So the flight core's inbox never overflows.
    asked: [Option<Open>; REQUESTS_MAX],
    waiting: Deque<Told, ANSWERS_MAX>,
    unanswered: u32,
}

/// An answer that waits.
struct Told {
    command: u16,
    answer: Answer,
    to: Address,
}

/// A request without an answer.
#[derive(Clone, Copy)]
struct Open {
    command: u16,
    from: Address,
    at_us: u64,
}

impl Answers {
    /// Leaves what `command` asks of the flight core in `inbox`, and answers the rest.
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
            // One that stops the motors is on its way.
            None if kills => self.answer(id, Answer::Accepted, from),
            None => self.answer(id, Answer::Refused(BUSY), from),
        }
    }

    /// What the flight core answered in a tick, and to whom.
    pub(crate) fn settle(&mut self, answer: afbc_flight_core::Answer) -> Option<Downlink> {
        let Open { command, from: to, .. } = self.asked.get_mut(usize::from(answer.ticket))?.take()?;
        let answer = answer.result.map_or_else(|refusal| Answer::Refused(refusal as i32), |()| Answer::Accepted);
        Some(Downlink::Answer { command, answer, to })
    }

    /// The next answer to be sent at `now_us`.
    pub(crate) fn next(&mut self, now_us: u64) -> Option<Downlink> {
        let told = self.waiting.pop_front().or_else(|| {
            let forgotten = |open: &mut Open| now_us.saturating_sub(open.at_us) > FORGOTTEN_US;
            let Open { command, from: to, .. } = self.asked.iter_mut().find_map(|place| place.take_if(forgotten))?;
            Some(Told { command, answer: Answer::Failed, to })
        });
        told.map(|Told { command, answer, to }| Downlink::Answer { command, answer, to })
    }

    /// Commands that got no answer.
    pub(crate) fn unanswered(&self) -> u32 {
        self.unanswered
    }

    fn answer(&mut self, command: u16, answer: Answer, to: Address) {
        if self.waiting.push_back(Told { command, answer, to }).is_err() {
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }
}
