//! Campaigns draw the behaviour of the instruments, not the estimator's knowledge of them.

#![expect(clippy::unwrap_used, clippy::panic, reason = "tests")]

use afbc_campaign::{self as campaign, Campaign, QUANTITIES};
use afbc_scenario::AssumedInstruments;
use std::path::Path;

/// Returns a campaign that draws every quantity of the instruments.
fn all(told: &str) -> Campaign {
    let of_estimate = ["tracker_", "gnss_", "imu_", "vibration", "barometer_", "magnetometer_", "aiding"];
    let mut spread = String::new();
    for quantity in QUANTITIES.iter().filter(|it| of_estimate.iter().any(|start| it.range.name.starts_with(start))) {
        let (name, min, max) = (quantity.range.name, quantity.range.min, quantity.range.max.min(3.0));
        spread += &format!("{name} = [{min:?}, {max:?}]\n");
    }
    let text = format!(
        "flights = 1\n[spread]\n{spread}[scenario]\n{told}controllers = [\"pid\"]\n\
         trajectory = {{ kind = \"hover\", position_m = [0, 0, 1] }}\n[scenario.instruments]\ntracker = \"mocap-100\"\n\
         gnss = \"m10\"\nbarometer = \"dps310\"\nmagnetometer = \"ist8310\"\n[scenario.instruments.imu]\n\
         part = \"icm-42688-p\"\ngyro = {{ vibration_rad_s = 0.02 }}\naccel = {{ vibration_m_s2 = 1.0 }}\n"
    );
    campaign::parse("all.toml", &text, "all", Path::new("")).unwrap_or_else(|error| panic!("{error}"))
}

/// In many flights, the estimator is told the values of the file for every instrument present, while their behaviour is
/// drawn.
#[test]
fn what_is_told_does_not_depend_on_what_is_drawn() {
    let campaign = all("");
    let stated = campaign.scenario.instruments;
    let mut differ = 0;
    for flight in 0..200 {
        let flight = campaign.flight(flight).unwrap();
        let (told, there) = (flight.told(), flight.instruments);
        assert_eq!(flight.told, AssumedInstruments::Suite(Box::new(stated)));
        assert_eq!(told.imu, stated.imu);
        assert_eq!(told.tracker, stated.tracker.filter(|_| there.tracker.is_some()));
        assert_eq!(told.gnss, stated.gnss.filter(|_| there.gnss.is_some()));
        assert_eq!(told.barometer, stated.barometer.filter(|_| there.barometer.is_some()));
        assert_eq!(told.magnetometer, stated.magnetometer.filter(|_| there.magnetometer.is_some()));
        differ += usize::from(told != there);
    }
    assert_eq!(differ, 200);
    // A table `told` takes precedence over the instruments.
    let own = all("told = { imu = \"bmi270\" }\n");
    let told = own.flight(3).unwrap().told();
    assert_eq!(told.imu, Some(afbc_plant::instruments::ImuModel::BMI270));
}

/// With `told = "drawn"`, the estimator's settings follow from the drawn instruments of the flight. The draws are the
/// same.
#[test]
fn a_campaign_that_says_so_tells_what_it_draws() {
    let (untold, told) = (all(""), all("told = \"drawn\"\n"));
    let mut differ = 0;
    for flight in 0..200 {
        let [untold, told] = [&untold, &told].map(|campaign| campaign.flight(flight).unwrap());
        assert_eq!((told.instruments, told.seed), (untold.instruments, untold.seed));
        assert_eq!(told.told(), told.instruments);
        differ += usize::from(told.estimation(0.001) != untold.estimation(0.001));
    }
    assert!(differ > 190, "{differ}");
}

/// All built-in campaigns tell the estimator the drawn instruments.
#[test]
fn the_built_in_campaigns_keep_what_they_told() {
    for known in &campaign::BUILT_IN {
        let campaign = known.read().unwrap();
        let flights = (0..20).map(|flight| campaign.flight(flight).unwrap());
        assert!(flights.into_iter().all(|flight| flight.told() == flight.instruments), "{}", known.name);
    }
}
