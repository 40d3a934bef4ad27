//! An equation with a closed solution: nonlinear, and dependent on time, so that a stage at a wrong time
//! costs the order.

use driftless::dynamics::{OdeSystem, Time};

/// y' = y² cos t, y = 1 / (2 - sin t); the event is y falling to its value at `level` \[s\].
#[derive(Clone, Copy)]
pub struct Bernoulli {
    pub level: Option<f64>,
}

/// The solution.
pub fn exact(t: f64) -> f64 {
    1.0 / (2.0 - t.sin())
}

impl OdeSystem for Bernoulli {
    fn dimension(&self) -> usize {
        1
    }
    fn angles(&self) -> usize {
        0
    }
    fn rhs(&mut self, t: Time, y: &[f64], rate: &mut [f64]) {
        rate[0] = y[0] * y[0] * t.hi.cos();
    }
    fn jacobian(&mut self, t: Time, y: &[f64], jacobian: &mut [f64]) -> bool {
        jacobian[0] = 2.0 * y[0] * t.hi.cos();
        true
    }
    fn label(&self, _: usize) -> String {
        "y".into()
    }
    fn events(&self) -> usize {
        usize::from(self.level.is_some())
    }
    fn gaps(&mut self, _: Time, y: &[f64], gaps: &mut [f64]) {
        if let Some(level) = self.level {
            gaps[0] = y[0] - exact(level);
        }
    }
}
