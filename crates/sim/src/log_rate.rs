//! Chooses the row rate of a flight's log.

use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use std::str::FromStr;

/// Largest number of rows in a log: somewhat more than an hour at 100 Hz.
const ROWS: f64 = 500_000.0;
/// Largest number of rows at the default rate: ten minutes at 100 Hz, some 26 MB.
const PLENTY: f64 = 60_000.0;
/// Candidates for the default rate, of which the fastest that fits is used \[Hz\].
const USUAL: [u16; 11] = [100, 50, 40, 25, 20, 10, 8, 5, 4, 2, 1];

/// Number of log rows per second.
#[derive(Clone, Copy, Debug)]
pub struct LogRate(u16);

impl FromStr for LogRate {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.parse() {
            Ok(hz @ 1..=1000) if 1000 % hz == 0 => Ok(LogRate(hz)),
            _ => Err("the rate must divide 1000: 1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 100, 125, 200, 250, 500 or 1000"),
        }
    }
}

impl LogRate {
    /// Returns 100 Hz, or the largest lower rate with at most 60,000 rows in `duration_s`.
    pub fn usual(duration_s: f64) -> Self {
        let fits = |hz: &u16| f64::from(*hz) * duration_s <= PLENTY;
        LogRate(USUAL.into_iter().find(fits).unwrap_or(1))
    }

    /// Returns a message if a flight of `duration_s` gets fewer rows per second than usual.
    pub fn thinned(duration_s: f64) -> Option<String> {
        let [full, ..] = USUAL;
        let LogRate(hz) = Self::usual(duration_s);
        (hz < full).then(|| format!("logs of {duration_s} s keep {hz} rows per second; --log-hz {full} keeps more"))
    }

    /// Returns the control steps between log rows for figures: one number for all contenders of all `scenarios`.
    ///
    /// # Errors
    /// Returns a message if the log of one run would be too long.
    pub fn common(scenarios: &[Scenario]) -> Result<u64, String> {
        let every = |scenario: &Scenario| {
            let usual = Self::usual(scenario.duration_s);
            let steps = scenario.contenders.iter().map(|contender| usual.steps(scenario, contender));
            steps.collect::<Result<Vec<_>, _>>()
        };
        let every = scenarios.iter().map(every).collect::<Result<Vec<_>, _>>()?;
        Ok(every.into_iter().flatten().max().unwrap_or(1))
    }

    /// Returns the whole number of control steps between log rows.
    ///
    /// # Errors
    /// Returns a message if the log would be too long.
    pub fn steps(self, scenario: &Scenario, contender: &Contender) -> Result<u64, String> {
        let LogRate(hz) = self;
        let steps = (1.0 / (f64::from(hz) * contender.step_s())).round().max(1.0);
        let rows = scenario.duration_s / (contender.step_s() * steps);
        if rows > ROWS {
            let duration_s = scenario.duration_s;
            return Err(format!(
                "--log-hz {hz}: {duration_s} s would give {rows:.1e} rows, more than {ROWS:.1e}; lower --log-hz or \
                 --duration"
            ));
        }
        Ok(steps as u64)
    }
}
