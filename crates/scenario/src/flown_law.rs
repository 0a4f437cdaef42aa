//! Selects the law that the firmware's code flies.

use crate::AnyController;
use crate::contender::Law;
use afbc_onboard::{Configuration, Prepare, Prepared};
use afbc_types::{Declared, OutOfRange};

/// Prepares flights of the firmware's code. Without a law here, it flies its own law with the monitor. With a law, it
/// flies that law with these gains, without a monitor. Vehicle and settings come from the configuration.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlownLaw(pub Option<Law>);

impl Prepare for FlownLaw {
    type Law<const N: usize> = AnyController<N>;

    // The function is not inlined, like the control step.
    #[inline(never)]
    fn prepare<const N: usize>(
        &self,
        configuration: &Configuration,
    ) -> Result<Prepared<N, AnyController<N>>, OutOfRange> {
        let Configuration { parameters, settings, .. } = configuration;
        let controller = match self.0 {
            None => AnyController::Monitored(configuration.controller()?),
            Some(law) => {
                parameters.validate()?;
                settings.validate()?;
                law.controller(configuration.airframe()?, *settings)?
            }
        };
        Prepared::under(configuration, controller)
    }
}
