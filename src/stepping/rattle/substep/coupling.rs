//! Gears and cams in a substep of RATTLE.
//!
//! Their formulas are no polynomials: the iterations on positions form C from pairs, because C in plain
//! doubles, over h²/2, would be the rounding of positions as a force.

use super::SubstepScratch;
use crate::arithmetic::{Complex, DoubleDouble};
use crate::dynamics::Time;
use crate::dynamics::natural::Natural;
use crate::dynamics::natural::coupling::{CouplingTerms, NearestTurns};

/// Scratch space for them.
#[derive(Clone, Debug, Default)]
pub struct CouplingScratch {
    /// Angles at the beginning of the substep.
    whole: NearestTurns,
    /// The time last asked about.
    t: Time,
    /// z0 + h v0 + push a (n).
    there: Vec<Complex<DoubleDouble>>,
    pairs: CouplingTerms<DoubleDouble>,
    plain: CouplingTerms<f64>,
}

impl SubstepScratch {
    /// Takes over the angles at hand.
    pub(super) fn count_turns(&mut self, natural: &Natural) {
        if !natural.couplings().is_empty() {
            self.couplings.whole.set(&self.z, &self.turns);
        }
    }

    /// What the formulas ask for at time `t`.
    pub(super) fn couple(&mut self, t: Time) {
        self.couplings.t = t;
    }

    /// Adds the gradients of the formulas at `here` to those of the guides.
    pub(super) fn coupled_gradients(&mut self, natural: &Natural) {
        if natural.couplings().is_empty() {
            return;
        }
        let (n, couplings) = (self.here.len(), &mut self.couplings);
        let at = (couplings.t, &couplings.whole);
        couplings.plain.evaluate(natural.couplings(), at, &self.here, &[]);
        for (coupling, part) in natural.couplings().iter().zip(couplings.plain.gradients.chunks(n)) {
            let gradient = &mut self.gradient[coupling.guide * n..(coupling.guide + 1) * n];
            gradient.iter_mut().zip(part).for_each(|(gradient, &part)| *gradient += part);
        }
    }

    /// Adds the explicit rates of the formulas at `here`, after their gradients.
    pub(super) fn coupled_drives(&mut self, natural: &Natural) {
        for (coupling, row) in natural.couplings().iter().zip(&self.couplings.plain.rows) {
            self.drive[coupling.guide] += row.drive;
        }
    }

    /// Writes C of the coupled guides at the predicted end and `push` times the acceleration at hand, times
    /// `factor`, among the changes.
    pub(super) fn coupled_residuals(&mut self, natural: &Natural, push: f64, factor: f64) {
        if natural.couplings().is_empty() {
            return;
        }
        let (bodies, couplings) = (self.turns.len(), &mut self.couplings);
        let there = self.predicted.iter().zip(&self.acceleration);
        couplings.there.clear();
        couplings.there.extend(there.map(|(z, a)| Complex::new(z.re + a.re * push, z.im + a.im * push)));
        let at = (couplings.t, &couplings.whole);
        couplings.pairs.evaluate(natural.couplings(), at, &couplings.there, &[]);
        for (coupling, row) in natural.couplings().iter().zip(&couplings.pairs.rows) {
            let guide = &natural.guides()[coupling.guide];
            let own = guide.value(&self.demand[coupling.guide], &couplings.there);
            self.change[bodies + coupling.guide] = (own + row.position).hi * factor;
        }
    }

    /// Adds the rates of the formulas at z and v to those of the guides, among the multipliers.
    pub(super) fn coupled_rates(&mut self, natural: &Natural, factor: f64) {
        if natural.couplings().is_empty() {
            return;
        }
        let (bodies, couplings) = (self.turns.len(), &mut self.couplings);
        let at = (couplings.t, &couplings.whole);
        couplings.pairs.evaluate(natural.couplings(), at, &self.z, &[]);
        for (number, coupling) in natural.couplings().iter().enumerate() {
            let (guide, demand) = (&natural.guides()[coupling.guide], &self.demand[coupling.guide]);
            let own = guide.slip(demand, &self.z, &self.v) + guide.drive(demand, &self.z);
            let rate = own + couplings.pairs.slip(number, &self.v) + couplings.pairs.rows[number].drive;
            let n = self.here.len();
            let gradient = &self.gradient[coupling.guide * n..(coupling.guide + 1) * n];
            let direct: f64 =
                gradient.iter().zip(&self.free).map(|(gradient, free)| gradient.dot(*free)).sum();
            self.multiplier[bodies + coupling.guide] = direct + rate.hi * factor;
        }
    }
}
