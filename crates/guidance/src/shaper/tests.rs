//! Compares the motion with the formulas of the module's documentation, in double precision and with numeric
//! derivatives.
#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use nalgebra::{Vector1, Vector2};
use proptest::prelude::*;

const DT_S: f32 = 1e-3;

/// Constants of the formulas.
struct Page {
    a: f64,
    j: f64,
    b: f64,
    c: f64,
    settling: f64,
    d: f64,
    k2: f64,
    k3: f64,
}

type Vec64<const D: usize> = SVector<f64, D>;

fn wide<const D: usize>(v: &SVector<f32, D>) -> Vec64<D> {
    v.map(f64::from)
}

fn shortened<const D: usize>(v: Vec64<D>, most: f64) -> Vec64<D> {
    if v.norm() > most { v.normalize() * most } else { v }
}

/// Returns the limit for the vector's direction; for one coordinate, by its sign.
fn limit<const D: usize>(v: &Vec64<D>, (up, down): (f32, f32)) -> f64 {
    let down_counts = D == 1 && v.iter().all(|x| *x < 0.0);
    f64::from(if down_counts { down } else { up })
}

impl Page {
    fn new(a: f32, j: f32) -> Self {
        let (a, j) = (f64::from(a), f64::from(j));
        let (b, eased) = (0.7 * a, 0.9 * j);
        // c is 2 B^2/J', but large enough that k1 = B/c does not exceed its limit.
        let c = (2.0 * b * b / eased).max(b / 12.0);
        let k2 = 4.0 * b / c;
        let settling = 0.55 * j;
        Page { a, j, b, c, settling, d: settling / k2, k2, k3: 5.0 * k2 }
    }

    /// Returns f(e), along e.
    fn f<const D: usize>(&self, e: &Vec64<D>) -> Vec64<D> {
        let size = e.norm();
        if size == 0.0 { *e } else { e * (((self.c * self.c + 2.0 * self.b * size).sqrt() - self.c) / size) }
    }

    /// Returns g(x), along x, and the derivative g'.
    fn g<const D: usize>(&self, x: &Vec64<D>) -> (Vec64<D>, f64) {
        let size = x.norm();
        let root = (self.d * self.d + 2.0 * self.settling * size).sqrt();
        let along = if size == 0.0 { *x } else { x * ((root - self.d) / size) };
        (along, self.settling / root)
    }

    /// Returns the wanted velocity, and its derivative without the goal's acceleration: that of the approach, or zero
    /// if the approach is limited.
    fn wanted<const D: usize>(
        &self,
        motion: &MotionState<D>,
        goal: &MotionGoal<D>,
        reach: &MotionBounds,
    ) -> (Vec64<D>, Vec64<D>) {
        let zero = Vec64::<D>::zeros();
        let v = wide(&motion.velocity);
        let Some(given) = goal.velocity.as_ref().map(wide) else {
            // The x for which g(x) is the given acceleration.
            let a = wide(&goal.acceleration);
            let size = ((a.norm() + self.d).powi(2) - self.d * self.d) / (2.0 * self.settling);
            let ahead = if a.norm() > 0.0 { v + a.normalize() * size } else { v };
            return (shortened(ahead, 0.98 * limit(&ahead, reach.approach)), zero);
        };
        let Some(position) = goal.position.as_ref().map(wide) else {
            return (shortened(given, 0.98 * limit(&given, reach.approach)), zero);
        };
        let e = position - wide(&motion.position) - wide(&motion.below);
        let most = 0.98 * limit(&e, reach.approach);
        let approach = self.f(&e);
        let change = if approach.norm() <= most {
            let h = 1e-6;
            let shaping = (given - v) * h;
            (self.f(&(e + shaping)) - self.f(&(e - shaping))) / (2.0 * h)
        } else {
            zero
        };
        let wanted = given + shortened(approach, most);
        (shortened(wanted, 0.98 * limit(&wanted, reach.speed)), change)
    }

    /// Returns the jerk of a step.
    fn jerk<const D: usize>(&self, motion: &MotionState<D>, goal: &MotionGoal<D>, reach: &MotionBounds) -> Vec64<D> {
        let (v, a) = (wide(&motion.velocity), wide(&motion.acceleration));
        let (wanted, change) = self.wanted(motion, goal, reach);
        let x = wanted - v;
        let given = if goal.velocity.is_some() { wide(&goal.acceleration) } else { Vec64::<D>::zeros() };
        let (own, slope) = self.g(&x);
        let own = change + own;
        let rise = if own.norm() <= self.a { (change + given - a) * slope } else { Vec64::<D>::zeros() };
        let wanted = shortened(given + shortened(own, self.a), f64::from(reach.acceleration));
        // The acceleration from which the speed settles to its limit in time.
        let size = wanted.norm();
        let jerk = if size > 0.0 {
            let along = v.dot(&wanted) / size;
            let speed = 0.98 * limit(&wanted, reach.speed);
            let across = (v.norm_squared() - along * along).max(0.0);
            let room = ((speed * speed - across).max(0.0).sqrt() - along).max(0.0);
            let settling = 0.55 * f64::from(reach.jerk);
            let d = settling / self.k2;
            let root = (d * d + 2.0 * settling * room).sqrt();
            if size > root - d {
                let least = wanted * ((root - d) / size);
                a * (-settling / root) + (least - a) * self.k3
            } else {
                wide(&goal.jerk) + shortened(rise + (wanted - a) * self.k3, self.j)
            }
        } else {
            wide(&goal.jerk) + shortened(rise + (wanted - a) * self.k3, self.j)
        };
        let dt = f64::from(DT_S);
        let most = f64::from(reach.jerk);
        let next = shortened(a + shortened(jerk, most) * dt, f64::from(reach.acceleration));
        shortened((next - a) / dt, most)
    }
}

fn pair(most: f32) -> impl Strategy<Value = Vector2<f32>> {
    (-most..most, -most..most).prop_map(|(x, y)| Vector2::new(x, y))
}

/// Vectors of small, medium and large numbers.
fn vector(most: f32) -> impl Strategy<Value = Vector2<f32>> {
    prop_oneof![pair(most), pair(0.1 * most), pair(0.003 * most), Just(Vector2::zeros())]
}

fn any_motion() -> impl Strategy<Value = MotionState<2>> {
    (vector(50.0), vector(12.0), vector(6.0)).prop_map(|(p, v, a)| MotionState::moving(p, v, a, Vector2::zeros()))
}

fn any_goal() -> impl Strategy<Value = MotionGoal<2>> {
    (0..6u8, vector(50.0), vector(6.0), vector(4.0), vector(20.0)).prop_map(|(kind, p, v, acceleration, jerk)| {
        MotionGoal {
            position: (kind > 1).then_some(p),
            velocity: (kind > 0).then_some(if kind > 4 { Vector2::zeros() } else { v }),
            acceleration,
            jerk,
        }
    })
}

fn any_reach() -> impl Strategy<Value = MotionBounds> {
    (0.5..8.0f32, 0.5..8.0f32, 0.0..8.0f32, 0.0..8.0f32, 1.0..9.0f32, 3.0..200.0f32).prop_map(
        |(a, b, more_a, more_b, acceleration, jerk)| MotionBounds {
            approach: (a, b),
            speed: (a + more_a, b + more_b),
            acceleration,
            jerk,
        },
    )
}

fn of_one(v: &Vector2<f32>) -> Vector1<f32> {
    Vector1::new(v.x)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, ..ProptestConfig::default() })]

    /// A step's jerk follows the formulas, for two coordinates, and for one coordinate with different limits in each
    /// direction.
    #[test]
    fn a_step_is_that_of_the_page(
        motion in any_motion(), goal in any_goal(), reach in any_reach(), a in 0.5..8.0f32, jerk_s in 0.5..60.0f32,
    ) {
        let j = a * jerk_s;
        let (shape, page) = (MotionShaper::new(a, j), Page::new(a, j));
        let mut moved = motion;
        shape.advance(&mut moved, &goal, &reach, DT_S);
        let expected = page.jerk(&motion, &goal, &reach);
        // Single precision: velocities are resolved to 1e-6, amplified by the rates up to k3 and divided by a step.
        let hair = 2e-3 * (1.0 + expected.norm()) + 1e-3 * page.k3;
        prop_assert!((wide(&moved.jerk) - expected).norm() < hair, "{:?}, not {expected:?}", moved.jerk);

        let motion = MotionState { below: Vector1::new(1e-4), ..MotionState::moving(
            of_one(&motion.position), of_one(&motion.velocity), of_one(&motion.acceleration), Vector1::zeros(),
        ) };
        let goal = MotionGoal {
            position: goal.position.as_ref().map(of_one),
            velocity: goal.velocity.as_ref().map(of_one),
            acceleration: of_one(&goal.acceleration),
            jerk: of_one(&goal.jerk),
        };
        let mut moved = motion;
        shape.advance(&mut moved, &goal, &reach, DT_S);
        let expected = page.jerk(&motion, &goal, &reach);
        let found = wide(&moved.jerk);
        prop_assert!((found - expected).norm() < hair + 2e-3 * expected.norm(), "{found:?}, not {expected:?}");
    }

    /// A step integrates its jerk, also far from the origin, where the position's two parts count together.
    #[test]
    fn a_step_integrates_its_jerk(motion in any_motion(), jerk in pair(100.0), far in -9e4..9e4f32) {
        let mut moved = MotionState { position: motion.position.map(|x| x + far), ..motion };
        let begin = wide(&moved.position);
        // Long steps make every term visible.
        let dt = 0.05_f32;
        for _ in 0..20 {
            moved.advance(jerk, dt);
        }
        let (v, a, j, t) = (wide(&motion.velocity), wide(&motion.acceleration), wide(&jerk), 1.0);
        let position = v * t + a * (t * t / 2.0) + j * (t * t * t / 6.0);
        let there = wide(&moved.position) + wide(&moved.below) - begin;
        prop_assert!((there - position).norm() < 1e-3, "{there:?}, not {position:?}");
        prop_assert!(moved.below.amax() <= 0.004);
        prop_assert!((wide(&moved.velocity) - v - a * t - j * (t * t / 2.0)).norm() < 1e-3);
        prop_assert!((wide(&moved.acceleration) - a - j * t).norm() < 1e-3);
        prop_assert_eq!(moved.jerk, jerk);
        let to = moved.to(&moved.position);
        prop_assert_eq!(to, -moved.below);
    }
}

#[test]
fn a_vector_is_shortened_and_never_lengthened() {
    for (vector, most, expected) in [
        ([3.0, 4.0], 5.0, [3.0, 4.0]),
        ([3.0, 4.0], 2.5, [1.5, 2.0]),
        ([-3.0, 4.0], 0.0, [0.0, 0.0]),
        ([0.0, 0.0], 0.0, [0.0, 0.0]),
    ] {
        assert!((capped(Vector2::from(vector), most) - Vector2::from(expected)).norm() < 1e-6, "{vector:?}, {most}");
    }
}
