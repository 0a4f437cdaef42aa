//! Readings of the paper's description of its experiment.

/// Reading of the paper's "1.2 N" and "1.2 N m" (decision 3 in `docs/paper.md`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Reading {
    /// Accelerations of 1.2 m/s2 and 1.2 rad/s2 that persist from their onset: the paper's claims hold.
    Persistent,
    /// Accelerations of 1.2 m/s2 and 1.2 rad/s2 that last one second each.
    Pulses,
    /// Physical forces and moments that persist. 1.2 N m is 316 rad/s2 here, and the vehicle is lost.
    Forces,
}

impl Reading {
    /// Every reading.
    pub const ALL: [Reading; 3] = [Reading::Persistent, Reading::Pulses, Reading::Forces];

    /// Returns the lower-case name, as on the command line and in logs.
    pub const fn name(self) -> &'static str {
        match self {
            Reading::Persistent => "persistent",
            Reading::Pulses => "pulses",
            Reading::Forces => "forces",
        }
    }
}

/// Sign of an uncertainty of which the paper prints only the size (decision 4 in `docs/paper.md`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Sign {
    /// The true value is larger than the nominal one.
    Plus,
    /// The true value is smaller than the nominal one.
    Minus,
}

impl Sign {
    /// Returns 1 + `size` or 1 - `size`.
    pub(crate) const fn factor(self, size: f64) -> f64 {
        match self {
            Sign::Plus => 1.0 + size,
            Sign::Minus => 1.0 - size,
        }
    }

    /// Returns "+" or "-".
    pub const fn symbol(self) -> &'static str {
        match self {
            Sign::Plus => "+",
            Sign::Minus => "-",
        }
    }
}

/// Signs of the parameter uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Uncertainty {
    /// Sign of the inertia's 75 %.
    pub inertia: Sign,
    /// Sign of the thrust factor's 40 %.
    pub thrust: Sign,
}

impl Uncertainty {
    /// Inertia up, thrust down: the most difficult combination, and the default.
    pub const DEFAULT: Self = Uncertainty { inertia: Sign::Plus, thrust: Sign::Minus };

    /// All four combinations, the default first.
    pub const ALL: [Self; 4] = [
        Self::DEFAULT,
        Uncertainty { inertia: Sign::Plus, thrust: Sign::Plus },
        Uncertainty { inertia: Sign::Minus, thrust: Sign::Minus },
        Uncertainty { inertia: Sign::Minus, thrust: Sign::Plus },
    ];
}

/// A variant of the experiment; `None` leaves out gusts or uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Case {
    /// Reading of the gusts.
    pub reading: Option<Reading>,
    /// Signs of the uncertain parameters.
    pub uncertainty: Option<Uncertainty>,
}

impl Case {
    /// The default reading of Section IV.
    pub const DEFAULT: Self = Case { reading: Some(Reading::Persistent), uncertainty: Some(Uncertainty::DEFAULT) };

    /// Returns the short name: `calm`, `uncertain`, `gusts`, `pulses`, `forces`, or `paper` with both gusts and
    /// uncertainty.
    pub const fn name(self) -> &'static str {
        match (self.reading, self.uncertainty) {
            (None, None) => "calm",
            (None, Some(_)) => "uncertain",
            (Some(Reading::Persistent), None) => "gusts",
            (Some(Reading::Pulses), None) => "pulses",
            (Some(Reading::Forces), None) => "forces",
            (Some(_), Some(_)) => "paper",
        }
    }
}
