//! The mission: upload, download and deletion by MAVLink's mission protocol, and what the guidance gets of it.
//!
//! An upload takes the place of the mission only once it is complete and every item is valid. Downloads have no state:
//! any number of stations may read at once. Fences and rally points are always empty.

mod items;
mod upload;

pub use items::{ITEMS_MAX, Invalid, check, to_guidance};

use crate::services::origin::EarthOrigin;
use crate::services::texts::Words;
use afbc_guidance::Leg;
use afbc_link::{Address, Mission, MissionCurrent, MissionItem, MissionResult, Plan};
use heapless::{Deque, Vec};
use upload::Upload;

/// Most messages that wait to be sent; the protocol repeats what is lost.
const OUT_MAX: usize = 8;

/// The mission and its transfer.
#[derive(Clone, Debug, Default)]
pub struct Missions {
    items: Vec<MissionItem, ITEMS_MAX>,
    /// Which upload it is.
    number: u16,
    upload: Option<Upload>,
    /// Station, number of items and outcome of the last upload, in case its answer is lost.
    done: Option<(Address, u16)>,
    out: Deque<(Mission, Address), OUT_MAX>,
}

/// What a message of a station leads to, besides answers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// A text for everyone.
    pub text: Option<Words>,
    /// The item to go on with.
    pub resume: Option<u16>,
}

impl Missions {
    /// Handles a message of `from`, which is `in_control` or not.
    pub fn hear(&mut self, message: Mission, from: Address, in_control: bool, now_us: u64) -> Heard {
        let mut heard = Heard::default();
        match message {
            Mission::List(plan) => self.say(Mission::Count(self.count(plan), plan), from),
            Mission::Request(number, plan) => match self.item(number, plan) {
                Some(item) => self.say(Mission::Item(item, plan), from),
                None => self.acknowledge(MissionResult::INVALID_SEQUENCE, plan, from),
            },
            Mission::Count(_, plan) | Mission::Clear(plan) if !in_control => {
                self.acknowledge(MissionResult::DENIED, plan, from);
            }
            Mission::Count(count, plan) => heard.text = self.begin(count, plan, from, now_us),
            Mission::Item(item, plan) => heard.text = self.take(item, plan, from, now_us),
            // A part of a list, which hardly any station wants any more.
            Mission::Part(_, plan) => self.acknowledge(MissionResult::UNSUPPORTED, plan, from),
            Mission::Clear(plan) => {
                if plan == Plan::MISSION || plan == Plan::ALL {
                    self.clear();
                }
                let known = [Plan::MISSION, Plan::FENCE, Plan::RALLY, Plan::ALL].contains(&plan);
                let result = if known { MissionResult::ACCEPTED } else { MissionResult::UNSUPPORTED };
                self.acknowledge(result, plan, from);
            }
            Mission::SetCurrent(number) if in_control => {
                if usize::from(number) < self.items.len() {
                    heard.resume = Some(number);
                } else {
                    heard.text = Some(Words::of("no mission item ").number(number.into()));
                }
            }
            // The station gives its upload up.
            Mission::Ack(..) if self.upload.as_ref().is_some_and(|upload| upload.from == from) => self.upload = None,
            Mission::SetCurrent(_) | Mission::Ack(..) | Mission::Current(_) | Mission::Reached(_) => (),
        }
        heard
    }

    /// Repeats what is unanswered for too long at `now_us`; returns a text if an upload is given up.
    pub fn tick(&mut self, now_us: u64) -> Option<Words> {
        let upload = self.upload.as_mut()?;
        let from = upload.from;
        match upload.remind(now_us) {
            upload::Reminder::None => None,
            upload::Reminder::Ask(number) => {
                self.say(Mission::Request(number, Plan::MISSION), from);
                None
            }
            upload::Reminder::GiveUp => {
                self.upload = None;
                self.acknowledge(MissionResult::CANCELLED, Plan::MISSION, from);
                Some(Words::of("mission upload given up: no answer"))
            }
        }
    }

    /// Returns the next message to be sent, with its receiver.
    pub fn next_message(&mut self) -> Option<(Mission, Address)> {
        self.out.pop_front()
    }

    /// Returns the item that the guidance wants, in the local frame.
    pub fn leg(&self, number: u16, origin: Option<&EarthOrigin>, home_m: f32) -> Option<Leg> {
        let item = to_guidance(self.items.get(usize::from(number))?, origin, home_m)?;
        Some(Leg { number, upload: self.number, item, is_last: usize::from(number) + 1 == self.items.len() })
    }

    /// Returns the items.
    pub fn items(&self) -> &[MissionItem] {
        &self.items
    }

    /// Returns MISSION_CURRENT, when the guidance flies, or flew last, `item`, in mission mode or not.
    pub fn current(&self, item: Option<u16>, reached: Option<u16>, flies: bool) -> MissionCurrent {
        let total = self.items.len() as u16;
        let last = total.checked_sub(1);
        let state = match (last, item) {
            (None, _) => 1,
            _ if flies => 3,
            (_, None) => 2,
            (last, _) if reached == last => 5,
            _ => 4,
        };
        MissionCurrent { number: item.unwrap_or(0), total, state, mode: if flies { 1 } else { 2 } }
    }

    fn count(&self, plan: Plan) -> u16 {
        if plan == Plan::MISSION { self.items.len() as u16 } else { 0 }
    }

    fn item(&self, number: u16, plan: Plan) -> Option<MissionItem> {
        self.items.get(usize::from(number)).filter(|_| plan == Plan::MISSION).copied()
    }

    fn begin(&mut self, count: u16, plan: Plan, from: Address, now_us: u64) -> Option<Words> {
        let result = match plan {
            Plan::MISSION if self.upload.as_ref().is_some_and(|upload| upload.from != from) => MissionResult::DENIED,
            Plan::MISSION if usize::from(count) > ITEMS_MAX => MissionResult::NO_SPACE,
            Plan::MISSION if count == 0 => {
                self.clear();
                MissionResult::ACCEPTED
            }
            Plan::MISSION => {
                (self.upload, self.done) = (Some(Upload::new(count, from, now_us)), None);
                self.say(Mission::Request(0, plan), from);
                return None;
            }
            // Empty lists, as they are.
            Plan::FENCE | Plan::RALLY if count == 0 => MissionResult::ACCEPTED,
            _ => MissionResult::UNSUPPORTED,
        };
        self.acknowledge(result, plan, from);
        let room = Words::of("mission refused: more than ").number(ITEMS_MAX as u32).and(" items");
        (result == MissionResult::NO_SPACE).then_some(room)
    }

    fn take(&mut self, item: MissionItem, plan: Plan, from: Address, now_us: u64) -> Option<Words> {
        let uploads = self.upload.as_mut().filter(|upload| upload.from == from && plan == Plan::MISSION);
        let Some(upload) = uploads else {
            // The last item again: the answer to it was lost.
            let is_done = plan == Plan::MISSION && self.done == Some((from, item.number));
            let result = if is_done { MissionResult::ACCEPTED } else { MissionResult::INVALID_SEQUENCE };
            self.acknowledge(result, plan, from);
            return None;
        };
        if item.number != upload.wanted() {
            // An item twice, or one too early. The one that is wanted was asked for, and will be again.
            return None;
        }
        if let Err(Invalid { result, reason }) = check(&item) {
            self.upload = None;
            self.acknowledge(result, plan, from);
            return Some(Words::of("mission item ").number(item.number.into()).and(": ").and(reason));
        }
        match upload.put(item, now_us) {
            Some(number) => self.say(Mission::Request(number, plan), from),
            None => {
                // In place: a copy would take much of the stack.
                self.items.clear();
                self.items.extend_from_slice(&upload.items).ok();
                self.renew();
                self.done = Some((from, item.number));
                self.acknowledge(MissionResult::ACCEPTED, plan, from);
            }
        }
        None
    }

    /// Notes that there is another mission.
    fn renew(&mut self) {
        (self.number, self.upload, self.done) = (self.number.wrapping_add(1), None, None);
    }

    fn clear(&mut self) {
        self.items.clear();
        self.renew();
    }

    fn acknowledge(&mut self, result: MissionResult, plan: Plan, to: Address) {
        self.say(Mission::Ack(result, plan), to);
    }

    fn say(&mut self, message: Mission, to: Address) {
        self.out.push_back((message, to)).ok();
    }
}

#[cfg(test)]
mod tests;
