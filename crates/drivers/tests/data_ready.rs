//! Reading at a part's interrupt in simulated time, over a wire that works, breaks, recovers or is noisy.

use afbc_drivers::PartTiming;
use afbc_drivers::data_ready::{DataReady, DataReadyPin};
use core::future::poll_fn;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use std::cell::RefCell;
use std::rc::Rc;

const PERIOD_US: u64 = 1_000;
/// Time of a transfer \[us\].
const TRANSFER_US: u64 = 60;

/// The current time, and the times that futures wait for \[us\].
#[derive(Clone, Default)]
struct Time(Rc<RefCell<(u64, Vec<u64>)>>);

impl Time {
    fn now_us(&self) -> u64 {
        self.0.borrow().0
    }

    async fn until(&self, at_us: u64) {
        poll_fn(|_| {
            let mut time = self.0.borrow_mut();
            if time.0 >= at_us {
                return Poll::Ready(());
            }
            time.1.push(at_us);
            Poll::Pending
        })
        .await;
    }

    /// Runs a future; time passes while it waits.
    fn run<T>(&self, future: impl Future<Output = T>) -> T {
        let mut future = pin!(future);
        loop {
            if let Poll::Ready(value) = future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
                return value;
            }
            let mut time = self.0.borrow_mut();
            time.0 = time.1.drain(..).min().expect("it waits for a time");
        }
    }
}

impl PartTiming for Time {
    fn now_us(&self) -> u64 {
        Time::now_us(self)
    }

    async fn wait(&self, us: u32) {
        self.until(self.now_us() + u64::from(us)).await;
    }

    async fn ready(&mut self, _us: u32) -> bool {
        self.until((self.now_us() / PERIOD_US + 1) * PERIOD_US).await;
        true
    }
}

/// A clock to which no interrupt is wired.
struct Clock(Time);

impl PartTiming for Clock {
    fn now_us(&self) -> u64 {
        self.0.now_us()
    }

    async fn wait(&self, us: u32) {
        self.0.wait(us).await;
    }
}

/// Without an interrupt, a part is taken to be ready after the whole time.
#[test]
fn without_a_wire_the_whole_time_is_waited() {
    let time = Time::default();
    let mut clock = Clock(time.clone());
    assert!(time.run(clock.ready(1_700)));
    assert_eq!((time.now_us(), clock.ready_us()), (1_700, None));
}

/// An interrupt wire; the function returns the next edge after a time.
struct Wire<F>(Time, F);

impl<F: Fn(u64) -> Option<u64>> DataReadyPin for Wire<F> {
    async fn next(&mut self) -> u64 {
        let at_us = (self.1)(self.0.now_us()).unwrap_or(u64::MAX);
        self.0.until(at_us).await;
        at_us
    }
}

/// Reads a part with samples every `sample_us`, for the time `us`. Returns when each reading began, and its interrupt
/// time.
fn readings(sample_us: f64, us: u64, wire: impl Fn(u64) -> Option<u64>) -> Vec<(u64, Option<u64>)> {
    let time = Time::default();
    let mut timing = DataReady::new(Wire(time.clone(), wire), time.clone(), PERIOD_US as u32);
    let mut all = Vec::new();
    while time.now_us() < us {
        assert!(time.run(timing.ready((2.0 * sample_us) as u32)), "it is always read");
        all.push((time.now_us(), timing.ready_us()));
        assert_eq!(timing.ready_us().is_some(), timing.is_wired());
        assert_eq!(timing.now_us(), time.now_us(), "the part's clock is the board's");
        time.run(time.until(time.now_us() + TRANSFER_US));
    }
    all
}

/// Returns the edges of a part with samples every `sample_us`.
fn edges(sample_us: f64) -> impl Fn(u64) -> Option<u64> {
    move |after_us| {
        let next = (after_us as f64 / sample_us).floor() as u64 + 1;
        (next..).map(|number| (number as f64 * sample_us) as u64).find(|at_us| *at_us > after_us)
    }
}

#[test]
fn each_sample_of_a_part_as_fast_as_the_clock_is_read_at_its_edge() {
    for sample_us in [990.0, 999.7, 1_000.0, 1_001.3, 1_010.0] {
        // The driver passes the nominal sample time.
        let read = readings(1_000.0, 10_000_000, edges(sample_us));
        let samples = (10_000_000.0 / sample_us) as usize;
        // The first readings come by the clock, while each edge falls into a transfer and is missed.
        let first = read.iter().position(|(_, edge_us)| edge_us.is_some()).expect("met");
        assert!(first <= 60, "{sample_us}: {first}");
        assert!(read.len().abs_diff(samples) <= 2, "{sample_us}: {} of {samples}", read.len());
        assert!(read.iter().skip(first).all(|(at_us, edge_us)| Some(*at_us) == *edge_us), "{sample_us}");
    }
}

#[test]
fn a_faster_part_is_read_once_in_a_period_at_its_first_edge() {
    for sample_us in [247.5, 250.0, 252.5, 619.0, 625.0, 631.0] {
        let read = readings(sample_us, 10_000_000, edges(sample_us));
        for (number, (at_us, edge_us)) in (2..).zip(read.iter().skip(2)) {
            assert_eq!((at_us / PERIOD_US, Some(*at_us)), (number, *edge_us), "{sample_us}");
            assert!((at_us % PERIOD_US) as f64 <= sample_us + 1.0, "{sample_us}: {at_us}");
        }
    }
}

/// Without a wire, the part is read at the beginning of every period, as by the clock alone.
#[test]
fn a_part_without_a_wire_is_read_by_the_clock() {
    for sample_us in [250.0, 625.0, 1_000.0] {
        let read = readings(sample_us, 1_000_000, |_| None);
        let expected: Vec<_> = (1..=1_000).map(|number| (number * PERIOD_US, None)).collect();
        assert_eq!(read, expected, "{sample_us}");
    }
}

/// Whenever a wire breaks, the next reading comes within two periods and a transfer, which counts as no failure
/// (`ImuSelector` waits 3 ms). After that there is a reading in every period. Once the wire is back, readings follow
/// its edges.
#[test]
fn a_broken_wire_costs_two_periods_and_no_part() {
    for sample_us in [250.0, 625.0, 1_000.0] {
        for breaks_us in (100_000..102_000).step_by(37) {
            let (back_us, whole) = (breaks_us + 50_000, edges(sample_us));
            let read = readings(sample_us, 200_000, |after_us| {
                whole(after_us).filter(|at_us| !(breaks_us..back_us).contains(at_us)).or_else(|| whole(back_us))
            });
            for pair in read.windows(2) {
                assert!(pair[1].0 - pair[0].0 <= 2 * PERIOD_US + TRANSFER_US, "{sample_us}, {breaks_us}: {pair:?}");
            }
            let of = |from_us, to_us| read.iter().filter(move |(at_us, _)| (from_us..to_us).contains(at_us));
            assert!(of(breaks_us + 3_000, back_us).all(|(at_us, edge_us)| at_us % PERIOD_US == 0 && edge_us.is_none()));
            assert!(of(breaks_us + 3_000, back_us).count() >= 46, "{sample_us}, {breaks_us}");
            assert!(of(back_us + 2_100, 200_000).all(|(_, edge_us)| edge_us.is_some()), "{sample_us}, {breaks_us}");
        }
    }
}

/// Noise on a floating wire next to a motor's does not use up the processor's time.
#[test]
fn noise_on_the_wire_makes_at_most_three_readings_in_a_period() {
    for (sample_us, noise_us) in [(250.0, 1), (250.0, 20), (1_000.0, 1), (1_000.0, 20), (1_000.0, 170), (625.0, 90)] {
        let read = readings(sample_us, 1_000_000, |after_us| Some((after_us / noise_us + 1) * noise_us));
        for period in 1..1_000 {
            let count = read.iter().filter(|(at_us, _)| at_us / PERIOD_US == period).count();
            assert!((1..=3).contains(&count), "{sample_us}, {noise_us}: {count} in period {period}");
        }
    }
}
