//! Any law in the place of the firmware's own.

use crate::contender::{Law, Task};
use afbc_control::FlightController;
use afbc_onboard::{Configuration, Prepare, Prepared, Unmonitored};
use afbc_types::{Declared, OutOfRange};
use core::any::Any;

/// Prepares flights of the firmware's code under a law of the list, without a monitor: its gains stay, vehicle and
/// settings are those of the configuration.
#[derive(Clone, Debug)]
pub struct OtherLaw<C> {
    law: Law,
    controller: C,
}

impl<C> OtherLaw<C> {
    /// Makes it of a law and a controller of that law, as [`Law::build`] hands it to a task.
    pub fn new(law: Law, controller: C) -> Self {
        OtherLaw { law, controller }
    }
}

impl<C: FlightController<N> + Clone + 'static, const N: usize> Prepare<N> for OtherLaw<C> {
    type Law = Unmonitored<C>;

    fn prepare(&self, configuration: &Configuration<N>) -> Result<Prepared<N, Unmonitored<C>>, OutOfRange> {
        let Configuration { airframe, settings, .. } = configuration;
        airframe.parameters.validate()?;
        settings.validate()?;
        let controller = self.law.build(*airframe, *settings, Again(&self.controller))?;
        Prepared::under(configuration, Unmonitored(controller))
    }
}

/// Returns a controller of the same type as this one, or else this one.
struct Again<'a, C>(&'a C);

impl<C: Clone + 'static> Task for Again<'_, C> {
    type Output = C;

    fn with<D, const N: usize>(self, controller: D) -> Result<C, OutOfRange>
    where
        D: FlightController<N> + Clone + 'static,
    {
        let controller: &dyn Any = &controller;
        Ok(controller.downcast_ref::<C>().unwrap_or(self.0).clone())
    }
}
