//! The macro that expands the [list of laws](super).

/// Declares the control laws. Each law has
///
/// * `name`: lower-case name, as in scenario files and logs; `title`: name in tables and figures;
/// * `prefix`: prefix of its gains' parameter names on a ground station;
/// * `in_cascade`: true for a law in AFBC's cascade, with the cascade's settings and gains for each axis;
/// * `gains`: type of its gains;
/// * `tuned`: its tuned gains, computed from AFBC's gains;
/// * `by_hand`: hand-tuned gains, from which a search starts;
/// * `controller`: type of its controller, and the expression that makes it.
macro_rules! laws {
    ($(
        #[doc = $doc:literal]
        $Law:ident {
            name: $name:literal,
            title: $title:literal,
            prefix: $prefix:literal,
            in_cascade: $in_cascade:literal,
            gains: $Gains:ty,
            tuned: |$afbc:pat_param| $tuned:expr,
            by_hand: $by_hand:expr,
            controller: $Controller:ty, |$vehicle:ident, $settings:ident, $gains:ident| $controller:expr,
        }
    )*) => {
        /// A kind of control law.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum ControllerKind {
            $( #[doc = $doc] $Law, )*
            /// A registered law, which is not in the list.
            Own(OwnKind),
        }

        impl ControllerKind {
            /// Every law of the list.
            pub const ALL: [ControllerKind; [$($name),*].len()] = [$( ControllerKind::$Law ),*];

            /// Returns the lower-case name, as in scenario files and logs.
            pub const fn name(self) -> &'static str {
                match self {
                    $( ControllerKind::$Law => $name, )*
                    ControllerKind::Own(kind) => kind.name(),
                }
            }

            /// Returns the name for tables and figures.
            pub const fn title(self) -> &'static str {
                match self {
                    $( ControllerKind::$Law => $title, )*
                    ControllerKind::Own(kind) => kind.title(),
                }
            }

            /// Returns the prefix of the gains' parameter names on a ground station.
            pub const fn prefix(self) -> &'static str {
                match self {
                    $( ControllerKind::$Law => $prefix, )*
                    ControllerKind::Own(_) => "OWN_",
                }
            }

            /// Returns true for a law in AFBC's cascade, which has gains for each axis; other laws have one set for the
            /// whole vehicle.
            pub const fn in_cascade(self) -> bool {
                match self {
                    $( ControllerKind::$Law => $in_cascade, )*
                    ControllerKind::Own(_) => false,
                }
            }
        }

        /// A control law with its gains.
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
        pub enum Law {
            $( #[doc = concat!("See [`ControllerKind::", stringify!($Law), "`].")] $Law($Gains), )*
            /// See [`ControllerKind::Own`].
            Own(OwnGains),
        }

        impl Law {
            /// Returns the law of this kind with its tuned gains. Gains that the law shares with AFBC are taken from
            /// `afbc`.
            pub fn beside(kind: ControllerKind, afbc: &afbc_types::PerAxis<afbc::adaptive::Gains>) -> Self {
                match kind {
                    $( ControllerKind::$Law => {
                        let $afbc = afbc;
                        Law::$Law($tuned)
                    } )*
                    ControllerKind::Own(kind) => Law::Own(OwnGains::of(kind)),
                }
            }

            /// Returns the law of this kind with hand-tuned gains, from which a search starts.
            pub fn by_hand(kind: ControllerKind) -> Self {
                match kind {
                    $( ControllerKind::$Law => Law::$Law($by_hand), )*
                    ControllerKind::Own(kind) => Law::Own(OwnGains::of(kind)),
                }
            }

            /// Returns the kind of the law.
            pub const fn kind(&self) -> ControllerKind {
                match self {
                    $( Law::$Law(_) => ControllerKind::$Law, )*
                    Law::Own(gains) => ControllerKind::Own(gains.kind()),
                }
            }

            /// Returns the law's controller for this vehicle, without a monitor.
            ///
            /// # Errors
            /// The first parameter, gain or setting that is out of range.
            // The function is not inlined, like the control step.
            #[inline(never)]
            pub fn controller<const N: usize>(
                &self,
                vehicle: afbc_types::Airframe<N>,
                settings: afbc::Settings,
            ) -> Result<AnyController<N>, afbc_types::OutOfRange> {
                match *self {
                    $( Law::$Law($gains) => {
                        let ($vehicle, $settings) = (vehicle, settings);
                        Ok(AnyController::$Law($controller?))
                    } )*
                    Law::Own(gains) => Ok(AnyController::Own(gains.controller(vehicle, &settings.common)?)),
                }
            }
        }

        impl afbc_types::Declared for Law {
            /// Visits each gain; the gains of a law in the cascade are in a group for each axis.
            fn visit<E>(&self, visit: &mut impl afbc_types::Visitor<E>) -> Result<(), E> {
                match self {
                    $( Law::$Law(gains) => gains.visit(visit), )*
                    Law::Own(gains) => gains.visit(visit),
                }
            }

            fn visit_mut<E>(&mut self, visit: &mut impl afbc_types::VisitorMut<E>) -> Result<(), E> {
                match self {
                    $( Law::$Law(gains) => gains.visit_mut(visit), )*
                    Law::Own(gains) => gains.visit_mut(visit),
                }
            }

            fn together(&self) -> Result<(), afbc_types::OutOfRange> {
                match self {
                    $( Law::$Law(gains) => gains.together(), )*
                    Law::Own(gains) => gains.together(),
                }
            }
        }

        controllers::any_controller! {
            /// AFBC under its monitor, as on board.
            Monitored(Guarded<N>),
            $( #[doc = concat!("See [`ControllerKind::", stringify!($Law), "`].")] $Law($Controller), )*
            /// See [`ControllerKind::Own`].
            Own(OwnFlight<N>),
        }
    };
}

pub(super) use laws;
