//! Plans: mission, geofence and rally points. Handles their upload, download and deletion by MAVLink's mission
//! protocol, and gives the guidance the mission's items.
//!
//! An upload replaces the plan only once it is complete and every item is valid. A download has no state, so any number
//! of stations may read at once. The plans share room for [`ITEMS_MAX`] items.

mod jumps;
mod plans;
mod upload;

pub use crate::services::items::{ITEMS_MAX, Invalid, check, to_guidance};

use crate::services::fence;
use crate::services::items::{FAR, check_jumps, check_rally, stop_m};
use crate::services::origin::EarthOrigin;
use crate::services::texts::Words;
use afbc_guidance::{FailsafeSettings, Item, OrderRefusal, RequestedItem};
use afbc_mavlink::{Address, MissionCurrent, MissionItem, MissionMessage, MissionResult, MissionType};
use heapless::Deque;
use jumps::Jumps;
use nalgebra::{Vector2, Vector3};
use plans::PlanItems;
use upload::Upload;

/// Largest number of queued messages. The protocol repeats lost messages.
const OUT_MAX: usize = 8;

/// Position data with which plans are checked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surroundings {
    /// Origin of the local frame, if known.
    pub origin: Option<EarthOrigin>,
    /// Position of the vehicle, if known \[m\].
    pub here_m: Option<Vector2<f32>>,
    /// Home position, if set \[m\].
    pub home_m: Option<Vector3<f32>>,
    /// Radius and height of the cylindrical geofence around home \[m\]; 0 for none.
    pub cylinder_m: [f32; 2],
}

/// The plans and their transfer.
#[derive(Clone, Debug, Default)]
pub struct Missions {
    plans: PlanItems,
    /// Number of the mission's upload.
    number: u16,
    /// Item at which the mission ends early.
    last: Option<u16>,
    jumps: Jumps,
    upload: Option<Upload>,
    /// Station, plan and last item of the last upload, in case its acknowledgement is lost.
    done: Option<(Address, MissionType, u16)>,
    out: Deque<(MissionMessage, Address), OUT_MAX>,
}

/// Results of a station's message, besides answers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Heard {
    /// Text for all stations.
    pub text: Option<Words>,
    /// Mission item to continue with.
    pub resume: Option<u16>,
    /// True if the geofence has changed.
    pub fence: bool,
}

impl Missions {
    /// Handles a message of `from`. `in_control` is true if that station is in control.
    pub fn hear(
        &mut self,
        message: MissionMessage,
        from: Address,
        in_control: bool,
        now_us: u64,
        around: &Surroundings,
    ) -> Heard {
        let mut heard = Heard::default();
        if self.out.is_full() {
            // The message is ignored as if lost: no request is carried out that cannot be answered.
            return heard;
        }
        match message {
            MissionMessage::List(plan) => self.say(MissionMessage::Count(self.count(plan), plan), from),
            MissionMessage::Request(number, plan) => match self.item(number, plan) {
                Some(item) => self.say(MissionMessage::Item(item, plan), from),
                None => self.acknowledge(MissionResult::INVALID_SEQUENCE, plan, from),
            },
            MissionMessage::Count(_, plan) | MissionMessage::Clear(plan) if !in_control => {
                self.acknowledge(MissionResult::DENIED, plan, from);
            }
            MissionMessage::Count(count, plan) => (heard.text, heard.fence) = self.begin(count, plan, from, now_us),
            MissionMessage::Item(item, plan) => (heard.text, heard.fence) = self.take(item, plan, from, now_us, around),
            // Partial lists are refused; hardly any station uses them.
            MissionMessage::PartialList(_, plan) => self.acknowledge(MissionResult::UNSUPPORTED, plan, from),
            MissionMessage::Clear(plan) => {
                for each in [MissionType::MISSION, MissionType::FENCE, MissionType::RALLY] {
                    if plan == each || plan == MissionType::ALL {
                        self.clear(each);
                        heard.fence |= each == MissionType::FENCE;
                    }
                }
                let known =
                    [MissionType::MISSION, MissionType::FENCE, MissionType::RALLY, MissionType::ALL].contains(&plan);
                let result = if known { MissionResult::ACCEPTED } else { MissionResult::UNSUPPORTED };
                self.acknowledge(result, plan, from);
            }
            MissionMessage::SetCurrent(number) if in_control => {
                if usize::from(number) < self.items().len() {
                    heard.resume = Some(number);
                } else {
                    heard.text = Some(Words::of("no mission item ").number(number.into()));
                }
            }
            // The station aborts its upload.
            MissionMessage::Ack(..) if self.upload.as_ref().is_some_and(|upload| upload.from == from) => {
                self.upload = None
            }
            MissionMessage::SetCurrent(_)
            | MissionMessage::Ack(..)
            | MissionMessage::Current(_)
            | MissionMessage::Reached(_) => (),
        }
        heard
    }

    /// Repeats an unanswered request at `now_us`. Returns a text if an upload is given up.
    pub fn tick(&mut self, now_us: u64) -> Option<Words> {
        let upload = self.upload.as_mut()?;
        let (from, plan) = (upload.from, upload.plan);
        match upload.remind(now_us) {
            upload::Reminder::None => None,
            upload::Reminder::Ask(number) => {
                self.say(MissionMessage::Request(number, plan), from);
                None
            }
            upload::Reminder::GiveUp => {
                self.upload = None;
                self.acknowledge(MissionResult::CANCELLED, plan, from);
                Some(Words::of(name(plan)).and(" upload given up: station does not answer"))
            }
        }
    }

    /// Returns the next message to be sent, with its receiver.
    pub fn next_message(&mut self) -> Option<(MissionMessage, Address)> {
        self.out.pop_front()
    }

    /// Returns a mission item for the guidance, in the local frame.
    pub fn leg(&self, number: u16, origin: Option<&EarthOrigin>, home_m: f32) -> Option<RequestedItem> {
        let items = self.items();
        let of_station = items.get(usize::from(number))?;
        let mut item = to_guidance(of_station, origin, home_m)?;
        let mut is_last = usize::from(number) + 1 == items.len() || self.last == Some(number);
        if let Item::Jump(target) = &mut item {
            *target = self.jumps.next(of_station, *target);
            is_last &= usize::from(*target) == items.len();
        }
        Some(RequestedItem { number, upload: self.number, item, is_last })
    }

    /// Notes that the guidance has completed an item.
    pub fn reached(&mut self, number: u16) {
        if let Some(item) = self.plans.of(MissionType::MISSION).get(usize::from(number)) {
            self.jumps.made(item);
        }
    }

    /// Notes that the mission starts again.
    pub fn restart(&mut self) {
        self.jumps.clear();
    }

    /// Sets the item at which the mission ends; none for its last item. Returns true if this is a change.
    pub fn set_last(&mut self, last: Option<u16>) -> bool {
        core::mem::replace(&mut self.last, last) != last
    }

    /// Returns a text about the first mission item that cannot be flown now.
    pub fn problem(&self, around: &Surroundings) -> Option<Words> {
        let (number, invalid) = check_places(self.items(), self.fence(), around).err()?;
        let command = self.items().get(usize::from(number)).map_or(0, |item| item.command);
        Some(invalid.text(name(MissionType::MISSION), number, command))
    }

    /// Returns the items of the mission.
    pub fn items(&self) -> &[MissionItem] {
        self.plans.of(MissionType::MISSION)
    }

    /// Returns the items of the geofence.
    pub fn fence(&self) -> &[MissionItem] {
        self.plans.of(MissionType::FENCE)
    }

    /// Returns the rally points.
    pub fn rally(&self) -> &[MissionItem] {
        self.plans.of(MissionType::RALLY)
    }

    /// Returns the number of the mission's upload.
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Returns MISSION_CURRENT. `item` is the item flown now or last. `flies` is true while the mission is flown.
    pub fn current(&self, item: Option<u16>, reached: Option<u16>, flies: bool) -> MissionCurrent {
        let total = self.items().len() as u16;
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

    fn count(&self, plan: MissionType) -> u16 {
        self.plans.of(plan).len() as u16
    }

    fn item(&self, number: u16, plan: MissionType) -> Option<MissionItem> {
        self.plans.of(plan).get(usize::from(number)).copied()
    }

    /// Begins an upload. Returns a text, and true if the fence has changed.
    fn begin(&mut self, count: u16, plan: MissionType, from: Address, now_us: u64) -> (Option<Words>, bool) {
        let known = [MissionType::MISSION, MissionType::FENCE, MissionType::RALLY].contains(&plan);
        let room = self.plans.room(plan);
        let result = match count {
            _ if !known => MissionResult::UNSUPPORTED,
            _ if self.upload.as_ref().is_some_and(|upload| upload.from != from) => MissionResult::DENIED,
            0 => {
                self.clear(plan);
                MissionResult::ACCEPTED
            }
            _ if usize::from(count) > room => MissionResult::NO_SPACE,
            _ => {
                (self.upload, self.done) = (Some(Upload::new(plan, count, from, now_us)), None);
                self.say(MissionMessage::Request(0, plan), from);
                return (None, false);
            }
        };
        self.acknowledge(result, plan, from);
        let text = Words::of(name(plan)).and(" refused: room for ").number(room as u32).and(" items");
        let cleared = result == MissionResult::ACCEPTED && plan == MissionType::FENCE;
        ((result == MissionResult::NO_SPACE).then_some(text), cleared)
    }

    /// Takes an item of an upload. Returns a text, and true if the fence has changed.
    fn take(
        &mut self,
        item: MissionItem,
        plan: MissionType,
        from: Address,
        now_us: u64,
        around: &Surroundings,
    ) -> (Option<Words>, bool) {
        let uploads = self.upload.as_mut().filter(|upload| upload.from == from && upload.plan == plan);
        let Some(upload) = uploads else {
            // The last item was sent again because its acknowledgement was lost.
            let is_done = self.done == Some((from, plan, item.number));
            let result = if is_done { MissionResult::ACCEPTED } else { MissionResult::INVALID_SEQUENCE };
            self.acknowledge(result, plan, from);
            return (None, false);
        };
        if item.number != upload.wanted() {
            // The item is repeated or too early. The expected item was requested, and will be again.
            return (None, false);
        }
        let mut checked = match plan {
            MissionType::FENCE => fence::check_item(&item),
            MissionType::RALLY => check_rally(&item, around.origin.as_ref()),
            _ => check(&item),
        }
        .map_err(|invalid| (item.number, invalid));
        let next = if checked.is_ok() { upload.put(item, now_us) } else { None };
        if let Some(number) = next {
            self.say(MissionMessage::Request(number, plan), from);
            return (None, false);
        }
        if checked.is_ok() {
            checked = match plan {
                MissionType::FENCE => {
                    let chart = around.origin.map(|origin| origin.chart());
                    fence::check(&upload.items, chart.as_ref(), around.here_m)
                }
                MissionType::MISSION => check_jumps(&upload.items)
                    .and_then(|()| check_places(&upload.items, self.plans.of(MissionType::FENCE), around)),
                _ => Ok(()),
            };
        }
        if let Err((number, invalid)) = checked {
            self.upload = None;
            self.acknowledge(invalid.result, plan, from);
            return (Some(invalid.text(name(plan), number, item.command)), false);
        }
        // The items are replaced in place: a copy would need much stack.
        let fits = self.plans.replace(plan, &upload.items);
        self.upload = None;
        if plan == MissionType::MISSION && fits {
            self.renew();
        }
        self.done = fits.then_some((from, plan, item.number));
        self.acknowledge(if fits { MissionResult::ACCEPTED } else { MissionResult::NO_SPACE }, plan, from);
        (None, fits && plan == MissionType::FENCE)
    }

    /// Removes the items of a plan, and ends any upload.
    fn clear(&mut self, plan: MissionType) {
        self.plans.replace(plan, &[]);
        (self.upload, self.done) = (None, None);
        if plan == MissionType::MISSION {
            self.renew();
        }
    }

    /// Notes that the mission has changed.
    fn renew(&mut self) {
        self.number = self.number.wrapping_add(1);
        self.last = None;
        self.jumps.clear();
    }

    fn acknowledge(&mut self, result: MissionResult, plan: MissionType, to: Address) {
        self.say(MissionMessage::Ack(result, plan), to);
    }

    fn say(&mut self, message: MissionMessage, to: Address) {
        self.out.push_back((message, to)).ok();
    }
}

/// Checks that the guidance accepts each item of a mission, and that its place is inside the fence, if the place is
/// known.
fn check_places(items: &[MissionItem], fence: &[MissionItem], around: &Surroundings) -> Result<(), (u16, Invalid)> {
    let [fence_radius_m, fence_height_m] = around.cylinder_m;
    let (net, home_m) =
        (FailsafeSettings { fence_radius_m, fence_height_m, ..FailsafeSettings::DEFAULT }, around.home_m);
    let chart = around.origin.filter(|_| !fence.is_empty()).map(|origin| origin.chart());
    let flown = |item: &MissionItem| {
        let flown = to_guidance(item, around.origin.as_ref(), home_m.map_or(0.0, |home_m| home_m.z));
        flown.map_or(Ok(()), |flown| flown.check(&net, home_m.as_ref()))?;
        let stop_m = chart.as_ref().and_then(|chart| Some((chart, stop_m(item, chart)?)));
        let inside = stop_m.is_none_or(|(chart, stop_m)| fence::holds(fence, chart, stop_m));
        if inside { Ok(()) } else { Err(OrderRefusal::OutsideFence) }
    };
    let outside = Invalid { result: MissionResult::DENIED, reason: "outside the geofence" };
    items.iter().try_for_each(|item| {
        flown(item).map_err(|refusal| (item.number, if refusal == OrderRefusal::OutsideFence { outside } else { FAR }))
    })
}

/// Returns the name of a plan.
fn name(plan: MissionType) -> &'static str {
    match plan {
        MissionType::FENCE => "fence",
        MissionType::RALLY => "rally",
        _ => "mission",
    }
}

#[cfg(test)]
mod tests;
