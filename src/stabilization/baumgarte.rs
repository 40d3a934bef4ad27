//! Baumgarte stabilization: a violated constraint is pulled back like a critically damped spring.
//!
//! ```text
//! C'' + (2/T) C' + (1/T²) C = 0         one time constant T
//! ```
//!
//! Source: J. Baumgarte, *Stabilization of constraints and integrals of motion in dynamical systems*, Comput.
//! Methods Appl. Mech. Eng. 1 (1972).
//!
//! It is not free: an explicit method must resolve T, so T far below the step multiplies the steps, and T far
//! above it leaves the violation standing.  The energy it moves is an unknown of its own and appears in
//! reports.

use crate::dynamics::kernel::Bias;
use crate::dynamics::multiplier::Multiplier;
use crate::dynamics::{Along, Form, Mechanism, Motion, OdeSystem, State, Time};

/// The multiplier form with a Baumgarte term in every row.
#[derive(Clone, Debug)]
pub struct Baumgarte<const N: usize> {
    inner: Multiplier<N, true>,
    bias: Bias,
}

impl<const N: usize> Baumgarte<N> {
    /// Stabilizes a form with time constant T \[s\], positive.
    pub fn new(inner: Multiplier<N, true>, time_constant: f64) -> Self {
        let rate = 1.0 / time_constant;
        Self { inner, bias: Bias { rate: 2.0 * rate, position: rate * rate } }
    }
}

impl<const N: usize> OdeSystem for Baumgarte<N> {
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    fn angles(&self) -> usize {
        self.inner.angles()
    }

    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        self.inner.biased_rate(t, y, rate, self.bias);
    }

    fn fine_rate(&mut self, t: Time, y: &[f64], low: &[f64], rate: &mut [f64]) {
        self.inner.fine_biased_rate(t, y, low, rate, self.bias);
    }

    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool {
        self.inner.biased_jacobian(t, y, jacobian, self.bias);
        true
    }

    fn may_grow_by_rates(&self) -> bool {
        self.inner.may_grow_by_rates()
    }

    fn label(&self, i: usize) -> String {
        self.inner.label(i)
    }

    fn unit(&self, i: usize) -> f64 {
        self.inner.unit(i)
    }

    fn time_unit(&self) -> f64 {
        self.inner.time_unit()
    }

    fn rough_quadrature(&self) -> Option<usize> {
        self.inner.rough_quadrature()
    }

    fn events(&self) -> usize {
        self.inner.events()
    }

    fn gaps(&mut self, t: Time, y: &[f64], gaps: &mut [f64]) {
        self.inner.gaps(t, y, gaps);
    }

    fn watched(&self) -> usize {
        self.inner.watched()
    }

    fn gap(&self, event: usize, along: Along) -> Option<[f64; 3]> {
        self.inner.gap(event, along)
    }

    fn gap_bend(&self, event: usize, t: f64, step_size: f64, first: &[f64], second: &[f64]) -> f64 {
        self.inner.gap_bend(event, t, step_size, first, second)
    }
}

impl<const N: usize> Form for Baumgarte<N> {
    fn mechanism(&self) -> &Mechanism {
        self.inner.mechanism()
    }

    fn state(&self, motion: &Motion) -> State {
        self.inner.state(motion)
    }

    fn read(&mut self, state: &State, motion: &mut Motion) {
        self.inner.read(state, motion);
    }
}
