//! Radio control, in addition to MAVLink stations.
//!
//! The pilot may arm, kill and switch modes even if a station is in control. While no receiver hears a pilot, the
//! station in control may send channels in place of a receiver (RC_CHANNELS_OVERRIDE). They are interpreted like a
//! receiver's.

use crate::comms::Comms;
use crate::services::sensors;
use crate::services::status::RadioStatus;
use crate::services::streams::id;
use crate::services::telemetry::compose;
use afbc_control::math::sqrt;
use afbc_flight_core::{Refusal, Request, Stamped, Ticketed};
use afbc_guidance::{FlightMode, Order};
use afbc_mavlink::{ChannelsOverride, Downlink, MavSeverity, Telemetry};
use afbc_onboard::{ControlInputs, give};
use afbc_rc::{
    CHANNELS, Channels, CrsfDecoder, CrsfFrame, CrsfTelemetry, LinkStatistics, PilotInputs, PilotNotice, PilotOutput,
    RadioLink, RadioPilot, RadioProtocol, RadioSettings, SILENT_US, SbusDecoder,
};
use heapless::Vec;

/// Ticket of the pilot's requests and orders. Refusals are announced to all stations; nobody waits for an answer.
const PILOT: u8 = 254;

/// Time between two telemetry frames to the transmitter \[us\]. Each of the four kinds is sent 2.5 times per second.
const TELEMETRY_US: u64 = 100_000;
/// Longest telemetry frame \[bytes\].
pub const RADIO_FRAME_MAX: usize = 64;

/// RSSI of a receiver that does not report its signal strength.
const RSSI_UNKNOWN: u8 = 255;

/// Channels that a station sends in place of a receiver.
#[derive(Clone, Debug, Default)]
struct Override {
    us: [u16; CHANNELS],
    /// Time at which each channel was sent last \[ms\].
    sent_ms: [u32; CHANNELS],
    link: RadioLink,
    pilot: RadioPilot,
}

/// State of the radio receiver and of the pilot's inputs.
#[derive(Clone, Debug, Default)]
pub struct RadioControl {
    overrides: Override,

    crsf: CrsfDecoder,
    sbus: SbusDecoder,
    link: RadioLink,
    pilot: RadioPilot,
    statistics: LinkStatistics,
    /// Time of the next telemetry frame \[us\], and its kind.
    next_us: u64,
    turn: u8,
}

impl RadioControl {
    /// Processes bytes of the receiver. After each frame, `act` is called with the pilot's inputs. To be called without
    /// bytes too, so that silence is noticed.
    fn receive(
        &mut self,
        bytes: &[u8],
        settings: &RadioSettings,
        inputs: &PilotInputs,
        act: &mut dyn FnMut(PilotOutput),
    ) {
        let RadioControl { crsf, sbus, link, pilot, statistics, .. } = self;
        let (now_us, bad) = (inputs.now_us, crsf.bad_frames() + sbus.bad_frames());
        match settings.receiver.protocol {
            RadioProtocol::Crsf => crsf.feed(bytes, now_us, |frame| match frame {
                CrsfFrame::Channels(channels) => {
                    link.take(&channels, now_us);
                    act(pilot.step(settings, link, inputs));
                }
                CrsfFrame::LinkStatistics(read) => *statistics = read,
            }),
            RadioProtocol::Sbus => sbus.feed(bytes, now_us, |frame| {
                match (frame.failsafe, frame.frame_lost) {
                    (true, _) => link.lose(),
                    (_, true) => link.refuse(),
                    _ => link.take(&frame.channels, now_us),
                }
                act(pilot.step(settings, link, inputs));
            }),
        }
        if crsf.bad_frames() + sbus.bad_frames() != bad {
            link.refuse();
        }
        act(pilot.step(settings, link, inputs));
    }

    /// Processes channels of the station in control. To be called after each [`receive`](Self::receive). They time out
    /// like a receiver's, and a pilot heard by the receiver takes precedence.
    fn relay(
        &mut self,
        news: Option<ChannelsOverride>,
        settings: &RadioSettings,
        inputs: &PilotInputs,
        act: &mut dyn FnMut(PilotOutput),
    ) {
        let now_us = inputs.now_us;
        let Override { us, sent_ms, link, pilot } = &mut self.overrides;
        if self.link.heard(now_us).is_some() {
            self.overrides = Override::default();
            return;
        }
        if let Some(news) = news {
            // The 32-bit time wraps after 49 days; only differences are used.
            let now_ms = (now_us / 1000) as u32;
            let mut refreshed = false;
            for (place, (us, sent_ms)) in us.iter_mut().zip(sent_ms).enumerate() {
                match news.channel(place) {
                    Some(new) => (*us, *sent_ms, refreshed) = (new, now_ms, true),
                    // A channel that the station no longer sends times out like a stick.
                    None if now_ms.wrapping_sub(*sent_ms) > (SILENT_US / 1000) as u32 => *us = 0,
                    None => (),
                }
            }
            if us.iter().all(|us| *us == 0) {
                link.lose();
            } else if refreshed {
                link.take(&Channels { us: *us }, now_us);
            }
        }
        let output = pilot.step(settings, link, inputs);
        // The sender of the channels need not be told that they arrive.
        let notice = output.notice.filter(|notice| *notice != PilotNotice::Heard);
        act(PilotOutput { notice, ..output });
    }

    /// Returns the channels that are in use.
    fn status(&self, settings: &RadioSettings, now_us: u64) -> Option<RadioStatus> {
        if let Some(channels) = self.link.heard(now_us) {
            let rssi = match settings.receiver.protocol {
                RadioProtocol::Crsf => (u32::from(self.statistics.quality_percent.min(100)) * 254 / 100) as u8,
                RadioProtocol::Sbus => RSSI_UNKNOWN,
            };
            return Some(RadioStatus { channels: *channels, rssi });
        }
        self.overrides.link.heard(now_us).map(|channels| RadioStatus { channels: *channels, rssi: RSSI_UNKNOWN })
    }

    /// Returns the quality of the radio link.
    pub fn statistics(&self) -> &LinkStatistics {
        &self.statistics
    }
}

impl Comms {
    /// Processes the radio receiver's bytes since the last tick. To be called after each tick, even without bytes.
    /// Returns new inputs for the control tick, if any, to be [merged](ControlInputs::merge).
    pub fn pilot(&mut self, radio: &mut RadioControl, bytes: &[u8], settings: &RadioSettings) -> Option<ControlInputs> {
        let (now_us, status) = (self.now_us, &self.status);
        let inputs = PilotInputs { now_us, armed: status.mode.armed(), mode: status.guided.mode };
        let faulty = sensors::faulty(&status.aux);
        let mut update = None;
        let news = self.overrides.take();
        let (texts, radio_us) = (&mut self.texts, &mut self.radio_us);
        let mut act = |output: PilotOutput| {
            let PilotOutput { sticks, request, order, notice } = output;
            let sticks = sticks.map(|sticks| settings.curves.shape(inputs.mode, &sticks));
            if let Some(notice) = notice {
                let severity = match notice {
                    PilotNotice::Heard => MavSeverity::MAV_SEVERITY_INFO,
                    _ => MavSeverity::MAV_SEVERITY_WARNING,
                };
                texts.put(severity, notice.text());
            }
            let mut request = request;
            let lands = matches!(order, Some(Order::Select(FlightMode::Land | FlightMode::Return)));
            if request == Some(Request::Arm) && lands {
                texts.put(MavSeverity::MAV_SEVERITY_WARNING, Refusal::WrongMode.reason());
                return;
            }
            if request == Some(Request::Arm)
                && let Some(text) = faulty
            {
                texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
                request = None;
            }
            if (sticks, request, order) == (None, None, None) {
                return;
            }
            if sticks.is_some() {
                *radio_us = Some(now_us);
            }
            let update = update.get_or_insert(ControlInputs::EMPTY);
            if let Some(value) = request {
                update.inbox.request(Ticketed { value, ticket: PILOT });
            }
            if sticks.is_some() || order.is_some() {
                let orders = update.order();
                orders.sticks = sticks.map(|value| Stamped { value, at_us: now_us }).or(orders.sticks);
                order.into_iter().for_each(|value| give(orders, Ticketed { value, ticket: PILOT }));
            }
        };
        radio.receive(bytes, settings, &inputs, &mut act);
        radio.relay(news, settings, &inputs, &mut act);
        self.status.radio = radio.status(settings, now_us);
        update
    }

    /// Returns the next telemetry frame for the pilot's transmitter, if one is due: battery, attitude, mode, position
    /// in turn.
    pub fn radio_telemetry(&self, radio: &mut RadioControl) -> Option<Vec<u8, RADIO_FRAME_MAX>> {
        let status = &self.status;
        if status.time_us < radio.next_us {
            return None;
        }
        radio.next_us = status.time_us + TELEMETRY_US;
        radio.turn = (radio.turn + 1) % 4;
        let telemetry = match radio.turn {
            0 => {
                let battery = status.aux.battery?;
                CrsfTelemetry::Battery {
                    voltage_v: f32::from(battery.voltage_mv) * 1e-3,
                    current_a: f32::from(battery.current_ca.max(0)) * 1e-2,
                    drawn_mah: battery.consumed_mah.max(0) as f32,
                    left: status.guided.charge.unwrap_or_default(),
                }
            }
            1 => {
                let attitude_rad = status.state?.attitude_rad;
                CrsfTelemetry::Attitude { angles_rad: [attitude_rad.x, -attitude_rad.y, -attitude_rad.z] }
            }
            2 => CrsfTelemetry::Mode(status.flight_mode().name()),
            _ => {
                let Some(Downlink::Telemetry(Telemetry::GlobalPositionInt(global))) =
                    compose(id::GLOBAL_POSITION_INT, status)
                else {
                    return None;
                };
                let [north, east, _] = global.velocity_ned_cm_s.map(|cm_s| f32::from(cm_s) * 1e-2);
                CrsfTelemetry::Gps {
                    place_1e7deg: global.place_e7,
                    speed_m_s: sqrt(north * north + east * east),
                    course_rad: libm::atan2f(east, north),
                    height_m: global.altitude_mm as f32 * 1e-3,
                    satellites: status.aux.receiver.map_or(0, |receiver| receiver.satellites),
                }
            }
        };
        Some(telemetry.encode())
    }
}
