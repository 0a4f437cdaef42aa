//! Positions and directions of the rotors.

use crate::{OutOfRange, Parameters, Range};

/// Largest number of rotors.
pub const ROTORS_MAX: usize = 8;

/// Accepted number of rotors.
pub const ROTORS: Range = Range::new("rotors", 4.0, ROTORS_MAX as f64);

/// Accepted coordinate of a rotor's position, in arm lengths.
pub const ROTOR_POSITION: Range = Range::new("rotor_position", -10.0, 10.0);

/// Position of a rotor, and the direction in which it turns the body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotor<T = f32> {
    /// Position along body x, in [arm lengths](crate::Parameters::arm_m).
    pub x: T,
    /// Position along body y, in arm lengths.
    pub y: T,
    /// True if the rotor's drag pushes the body to positive yaw: seen from above, the rotor turns clockwise.
    pub pushes_left: bool,
}

/// The paper's frame: rotor 1 at -y, 2 at +x, 3 at +y, 4 at -x.
pub const PLUS: [Rotor; 4] = [
    Rotor { x: 0.0, y: -1.0, pushes_left: true },
    Rotor { x: 1.0, y: 0.0, pushes_left: false },
    Rotor { x: 0.0, y: 1.0, pushes_left: true },
    Rotor { x: -1.0, y: 0.0, pushes_left: false },
];

impl Rotor {
    /// Returns the rotor in double precision, for the plant.
    #[must_use]
    pub fn to_f64(&self) -> Rotor<f64> {
        Rotor { x: self.x.into(), y: self.y.into(), pushes_left: self.pushes_left }
    }
}

impl Rotor<f64> {
    /// Returns the rotor rounded to single precision, for a controller.
    #[must_use]
    pub fn to_f32(&self) -> Rotor {
        Rotor { x: self.x as f32, y: self.y as f32, pushes_left: self.pushes_left }
    }

    /// Returns 1 if the rotor pushes the body to positive yaw, otherwise -1.
    #[must_use]
    pub fn spin(&self) -> f64 {
        if self.pushes_left { 1.0 } else { -1.0 }
    }
}

/// Rotors of a vehicle with any accepted number of them, in the order of the motor outputs.
// The rotors are stored by coordinate. Eight `Rotor`s with their count would take 32 bytes more in each copy of a
// configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotors {
    x: [f32; ROTORS_MAX],
    y: [f32; ROTORS_MAX],
    /// A bit for each rotor, the first rotor's lowest.
    pushes_left: u8,
    count: u8,
}

impl Rotors {
    /// Takes these rotors.
    #[must_use]
    #[expect(clippy::indexing_slicing, reason = "within both lengths, as the compiler checks")]
    pub const fn new<const N: usize>(rotors: &[Rotor; N]) -> Self {
        const { assert!(ROTORS.min as usize <= N && N <= ROTORS_MAX, "a vehicle has 4 to 8 rotors") };
        let mut all = Rotors { x: [0.0; ROTORS_MAX], y: [0.0; ROTORS_MAX], pushes_left: 0, count: N as u8 };
        let mut index = 0;
        while index < N {
            let Rotor { x, y, pushes_left } = rotors[index];
            (all.x[index], all.y[index]) = (x, y);
            all.pushes_left |= (pushes_left as u8) << index;
            index += 1;
        }
        all
    }

    /// Returns the number of rotors.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.count as usize
    }

    /// Returns each rotor in turn.
    pub fn iter(&self) -> impl Iterator<Item = Rotor> + use<> {
        let Rotors { x, y, pushes_left, count } = *self;
        let all = x.into_iter().zip(y).zip(0..u32::from(count));
        all.map(move |((x, y), index)| Rotor { x, y, pushes_left: pushes_left.wrapping_shr(index) & 1 == 1 })
    }

    /// Returns the rotors of a vehicle that has `N`.
    ///
    /// # Errors
    /// If there are not `N` rotors.
    pub fn array<const N: usize>(&self) -> Result<[Rotor; N], OutOfRange> {
        taken(self.count(), self.iter())
    }
}

impl TryFrom<&[Rotor<f64>]> for Rotors {
    type Error = OutOfRange;

    /// Rounds the rotors to single precision, for a controller. Fails if a vehicle may not have that many.
    fn try_from(rotors: &[Rotor<f64>]) -> Result<Self, OutOfRange> {
        ROTORS.check(rotors.len() as f64)?;
        crate::with_rotors!(rotors.len(), N => Ok(Rotors::new::<N>(&taken(N, rotors.iter().map(Rotor::to_f32))?)))
    }
}

/// Returns `count` rotors, if that is `N`.
fn taken<const N: usize>(count: usize, mut rotors: impl Iterator<Item = Rotor>) -> Result<[Rotor; N], OutOfRange> {
    Range { min: N as f64, max: N as f64, ..ROTORS }.check(count as f64)?;
    Ok([(); N].map(|()| rotors.next().unwrap_or(NO_ROTOR)))
}

/// A rotor at the centre of mass, in place of one that is missing.
const NO_ROTOR: Rotor = Rotor { x: 0.0, y: 0.0, pushes_left: false };

/// A vehicle as controllers know it: nominal parameters and the positions of its `N` rotors.
///
/// [`Parameters`] alone convert to a vehicle with the paper's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Airframe<const N: usize = 4> {
    /// Nominal parameters.
    pub parameters: Parameters,
    /// Rotors, in the order of the motor outputs.
    pub rotors: [Rotor; N],
}

impl From<Parameters> for Airframe {
    fn from(parameters: Parameters) -> Self {
        Airframe { parameters, rotors: PLUS }
    }
}

impl<const N: usize> Airframe<N> {
    /// Makes the airframe with these parameters and rotors.
    ///
    /// # Errors
    /// If there are not `N` rotors.
    pub fn new(parameters: &Parameters<f64>, rotors: &[Rotor<f64>]) -> Result<Self, OutOfRange> {
        let rotors = taken(rotors.len(), rotors.iter().map(Rotor::to_f32))?;
        Ok(Airframe { parameters: parameters.to_f32(), rotors })
    }
}

/// Evaluates an expression with the constant `N` equal to the number of rotors, 4 to 8. Selects the code for a number
/// of rotors that is known only at run time, such as from a file.
///
/// ```
/// let room = afbc_types::with_rotors!(6, N => [0.0_f32; N].len());
/// assert_eq!(room, 6);
/// ```
#[macro_export]
macro_rules! with_rotors {
    ($count:expr, $N:ident => $body:expr) => {
        match $count {
            4 => $crate::with_rotors!(@ 4, $N => $body),
            5 => $crate::with_rotors!(@ 5, $N => $body),
            6 => $crate::with_rotors!(@ 6, $N => $body),
            7 => $crate::with_rotors!(@ 7, $N => $body),
            // Eight: `ROTORS` has refused all other numbers.
            _ => $crate::with_rotors!(@ 8, $N => $body),
        }
    };
    (@ $count:literal, $N:ident => $body:expr) => {{
        const $N: usize = $count;
        $body
    }};
}
