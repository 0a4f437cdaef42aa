//! Draws a campaign's flights from its seed.

use crate::plan::{Campaign, NamedTrajectory, Spread};
use crate::quantity::{self, QUANTITIES, Quantity};
use afbc_plant::noise::{Noise, NoiseStream};
use afbc_scenario::Scenario;
use afbc_types::OutOfRange;

/// Values drawn for one flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Seed of the flight's noise and weather: 53 bits, so that no tool rounds it.
    pub seed: u64,
    /// One value for each of the campaign's spreads.
    pub values: Vec<f64>,
}

impl Spread {
    /// Returns the quantity.
    pub fn quantity(&self) -> Option<&'static Quantity> {
        QUANTITIES.get(self.quantity)
    }

    /// Returns the value at the fraction `share`, in \[0, 1), of the interval.
    fn at(&self, whole: bool, share: f64) -> f64 {
        let [low, high] = self.ends;
        if whole { low + libm::floor(share * (high - low + 1.0)) } else { low + share * (high - low) }
    }
}

impl Campaign {
    /// Draws flight `flight`. The result depends only on the flight's index and the campaign's seed.
    pub fn draw(&self, flight: u64) -> Draw {
        let seed = mix(mix(self.seed).wrapping_add(flight)) >> 11;
        let mut noise = Noise::new(seed, NoiseStream::Scenario);
        let shares: Vec<f64> = QUANTITIES.iter().map(|_| noise.uniform()).collect();
        let value = |spread: &Spread| {
            let share = shares.get(spread.quantity).copied().unwrap_or_default();
            spread.at(spread.quantity().is_some_and(|quantity| quantity.whole), share)
        };
        Draw { seed, values: self.spreads.iter().map(value).collect() }
    }

    /// Returns the reference trajectory of flight `flight`. The flights take the campaign's trajectories in turn.
    pub fn trajectory(&self, flight: u64) -> Option<&NamedTrajectory> {
        self.trajectories.get((flight % self.trajectories.len().max(1) as u64) as usize)
    }

    /// Returns flight `flight` as a scenario.
    ///
    /// # Errors
    /// The first parameter that the draw puts out of range.
    pub fn flight(&self, flight: u64) -> Result<Scenario, OutOfRange> {
        self.with(flight, &self.draw(flight))
    }

    /// Checks both ends of every spread on every trajectory. If they are in range, the flights between them normally
    /// are too.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let flights = 0..self.trajectories.len() as u64;
        (0..2).try_for_each(|end| flights.clone().try_for_each(|flight| self.at_end(flight, end)?.check()))
    }

    /// Returns flight `flight` with every quantity at the lower (0) or upper (1) end of its interval.
    pub(super) fn at_end(&self, flight: u64, end: usize) -> Result<Scenario, OutOfRange> {
        let values = self.spreads.iter().filter_map(|spread| spread.ends.get(end).copied()).collect();
        self.with(flight, &Draw { values, ..self.draw(flight) })
    }

    /// Returns flight `flight` with the given draw.
    pub(super) fn with(&self, flight: u64, draw: &Draw) -> Result<Scenario, OutOfRange> {
        let told = self.scenario.told_before_draws();
        let mut scenario = Scenario { seed: draw.seed, told, ..self.scenario.clone() };
        if let Some(named) = self.trajectory(flight) {
            scenario.trajectory = named.trajectory.clone();
            scenario.initial = named.initial;
        }
        let quantities = self.spreads.iter().filter_map(Spread::quantity);
        quantity::apply(scenario, quantities.zip(draw.values.iter().copied()))
    }
}

/// Returns SplitMix64's output for the state `x` (Steele, Lea, Flood 2014), a bijection that maps neighbouring numbers
/// far apart.
pub(crate) const fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::mix;

    /// Checks the first outputs of the generator's published sequence from state 0.
    #[test]
    fn mix_is_splitmix64() {
        assert_eq!(mix(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(mix(0x9e37_79b9_7f4a_7c15), 0x6e78_9e6a_a1b9_65f4);
    }
}
