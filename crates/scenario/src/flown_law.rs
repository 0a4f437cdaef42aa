//! Which law the firmware's code flies.

use crate::AnyController;
use crate::contender::Law;
use afbc_onboard::{Configuration, Prepare, Prepared};
use afbc_types::{Declared, OutOfRange};

/// Prepares flights of the firmware's code: under its own law with the monitor, or under another one of the list in its
/// place, without a monitor, whose gains stay. Vehicle and settings are those of the configuration.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlownLaw(pub Option<Law>);

impl<const N: usize> Prepare<N> for FlownLaw {
    type Law = AnyController<N>;

    // Not inlined, like what flies.
    #[inline(never)]
    fn prepare(&self, configuration: &Configuration<N>) -> Result<Prepared<N, AnyController<N>>, OutOfRange> {
        let Configuration { airframe, settings, .. } = configuration;
        let controller = match self.0 {
            None => AnyController::Monitored(configuration.controller()?),
            Some(law) => {
                airframe.parameters.validate()?;
                settings.validate()?;
                law.controller(*airframe, *settings)?
            }
        };
        Prepared::under(configuration, controller)
    }
}
