//! In place of [`pictures`](super) where the program is built without charts: nothing is drawn.

use super::{Done, SimulateTask};
use crate::cli::failure::Failure;
use crate::cli::flags::RunFlags;
use crate::dynamics::Mechanism;
use crate::run::{Folder, Outcome, Plan};
use crate::scene::Scene;

/// No page.
#[derive(Default)]
pub(super) struct Pages;

impl Pages {
    pub fn see(&mut self, _: &[f64]) {}

    pub fn write(self, _: &SimulateTask<'_>, _: &mut Folder) -> Result<(), Failure> {
        Ok(())
    }
}

impl SimulateTask<'_> {
    pub(super) fn window(&self, _: &Plan) -> Result<Option<[f64; 2]>, Failure> {
        Ok(None)
    }

    pub(super) fn page(&self, _: &Plan) -> Pages {
        Pages
    }
}

pub(super) fn check(_: &Mechanism, _: &RunFlags) -> Result<(), Failure> {
    Ok(())
}

pub(super) fn draw(
    _: &Scene,
    _: &Mechanism,
    _: &Outcome,
    _: &mut Folder,
    _: &RunFlags,
) -> Result<(), Failure> {
    Ok(())
}

pub(super) fn overlay(_: &Scene, _: &Mechanism, _: &[Done], _: &RunFlags) -> Result<(), Failure> {
    Ok(())
}
