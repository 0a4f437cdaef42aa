//! Selects the law that the firmware's code flies.

use crate::AnyController;
use crate::contender::Law;
use afbc_onboard::{Configuration, Prepare, Prepared};
use afbc_types::{Declared, OutOfRange};

/// Prepares flights of the firmware's code. Without a law here, it flies its own law with the monitor. With a law, it
/// flies that law with these gains, without a monitor. Vehicle and settings come from the configuration.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlownLaw(pub Option<Law>);

impl<const N: usize> Prepare<N> for FlownLaw {
    type Law = AnyController<N>;

    // Not inlined, like the control step.
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
