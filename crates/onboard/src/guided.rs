//! Runs the guidance within the control tick.

use crate::configuration::Configuration;
use crate::control_inputs::ControlInputs;
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::{Mode, Stamped, Ticketed};
use afbc_guidance::failsafe::FailedSensors;
use afbc_guidance::{AvailableThrust, Guidance, GuidanceInputs, GuidanceOutputs};
use afbc_types::{OutOfRange, State};

/// Ticket number of the guidance's own requests, whose answers are ignored.
const OWN: u8 = u8::MAX;

/// The guidance of a vehicle, with the vehicle's data that it needs.
#[derive(Clone, Debug)]
pub(crate) struct GuidanceStage {
    guidance: Guidance,
    available_thrust: AvailableThrust,
    mass_kg: f32,
    last_us: u64,
}

/// State of the flight core and the sensors, as input of the guidance.
pub(crate) struct Core<'a> {
    pub(crate) mode: Mode,
    pub(crate) airborne: bool,
    /// True if the vehicle has been at rest as long as arming requires.
    pub(crate) rested: bool,
    pub(crate) sensors: FailedSensors,
    /// The last tick's state from the observer, which replaces a missing estimate.
    pub(crate) observed: Option<&'a State>,
}

impl GuidanceStage {
    /// Creates the guidance of a vehicle.
    ///
    /// # Errors
    /// The first setting out of range.
    pub(crate) fn new(configuration: &Configuration) -> Result<Self, OutOfRange> {
        let Configuration { parameters, rotors, settings, guidance, .. } = configuration;
        let most_m_s2 = rotors.count() as f32 * settings.common.rotor_force_max_n / parameters.mass_kg;
        Ok(GuidanceStage {
            guidance: Guidance::new(*guidance)?,
            available_thrust: AvailableThrust { most_m_s2, gravity_m_s2: parameters.gravity_m_s2, given_m_s2: None },
            mass_kg: parameters.mass_kg,
            last_us: 0,
        })
    }

    /// Takes over new settings for the same number of rotors. Mode, mission and home stay.
    pub(crate) fn adopt(&mut self, prepared: &GuidanceStage) {
        // The call cannot fail, because `prepared` was made from these settings.
        let _ = self.guidance.set(*prepared.guidance.settings());
        (self.available_thrust, self.mass_kg) = (prepared.available_thrust, prepared.mass_kg);
    }

    /// Stores the total thrust that the flight core has commanded.
    #[inline]
    pub(crate) fn gave(&mut self, thrust_n: f32) {
        self.available_thrust.given_m_s2 = (thrust_n > 0.0).then_some(thrust_n / self.mass_kg);
    }

    /// Runs the guidance on the oldest order, and puts its setpoint and requests into the flight core's inbox.
    #[inline(always)]
    pub(crate) fn tick(&mut self, now_us: u64, inputs: &mut ControlInputs, core: &Core<'_>) -> GuidanceOutputs {
        let ControlInputs { inbox, orders, battery, .. } = inputs;
        let fresh = inbox.state().filter(|state| state.age_us(now_us) <= COAST_US);
        let state = fresh.map(|state| &state.value).or(core.observed);
        // The processor converts 32 bits to a float itself; 64 bits would take a library call.
        let gap_us = u32::try_from(now_us.saturating_sub(self.last_us)).unwrap_or(u32::MAX);
        let dt_s = gap_us as f32 * 1e-6;
        self.last_us = now_us;
        let guidance_inputs = GuidanceInputs {
            now_us,
            dt_s,
            state,
            reset: inbox.reset(),
            core: core.mode,
            airborne: core.airborne,
            rested: core.rested,
            battery: *battery,
            sensors: core.sensors,
            available_thrust: self.available_thrust,
        };
        let guided = self.guidance.tick_with_plausible_state(&guidance_inputs, orders);
        if let Some(value) = guided.setpoint {
            inbox.put_own_setpoint(Stamped { value, at_us: now_us });
        }
        inbox.set_idle_on_ground(guided.idle_on_ground);
        inbox.command_rates(self.guidance.rates());
        inbox.inhibit(self.guidance.arming_refusals());
        if let Some(request) = guided.request {
            // A station's request has priority.
            if inbox.asked().is_none() {
                inbox.request(Ticketed { value: request, ticket: OWN });
            }
        }
        if guided.answer.is_some() {
            inputs.orders.given.pop_front();
        }
        guided
    }
}
