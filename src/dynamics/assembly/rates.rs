//! Rates of a start that keep the constraints.

use super::StartChange;
use super::newton::{AssemblyProblem, GivenNumber, Goal, KEPT, of_origin};
use crate::arithmetic::{DoubleDouble, Scalar};
use crate::dynamics::compile::CompileError;
use crate::dynamics::constraint::ConstraintEquation;
use crate::scene::{Given, Scene};

impl AssemblyProblem<'_> {
    /// Rates that keep the rows; adds what is not as given to `changes`.
    pub(super) fn find_rates(
        &self,
        scene: &Scene,
        given: &dyn Fn(usize) -> Given,
        q: &[DoubleDouble],
        is_singular: bool,
        changes: &mut Vec<StartChange>,
    ) -> Result<Vec<DoubleDouble>, CompileError> {
        let aims = self.rate_aims(scene, given);
        let mut guess = vec![DoubleDouble::ZERO; q.len()];
        for aim in &aims {
            if let Goal::Coordinate(k) = aim.goal {
                guess[k] = DoubleDouble::of(aim.given);
            }
        }
        let every = vec![true; self.mechanism.constraints.len()];
        let (all, none) = (vec![true; aims.len()], vec![false; aims.len()]);
        let missing = AssemblyProblem { aims: aims.clone(), ..self.clone() }.columns(&all);
        let mut ways = vec![all];
        if !missing.is_empty() {
            ways.push(self.kept(&aims, q, &every));
        }
        ways.push(none);
        let mut omega = guess.clone();
        let keeps = ways.iter().any(|held| {
            omega.clone_from(&guess);
            self.rates(q, &mut omega, &aims, held) < 10.0 * KEPT
        });
        if !keeps {
            let slips = self.slips(q, &omega);
            let measured = |i: &usize| slips[*i].abs() / self.lever[*i];
            let worst = (0..slips.len()).max_by(|a, b| measured(a).total_cmp(&measured(b))).unwrap_or(0);
            let unit = |row: &ConstraintEquation| if row.is_angle() { "rad/s" } else { "m/s" };
            let (row, unit) =
                self.mechanism.constraints.get(worst).map_or(("start", "m/s"), |row| (&row.name, unit(row)));
            let left = slips.get(worst).map_or(0.0, |slip| slip.abs());
            return Err(CompileError::ImpossibleRates { row: row.into(), left, unit });
        }
        if is_singular && !missing.is_empty() && omega.iter().any(|omega| omega.hi != 0.0) {
            // Rows of lost rank would take any rates for these.
            self.check_open(q, &every, &aims, &missing, "omega")?;
        }
        changes.extend(self.rate_changes(&aims, q, &omega));
        Ok(omega)
    }

    /// The rates that the scene gives.
    pub(super) fn rate_aims(&self, scene: &Scene, given: &dyn Fn(usize) -> Given) -> Vec<GivenNumber> {
        let mut aims = Vec::new();
        for (bar, start) in scene.start.iter().enumerate() {
            if given(bar).omega {
                aims.push(GivenNumber { bar, goal: Goal::Coordinate(bar), given: start.omega });
            }
            if let Some(velocity) = given(bar).velocity {
                aims.extend(of_origin(self.mechanism, bar, velocity));
            }
        }
        aims
    }
}
