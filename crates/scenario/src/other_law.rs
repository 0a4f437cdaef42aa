//! Any law in the place of the firmware's own.

use crate::contender::{Law, Task};
use afbc::monitor::Norm;
use afbc::{Adaptive, Backstepping, Controller};
use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_onboard::{Configuration, FlightLaw, Prepare, Prepared};
use afbc_peers::{Dfbc, Geometric, Indi, L1, Mpc, Pid};
use afbc_types::{Axis, Declared, OutOfRange, Range, Setpoint, State};
use core::any::Any;

/// Prepares flights of the firmware's code under a law of the list, without a monitor: its gains stay, vehicle and
/// settings are those of the configuration.
#[derive(Clone, Copy, Debug)]
pub struct OtherLaw(pub Law);

impl<const N: usize> Prepare<N> for OtherLaw {
    type Law = AnyController<N>;

    fn prepare(&self, configuration: &Configuration<N>) -> Result<Prepared<N, AnyController<N>>, OutOfRange> {
        let Configuration { airframe, settings, .. } = configuration;
        airframe.parameters.validate()?;
        settings.validate()?;
        let controller = self.0.build(*airframe, *settings, Collect::<N>)?;
        Prepared::under(configuration, controller)
    }
}

/// Puts a controller among those of any law.
struct Collect<const N: usize>;

/// The error on a controller that is not listed below: a defect.
const UNLISTED: OutOfRange = OutOfRange { value: 0.0, range: Range::new("listed_law", 1.0, 1.0) };

/// Defines the controller of any law, and its memory, from one line per law.
macro_rules! any_controller {
    ($($Name:ident($Controller:ty)),* $(,)?) => {
        /// The controller of any law, so that what flies is compiled once for all of them.
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant, reason = "one per vehicle")]
        pub enum AnyController<const N: usize> {
            $(
                /// Of this law.
                $Name($Controller),
            )*
        }

        /// What the controller of any law changes from step to step.
        #[derive(Clone, Copy, Debug, Default)]
        #[allow(clippy::large_enum_variant, reason = "one per vehicle")]
        pub enum AnyControllerMemory<const N: usize> {
            /// Before the first step.
            #[default]
            None,
            $(
                /// Of this law.
                $Name(<$Controller as FlightController<N>>::Memory),
            )*
        }

        impl<const N: usize> FlightController<N> for AnyController<N> {
            type Memory = AnyControllerMemory<N>;

            fn dt_s(&self) -> f32 {
                match self {
                    $( AnyController::$Name(controller) => controller.dt_s(), )*
                }
            }

            fn mixer(&self) -> &Mixer<N> {
                match self {
                    $( AnyController::$Name(controller) => controller.mixer(), )*
                }
            }

            fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
                self.begin(memory);
                match (self, memory) {
                    $(
                        (AnyController::$Name(controller), AnyControllerMemory::$Name(memory)) => {
                            controller.decide(memory, state, setpoint, fresh)
                        }
                    )*
                    _ => Action::default(),
                }
            }

            fn position_lost(&self, memory: &mut Self::Memory) {
                self.begin(memory);
                match (self, memory) {
                    $(
                        (AnyController::$Name(controller), AnyControllerMemory::$Name(memory)) => {
                            controller.position_lost(memory);
                        }
                    )*
                    _ => {}
                }
            }

            fn trace(memory: &Self::Memory) -> Trace {
                match memory {
                    AnyControllerMemory::None => Trace::default(),
                    $( AnyControllerMemory::$Name(memory) => <$Controller>::trace(memory), )*
                }
            }

            fn engage(&self, memory: &mut Self::Memory) -> bool {
                match (self, memory) {
                    $(
                        (AnyController::$Name(controller), AnyControllerMemory::$Name(memory)) => {
                            controller.engage(memory)
                        }
                    )*
                    _ => false,
                }
            }
        }

        impl<const N: usize> AnyController<N> {
            /// Makes the memory one of this law.
            fn begin(&self, memory: &mut AnyControllerMemory<N>) {
                if !matches!(memory, AnyControllerMemory::None) {
                    return;
                }
                *memory = match self {
                    $( AnyController::$Name(_) => AnyControllerMemory::$Name(Default::default()), )*
                };
            }
        }

        impl<const N: usize> Task for Collect<N> {
            type Output = AnyController<N>;

            fn with<C, const M: usize>(self, controller: C) -> Result<AnyController<N>, OutOfRange>
            where
                C: FlightController<M> + Clone + 'static,
            {
                let any: &dyn Any = &controller;
                $(
                    if let Some(found) = any.downcast_ref::<$Controller>() {
                        return Ok(AnyController::$Name(found.clone()));
                    }
                )*
                Err(UNLISTED)
            }
        }
    };
}

any_controller! {
    Afbc(Controller<Adaptive, N>),
    Backstepping(Controller<Backstepping, N>),
    Pid(Pid<N>),
    Geometric(Geometric<N>),
    Indi(Indi<N>),
    L1(L1<N>),
    Dfbc(Dfbc<N>),
    Mpc(Mpc<N>),
}

impl<const N: usize> FlightLaw<N> for AnyController<N> {
    fn norms(_: &AnyControllerMemory<N>) -> Option<(Axis, Norm)> {
        None
    }
}
