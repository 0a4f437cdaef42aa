//! The suite `rough-estimate` flies with sensor behaviour that the vehicle is not told of, and measures the quality of
//! its estimate. `docs/reference/suites.md` has the classes of behaviour.
//!
//! A flight depends only on seed, vehicle, class and number. It is the same on every machine, whichever other flights
//! are drawn.

mod builder;
mod class;
mod flight;
mod judgement;
mod row;

pub use class::{CLASSES, MIXTURE, MIXTURE_MEANING, SensorClass, Venue, names};
pub use flight::RoughFlight;
pub use judgement::Judgement;
pub use row::{ClassRow, FlownRoughFlight, rows};

use crate::compare;
use crate::draw::mix;
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_files::read::words::out_of_range;
use afbc_plant::noise::{Noise, NoiseStream};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_scenario::trajectory::Trajectory;
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;
use builder::RoughFlightBuilder;
use core::ops::Range;
use rayon::prelude::*;

/// Name of the suite.
pub const NAME: &str = "rough-estimate";
/// Length of most flights \[s\].
pub const SHORT_S: f64 = 60.0;
/// Length of the long flights \[s\].
pub const LONG_S: f64 = 600.0;
/// One flight in this number is long, on average.
pub const LONG_ONE_IN: u64 = 10;

/// Selection of the flights to draw.
#[derive(Clone, Debug)]
pub struct RoughFlights {
    /// Seeds from which flights are drawn.
    pub seeds: Range<u64>,
    /// Number of flights per vehicle, class and seed.
    pub flights: u64,
    /// Length of every flight, instead of [`SHORT_S`] and [`LONG_S`].
    pub duration_s: Option<f64>,
    /// Vehicles that fly.
    pub vehicles: Vec<Vehicle>,
}

/// A vehicle equipped for flights indoors and for flights outdoors. Its sensors behave as their data sheets state.
struct VenueVehicles<'a> {
    vehicle: &'a Vehicle,
    indoors: Scenario,
    outdoors: Scenario,
}

impl RoughFlights {
    /// Draws all flights, flown by `contender` with its gains for the vehicle.
    ///
    /// # Errors
    /// One line about the first value that a vehicle cannot fly with, or a gain or setting out of range.
    pub fn draw(&self, contender: &Contender) -> Result<Vec<RoughFlight>, FileError> {
        let bases = self.vehicles.iter().map(|vehicle| VenueVehicles::new(vehicle, contender));
        let bases = bases.collect::<Result<Vec<_>, _>>()?;
        let (bases, flights) = (bases.as_slice(), self.flights);
        let of_base = |seed| bases.iter().flat_map(move |base| names().map(move |class| (base, class, seed)));
        let all = self.seeds.clone().flat_map(of_base);
        let all = all.flat_map(|(base, class, seed)| (1..=flights).map(move |number| (base, class, seed, number)));
        let all: Vec<_> = all.collect();
        all.into_par_iter().map(|(base, class, seed, number)| self.flight(base, class, seed, number)).collect()
    }

    fn flight(
        &self,
        base: &VenueVehicles<'_>,
        class: &'static str,
        seed: u64,
        number: u64,
    ) -> Result<RoughFlight, FileError> {
        let vehicle = &base.vehicle.name;
        // The names enter the draw, not the indices in the lists, so that other vehicles and classes change nothing.
        let of_names = vehicle.bytes().chain(class.bytes()).fold(mix(seed), |hash, byte| mix(hash ^ u64::from(byte)));
        let bits = mix(of_names.wrapping_add(number)) >> 11;
        let mut noise = Noise::new(bits, NoiseStream::Scenario);
        let is_long = (noise.uniform() * LONG_ONE_IN as f64) < 1.0;
        let hovers = noise.uniform() < 0.3;
        let drawn_place = if noise.uniform() < 0.5 { Venue::Indoors } else { Venue::Outdoors };
        let one = CLASSES.iter().find(|own| own.name == class);
        let place = one.and_then(|one| one.place).unwrap_or(drawn_place);
        let parts = match one {
            Some(one) => vec![one],
            None => two(&mut noise, place),
        };
        let stated = if place == Venue::Indoors { &base.indoors } else { &base.outdoors };
        let lasts_s = if is_long { LONG_S } else { SHORT_S };
        let mut scenario = Scenario {
            name: format!("{vehicle}-{class}-{seed}-{number}"),
            duration_s: self.duration_s.unwrap_or(lasts_s),
            seed: bits,
            told: stated.told_before_draws(),
            ..stated.clone()
        };
        if hovers {
            scenario.trajectory = Trajectory::Hover { position_m: scenario.initial.position_m, yaw_rad: 0.0 };
        }
        let mut drawing = RoughFlightBuilder { noise: &mut noise, scenario: &mut scenario, gusts: Vec::new() };
        parts.iter().for_each(|part| part.put(&mut drawing));
        let parts: Vec<&str> = parts.iter().map(|part| part.name).collect();
        let unfit = |error: OutOfRange| {
            let problem =
                format!("the vehicle cannot fly the class {class} with {}; choose other seeds", out_of_range(&error));
            FileError::whole(vehicle, problem)
        };
        drawing.finish().and_then(|()| scenario.check()).map_err(unfit)?;
        scenario.description = format!("{}, {}", parts.join(" and "), place.name());
        Ok(RoughFlight { seed, vehicle: vehicle.clone(), class, parts, number, place, scenario })
    }
}

/// Draws two different classes whose instruments exist at `place`.
fn two(noise: &mut Noise, place: Venue) -> Vec<&'static SensorClass> {
    let mut there: Vec<&SensorClass> = CLASSES.iter().skip(1).filter(|class| class.is_at(place)).collect();
    let mut one = || there.remove((noise.uniform() * there.len() as f64) as usize);
    vec![one(), one()]
}

impl<'a> VenueVehicles<'a> {
    fn new(vehicle: &'a Vehicle, contender: &Contender) -> Result<Self, FileError> {
        let at = |text: &str| {
            let mut scenario = afbc_scenario::parse(NAME, text, NAME)?.on(vehicle, Profile::Flight)?;
            compare::fly_under(&mut scenario, core::slice::from_ref(contender))?;
            // Without this, the batteries of some vehicles would be empty before ten minutes are over.
            scenario.realism.rotors.battery = None;
            Ok::<Scenario, FileError>(scenario)
        };
        Ok(VenueVehicles {
            vehicle,
            indoors: at(include_str!("indoors.toml"))?,
            outdoors: at(include_str!("outdoors.toml"))?,
        })
    }
}

/// Flies all flights on the current rayon pool. Calls `progress` after each flight. The result does not depend on the
/// number of threads.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn fly(flights: Vec<RoughFlight>, progress: &(dyn Fn() + Sync)) -> Result<Vec<FlownRoughFlight>, OutOfRange> {
    let flown = |flight: RoughFlight| {
        let judgement = Judgement::of(&flight.scenario)?;
        progress();
        Ok(FlownRoughFlight { flight, judgement })
    };
    flights.into_par_iter().map(flown).collect()
}
