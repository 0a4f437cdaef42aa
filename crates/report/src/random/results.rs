//! The flown random flights, and the ranking of the contenders.

use afbc_campaign::random::{FeedbackSource, FlownRandomFlight, RandomFlights, Ranking, Score, rankings};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;

/// The flown random flights, and the ranking of the contenders in them.
#[derive(Clone, Debug)]
pub struct RandomResults<'a> {
    /// Settings from which the flights were drawn.
    pub random: &'a RandomFlights,
    /// The flights with their results.
    pub flown: &'a [FlownRandomFlight],
    /// Index of the reference contender, with which the others are compared.
    baseline: usize,
    /// One group per vehicle and, if there are several vehicles, one of all flights.
    pub(super) groups: Vec<VehicleGroup<'a>>,
}

/// The flights of one vehicle, or of all vehicles.
#[derive(Clone, Debug)]
pub(super) struct VehicleGroup<'a> {
    /// Name of the vehicle; `None` for all vehicles.
    pub(super) vehicle: Option<&'a str>,
    pub(super) flights: usize,
    /// Names of the flights that every contender lost.
    pub(super) lost_by_all: Vec<&'a str>,
    /// Names of the flights that the reference contender lost and another contender kept.
    pub(super) lost_alone: Vec<&'a str>,
    /// Ranking of each contender.
    pub(super) rankings: Vec<Ranking>,
}

impl<'a> RandomResults<'a> {
    /// Ranks the contenders. The reference contender is the one called `baseline`, or else the first.
    pub fn new(random: &'a RandomFlights, flown: &'a [FlownRandomFlight], baseline: &str) -> Self {
        let mut judged = RandomResults { random, flown, baseline: 0, groups: Vec::new() };
        let contenders = judged.contenders();
        let baseline = contenders.iter().position(|contender| contender.name == baseline).unwrap_or_default();
        let vehicles = random.vehicles.iter().map(|vehicle| Some(vehicle.name.as_str()));
        let all = (random.vehicles.len() > 1).then_some(None);
        let groups = vehicles.chain(all).map(|vehicle| group(flown, vehicle, baseline)).collect();
        judged.baseline = baseline;
        judged.groups = groups;
        judged
    }

    /// Returns the reference contender's worst flight on each vehicle: one that it lost and another contender kept, or
    /// else the one in which it was farthest behind the best.
    pub fn telling(&self) -> Vec<&'a Scenario> {
        let behind = |score: &Score| match (score.of(self.baseline), score.best_m()) {
            (Some(own), Some(best)) => own / best,
            _ => f64::INFINITY,
        };
        let of_vehicle = |vehicle: &str| {
            let flown = self.flown.iter().filter(|flown| flown.flight.vehicle == vehicle);
            let judged =
                flown.filter_map(|flown| Some((flown, flown.score())).filter(|(_, score)| score.best_m().is_some()));
            // The first one of several equals counts.
            let worst = judged.reduce(|worst, next| if behind(&next.1) > behind(&worst.1) { next } else { worst });
            worst.map(|(flown, _)| &flown.flight.scenario)
        };
        self.random.vehicles.iter().filter_map(|vehicle| of_vehicle(&vehicle.name)).collect()
    }

    /// Returns the contenders.
    pub(super) fn contenders(&self) -> &'a [Contender] {
        self.flown.first().map_or(&[], |first| first.flight.scenario.contenders.as_slice())
    }

    /// Returns the title of the reference contender.
    pub(super) fn baseline(&self) -> &'a str {
        self.contenders().get(self.baseline).map_or("", Contender::title)
    }

    /// Returns the name of the reference contender.
    pub(super) fn baseline_name(&self) -> &'a str {
        self.contenders().get(self.baseline).map_or("", |contender| contender.name.as_str())
    }

    /// Describes the flights: "seeds 1 to 20, 12 flights of each vehicle and seed, on the truth".
    pub(super) fn words(&self) -> String {
        let (first, last) = (self.random.seeds.start, self.random.seeds.end.saturating_sub(1));
        let seeds = if first == last { format!("seed {first}") } else { format!("seeds {first} to {last}") };
        let seen = match self.random.seen {
            FeedbackSource::Truth => "on the true state, with the noise of the scenario hardware".into(),
            seen => format!("on the vehicle's own estimate by the instruments of the scenario {}", seen.scenario()),
        };
        format!("{seeds}, {} flights of each vehicle and seed, {seen}", self.random.flights)
    }
}

impl VehicleGroup<'_> {
    /// Returns the name of the group.
    pub(super) fn name(&self) -> &str {
        self.vehicle.unwrap_or("all vehicles")
    }

    /// Returns the number of flights that at least one contender kept.
    pub(super) fn kept(&self) -> usize {
        self.flights - self.lost_by_all.len()
    }
}

fn group<'a>(flown: &'a [FlownRandomFlight], vehicle: Option<&'a str>, baseline: usize) -> VehicleGroup<'a> {
    let of_group = |flown: &&FlownRandomFlight| vehicle.is_none_or(|vehicle| flown.flight.vehicle == vehicle);
    let (names, scores): (Vec<&str>, Vec<Score>) =
        flown.iter().filter(of_group).map(|flown| (flown.flight.scenario.name.as_str(), flown.score())).unzip();
    let named = |is: fn(&Score, usize) -> bool| {
        let those = names.iter().zip(&scores).filter(|(_, score)| is(score, baseline));
        those.map(|(name, _)| *name).collect()
    };
    VehicleGroup {
        vehicle,
        flights: scores.len(),
        lost_by_all: named(|score, _| score.best_m().is_none()),
        lost_alone: named(|score, baseline| score.best_m().is_some() && score.of(baseline).is_none()),
        rankings: rankings(&scores, baseline),
    }
}
