//! The macro that makes one controller type for all laws.

/// Defines the controller type for all laws and its memory, from one line per law.
macro_rules! any_controller {
    ($($(#[$doc:meta])* $Name:ident($Controller:ty)),* $(,)?) => {
        /// The controller of any law: code that flies is compiled once for all laws.
        #[derive(Clone, Debug)]
        #[allow(clippy::large_enum_variant, reason = "one per vehicle")]
        pub enum AnyController<const N: usize> {
            $(
                $(#[$doc])*
                $Name($Controller),
            )*
        }

        /// Memory of any law's controller, which changes from step to step.
        #[derive(Clone, Copy, Debug, Default)]
        #[allow(clippy::large_enum_variant, reason = "one per vehicle")]
        pub enum AnyControllerMemory<const N: usize> {
            /// Empty memory before the first step.
            #[default]
            None,
            $(
                $(#[$doc])*
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

            // This function is not inlined, so that it is compiled only once instead of in each crate that flies.
            #[inline(never)]
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

            fn on_ground(&self, memory: &mut Self::Memory) {
                self.begin(memory);
                match (self, memory) {
                    $(
                        (AnyController::$Name(controller), AnyControllerMemory::$Name(memory)) => {
                            controller.on_ground(memory);
                        }
                    )*
                    _ => {}
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

            #[inline(always)]
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
            /// Makes an empty memory a memory of this law.
            fn begin(&self, memory: &mut AnyControllerMemory<N>) {
                if !matches!(memory, AnyControllerMemory::None) {
                    return;
                }
                *memory = match self {
                    $( AnyController::$Name(_) => AnyControllerMemory::$Name(Default::default()), )*
                };
            }
        }
    };
}

pub(super) use any_controller;
